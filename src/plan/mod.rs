//! What a scene needs of its trees, and what that costs, before anything is baked.
//!
//! The camera goes its path through the trees; what it sees says which levels each kind of tree
//! needs at all, how many triangles a frame takes, and how far all levels have to be moved where
//! that is more than the budget. These are what an engine without occlusion culling draws; what
//! trees hide of each other is told beside them.

mod answer;
mod count;
mod hidden;
mod kind;
mod path;
mod places;
mod seen;
mod shared;
mod spec;

use std::path::Path;

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::export::maps::Maps;
use crate::recipe::Recipe;
use crate::runtime::Cells;
use crate::scene::{Mips, Scene};
pub use answer::{Answer, Cost, EngineAnswer, LevelAnswer, SpeciesAnswer};
use count::{Frame, frame};
use hidden::Hiding;
pub use kind::Kind;
use seen::Seen;
pub use spec::{Key, Spec, Species};

/// Most that levels are moved nearer for a budget.
const NEAREST: f64 = 16.0;
/// Texels of a level's page over the square of the tree's height in pixels where the level starts:
/// the feather palm of the README has 8, the sample oak 16. Sides of pages are powers of two.
const TEXELS_PER_PIXEL: f64 = 12.0;
/// Bytes of a level's file over those of its textures, uncompressed: .09 to .13 for the sample oak, an EZ oak and an
/// instanced maple.
const FILE_SHARE: f64 = 0.11;
/// Bytes of a manifest for a triangle of the original: 15 to 65 for these.
const MANIFEST_BYTES: f64 = 50.0;
/// Maps of a page; the first alone where nothing is lit.
const MAPS: [&str; 3] = ["base color", "normal", "occlusion, roughness, metalness"];
/// All mips over the largest.
const MIPS: f64 = 4.0 / 3.0;
/// Distances that the camera comes to are rounded outwards by this share.
const ROUNDING: f64 = 0.01;

/// Plans a scene that will be baked with `recipe`; paths in `spec` are relative to `folder`.
///
/// # Errors
/// [`Error::Usage`] where there are no trees; those of reading trees and places.
pub fn plan(spec: &Spec, recipe: &Recipe, folder: &Path) -> Result<Answer> {
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
        disk_bytes_estimated: true,
        engine: EngineAnswer::of(spec.scene.engine),
        ..Answer::default()
    };
    for (index, kind) in kinds.iter().enumerate() {
        answer
            .species
            .push(species(spec, recipe, kind, index, nearer, &frames)?);
    }
    shared::partners(&kinds, &mut answer.species);
    let disk = kinds.iter().zip(&answer.species);
    answer.disk_bytes = disk.map(|(k, s)| disk_bytes(k, s, spec)).sum();
    answer.add_up();
    Ok(answer)
}

/// About what a package takes: every level is in a file of its own and in the one of all.
fn disk_bytes(kind: &Kind, answer: &SpeciesAnswer, spec: &Spec) -> u64 {
    if answer.nearest_m.is_none() {
        return 0;
    }
    let uncompressed = 4.0 / spec.scene.texture_format.texel_bytes();
    let level = |(number, level): (usize, &LevelAnswer)| match (level.needed, number) {
        (false, _) => 0.0,
        (true, 0) => kind.file_bytes as f64,
        (true, _) => level.texture_bytes as f64 * uncompressed * FILE_SHARE,
    };
    let files: f64 = answer.levels.iter().enumerate().map(level).sum();
    let needed = answer.levels.iter().filter(|l| l.needed);
    let shipped: u64 = match spec.scene.mips {
        Mips::Engine => 0,
        Mips::Shipped => needed.map(|l| l.texture_bytes).sum(),
    };
    (2.0 * files + MANIFEST_BYTES * kind.triangles as f64) as u64 + shipped
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
    recipe: &Recipe,
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
    let mut from = Seen::default();
    frames.iter().for_each(|f| from.join(&f.seen[index]));
    let sector = from.sector();
    let maps = match spec.scene.lit {
        true => kind.maps.count(),
        false => Maps::Unlit.count(),
    };
    // Maps of light are coarser where the recipe says so.
    let light = 0.25f64.powi(recipe.own_light_halvings() as i32);
    let maps_of_page = 1.0 + (maps - 1) as f64 * light;
    let texel_bytes = spec.scene.texture_format.texel_bytes();
    let levels = ladder.iter().enumerate().map(|(level, range)| {
        let shown = Cost::over(frames.iter().map(|f| f.shown[index][level]));
        let texels = TEXELS_PER_PIXEL * range.height_px * range.height_px;
        LevelAnswer {
            distance_m: range.distance_m,
            height_px: (level > 0).then_some(range.height_px),
            texels_per_m: (level > 0).then(|| range.texels_high() / kind.height_m),
            triangles: range.triangles,
            needed: shown.worst > 0,
            shown,
            texture_bytes: match level {
                0 => (kind.texture_bytes as f64 / 4.0 * texel_bytes) as u64,
                _ => (texels * maps_of_page * MIPS * texel_bytes) as u64,
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
        azimuths_deg: sector.map(|s| s.azimuths_deg),
        elevations_deg: sector.map(|s| s.elevations_deg),
        both_sides: sector.map_or(0.0, |s| s.both_sides()),
        maps: MAPS[..maps].to_vec(),
        can_share_with: Vec::new(),
        atlas: kind.atlas.clone(),
        scene: Scene {
            nearest_m: spec.scene.nearest_m.max(nearest * (1.0 - ROUNDING)),
            farthest_m: match farthest * (1.0 + ROUNDING) {
                far if spec.scene.farthest_m > 0.0 => far.min(spec.scene.farthest_m),
                far => far,
            },
            heights_px: ladder[1..].iter().map(|l| l.height_px).collect(),
            ..match sector {
                Some(sector) if !spec.from_all_sides => Scene {
                    azimuths_deg: sector.azimuths_deg,
                    elevations_deg: sector.elevations_deg,
                    ..spec.scene.clone()
                },
                _ => spec.scene.clone(),
            }
        },
    })
}
