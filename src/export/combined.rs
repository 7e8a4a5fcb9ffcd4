//! All levels in one file: the scene holds level 0, whose node names the others by `MSFT_lod`.
//!
//! The specification calls its numbers "screen coverage" and doesn't say of what; they are shares
//! of the screen's area here, and the extras of every level's node say the same as distance and
//! as share of the screen's height.

use serde_json::{Value, json};

use super::gltf::FileBuilder;
use super::manifest::Range;
use super::surface::Scene;
use crate::botany::model::Frame;
use crate::error::Result;
use crate::scene;
use crate::space::glb::Glb;

/// A level that is ready to be written.
#[derive(Clone, Debug)]
pub struct Packed {
    /// "oak_LOD1".
    pub name: String,
    /// What it draws.
    pub scene: Scene,
    /// Its images.
    pub pngs: Vec<Vec<u8>>,
    /// What its node says beside geometry; see [`extras`].
    pub extras: Value,
    /// Where it is shown.
    pub range: Range,
    /// Whether the scene comes so near: a level that it never shows is not written.
    pub shown: bool,
}

impl Packed {
    /// Drops what is written by now: only where and how it is shown stays.
    pub fn forget(&mut self) {
        self.scene = Scene::default();
        self.pngs = Vec::new();
    }
}

/// Writes all levels that are shown, nearest first, into one GLB.
pub fn write_combined<'b>(levels: &'b [Packed], frame: &Frame) -> Result<Glb<'b>> {
    let levels: Vec<&Packed> = levels.iter().filter(|l| l.shown).collect();
    let mut file = FileBuilder::for_scenes(levels.iter().map(|l| &l.scene));
    let meshes = levels
        .iter()
        .map(|l| file.mesh(&l.name, &l.scene, &l.pngs))
        .collect::<Result<Vec<usize>>>()?;
    let first = wired(&mut file, &levels, &meshes, frame);
    file.finish_in_pieces(vec![first])
}

/// A tree of a species with its levels, nearest first.
pub struct Stand<'a> {
    /// "oak".
    pub name: &'a str,
    /// Where it stands.
    pub frame: &'a Frame,
    /// Its levels.
    pub levels: &'a [Packed],
    /// The files of each level's images.
    pub uris: Vec<Vec<String>>,
}

/// Writes all levels of all trees into one GLB, a scene for each tree; images are in files of their own.
pub fn write_species(trees: &[Stand]) -> Result<Vec<u8>> {
    let mut file = FileBuilder::default();
    let mut scenes = Vec::with_capacity(trees.len());
    for tree in trees {
        let both = tree.levels.iter().zip(&tree.uris);
        let (levels, uris): (Vec<&Packed>, Vec<_>) = both.filter(|(l, _)| l.shown).unzip();
        let meshes = levels
            .iter()
            .zip(uris)
            .map(|(l, uris)| file.linked_mesh(&l.name, &l.scene, uris))
            .collect::<Result<Vec<usize>>>()?;
        let first = wired(&mut file, &levels, &meshes, tree.frame);
        scenes.push((tree.name, vec![first]));
    }
    file.finish_scenes(&scenes)
}

/// Adds a node for each level; returns the first, which names the others.
fn wired(file: &mut FileBuilder, levels: &[&Packed], meshes: &[usize], frame: &Frame) -> usize {
    let node =
        |(level, &mesh): (&&Packed, _)| file.node(&level.name, mesh, frame, level.extras.clone());
    let nodes: Vec<usize> = levels.iter().zip(meshes).map(node).collect();
    let (first, lower) = (nodes[0], &nodes[1..]);
    if !lower.is_empty() {
        file.use_extension("MSFT_lod");
        let coverage: Vec<f64> = levels.iter().map(|l| l.range.screen_coverage).collect();
        let node = file.node_mut(first);
        node["extensions"] = json!({ "MSFT_lod": { "ids": lower } });
        node["extras"]["MSFT_screencoverage"] = json!(coverage);
    }
    first
}

/// What a level's node says of itself; numbers that are infinite are left out.
pub fn extras(
    level: usize,
    range: &Range,
    error_m: f64,
    tree_height_m: f64,
    scene: &scene::Scene,
) -> Value {
    let mut out = json!({
        "level": level,
        "distance_m": range.distance_m,
        "error_m": error_m,
        "tree_height_m": tree_height_m,
        "fov_deg": scene.fov_deg,
        "screen_height_px": scene.screen_height_px,
    });
    let mut put = |key: &str, value: f64| {
        if value.is_finite() {
            out[key] = json!(value);
        }
    };
    put("screen_height", range.screen_height);
    put("end_m", range.end_m);
    if level > 0 {
        out["fade_m"] = json!(range.fade_m);
    }
    out
}
