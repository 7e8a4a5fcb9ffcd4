//! What a scene needs of its trees, and what that costs, before anything is baked.
//!
//! The camera goes its path through the trees; what it sees says which levels each kind of tree
//! needs at all, how many triangles a frame takes, and how far all levels have to be moved where
//! that is more than the budget. These are what an engine without occlusion culling draws; what
//! trees hide of each other is told beside them.

mod count;
mod hidden;
mod kind;
mod path;
mod places;
mod spec;

use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::runtime::Cells;
use crate::scene::Scene;
use count::{Frame, frame};
use hidden::Hiding;
pub use kind::Kind;
pub use spec::{Key, Spec, Species};

/// Most that levels are moved nearer for a budget.
const NEAREST: f64 = 16.0;
/// Texels of a level's page over the square of the tree's height in pixels where the level starts:
/// the feather palm of the README has 8, the sample oak 16. Sides of pages are powers of two.
const TEXELS_PER_PIXEL: f64 = 12.0;
/// Base colour, normals, and roughness with metalness and occlusion.
const MAPS: f64 = 3.0;
/// All mips over the largest.
const MIPS: f64 = 4.0 / 3.0;
/// Distances that the camera comes to are rounded outwards by this share.
const ROUNDING: f64 = 0.01;

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
    /// Bytes of the packages; absent before they are baked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub disk_bytes: Option<u64>,
    /// Each kind of tree.
    pub species: Vec<SpeciesAnswer>,
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
    /// Bytes of its textures on the GPU, with mips.
    pub texture_bytes: u64,
}

/// Plans a scene; paths in `spec` are relative to `folder`.
///
/// # Errors
/// [`Error::Usage`] where there are no trees; those of reading trees and places.
pub fn plan(spec: &Spec, folder: &Path) -> Result<Answer> {
    if spec.species.is_empty() {
        return Err(Error::usage(
            "the plan has no species",
            "write species: [(input: \"oak.glb\", count: 100)]",
        ));
    }
    names_differ(spec)?;
    let kinds: Vec<Kind> = (spec.species.iter().enumerate())
        .map(|(index, species)| Kind::read(spec, index, species, folder))
        .collect::<Result<_>>()?;
    let views = path::frames(spec);
    let walk = |nearer: f64, grid: Option<&Cells>| -> Result<Vec<Frame>> {
        let ladders = kinds.iter().map(|k| k.ladder(spec, nearer));
        let ladders: Vec<_> = ladders.collect::<Result<_>>()?;
        let frames = views.par_iter().map_init(
            || Hiding::new(grid),
            |hiding, view| frame(view, &kinds, &ladders, spec, hiding),
        );
        Ok(frames.collect())
    };
    let nearer = within_budget(spec.triangles_per_frame, |nearer| walk(nearer, None))?;
    let frames = walk(nearer, hidden::grid(&kinds).as_ref())?;
    let triangles = Cost::over(frames.iter().map(Frame::triangles));
    let budget = Some(spec.triangles_per_frame).filter(|&n| n > 0);
    let mut answer = Answer {
        frames: spec.frames,
        trees: kinds.iter().map(|k| k.spots.len() as u64).sum(),
        moved_nearer: nearer,
        budget_met: budget.map(|budget| triangles.worst <= budget),
        triangles,
        triangles_unhidden: Cost::over(frames.iter().map(|f| f.unhidden_triangles)),
        hidden_trees: Cost::over(frames.iter().map(|f| f.hidden_trees)),
        triangles_original: Cost::over(frames.iter().map(|f| f.original_triangles)),
        texture_bytes_estimated: true,
        ..Answer::default()
    };
    for (index, kind) in kinds.iter().enumerate() {
        answer
            .species
            .push(species(spec, kind, index, nearer, &frames)?);
    }
    answer.add_up();
    Ok(answer)
}

/// Two species of one name would be baked into one folder, the second over the first.
fn names_differ(spec: &Spec) -> Result<()> {
    let mut names = std::collections::BTreeSet::new();
    for species in &spec.species {
        let name = species.input.file_stem().unwrap_or_default();
        // Some file systems take upper and lower case for the same.
        if !names.insert(name.to_string_lossy().to_lowercase()) {
            return Err(Error::usage(
                format!("the plan has two species named {}", name.display()),
                "write all places of a tree into one file, or rename one of the trees",
            ));
        }
    }
    Ok(())
}

/// The least move at which the worst frame keeps the budget; [`NEAREST`] where none does.
fn within_budget(budget: u64, walk: impl Fn(f64) -> Result<Vec<Frame>>) -> Result<f64> {
    let kept = |nearer: f64| -> Result<bool> {
        let frames = walk(nearer)?;
        Ok(frames.iter().all(|f| f.triangles() <= budget))
    };
    if budget == 0 || kept(1.0)? {
        return Ok(1.0);
    }
    let (mut low, mut high) = (1.0, NEAREST);
    if !kept(high)? {
        return Ok(high);
    }
    // Factors, so halved in the logarithm: to a hundredth.
    while high / low > 1.01 {
        let middle = f64::sqrt(low * high);
        match kept(middle)? {
            true => high = middle,
            false => low = middle,
        }
    }
    Ok(high)
}

fn species(
    spec: &Spec,
    kind: &Kind,
    index: usize,
    nearer: f64,
    frames: &[Frame],
) -> Result<SpeciesAnswer> {
    let ladder = kind.ladder(spec, nearer)?;
    let seen = |pick: fn(&Frame) -> &Vec<[f64; 2]>| frames.iter().map(move |f| pick(f)[index]);
    let nearest = seen(|f| &f.distances)
        .map(|d| d[0])
        .fold(f64::MAX, f64::min);
    let farthest = seen(|f| &f.distances).map(|d| d[1]).fold(0.0, f64::max);
    let ever = nearest < f64::MAX;
    let levels = ladder.iter().enumerate().map(|(level, range)| {
        let shown = Cost::over(frames.iter().map(|f| f.shown[index][level]));
        let texels = TEXELS_PER_PIXEL * range.height_px * range.height_px;
        LevelAnswer {
            distance_m: range.distance_m,
            height_px: (level > 0).then_some(range.height_px),
            triangles: range.triangles,
            needed: shown.worst > 0,
            shown,
            texture_bytes: match level {
                0 => (kind.texture_bytes as f64 / 4.0 * spec.texel_bytes) as u64,
                _ => (texels * MAPS * MIPS * spec.texel_bytes) as u64,
            },
        }
    });
    Ok(SpeciesAnswer {
        name: kind.name.clone(),
        input: kind.input.clone(),
        trees: kind.spots.len() as u64,
        triangles: kind.triangles,
        height_m: kind.height_m,
        nearest_m: ever.then_some(nearest),
        farthest_m: ever.then_some(farthest),
        levels: levels.collect(),
        scene: Scene {
            nearest_m: spec.scene.nearest_m.max(nearest * (1.0 - ROUNDING)),
            farthest_m: match farthest * (1.0 + ROUNDING) {
                far if spec.scene.farthest_m > 0.0 => far.min(spec.scene.farthest_m),
                far => far,
            },
            heights_px: ladder[1..].iter().map(|l| l.height_px).collect(),
            ..spec.scene.clone()
        },
    })
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
    fn over(values: impl Iterator<Item = u64>) -> Self {
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
