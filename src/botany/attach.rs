//! Leaves are attached to the branch that they grow from.
//!
//! Congruent leaves grow from the same point of theirs. So each class first learns which of its
//! corners or edge middles lies nearest to wood over a sample of its leaves; then one look-up a
//! leaf is enough, and a tip that happens to touch another twig deceives nobody.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::skeleton::near::{Contact, Grid, Segment};
use super::tree::{Leaf, NO_NODE, Skeleton, Tree};

/// Leaves of a class that are asked where their base is.
const SAMPLE: usize = 200;
/// Most corners of one leaf that may be its base.
const MOST_POINTS: usize = 48;
/// With at most this many corners the middle of any two may be the base.
const MOST_PAIRED: usize = 12;

/// Sets `node` of every leaf.
pub fn attach_leaves(tree: &mut Tree, warnings: &mut Vec<String>) {
    if tree.skeleton.nodes.is_empty() || tree.leaves.is_empty() {
        return;
    }
    let grid = Grid::new(segments(&tree.skeleton));
    let bases = bases_of_classes(tree, &grid);
    let found: Vec<(u32, f32)> = tree
        .leaves
        .par_iter()
        .map(|leaf| {
            let base = bases[leaf.class as usize];
            let outline = Outline::of(tree, leaf);
            let hit = nearest(&grid, outline.point(base.point), base.depth);
            hit.map_or((NO_NODE, f32::MAX), |hit| {
                (hit.node(&tree.skeleton), hit.contact.gap())
            })
        })
        .collect();
    let mut far = 0;
    for (leaf, (node, gap)) in tree.leaves.iter_mut().zip(found) {
        leaf.node = node;
        far += usize::from(gap > 2.0 * leaf.area.max(0.0).sqrt() + 0.01);
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

/// The branch that a leaf's base most likely grows from: the one in which it sits as deep as
/// leaves of its class do (`depth` 0: on the centre line, 1: on the surface).
fn nearest(grid: &Grid, p: Vec3, depth: f32) -> Option<Hit> {
    let mut reach = 0.25 * grid.cell();
    loop {
        let mut best: Option<Hit> = None;
        let mut gap = f32::MAX;
        grid.each_near(p, reach, |segment| {
            let contact = segment.contact(p);
            gap = gap.min(contact.gap());
            let off = (contact.distance - depth * contact.radius).abs();
            let hit = Hit {
                cost: contact.gap() + 0.5 * off.min(contact.radius),
                chain: segment.chain,
                index: segment.index,
                contact,
            };
            let better = |b: &Hit| (hit.cost, hit.chain, hit.index) < (b.cost, b.chain, b.index);
            if best.as_ref().is_none_or(better) {
                best = Some(hit);
            }
        });
        if gap <= reach || reach > grid.whole(p) {
            return best;
        }
        reach *= 2.0;
    }
}

/// Where leaves of a class are attached.
#[derive(Clone, Copy, Debug, Default)]
struct Base {
    point: BasePoint,
    /// Distance from the branch's centre line over the branch's radius there, 0 to 1.
    depth: f32,
}

/// A point of a leaf that all its copies have: the middle of two corners, moved towards the
/// centre of the leaf (cards reach a little below the stalk that is painted on them).
#[derive(Clone, Copy, Debug, Default)]
struct BasePoint {
    corners: [usize; 2],
    inward: f32,
}

/// The corners of a leaf in the order of their places on the texture, which neither mirroring nor
/// another order of the file's vertices changes; where these are the same, in the file's order.
struct Outline {
    corners: Vec<Vec3>,
    center: Vec3,
}

/// Steps of the texture that a leaf covers within which two corners have one place.
const STEPS: f32 = 1024.0;

fn sort_by_texture(vertices: &mut [u32], uvs: &[Vec2]) {
    let uv = |v: &u32| uvs[*v as usize];
    let (low, high) = vertices
        .iter()
        .map(uv)
        .fold((Vec2::MAX, Vec2::MIN), |(a, b), p| (a.min(p), b.max(p)));
    let step = (high - low).max(Vec2::splat(1e-12)) / STEPS;
    vertices.sort_by_key(|v| {
        let at = ((uv(v) - low) / step).round();
        // From the lower edge of the texture, where stalks are painted: of equals the first is taken.
        (-at.y as i32, at.x as i32)
    });
}

impl Outline {
    fn of(tree: &Tree, leaf: &Leaf) -> Self {
        let mut vertices: Vec<u32> = (leaf.triangles.iter())
            .flat_map(|&t| tree.model.triangles[t as usize])
            .collect();
        vertices.sort_unstable();
        vertices.dedup();
        sort_by_texture(&mut vertices, &tree.model.uvs[0]);
        let stride = vertices.len().div_ceil(MOST_POINTS).max(1);
        Self {
            corners: (vertices.iter().step_by(stride))
                .map(|&v| tree.model.positions[v as usize])
                .collect(),
            center: leaf.center,
        }
    }

    fn point(&self, base: BasePoint) -> Vec3 {
        let last = self.corners.len() - 1;
        let [a, b] = base.corners.map(|c| self.corners[c.min(last)]);
        ((a + b) / 2.0).lerp(self.center, base.inward)
    }

    /// Corners, and the middles of any two where there are few.
    fn candidates(&self) -> Vec<BasePoint> {
        let count = self.corners.len();
        let mut out = Vec::new();
        for i in 0..count {
            let to = if count <= MOST_PAIRED { count } else { i + 1 };
            out.extend((i..to).map(|j| BasePoint {
                corners: [i, j],
                inward: 0.0,
            }));
        }
        out
    }
}

/// For each class the point of its leaves that lies nearest to wood, by median.
fn bases_of_classes(tree: &Tree, grid: &Grid) -> Vec<Base> {
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); tree.leaf_classes.len()];
    let mut seen = vec![0u32; tree.leaf_classes.len()];
    for (index, leaf) in tree.leaves.iter().enumerate() {
        let class = leaf.class as usize;
        // Evenly over the tree, not the first ones of the file.
        let stride = (tree.leaf_classes[class].count as usize)
            .div_ceil(SAMPLE)
            .max(1);
        if (seen[class] as usize).is_multiple_of(stride) {
            members[class].push(index as u32);
        }
        seen[class] += 1;
    }
    members
        .par_iter()
        .map(|list| {
            let outlines: Vec<Outline> = (list.iter())
                .map(|&leaf| Outline::of(tree, &tree.leaves[leaf as usize]))
                .collect();
            base_of_class(&outlines, grid)
        })
        .collect()
}

fn base_of_class(outlines: &[Outline], grid: &Grid) -> Base {
    let Some(first) = outlines.first() else {
        return Base::default();
    };
    let cost = |point: BasePoint| {
        let hits = outlines
            .iter()
            .filter_map(|o| nearest(grid, o.point(point), 0.0));
        median(hits.map(|h| h.cost).collect())
    };
    let best_of = |points: Vec<BasePoint>| {
        let costs = points.into_iter().map(|p| (cost(p), p));
        // The first of equally good ones: corners before middles.
        costs.fold((f32::MAX, BasePoint::default()), |best, next| {
            if next.0 < best.0 { next } else { best }
        })
    };
    let (_, corner) = best_of(first.candidates());
    let inward = (0..=16).map(|k| BasePoint {
        inward: k as f32 * 0.025,
        ..corner
    });
    let (_, point) = best_of(inward.collect());
    let hits = outlines
        .iter()
        .filter_map(|o| nearest(grid, o.point(point), 0.0));
    let depths = hits.map(|h| h.contact.distance / h.contact.radius.max(1e-9));
    Base {
        point,
        depth: median(depths.collect()).min(1.0),
    }
}

fn median(mut values: Vec<f32>) -> f32 {
    values.sort_unstable_by(f32::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
