//! From where a sub-tree is drawn as a whole, and what hides it: what a cut needs at run time.
//!
//! *Optimal distance* (Deng): where the sub-tree's projection has the size of its texture,
//! `extent * focal_px / texels`, with the bounding sphere's diameter for the extent. *Geometric
//! distance*: where the distance of its surface from one plane through it is a pixel.
//!
//! *Sibling density* (Deng, Fig. 1(b)): the number of order-1 siblings whose middle lies within the
//! branch's own bounding sphere, over the number that hides what is behind it. The paper gives
//! no number; here it is that at which all but a twentieth is hidden, when each branch lets
//! `exp(-A / (2 pi r^2))` of the light pass (leaves of area A, turned any way, over its sphere's section).

use glam::Vec3;

use crate::botany::tree::{NO_NODE, Organ, Tree};
use crate::runtime::{Sibling, sibling_density};
use crate::space::eigen::Moments;

/// Texels along a sub-tree's texture: all have the same, as the paper demands.
pub const TEXELS: u32 = 128;

/// Share of what is behind that a hiding number of siblings still lets through.
const LET_THROUGH: f32 = 0.05;

/// What a cut needs to know of a sub-tree; lengths in normalised units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Aspect {
    /// Where one texel is one pixel.
    pub optimal_distance: f32,
    /// Where one plane instead of the sub-tree is off by one pixel (root mean square).
    pub geometric_distance: f32,
    /// Unit direction of the order-1 branch that carries it, from its connector to its middle;
    /// zero for trunk and whole tree.
    pub branch: Vec3,
    /// Density of that branch's siblings, 0 to 1.
    pub density: f32,
    /// What grows on its own branch (leaves, and the branch's wood), if it carries other branches too.
    pub own: Option<Own>,
}

/// What grows on a sub-tree's own branch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Own {
    /// Bounding sphere: centre and radius.
    pub sphere: (Vec3, f32),
    /// As of the sub-tree.
    pub optimal_distance: f32,
    /// As of the sub-tree.
    pub geometric_distance: f32,
}

/// Looks at every sub-tree, for a camera of so many pixels of focal length.
pub fn aspects(tree: &Tree, focal_px: f64) -> Vec<Aspect> {
    let triangles = own_triangles(tree);
    let moments: Vec<Moments> = triangles.iter().map(|t| moments(tree, t)).collect();
    let mut whole = moments.clone();
    for i in (1..tree.subtrees.len()).rev() {
        if let Some(parent) = tree.subtrees[i].parent {
            whole[parent as usize] = whole[parent as usize].merged(&whole[i]);
        }
    }
    let optimal = |radius: f32| 2.0 * radius * focal_px as f32 / TEXELS as f32;
    let geometric = |m: &Moments| {
        let spread = m.axes().map_or(0.0, |a| a.variances[0].sqrt());
        (spread * focal_px) as f32
    };
    let branches = branches(tree);
    let describe = |(i, subtree): (usize, &crate::botany::tree::Subtree)| {
        let (branch, density) = branches[i];
        let own = (!subtree.children.is_empty() && !triangles[i].is_empty()).then(|| {
            let sphere = sphere(tree, &triangles[i]);
            Own {
                sphere,
                optimal_distance: optimal(sphere.1),
                geometric_distance: geometric(&moments[i]),
            }
        });
        Aspect {
            optimal_distance: optimal(subtree.sphere.1),
            geometric_distance: geometric(&whole[i]),
            branch,
            density,
            own,
        }
    };
    tree.subtrees.iter().enumerate().map(describe).collect()
}

/// For each sub-tree the triangles on its own branch: its leaves and its wood.
pub fn own_triangles(tree: &Tree) -> Vec<Vec<u32>> {
    let mut out: Vec<Vec<u32>> = vec![Vec::new(); tree.subtrees.len()];
    let mut subtree_of_chain = vec![0; tree.skeleton.chains.len()];
    for (i, subtree) in tree.subtrees.iter().enumerate() {
        if let Some(chain) = subtree.chain {
            subtree_of_chain[chain as usize] = i;
        }
        for &leaf in &subtree.leaves {
            out[i].extend(&tree.leaves[leaf as usize].triangles);
        }
    }
    for (t, &node) in tree.wood_node.iter().enumerate() {
        if tree.organ[t] == Organ::Wood {
            let at = match node {
                NO_NODE => 0,
                node => subtree_of_chain[tree.skeleton.nodes[node as usize].chain as usize],
            };
            out[at].push(t as u32);
        }
    }
    out
}

/// Moments of foliage; of wood where there is none.
fn moments(tree: &Tree, triangles: &[u32]) -> Moments {
    let mut out = [Moments::default(); 2];
    for &t in triangles {
        let [a, b, c] = tree.model.corners(t);
        let area = f64::from(0.5 * (b - a).cross(c - a).length());
        let foliage = tree.organ[t as usize] == Organ::Foliage;
        out[usize::from(!foliage)].add_triangle([a, b, c], area);
    }
    match out[0].weight > 0.0 {
        true => out[0],
        false => out[1],
    }
}

/// A sphere around the middle of the bounding box.
fn sphere(tree: &Tree, triangles: &[u32]) -> (Vec3, f32) {
    let points = || triangles.iter().flat_map(|&t| tree.model.corners(t));
    let (low, high) = points().fold((Vec3::MAX, Vec3::MIN), |(a, b), p| (a.min(p), b.max(p)));
    let center = (low + high) / 2.0;
    let square = points()
        .map(|p| p.distance_squared(center))
        .fold(0.0, f32::max);
    (center, square.sqrt())
}

/// Direction and sibling density of the order-1 branch of each sub-tree.
fn branches(tree: &Tree) -> Vec<(Vec3, f32)> {
    let subtrees = &tree.subtrees;
    let is_first = |s: &crate::botany::tree::Subtree| s.order == 1 && s.parent.is_some();
    let mut leaf_area = vec![0.0f32; subtrees.len()];
    for i in (0..subtrees.len()).rev() {
        let own = subtrees[i]
            .leaves
            .iter()
            .map(|&l| tree.leaves[l as usize].area);
        leaf_area[i] += own.sum::<f32>();
        if let Some(parent) = subtrees[i].parent {
            leaf_area[parent as usize] += leaf_area[i];
        }
    }
    let first: Vec<usize> = (0..subtrees.len())
        .filter(|&i| is_first(&subtrees[i]))
        .collect();
    let siblings: Vec<Sibling> = first
        .iter()
        .map(|&i| {
            let (middle, radius) = subtrees[i].sphere;
            let depth = leaf_area[i] / (2.0 * std::f32::consts::PI * radius * radius).max(1e-12);
            Sibling {
                middle,
                reach: radius,
                full: -LET_THROUGH.ln() / depth.max(1e-3),
            }
        })
        .collect();
    let density = sibling_density(&siblings);
    let mut out = vec![(Vec3::ZERO, 0.0); subtrees.len()];
    for (&i, density) in first.iter().zip(density) {
        let way = subtrees[i].sphere.0 - subtrees[i].connector;
        out[i] = (way.normalize_or_zero(), density);
    }
    for i in 1..subtrees.len() {
        if subtrees[i].order > 1 {
            out[i] = subtrees[i].parent.map_or(out[i], |p| out[p as usize]);
        }
    }
    out
}
