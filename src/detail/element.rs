//! Elements: the smallest pieces that a level represents as one.
//!
//! A leaf of two crossed quads is two elements, because each quad is flat and fits a plane of its
//! own; a curved leaf is one. A branch chain is one element. Elements know only what merging and
//! fitting need: their moments, weighted by surface area.

use glam::Vec3;
use rayon::prelude::*;

use super::opaque::Opaque;
use crate::botany::model::Model;
use crate::botany::tree::{Leaf, NO_NODE, Organ, Tree, TriangleList};
use crate::cloud::occlusion::Occlusion;
use crate::space::eigen::Moments;

/// Triangles of one leaf belong to one element while their normals differ by less than this
/// (cosine); crossed quads stand at 60 to 90 degrees.
const SAME_SHEET_COSINE: f32 = 0.6;

/// A flat piece of foliage, or a branch chain.
#[derive(Clone, Debug)]
pub struct Element {
    /// Triangles of the model.
    pub triangles: TriangleList,
    /// Moments of its surface, weighted by area (opaque share only) times visibility, normalised
    /// units.
    pub moments: Moments,
    /// Area-weighted centre.
    pub center: Vec3,
    /// Surface that it shows: one side, opaque share only, half the surface for wood; normalised
    /// units squared, visibility not counted.
    pub area: f32,
    /// Wood so thick that it vanishes visibly where a card stands edge-on: never on a card.
    pub solid: bool,
    /// The skeleton chain, where the element is wood.
    pub chain: Option<u32>,
    /// The sub-tree that it belongs to (index into [`Tree::subtrees`]).
    pub subtree: u32,
}

/// Mean radius over the tree's height from which a branch is solid: two pixels and a quarter wide where
/// the tree is 256 pixels high. With two a grown oak's 1 % level has four more round branches and .002
/// less of F1.
const SOLID_SHARE: f32 = 0.0044;

/// The mean radius over a branch's bark that makes it solid, over the mean along its length that does.
const BARK_MEAN: f32 = 1.5;

/// Weight of what is fully hidden; what is fully visible weighs 1. Not zero, because the metaball
/// field knows no direction: what it calls hidden is seen from some.
const HIDDEN_WEIGHT: f64 = 0.3;

/// Kratt's view-independent visibility: metaball occlusion from the leaves (section 3.4).
struct Visible(Option<Occlusion>);

impl Visible {
    fn of(tree: &Tree) -> Self {
        let centers: Vec<Vec3> = tree.leaves.iter().map(|l| l.center).collect();
        Self((!centers.is_empty()).then(|| Occlusion::of_leaves(&centers, tree.model.height())))
    }

    fn weight(&self, at: Vec3) -> f64 {
        let sigma = self.0.as_ref().map_or(1.0, |o| o.sigma(at));
        HIDDEN_WEIGHT + (1.0 - HIDDEN_WEIGHT) * sigma
    }
}

impl Element {
    fn scale(&mut self, factor: f64) {
        self.moments.weight *= factor;
        self.moments.scatter *= factor;
    }
}

/// Mean radius along a chain, normalised units: however many nodes a mesh gives its thin end.
pub fn mean_radius(tree: &Tree, chain: u32) -> f32 {
    let [length, area, _] = radius_integrals(tree, chain);
    match length > 0.0 {
        true => area / length,
        false => {
            let node = tree.skeleton.chains[chain as usize].nodes.first();
            node.map_or(0.0, |&n| tree.skeleton.nodes[n as usize].radius)
        }
    }
}

/// Integrals along a chain of one, of its radius, and of its radius squared.
fn radius_integrals(tree: &Tree, chain: u32) -> [f32; 3] {
    let at = |node: u32| &tree.skeleton.nodes[node as usize];
    let nodes = &tree.skeleton.chains[chain as usize].nodes;
    nodes
        .windows(2)
        .fold([0.0; 3], |[one, first, second], pair| {
            let [a, b] = [at(pair[0]), at(pair[1])];
            let (step, r, s) = (a.position.distance(b.position), a.radius, b.radius);
            let means = [1.0, (r + s) / 2.0, (r * r + r * s + s * s) / 3.0];
            [
                one + step * means[0],
                first + step * means[1],
                second + step * means[2],
            ]
        })
}

/// Whether a chain is thicker than `radius` (normalised units) on average: along its length, or over its bark, where a
/// trunk that runs on as the midrib of a frond has all its weight below. Of a cone the second mean is 4/3 of the first.
pub fn is_thick(tree: &Tree, chain: u32, radius: f32) -> bool {
    let [_, area, square] = radius_integrals(tree, chain);
    mean_radius(tree, chain) > radius || square > BARK_MEAN * radius * area
}

/// Splits a tree into elements: foliage first, in the order of the leaves, then wood by chain. `opacity` is that of
/// the tree.
pub fn elements(tree: &Tree, opacity: &Opaque) -> Vec<Element> {
    let visible = Visible::of(tree);
    let solid_radius = SOLID_SHARE * tree.model.height();
    let subtree_of_chain = subtree_of_chain(tree);
    let of_leaf = |leaf: &Leaf| {
        let subtree = match leaf.node {
            NO_NODE => 0,
            node => subtree_of_chain[tree.skeleton.nodes[node as usize].chain as usize],
        };
        let weight = |mut sheet: Element| {
            sheet.scale(visible.weight(sheet.center));
            sheet
        };
        let sheets = sheets(&tree.model, &leaf.triangles).into_iter();
        let elements = sheets.map(|sheet| element(&tree.model, sheet, opacity, None, subtree));
        elements.map(weight).collect::<Vec<_>>()
    };
    let mut out: Vec<Element> = tree.leaves.par_iter().flat_map_iter(of_leaf).collect();
    for (chain, triangles) in wood_by_chain(tree).into_iter().enumerate() {
        if !triangles.is_empty() {
            let subtree = subtree_of_chain[chain];
            let chain_of_wood = Some(chain as u32);
            let mut wood = element(&tree.model, triangles, opacity, chain_of_wood, subtree);
            wood.scale(visible.weight(wood.center));
            wood.solid = is_thick(tree, chain as u32, solid_radius);
            out.push(wood);
        }
    }
    out.shrink_to_fit();
    out
}

pub(super) fn subtree_of_chain(tree: &Tree) -> Vec<u32> {
    let mut out = vec![0; tree.skeleton.chains.len()];
    for (index, subtree) in tree.subtrees.iter().enumerate() {
        if let Some(chain) = subtree.chain {
            out[chain as usize] = index as u32;
        }
    }
    out
}

/// Wood triangles of each chain, in order.
pub fn wood_by_chain(tree: &Tree) -> Vec<Vec<u32>> {
    let mut out = vec![Vec::new(); tree.skeleton.chains.len()];
    for (triangle, &node) in tree.wood_node.iter().enumerate() {
        if node != NO_NODE && tree.organ[triangle] == Organ::Wood {
            out[tree.skeleton.nodes[node as usize].chain as usize].push(triangle as u32);
        }
    }
    out
}

fn element(
    model: &Model,
    triangles: Vec<u32>,
    opacity: &Opaque,
    chain: Option<u32>,
    subtree: u32,
) -> Element {
    let mut moments = Moments::default();
    for &t in &triangles {
        let corners = model.corners(t);
        let area = triangle_area(corners) * f64::from(opacity.share(t));
        moments.add_triangle(corners, area);
    }
    let center = moments.mean.as_vec3();
    // A tube of surface S covers S/4 in the mean over all directions, as a leaf of one-sided area
    // S/2 does (Cauchy): wood and leaves then weigh alike.
    if chain.is_some() {
        moments.weight *= 0.5;
        moments.scatter *= 0.5;
    }
    Element {
        area: moments.weight as f32,
        solid: false,
        triangles: TriangleList::from_slice(&triangles),
        moments,
        center,
        chain,
        subtree,
    }
}

/// Area of a triangle, normalised units squared.
pub fn triangle_area(corners: [Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    (b - a).cross(c - a).length() / 2.0
}

/// Groups a leaf's triangles into sheets: joined at a vertex position, facing the same way.
fn sheets(model: &Model, triangles: &[u32]) -> Vec<Vec<u32>> {
    if triangles.len() == 1 {
        return vec![triangles.to_vec()];
    }
    let normal = |t: u32| {
        let [a, b, c] = model.corners(t);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let normals: Vec<Vec3> = triangles.iter().map(|&t| normal(t)).collect();
    let mut owner: Vec<usize> = (0..triangles.len()).collect();
    let root = |owner: &[usize], mut i: usize| {
        while owner[i] != i {
            i = owner[i];
        }
        i
    };
    let touches = |a: u32, b: u32| {
        let (a, b) = (model.corners(a), model.corners(b));
        let shared = a.iter().filter(|p| b.contains(p)).count();
        shared >= 2
    };
    // A leaf of more than 64 triangles is one sheet: it is a modelled blade, not crossed cards.
    if triangles.len() > 64 {
        return vec![triangles.to_vec()];
    }
    for i in 0..triangles.len() {
        for j in 0..i {
            if normals[i].dot(normals[j]).abs() > SAME_SHEET_COSINE
                && touches(triangles[i], triangles[j])
            {
                let (a, b) = (root(&owner, i), root(&owner, j));
                owner[a.max(b)] = a.min(b);
            }
        }
    }
    let mut sheets: Vec<(usize, Vec<u32>)> = Vec::new();
    for (i, &t) in triangles.iter().enumerate() {
        let r = root(&owner, i);
        match sheets.iter_mut().find(|(key, _)| *key == r) {
            Some((_, sheet)) => sheet.push(t),
            None => sheets.push((r, vec![t])),
        }
    }
    sheets.into_iter().map(|(_, sheet)| sheet).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::botany::grow::{Options, Species, grow};
    use crate::botany::load::load_slice;
    use crate::botany::recognise::{RecogniseOptions, recognise};
    use crate::botany::tree::Node;

    #[test]
    fn nodes_that_crowd_at_a_thin_tip_make_no_trunk_thinner() {
        let options = Options {
            leaves: Some(60),
            ..Options::default()
        };
        let grown = grow(&Species::named("oak").unwrap(), &options).unwrap();
        let model = load_slice(&grown.glb, "oak.glb".as_ref(), &Default::default()).unwrap();
        let mut tree = recognise(model, &RecogniseOptions::default()).unwrap();
        let before = mean_radius(&tree, 0);
        let nodes = tree.skeleton.chains[0].nodes.clone();
        let [.., last, tip] = nodes[..] else {
            panic!("a trunk of several nodes");
        };
        let ends = [last, tip].map(|n| tree.skeleton.nodes[n as usize]);
        let thick = tree.skeleton.nodes[nodes[0] as usize].radius;
        assert!(ends[1].radius < before / 2.0 && before < thick);
        // A hundred nodes more between the last two, as a mesh that was quantised has.
        let first = tree.skeleton.nodes.len() as u32;
        let between = (1..=100).map(|i| {
            let part = i as f32 / 101.0;
            Node {
                position: ends[0].position.lerp(ends[1].position, part),
                radius: ends[0].radius + (ends[1].radius - ends[0].radius) * part,
                ..ends[1]
            }
        });
        tree.skeleton.nodes.extend(between);
        let chain = &mut tree.skeleton.chains[0].nodes;
        chain.truncate(nodes.len() - 1);
        chain.extend((first..first + 100).chain([tip]));
        let after = mean_radius(&tree, 0);
        assert!((after - before).abs() < 1e-4 * before, "{before} {after}");
        assert!(is_thick(&tree, 0, after * 0.99) && !is_thick(&tree, 0, after * 1.2));
        // A midrib as long as the trunk that goes on from its tip halves the mean; it is no less of a trunk.
        let above = Node {
            position: ends[1].position + Vec3::Y * tree.model.height(),
            radius: 1e-5,
            ..ends[1]
        };
        tree.skeleton.chains[0].nodes.push(first + 100);
        tree.skeleton.nodes.push(above);
        let long = mean_radius(&tree, 0);
        assert!(
            long < after * 0.6 && is_thick(&tree, 0, after * 0.8),
            "{long} {after}"
        );
        // Nodes in one place have a radius, too.
        tree.skeleton.chains[0].nodes = vec![nodes[0]];
        assert_eq!(mean_radius(&tree, 0), thick);
    }
}
