//! Wood becomes a skeleton: centre lines with radii, joined where branches overlap.
//!
//! Every welded part of wood is traced on its own: a clean tube ring by ring ([`tube`]), anything
//! else by level sets of the distance from its base ([`levels`]). Then the base of each part
//! looks for the branch that carries it ([`join`]).

mod bands;
mod base;
mod chains;
mod fork;
pub mod join;
pub mod levels;
mod line;
pub mod mesh;
pub mod near;
mod pieces;
pub mod tube;

use glam::Vec3;
use rayon::prelude::*;

use super::part::Parts;
use super::tree::{NO_NODE, Organ, Skeleton};
use mesh::PartMesh;

/// The centre lines of one part; chain 0 starts at its base.
#[derive(Clone, Debug, Default)]
pub struct PartSkeleton {
    /// Chains; a parent comes before its children.
    pub chains: Vec<LocalChain>,
    /// For each triangle of the part, its chain and the node in that chain.
    pub node_of_triangle: Vec<(u32, u32)>,
    /// True where a triangle's node is the upper end of the segment that it lies on, false where
    /// it is the nearest node.
    pub by_segment: bool,
}

/// A chain inside a part.
#[derive(Clone, Debug, Default)]
pub struct LocalChain {
    /// Positions and radii from base to tip; never empty.
    pub nodes: Vec<(Vec3, f32)>,
    /// Chain and node that carry it, or `None` for the part's first chain.
    pub parent: Option<(u32, u32)>,
}

/// The skeleton of all wood, and for each triangle its node.
pub fn build(parts: &Parts, organs: &[Organ], warnings: &mut Vec<String>) -> (Skeleton, Vec<u32>) {
    let wood: Vec<usize> = (0..organs.len())
        .filter(|&p| organs[p] == Organ::Wood)
        .collect();
    let traced: Vec<PartSkeleton> = wood
        .par_iter()
        .map(|&part| trace(parts, parts.triangles.get(part)))
        .collect();
    let joined = join::join(traced, warnings);
    let mut wood_node = vec![NO_NODE; parts.welded.len()];
    for (&part, nodes) in wood.iter().zip(&joined.node_of_triangle) {
        for (&triangle, &node) in parts.triangles.get(part).iter().zip(nodes) {
            wood_node[triangle as usize] = node;
        }
    }
    (joined.skeleton, wood_node)
}

fn trace(parts: &Parts, triangles: &[u32]) -> PartSkeleton {
    let mesh = PartMesh::new(parts, triangles);
    tube::trace(&mesh).unwrap_or_else(|| levels::trace(&mesh))
}
