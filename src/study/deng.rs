//! Billboards, texels and silhouettes along a camera path (Deng and others): distance alone, the dot
//! product of 2007, density, and density with what a grid hides.
//!
//! F1 is that of silhouettes against all trees drawn leaf by leaf, 2 x 2 samples a pixel. In a
//! forest nearly everything is covered, so beside it stands the share of covered samples that show
//! the right tree.

use std::path::Path;

use rayon::prelude::*;
use serde_json::{Value, json};

use super::frame::Frame;
use super::picture::Sheet;
use super::scenes::{
    HEIGHT_PX, TREES, approach, five_species, forest, forest_cells, looked_at, stand_at,
    tree_cells, walk,
};
use super::species::Species;
use super::stand::{Cost, Stand, Walk};
use crate::detail::likeness::representatives;
use crate::error::Result;
use crate::report::agreement;
use crate::runtime::{Cells, Density, DotProduct, Hidden, Law, Occlusion, Plain, View};

/// How sub-trees are chosen, in the order of all rows.
pub const WAYS: [&str; 4] = ["distance", "dot product", "density", "density + occlusion"];

/// How the study is done.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Frames of the path.
    pub frames: usize,
    /// Frames that are drawn.
    pub pictures: usize,
    /// `k`: how much farther off what is right behind a dense crown counts.
    pub strength: f32,
    /// Share of the grid's extinction that counts.
    pub clumping: f32,
}

/// Cells of the forest's grid, metres.
const CELL_M: f32 = 4.0;
/// Cells along a tree.
const TREE_CELLS: u32 = 12;

/// One way to choose, along one path.
#[derive(Clone, Debug)]
pub struct Row {
    /// One of [`WAYS`].
    pub way: &'static str,
    /// Mean over frames.
    pub cost: Cost,
    /// F1 of the frames that were drawn.
    pub f1: Vec<f64>,
    /// Share of covered samples that show the right tree.
    pub right_tree: f64,
}

/// Textures of all sub-trees of a tree, and of those that stand for all (Deng, "Memory Strategy").
#[derive(Clone, Debug)]
pub struct Memory {
    /// The tree.
    pub name: String,
    /// Sub-trees, and those that represent them.
    pub subtrees: [usize; 2],
    /// RGBA with mips, of all and of those.
    pub bytes: [u64; 2],
}

impl Memory {
    fn of(species: &Species) -> Self {
        let first = representatives(&species.tree);
        let (mut subtrees, mut bytes) = ([first.len(), 0], [0; 2]);
        subtrees[1] = (0..).zip(&first).filter(|(i, first)| i == *first).count();
        for (origin, looks) in species.hierarchy.origins().iter().zip(&species.looks) {
            let texels: u64 = looks.billboards.iter().map(|b| b.texels).sum();
            let own = texels * 4 * 4 / 3;
            bytes[0] += own;
            if first[origin.subtree as usize] == origin.subtree {
                bytes[1] += own;
            }
        }
        Self {
            name: species.tree.model.name.clone(),
            subtrees,
            bytes,
        }
    }
}

/// The whole study.
pub struct Study {
    /// Name, trees and rows of each scene.
    pub scenes: Vec<(String, usize, Vec<Row>)>,
    /// Textures of each tree's sub-trees: the tree, then the forest's species.
    pub memory: Vec<Memory>,
    sheet: Sheet,
}

/// Runs the study on a tree, and on a forest of five grown species.
///
/// # Errors
/// Where the forest's trees can't be grown.
pub fn study(tree: Species, settings: &Settings) -> Result<Study> {
    let name = tree.tree.model.name.clone();
    let place = stand_at(&tree.tree, glam::Vec2::ZERO, 0.0, 1.0, 0);
    let mut memory = vec![Memory::of(&tree)];
    let alone = [tree];
    let cells = tree_cells(&alone[0], &place, TREE_CELLS, None);
    let path = approach(&place, settings.frames);
    let stand = Stand::new(&alone, vec![place]);
    let (one, _) = rows(&stand, &cells, &path, settings);
    let species = five_species()?;
    memory.extend(species.iter().map(Memory::of));
    let places = forest(&species, TREES);
    let cells = forest_cells(&species, &places, CELL_M, None);
    let stand = Stand::new(&species, places);
    let (many, frames) = rows(&stand, &cells, &walk(settings.frames), settings);
    Ok(Study {
        scenes: vec![
            (name, 1, one),
            ("forest of five species".into(), TREES, many),
        ],
        memory,
        sheet: Sheet::column(&frames),
    })
}

/// One frame: all leaves and every way, and each way's F1 and share of the right tree.
type Looked = (Vec<Frame>, Vec<(f64, f64)>);

/// Every way along a path, and the middle one of the frames: all leaves, then every way.
fn rows(
    stand: &Stand,
    cells: &Cells,
    path: &[View],
    settings: &Settings,
) -> (Vec<Row>, Vec<Frame>) {
    let shown = looked_at(path.len(), settings.pictures);
    let strength = settings.strength;
    let density = Density { strength };
    let hidden = Hidden::new(
        density,
        Occlusion::new(cells, Law::Beer).clumped(settings.clumping),
    );
    let walks: [Walk; 4] = [
        stand.walk(Plain, path, &shown),
        stand.walk(DotProduct { strength }, path, &shown),
        stand.walk(density, path, &shown),
        stand.walk(hidden, path, &shown),
    ];
    let looked: Vec<Looked> = shown
        .par_iter()
        .enumerate()
        .map(|(i, &frame)| {
            let view = &path[frame];
            let whole = stand.draw(&stand.everything(view), view, HEIGHT_PX);
            let coverage = whole.coverage();
            let mut frames = Vec::new();
            let mut figures = Vec::new();
            for walk in &walks {
                let drawn = stand.draw(&walk.shown[i], view, HEIGHT_PX);
                let f1 = agreement(&coverage, &drawn.coverage()).f1();
                figures.push((f1, whole.agrees(&drawn, |a, b| a.tree() == b.tree())));
                frames.push(drawn);
            }
            frames.insert(0, whole);
            (frames, figures)
        })
        .collect();
    let row = |(way, walk): (usize, &Walk)| Row {
        way: WAYS[way],
        cost: walk.cost,
        f1: looked.iter().map(|l| l.1[way].0).collect(),
        right_tree: looked.iter().map(|l| l.1[way].1).sum::<f64>() / looked.len().max(1) as f64,
    };
    let rows = walks.iter().enumerate().map(row).collect();
    let middle = looked.len() / 2;
    let frames = looked
        .into_iter()
        .nth(middle)
        .map(|l| l.0)
        .unwrap_or_default();
    (rows, frames)
}

impl Row {
    /// Mean over the frames that were drawn.
    pub fn mean_f1(&self) -> f64 {
        self.f1.iter().sum::<f64>() / self.f1.len().max(1) as f64
    }

    /// The most that a frame loses against another way.
    pub fn worst_loss(&self, other: &Row) -> f64 {
        let losses = other.f1.iter().zip(&self.f1).map(|(a, b)| a - b);
        losses.fold(f64::NEG_INFINITY, f64::max)
    }
}

impl Study {
    /// The figures for programs.
    pub fn to_json(&self) -> Value {
        let row = |row: &Row, first: &Row| {
            json!({
                "way": row.way, "billboards": row.cost.billboards, "texels": row.cost.texels,
                "triangles": row.cost.triangles, "f1": row.mean_f1(), "worst_loss": row.worst_loss(first),
                "right_tree": row.right_tree,
            })
        };
        let scene = |(name, trees, rows): &(String, usize, Vec<Row>)| json!({ "scene": name, "trees": trees, "ways": rows.iter().map(|r| row(r, &rows[0])).collect::<Vec<_>>() });
        let memory = |m: &Memory| {
            json!({
                "tree": m.name, "subtrees": m.subtrees[0], "representatives": m.subtrees[1],
                "texture_bytes": m.bytes[0], "texture_bytes_shared": m.bytes[1],
            })
        };
        json!({
            "scenes": self.scenes.iter().map(scene).collect::<Vec<_>>(),
            "textures": self.memory.iter().map(memory).collect::<Vec<_>>(),
        })
    }

    /// The figures for people.
    pub fn table(&self) -> String {
        let mut out = String::new();
        for (name, trees, rows) in &self.scenes {
            out += &format!(
                "{name} ({trees} {}), means a frame\n{:<22}{:>12}{:>10}{:>14}{:>12}{:>9}{:>13}{:>12}\n",
                if *trees == 1 { "tree" } else { "trees" },
                "",
                "billboards",
                "",
                "texels",
                "triangles",
                "F1",
                "worst loss",
                "right tree"
            );
            for row in rows {
                let saved = 100.0 * (row.cost.billboards / rows[0].cost.billboards.max(1e-9) - 1.0);
                out += &format!(
                    "{:<22}{:>12.1}{:>8.1} %{:>14.0}{:>12.0}{:>9.4}{:>13.4}{:>12.4}\n",
                    row.way,
                    row.cost.billboards,
                    saved,
                    row.cost.texels,
                    row.cost.triangles,
                    row.mean_f1(),
                    row.worst_loss(&rows[0]),
                    row.right_tree
                );
            }
            out += "\n";
        }
        out += &format!(
            "{:<22}{:>12}{:>16}{:>14}{:>14}\n",
            "textures of sub-trees", "sub-trees", "representatives", "all, MB", "shared, MB"
        );
        for m in &self.memory {
            let [all, shared] = m.bytes.map(|b| b as f64 / 1e6);
            let [subtrees, representatives] = m.subtrees;
            out += &format!(
                "{:<22}{subtrees:>12}{representatives:>16}{all:>14.1}{shared:>14.1}\n",
                m.name
            );
        }
        out
    }

    /// Writes deng.png: one view of the forest, all leaves first, then every way to choose.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn write(&self, folder: &Path) -> Result<()> {
        self.sheet.write(&folder.join("deng.png"))
    }
}
