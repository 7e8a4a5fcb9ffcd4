//! The stands and camera paths that studies look at.

use glam::{Vec2, Vec3};

use super::species::Species;
use crate::botany::grow::{Options, Species as Kind, grow};
use crate::botany::load::{Limits, load_slice};
use crate::botany::recognise::{RecogniseOptions, recognise};
use crate::botany::tree::Tree;
use crate::error::Result;
use crate::runtime::{Cells, Place, View, splat};

/// Lines of a picture.
pub const HEIGHT_PX: u32 = 360;
/// Vertical field of view, degrees.
pub const FOV_DEG: f32 = 60.0;
/// Width over height.
pub const ASPECT: f32 = 16.0 / 9.0;
/// Texels along a billboard's longer side.
pub const TEXELS: u32 = 64;
/// Trees of the forest: as many as Deng's.
pub const TREES: usize = 4992;
/// Metres between trees: about 800 a hectare.
const SPACING_M: f32 = 3.5;
/// Share of a grid's extinction that counts: see [`Occlusion::clumped`](crate::runtime::Occlusion::clumped).
pub const CLUMPING: f32 = 0.3;
/// Leaves of a grown tree.
const LEAVES: u32 = 1500;

/// Pixels of focal length.
pub fn focal_px() -> f64 {
    0.5 * f64::from(HEIGHT_PX) / f64::from(0.5 * FOV_DEG.to_radians()).tan()
}

/// The five species that `pleach grow` knows.
///
/// # Errors
/// Where growing or reading fails.
pub fn five_species() -> Result<Vec<Species>> {
    ["oak", "spruce", "palm", "willow", "birch_winter"]
        .into_iter()
        .filter_map(|name| Kind::named(name).map(|kind| (name, kind)))
        .map(|(name, kind)| {
            let leaves = kind.leaf.is_some().then_some(LEAVES);
            let grown = grow(
                &kind,
                &Options {
                    leaves,
                    ..Options::default()
                },
            )?;
            let model = load_slice(&grown.glb, std::path::Path::new(name), &Limits::default())?;
            let tree = recognise(model, &RecogniseOptions::default())?;
            Species::new(tree, focal_px(), TEXELS)
        })
        .collect()
}

/// Where a tree stands with its foot at a point of the ground.
pub fn stand_at(tree: &Tree, foot: Vec2, turn: f32, scale: f32, species: u32) -> Place {
    let low = tree.model.positions.iter().fold(0.0f32, |a, p| a.min(p.y));
    let scale = tree.model.frame.radius as f32 * scale;
    Place {
        position: Vec3::new(foot.x, -low * scale, foot.y),
        turn: Vec2::from_angle(turn),
        scale,
        species,
    }
}

/// Numbers from 0 to 1 by index and use, the same on every run.
fn chance(index: usize, usage: u64) -> f32 {
    let mut z = (index as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ usage.wrapping_mul(0xd1b5_4a32_d192_ed03);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}

/// A dense forest of so many trees, strewn over a jittered grid.
pub fn forest(species: &[Species], trees: usize) -> Vec<Place> {
    let side = (trees as f64).sqrt().ceil() as usize;
    (0..trees)
        .map(|i| {
            let jitter = Vec2::new(chance(i, 1), chance(i, 2)) - 0.5;
            let middle = Vec2::splat(side as f32 / 2.0);
            let foot =
                (Vec2::new((i % side) as f32, (i / side) as f32) - middle + jitter) * SPACING_M;
            let kind = (chance(i, 3) * species.len() as f32) as usize % species.len().max(1);
            let turn = std::f32::consts::TAU * chance(i, 4);
            stand_at(
                &species[kind].tree,
                foot,
                turn,
                0.8 + 0.4 * chance(i, 5),
                kind as u32,
            )
        })
        .collect()
}

/// A walk of 60 m through the forest at eye level, looking ahead and slowly around.
pub fn walk(frames: usize) -> Vec<View> {
    (0..frames)
        .map(|i| {
            let at = i as f32 / frames.max(1) as f32;
            let eye = Vec3::new(60.0 * at - 30.0, 1.7, 12.0 * (3.0 * at).sin());
            let angle = 0.8 * (5.0 * at).sin();
            looking(eye, Vec3::new(angle.cos(), 0.08, angle.sin()))
        })
        .collect()
}

/// Frames of a path of which pictures are made: the middles of equal parts.
pub fn looked_at(frames: usize, pictures: usize) -> Vec<usize> {
    (0..pictures)
        .map(|i| (2 * i + 1) * frames / (2 * pictures))
        .collect()
}

/// From twelve radii to one and once around a tree that stands at the origin.
pub fn approach(place: &Place, frames: usize) -> Vec<View> {
    (0..frames)
        .map(|i| {
            let at = i as f32 / frames.max(1) as f32;
            let angle = std::f32::consts::TAU * at;
            let away = place.scale * (1.2 + 10.8 * (1.0 - at).powi(2));
            let eye = place.position + Vec3::new(angle.cos(), 0.15, angle.sin()) * away;
            looking(eye, place.position - eye)
        })
        .collect()
}

fn looking(eye: Vec3, forward: Vec3) -> View {
    View::looking(eye, forward, FOV_DEG.to_radians(), ASPECT)
}

/// Cells of about `edge` metres over a forest, as solid as the trees in them.
pub fn forest_cells(species: &[Species], places: &[Place], edge: f32, rays: Option<u32>) -> Cells {
    let own: Vec<Cells> = species.iter().map(|s| s.cells(16, rays)).collect();
    let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
    for place in places {
        low = low.min(place.position - place.scale);
        high = high.max(place.position + place.scale);
    }
    let count = ((high - low) / edge).ceil().max(Vec3::ONE);
    let mut cells = Cells::new(low, low + count * edge, count.to_array().map(|c| c as u32));
    let mut extinction = vec![0.0; cells.solidity().len()];
    for place in places {
        splat(
            &mut cells,
            &mut extinction,
            &own[place.species as usize],
            place,
        );
    }
    cells
}

/// The tree's own cells where it stands upright at a place.
pub fn tree_cells(species: &Species, place: &Place, longest: u32, rays: Option<u32>) -> Cells {
    let own = species.cells(longest, rays);
    let low = place.to_world(own.low());
    let high = place.to_world(own.low() + own.edge() * own.count().as_vec3());
    let mut cells = Cells::new(low, high, own.count().to_array().map(|c| c as u32));
    for (index, &solidity) in own.solidity().iter().enumerate() {
        cells.set_index(index, solidity);
    }
    cells
}
