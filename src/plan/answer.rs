//! The answer to a plan.

use std::path::PathBuf;

use serde::Serialize;

use crate::client::{Client, Takes};
use crate::scene::Scene;

/// What a scene needs and costs.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Answer {
    /// Frames of the path.
    pub frames: u32,
    /// Trees that stand in the scene.
    pub trees: u64,
    /// How many times nearer than asked levels start, for the budget; their errors are as many times
    /// as large on the screen. 1: as asked.
    pub moved_nearer: f64,
    /// Whether the worst frame keeps the budget; absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub budget_met: Option<bool>,
    /// Triangles a frame with levels.
    pub triangles: Cost,
    /// Triangles a frame with levels where trees that others hide are left out, and what is half hidden
    /// is drawn coarser.
    pub triangles_unhidden: Cost,
    /// Trees in the picture that others hide: with a probability of .99 neither middle nor top is seen.
    pub hidden_trees: Cost,
    /// Triangles a frame without: every tree in view as it was modelled.
    pub triangles_original: Cost,
    /// Bytes of the textures of all levels that are needed, with mips, on the GPU.
    pub texture_bytes: u64,
    /// Whether those of levels are estimated and not read from packages.
    pub texture_bytes_estimated: bool,
    /// Bytes of the packages.
    pub disk_bytes: u64,
    /// Whether `disk_bytes` is estimated.
    pub disk_bytes_estimated: bool,
    /// What the engine does with the packages.
    pub engine: EngineAnswer,
    /// Each kind of tree.
    pub species: Vec<SpeciesAnswer>,
}

/// What an engine does with packages.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct EngineAnswer {
    /// The engine.
    pub name: Client,
    /// Which files it takes for levels.
    pub takes: Takes,
    /// Whether it makes mips of PNGs.
    pub makes_mips: bool,
    /// Whether it draws instances of EXT_mesh_gpu_instancing.
    pub draws_instances: bool,
}

impl Default for EngineAnswer {
    fn default() -> Self {
        Self::of(Client::default())
    }
}

impl EngineAnswer {
    /// What an engine does.
    pub fn of(name: Client) -> Self {
        Self {
            name,
            takes: name.takes(),
            makes_mips: name.makes_mips(),
            draws_instances: name.draws_instances(),
        }
    }
}

/// A cost over the frames of the path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Cost {
    /// Mean of all frames.
    pub mean: f64,
    /// The worst frame.
    pub worst: u64,
    /// Which one that is, from 0.
    pub worst_frame: u32,
}

/// What one kind of tree needs.
#[derive(Clone, Debug, Default, Serialize)]
pub struct SpeciesAnswer {
    /// The file's stem.
    pub name: String,
    /// The file.
    pub input: PathBuf,
    /// How many stand in the scene.
    pub trees: u64,
    /// Triangles of the original.
    pub triangles: u64,
    /// Height at scale 1, metres.
    pub height_m: f64,
    /// Nearest that the camera sees one, metres at scale 1 (a tree twice as large counts as half as
    /// far); absent where none is ever seen.
    pub nearest_m: Option<f64>,
    /// Farthest that the camera sees one, metres at scale 1.
    pub farthest_m: Option<f64>,
    /// From where trees are seen that show a level, degrees: azimuths in the tree's own space, from and to; those of
    /// trees that may be turned any way are all. Absent where no level is shown.
    pub azimuths_deg: Option<[f32; 2]>,
    /// Elevations, from and to, degrees above the horizon.
    pub elevations_deg: Option<[f32; 2]>,
    /// Share of upright planes both sides of which are seen: where it is 0, no back side of a card ever is.
    pub both_sides: f64,
    /// Maps of a level's page that light needs or not: "base color", "normal", "occlusion, roughness, metalness".
    pub maps: Vec<&'static str>,
    /// Species of this plan that are painted with the same images and show a level of the same size: they can share
    /// an atlas.
    pub can_share_with: Vec<String>,
    /// The atlas that the plan says it shares; empty: none.
    pub atlas: String,
    /// What to bake it with.
    #[serde(skip)]
    pub scene: Scene,
    /// All levels, the original first.
    pub levels: Vec<LevelAnswer>,
}

/// What one level is needed for.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LevelAnswer {
    /// Where it starts, metres at scale 1.
    pub distance_m: f64,
    /// Height of the tree there, pixels; absent for the original.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_px: Option<f64>,
    /// Most triangles.
    pub triangles: u64,
    /// Whether any frame shows it.
    pub needed: bool,
    /// Trees that show it, over the frames.
    pub shown: Cost,
    /// Texels of its cards for a metre of the tree; absent for the original.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub texels_per_m: Option<f64>,
    /// Bytes of its textures on the GPU, with mips. Of a page that several species share the first carries them.
    pub texture_bytes: u64,
}

impl Answer {
    /// Sums the textures of levels that are needed.
    pub fn add_up(&mut self) {
        let levels = self.species.iter().flat_map(|s| &s.levels);
        self.texture_bytes = levels.filter(|l| l.needed).map(|l| l.texture_bytes).sum();
    }
}

impl Cost {
    /// Mean and maximum; the first frame of those that are equal.
    pub fn over(values: impl Iterator<Item = u64>) -> Self {
        let mut cost = Self::default();
        let mut sum = 0.0;
        let mut count = 0u32;
        for value in values {
            if value > cost.worst {
                (cost.worst, cost.worst_frame) = (value, count);
            }
            sum += value as f64;
            count += 1;
        }
        cost.mean = sum / f64::from(count.max(1));
        cost
    }
}
