//! Sample trees with a known answer, for trying, testing and benching.
//!
//! A compact parametric generator after Weber and Penn 1995 ("Creation and Rendering of
//! Realistic Trees", SIGGRAPH): a [`Species`] and a seed give a tree as a GLB file, meshed as
//! one or another tool would mesh it, and the [`TrueSkeleton`] that recognition is scored against.
//! The same species, options and version give the same bytes on every machine.

mod bark;
mod file;
mod foliage;
mod mesh;
mod outline;
mod paint;
mod rng;
mod skin;
mod species;
mod stem;
#[cfg(test)]
mod tests;
mod truth;
mod tube;

pub use rng::Vary;
pub use species::{Bark, LeafKind, Level, Outline, Pattern, Shape, Species};
pub use truth::{TrueChain, TrueLeaf, TrueSkeleton};

use crate::{Error, Result};

/// The most leaves that can be asked for.
pub const MAX_LEAVES: u32 = 4_000_000;

/// How bark is meshed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Wood {
    /// Each branch a tube of its own, its base inside its parent (Sapling, EZ-Tree).
    #[default]
    Tubes,
    /// One welded piece: branches are stitched into their parents (MTree).
    Skin,
    /// Tubes as triangles that share no vertex, with the faces' normals (obj2gltf).
    Soup,
}

/// How leaves are meshed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Foliage {
    /// One alpha-tested quadrilateral.
    #[default]
    Quads,
    /// Two of them, crossed.
    Crossed,
    /// Polygons in the leaf's shape, opaque.
    Polygons,
}

/// How geometry is spread over nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Nodes {
    /// One for wood, one for foliage.
    #[default]
    One,
    /// One for each branch and one for each leaf; leaves share a mesh, half of them mirrored.
    Many,
}

/// What is asked for beside the species.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Number of leaves (1 to [`MAX_LEAVES`]); `None`: the species' own. More leaves are smaller
    /// and grow on more twigs.
    pub leaves: Option<u32>,
    /// Seed of all chance.
    pub seed: u64,
    /// How bark is meshed.
    pub wood: Wood,
    /// How leaves are meshed.
    pub foliage: Foliage,
    /// How geometry is spread over nodes.
    pub nodes: Nodes,
}

/// A grown tree.
#[derive(Clone, Debug)]
pub struct Grown {
    /// The GLB file.
    pub glb: Vec<u8>,
    /// What recognition should find in it.
    pub skeleton: TrueSkeleton,
    /// Triangles of wood and of foliage.
    pub triangles: [usize; 2],
}

/// Grows a tree.
///
/// # Errors
/// Where the number of leaves is out of range, or leaves are asked of a bare species.
pub fn grow(species: &Species, options: &Options) -> Result<Grown> {
    let amount = leaf_amount(species, options)?;
    let stems = stem::grow(species, &branch_scales(species, amount), options.seed);
    let foliage = match (&species.leaf, amount) {
        (Some(kind), Some((count, _))) => {
            let sprig = outline::sprig(kind.outline, kind.sprig);
            let size = rng::pow(kind.count as f32 / count as f32, 0.42);
            let placements = foliage::hang(species, kind, &stems, count, size);
            let prototype = foliage::prototype(&sprig, options.foliage);
            let texture = paint::paint_sprig(&sprig, kind);
            Some((placements, prototype, texture))
        }
        _ => None,
    };
    let chains = stems.iter().map(|stem| TrueChain {
        parent: stem.parent,
        order: stem.order,
        points: stem.points.iter().map(|p| p.to_array()).collect(),
        radii: stem.radii.clone(),
    });
    let mut skeleton = TrueSkeleton {
        chains: chains.collect(),
        leaves: Vec::new(),
    };
    if let Some((placements, prototype, _)) = &foliage {
        skeleton.leaves = placements
            .iter()
            .map(|p| foliage::truth(prototype, p))
            .collect();
    }
    let (glb, triangles) = file::write(species, options, &stems, foliage)?;
    Ok(Grown {
        glb,
        skeleton,
        triangles,
    })
}

/// Number of leaves and its ratio to the species' own; `None` for a bare tree.
fn leaf_amount(species: &Species, options: &Options) -> Result<Option<(u32, f32)>> {
    match (&species.leaf, options.leaves) {
        (_, Some(n)) if n == 0 || n > MAX_LEAVES => Err(Error::usage(
            format!("{n} leaves are out of range"),
            format!("ask for 1 to {MAX_LEAVES}"),
        )),
        (None, Some(_)) => Err(Error::usage(
            format!("the species \"{}\" is bare", species.name),
            "leave the number of leaves out, or give the species a `leaf`",
        )),
        (None, None) => Ok(None),
        (Some(kind), n) => {
            let n = n.unwrap_or(kind.count);
            Ok(Some((n, n as f32 / kind.count as f32)))
        }
    }
}

/// Factors on the number of branches by level: of ten times the leaves, the last level's twigs
/// take a factor of 4, the level before 1.6, and each twig 1.6.
fn branch_scales(species: &Species, amount: Option<(u32, f32)>) -> Vec<f32> {
    let ratio = amount.map_or(1.0, |(_, ratio)| ratio);
    let n = species.levels.len();
    (0..n)
        .map(|level| {
            let scale = match n - level {
                1 => rng::pow(ratio, 0.6),
                2 => rng::pow(ratio, 0.2),
                _ => 1.0,
            };
            // One branch stays, or leaves had nothing to hang on.
            scale.max(1.0 / species.levels[level].branches.max(1.0))
        })
        .collect()
}
