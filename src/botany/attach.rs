//! Leaves are attached to the branch that they grow from.
//!
//! Congruent leaves grow from the same point of theirs. So each class first learns which of its
//! corners or edge middles lies nearest to wood over a sample of its leaves; then one look-up a
//! leaf is enough, and a tip that happens to touch another twig deceives nobody.

use glam::Vec3;
use rayon::prelude::*;

use super::skeleton::near::{Contact, Grid, Segment};
use super::tree::{Leaf, NO_NODE, Skeleton, Tree};

/// Leaves of a class that are asked where their base is.
const SAMPLE: usize = 400;
/// Most points of one leaf that may be its base.
const MOST_POINTS: usize = 64;

/// Sets `node` of every leaf.
pub fn attach_leaves(tree: &mut Tree, warnings: &mut Vec<String>) {
    if tree.skeleton.nodes.is_empty() || tree.leaves.is_empty() {
        return;
    }
    let grid = Grid::new(segments(&tree.skeleton));
    let bases = base_of_classes(tree, &grid);
    let found: Vec<(u32, f32)> = tree
        .leaves
        .par_iter()
        .map(|leaf| {
            let points = base_points(tree, leaf);
            let at = (bases[leaf.class as usize] as usize).min(points.len() - 1);
            nearest(&grid, points[at]).map_or((NO_NODE, f32::MAX), |hit| {
                (hit.node(&tree.skeleton), hit.contact.gap())
            })
        })
        .collect();
    let mut far = 0;
    for (leaf, (node, gap)) in tree.leaves.iter_mut().zip(found) {
        leaf.node = node;
        far += (gap > 2.0 * leaf.area.max(0.0).sqrt() + 0.01) as usize;
    }
    if far > 0 {
        warnings.push(format!(
            "{far} leaves touch no branch; they were attached to the nearest one"
        ));
    }
}

/// The segments of a skeleton; `index` is the node at the lower end within its chain.
pub fn segments(skeleton: &Skeleton) -> Vec<Segment> {
    let mut out = Vec::with_capacity(skeleton.nodes.len());
    for (chain, number) in skeleton.chains.iter().zip(0u32..) {
        for i in 0..chain.nodes.len().saturating_sub(1).max(1) {
            let node =
                |i: usize| skeleton.nodes[chain.nodes[i.min(chain.nodes.len() - 1)] as usize];
            let (a, b) = (node(i), node(i + 1));
            out.push(Segment {
                ends: [a.position, b.position],
                radii: [a.radius, b.radius],
                chain: number,
                index: i as u32,
            });
        }
    }
    out
}

/// A branch near a point.
#[derive(Clone, Copy, Debug)]
struct Hit {
    cost: f32,
    chain: u32,
    index: u32,
    contact: Contact,
}

impl Hit {
    fn node(&self, skeleton: &Skeleton) -> u32 {
        let nodes = &skeleton.chains[self.chain as usize].nodes;
        let at = self.index as usize + (self.contact.along > 0.5) as usize;
        nodes[at.min(nodes.len() - 1)]
    }
}

/// The branch that a leaf's base most likely grows from: the nearest surface, and of several
/// that hold the point the one whose centre line is nearest.
fn nearest(grid: &Grid, p: Vec3) -> Option<Hit> {
    let mut reach = 0.25 * grid.cell();
    loop {
        let mut best: Option<Hit> = None;
        grid.each_near(p, reach, |segment| {
            let contact = segment.contact(p);
            let cost = contact.gap() + 0.5 * contact.distance.min(contact.radius);
            let hit = Hit {
                cost,
                chain: segment.chain,
                index: segment.index,
                contact,
            };
            let better = |b: &Hit| (cost, hit.chain, hit.index) < (b.cost, b.chain, b.index);
            if best.as_ref().is_none_or(better) {
                best = Some(hit);
            }
        });
        if best.is_some_and(|b| b.contact.gap() <= reach) || reach > grid.whole(p) {
            return best;
        }
        reach *= 2.0;
    }
}

/// Corners and edge middles of a leaf, in the order of its triangles.
fn base_points(tree: &Tree, leaf: &Leaf) -> Vec<Vec3> {
    let stride = (leaf.triangles.len() * 6).div_ceil(MOST_POINTS).max(1);
    let mut points = Vec::with_capacity(leaf.triangles.len() * 6);
    for &t in &leaf.triangles {
        let [a, b, c] = tree.model.corners(t);
        points.extend([a, b, c, (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0]);
    }
    points.into_iter().step_by(stride).collect()
}

/// For each class the point of its leaves that lies nearest to wood, by median.
fn base_of_classes(tree: &Tree, grid: &Grid) -> Vec<u32> {
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); tree.leaf_classes.len()];
    for (index, leaf) in tree.leaves.iter().enumerate() {
        let class = &tree.leaf_classes[leaf.class as usize];
        let list = &mut members[leaf.class as usize];
        // Evenly over the tree, not the first ones of the file.
        let stride = (class.count as usize).div_ceil(SAMPLE).max(1);
        let seen = index % stride == 0;
        if seen || list.is_empty() {
            list.push(index as u32);
        }
    }
    members
        .par_iter()
        .map(|list| {
            let costs: Vec<Vec<f32>> = (list.iter())
                .map(|&leaf| {
                    let points = base_points(tree, &tree.leaves[leaf as usize]);
                    let cost = |&p: &Vec3| nearest(grid, p).map_or(f32::MAX, |h| h.cost);
                    points.iter().map(cost).collect()
                })
                .collect();
            let count = costs.iter().map(Vec::len).min().unwrap_or(0);
            let median = |point: usize| {
                let mut column: Vec<f32> = costs.iter().map(|c| c[point]).collect();
                column.sort_unstable_by(f32::total_cmp);
                column[column.len() / 2]
            };
            (0..count as u32)
                .map(|point| (median(point as usize), point))
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
                .map_or(0, |best| best.1)
        })
        .collect()
}
