//! The hierarchy of sub-trees: the whole tree, then one for each chain; or clusters of leaves
//! where there is no skeleton.

use glam::{DVec3, Vec3};

use super::tree::{NO_NODE, Subtree, Tree};

/// A cluster with at most this many leaves is not split further.
const CLUSTER_LEAVES: usize = 32;

/// Builds the hierarchy; entry 0 is the whole tree.
pub fn build(tree: &Tree, warnings: &mut Vec<String>) -> Vec<Subtree> {
    let mut out = if tree.skeleton.chains.is_empty() {
        if !tree.leaves.is_empty() {
            warnings.push(
                "no wood was found, hence no skeleton: sub-trees are clusters of leaves".to_owned(),
            );
        }
        clusters(tree)
    } else {
        along_chains(tree)
    };
    let points = own_points(tree, &out);
    // Children come after their parents, so that one pass upward sums both counts and spheres.
    let mut reach: Vec<(DVec3, DVec3)> = points.iter().map(|p| bounds(p)).collect();
    for index in (0..out.len()).rev() {
        out[index].leaf_count += out[index].leaves.len() as u32;
        if let Some(parent) = out[index].parent {
            let (low, high) = reach[index];
            out[parent as usize].leaf_count += out[index].leaf_count;
            let up = &mut reach[parent as usize];
            *up = (up.0.min(low), up.1.max(high));
        }
    }
    spheres(&mut out, &points, &reach);
    out
}

fn along_chains(tree: &Tree) -> Vec<Subtree> {
    let skeleton = &tree.skeleton;
    let mut out = vec![Subtree::default()];
    for (index, chain) in skeleton.chains.iter().enumerate() {
        let first = skeleton.nodes[chain.nodes[0] as usize];
        let connector = match first.parent {
            NO_NODE => first.position,
            parent => skeleton.nodes[parent as usize].position,
        };
        let parent = chain.parent.map_or(0, |p| p + 1);
        out.push(Subtree {
            parent: Some(parent),
            chain: Some(index as u32),
            order: chain.order,
            connector,
            ..Subtree::default()
        });
        out[parent as usize].children.push(index as u32 + 1);
    }
    out[0].connector = skeleton.nodes[0].position;
    for (leaf, index) in tree.leaves.iter().zip(0u32..) {
        let at = match leaf.node {
            NO_NODE => 0,
            node => skeleton.nodes[node as usize].chain as usize + 1,
        };
        out[at].leaves.push(index);
    }
    out
}

/// Halves the leaves at the median of their longest extent until clusters are small.
fn clusters(tree: &Tree) -> Vec<Subtree> {
    let all: Vec<u32> = (0..tree.leaves.len() as u32).collect();
    let mut out = vec![Subtree::default()];
    let center = |leaf: u32| tree.leaves[leaf as usize].center;
    let mut work = vec![(0usize, all)];
    let mut next = 0;
    while next < work.len() {
        let (at, mut leaves) = std::mem::take(&mut work[next]);
        next += 1;
        let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
        for &leaf in &leaves {
            (low, high) = (low.min(center(leaf)), high.max(center(leaf)));
        }
        if !leaves.is_empty() {
            let middle = (low + high) / 2.0;
            out[at].connector = Vec3::new(middle.x, low.y, middle.z);
        }
        if leaves.len() <= CLUSTER_LEAVES || low == high {
            out[at].leaves = leaves;
            continue;
        }
        let axis = (0..3).fold(0, |best, i| {
            if (high - low)[i] > (high - low)[best] {
                i
            } else {
                best
            }
        });
        leaves
            .sort_unstable_by(|&a, &b| center(a)[axis].total_cmp(&center(b)[axis]).then(a.cmp(&b)));
        let second = leaves.split_off(leaves.len() / 2);
        for half in [leaves, second] {
            let child = out.len();
            out.push(Subtree {
                parent: Some(at as u32),
                order: out[at].order + 1,
                ..Subtree::default()
            });
            out[at].children.push(child as u32);
            work.push((child, half));
        }
    }
    out
}

/// The points of each sub-tree's own geometry.
fn own_points(tree: &Tree, subtrees: &[Subtree]) -> Vec<Vec<Vec3>> {
    let mut points: Vec<Vec<Vec3>> = vec![Vec::new(); subtrees.len()];
    for (at, subtree) in subtrees.iter().enumerate() {
        for &leaf in &subtree.leaves {
            for &t in &tree.leaves[leaf as usize].triangles {
                points[at].extend(tree.model.corners(t));
            }
        }
    }
    for (t, &node) in tree.wood_node.iter().enumerate() {
        if node != NO_NODE {
            let chain = tree.skeleton.nodes[node as usize].chain as usize;
            points[chain + 1].extend(tree.model.corners(t as u32));
        }
    }
    points
}

fn bounds(points: &[Vec3]) -> (DVec3, DVec3) {
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    points.iter().fold(start, |(low, high), p| {
        (low.min(p.as_dvec3()), high.max(p.as_dvec3()))
    })
}

/// Spheres around the middle of each box: every point raises the radius of its own sub-tree and
/// of all that carry it.
fn spheres(subtrees: &mut [Subtree], points: &[Vec<Vec3>], reach: &[(DVec3, DVec3)]) {
    for (subtree, &(low, high)) in subtrees.iter_mut().zip(reach) {
        let center = if low.x <= high.x {
            ((low + high) / 2.0).as_vec3()
        } else {
            subtree.connector
        };
        subtree.sphere = (center, 0.0);
    }
    for (own, list) in points.iter().enumerate() {
        let mut at = Some(own as u32);
        while let Some(index) = at {
            let (center, radius) = subtrees[index as usize].sphere;
            let square = list
                .iter()
                .map(|p| p.distance_squared(center))
                .fold(0.0, f32::max);
            subtrees[index as usize].sphere.1 = radius.max(square.sqrt());
            at = subtrees[index as usize].parent;
        }
    }
}
