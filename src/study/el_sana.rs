//! Triangles, splits and merges, time and changed visible triangles along a camera path (El-Sana and
//! others 2001, Table 1), with and without occlusion, by both solidities and several grids.

use std::time::Instant;

use serde_json::{Value, json};

use super::deng::Settings;
use super::frame::{Frame, Key};
use super::picture::Sheet;
use super::scenes::{
    HEIGHT_PX, TREES, approach, five_species, forest, forest_cells, looked_at, stand_at,
    tree_cells, walk,
};
use super::species::Species;
use super::stand::{Stand, Walk};
use crate::error::Result;
use crate::report::agreement;
use crate::runtime::{Cells, Hidden, Law, Occlusion, Plain, View};

/// How often pictures are drawn for the time that they take.
const TURNS: usize = 4;
/// Rays through a cell.
const RAYS: u32 = 64;
/// Probabilities up to which nothing counts as hidden, tried with one of the grids.
const DOUBTS: [f32; 2] = [0.99, 0.999];
/// Solid angles, steradians, that sub-trees are expected to show where they count, tried with a finer grid.
const EXPECTED_SR: [f32; 3] = [1e-3, 2e-3, 4e-3];

/// One way to follow a path.
#[derive(Clone, Debug)]
pub struct Row {
    /// Solidity, grid and law, or "without".
    pub name: String,
    /// Triangles a frame.
    pub triangles: f64,
    /// Nodes opened and closed a frame.
    pub changes: [f64; 2],
    /// Microseconds a frame for choosing.
    pub select_us: f64,
    /// Milliseconds a frame for drawing (on the processor).
    pub draw_ms: f64,
    /// Share of the time for choosing and drawing that is saved, drawn in turns with what is chosen by distance alone.
    pub saved: f64,
    /// Share of the triangles seen without occlusion that are no longer drawn.
    pub changed_triangles: f64,
    /// Share of the covered samples that no longer show the same triangle.
    pub changed_samples: f64,
    /// F1 of the silhouette against the one without occlusion.
    pub f1: f64,
}

/// The whole study.
pub struct Study {
    /// A tree, and a forest.
    pub scenes: Vec<Path>,
    sheet: Sheet,
}

/// What was found along one path.
pub struct Path {
    /// What stands there.
    pub name: String,
    /// How many.
    pub trees: usize,
    /// Share of the triangles chosen by distance whose sub-trees show nowhere: what occlusion could save at most
    /// without a change.
    pub unseen: f64,
    /// Every way to follow it.
    pub rows: Vec<Row>,
}

/// What is tried.
#[derive(Clone)]
struct Grid {
    law: Law,
    /// Solidity by so many rays, or by face projection.
    rays: Option<u32>,
    cells: Cells,
    doubt: f32,
    least_sr: f32,
    name: String,
}

impl Grid {
    fn new(rays: Option<u32>, cells: Cells, name: String) -> Self {
        Self {
            law: Law::Beer,
            rays,
            cells,
            doubt: 0.0,
            least_sr: 0.0,
            name,
        }
    }

    fn title(&self) -> String {
        let how = if self.rays.is_some() { "rays" } else { "faces" };
        let law = match self.law {
            Law::Beer => "",
            Law::Equation4 => ", eq. 4 as printed",
        };
        let doubt = match self.doubt {
            0.0 => String::new(),
            d => format!(", above {d}"),
        };
        let expected = match self.least_sr {
            0.0 => String::new(),
            sr => format!(", below {sr} sr"),
        };
        format!("{how}, {}{law}{doubt}{expected}", self.name)
    }
}

/// Runs the study on a tree, and on a forest of five grown species.
///
/// # Errors
/// Where the forest's trees can't be grown.
pub fn study(tree: Species, settings: &Settings) -> Result<Study> {
    let name = tree.tree.model.name.clone();
    let place = stand_at(&tree.tree, glam::Vec2::ZERO, 0.0, 1.0, 0);
    let alone = [tree];
    let grids = [(None, 6), (None, 12), (None, 24), (Some(RAYS), 12)].map(|(rays, longest)| {
        let cells = tree_cells(&alone[0], &place, longest, rays);
        Grid::new(rays, cells, format!("{longest} cells"))
    });
    let path = approach(&place, settings.frames);
    let stand = Stand::new(&alone, vec![place]);
    let (one, _) = follow(
        name,
        &stand,
        with_variants(grids.to_vec(), 1),
        &path,
        settings,
    );
    let species = five_species()?;
    let places = forest(&species, TREES);
    let grids = [(None, 8.0), (None, 4.0), (None, 2.0), (Some(RAYS), 4.0)].map(|(rays, edge)| {
        let cells = forest_cells(&species, &places, edge, rays);
        Grid::new(rays, cells, format!("{edge} m"))
    });
    let stand = Stand::new(&species, places);
    let (many, frames) = follow(
        "forest of five species".into(),
        &stand,
        with_variants(grids.to_vec(), 1),
        &walk(settings.frames),
        settings,
    );
    Ok(Study {
        scenes: vec![one, many],
        sheet: Sheet::column(&frames),
    })
}

/// The same by the printed law and where only what is surely hidden counts, with one of the grids, and where only what
/// is expected to show hardly anything does, with the next.
fn with_variants(mut grids: Vec<Grid>, pick: usize) -> Vec<Grid> {
    let (picked, finer) = (grids[pick].clone(), grids[pick + 1].clone());
    for doubt in DOUBTS {
        let picked = picked.clone();
        grids.push(Grid { doubt, ..picked });
    }
    for least_sr in EXPECTED_SR {
        let finer = finer.clone();
        grids.push(Grid { least_sr, ..finer });
    }
    let law = Law::Equation4;
    grids.push(Grid { law, ..picked });
    grids
}

/// Every grid along a path, and one frame without and with occlusion (the second grid).
fn follow(
    name: String,
    stand: &Stand,
    grids: Vec<Grid>,
    path: &[View],
    settings: &Settings,
) -> (Path, Vec<Frame>) {
    let shown = looked_at(path.len(), settings.pictures);
    let views: Vec<&View> = shown.iter().map(|&f| &path[f]).collect();
    let plain = stand.walk(Plain, path, &shown);
    let frames = draw(stand, &plain, &views);
    let [draw_ms] = time(stand, [&plain], &views);
    let itself = [draw_ms, 0.0];
    let mut out = vec![row("without".into(), &plain, &frames, &frames, itself)];
    let unseen = unseen(stand, &plain, &frames);
    let mut kept = None;
    for grid in &grids {
        let occlusion = Occlusion::new(&grid.cells, grid.law).clumped(settings.clumping);
        let hidden = Hidden::new(Plain, occlusion.doubting(grid.doubt)).expecting(grid.least_sr);
        let walk = stand.walk(hidden, path, &shown);
        let drawn = draw(stand, &walk, &views);
        let [plain_ms, draw_ms] = time(stand, [&plain, &walk], &views);
        let [before, after] = [plain_ms + plain.micros / 1e3, draw_ms + walk.micros / 1e3];
        let saved = 1.0 - after / before.max(1e-9);
        out.push(row(grid.title(), &walk, &frames, &drawn, [draw_ms, saved]));
        if out.len() == 3 {
            kept = drawn.into_iter().nth(settings.pictures / 2);
        }
    }
    let first = frames.into_iter().nth(settings.pictures / 2);
    let path = Path {
        name,
        trees: stand.places.len(),
        unseen,
        rows: out,
    };
    (path, first.into_iter().chain(kept).collect())
}

/// Share of the triangles that belong to drawn things of which no sample shows any.
fn unseen(stand: &Stand, walk: &Walk, frames: &[Frame]) -> f64 {
    let (mut all, mut lost) = (0.0, 0.0);
    for (drawn, frame) in walk.shown.iter().zip(frames) {
        let mut seen: Vec<u64> = frame.visible().iter().map(|k| k.drawn()).collect();
        seen.dedup();
        for d in drawn {
            let triangles = stand.cost(std::slice::from_ref(d)).triangles;
            all += triangles;
            if seen.binary_search(&Key::drawn_of(d)).is_err() {
                lost += triangles;
            }
        }
    }
    lost / f64::max(all, 1.0)
}

/// The pictures of a walk.
fn draw(stand: &Stand, walk: &Walk, views: &[&View]) -> Vec<Frame> {
    let drawn = walk.shown.iter().zip(views);
    drawn
        .map(|(drawn, view)| stand.draw(drawn, view, HEIGHT_PX))
        .collect()
}

/// Milliseconds that each walk's pictures take, a frame: drawn in turns, the least of some.
fn time<const N: usize>(stand: &Stand, walks: [&Walk; N], views: &[&View]) -> [f64; N] {
    let mut least = [f64::INFINITY; N];
    for _ in 0..TURNS {
        for (least, walk) in least.iter_mut().zip(walks) {
            let start = Instant::now();
            // Nothing is kept: what stays would have the next find no warm memory.
            drop(draw(stand, walk, views));
            let ms = start.elapsed().as_secs_f64() * 1e3;
            *least = least.min(ms / views.len().max(1) as f64);
        }
    }
    least
}

fn row(
    name: String,
    walk: &Walk,
    without: &[Frame],
    with: &[Frame],
    [draw_ms, saved]: [f64; 2],
) -> Row {
    let n = without.len().max(1) as f64;
    let mean = |figure: &dyn Fn(usize) -> f64| (0..without.len()).map(figure).sum::<f64>() / n;
    let gone = |i: usize| {
        let mut drawn: Vec<u64> = walk.shown[i].iter().map(Key::drawn_of).collect();
        drawn.sort_unstable();
        let seen = without[i].visible();
        let lost = seen
            .iter()
            .filter(|k| drawn.binary_search(&k.drawn()).is_err());
        lost.count() as f64 / seen.len().max(1) as f64
    };
    Row {
        name,
        triangles: walk.cost.triangles,
        changes: walk.changes,
        select_us: walk.micros,
        draw_ms,
        saved,
        changed_triangles: mean(&gone),
        changed_samples: mean(&|i| 1.0 - without[i].agrees(&with[i], |a, b| a == b)),
        f1: mean(&|i| agreement(&without[i].coverage(), &with[i].coverage()).f1()),
    }
}

impl Study {
    /// The figures for programs.
    pub fn to_json(&self) -> Value {
        let row = |r: &Row| {
            json!({
                "name": r.name, "triangles": r.triangles, "splits": r.changes[0], "merges": r.changes[1],
                "select_us": r.select_us, "draw_ms": r.draw_ms, "saved": r.saved, "changed_triangles": r.changed_triangles,
                "changed_samples": r.changed_samples, "f1": r.f1,
            })
        };
        let scene = |p: &Path| json!({ "scene": p.name, "trees": p.trees, "unseen": p.unseen, "rows": p.rows.iter().map(row).collect::<Vec<_>>() });
        json!({ "scenes": self.scenes.iter().map(scene).collect::<Vec<_>>() })
    }

    /// The figures for people.
    pub fn table(&self) -> String {
        let mut out = String::new();
        for Path {
            name,
            trees,
            unseen,
            rows,
        } in &self.scenes
        {
            out += &format!(
                "{name} ({trees} {}), means a frame; {:.0} % of the triangles without are of sub-trees that show nowhere\n{:<34}{:>11}{:>8}{:>8}{:>8}{:>11}{:>9}{:>11}{:>10}{:>8}\n",
                if *trees == 1 { "tree" } else { "trees" },
                100.0 * unseen,
                "",
                "triangles",
                "splits",
                "merges",
                "us",
                "draw ms",
                "saved",
                "changed",
                "samples",
                "F1"
            );
            for row in rows {
                out += &format!(
                    "{:<34}{:>11.0}{:>8.1}{:>8.1}{:>8.0}{:>11.2}{:>7.0} %{:>9.2} %{:>8.2} %{:>8.4}\n",
                    row.name,
                    row.triangles,
                    row.changes[0],
                    row.changes[1],
                    row.select_us,
                    row.draw_ms,
                    100.0 * row.saved,
                    100.0 * row.changed_triangles,
                    100.0 * row.changed_samples,
                    row.f1
                );
            }
            out += "\n";
        }
        out + "saved: of the time for choosing and drawing, in turns with the first row; changed: of the triangles that are seen without occlusion\n"
    }

    /// Writes el-sana.png: one view of the forest without and with occlusion.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn write(&self, folder: &std::path::Path) -> Result<()> {
        self.sheet.write(&folder.join("el-sana.png"))
    }
}
