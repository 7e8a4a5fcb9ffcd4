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
}

/// Writes all levels, nearest first, into one GLB.
pub fn write_combined(levels: &[Packed], frame: &Frame) -> Result<Vec<u8>> {
    let mut file = FileBuilder::default();
    let mut nodes = Vec::with_capacity(levels.len());
    for level in levels {
        let mesh = file.mesh(&level.name, &level.scene, &level.pngs)?;
        nodes.push(file.node(&level.name, mesh, frame, level.extras.clone()));
    }
    let (first, lower) = (nodes[0], &nodes[1..]);
    if !lower.is_empty() {
        file.use_extension("MSFT_lod");
        let coverage: Vec<f64> = levels.iter().map(|l| l.range.screen_coverage).collect();
        let node = file.node_mut(first);
        node["extensions"] = json!({ "MSFT_lod": { "ids": lower } });
        node["extras"]["MSFT_screencoverage"] = json!(coverage);
    }
    Ok(file.finish(vec![first]))
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
