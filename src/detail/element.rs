//! Elements: the smallest pieces that a level represents as one.
//!
//! A leaf of two crossed quads is two elements, because each quad is flat and fits a plane of its
//! own; a curved leaf is one. A branch chain is one element. Elements know only what merging and
//! fitting need: their moments, weighted by surface area.

use glam::Vec3;

use crate::botany::model::{AlphaMode, Model};
use crate::botany::tree::{NO_NODE, Organ, Tree};
use crate::space::eigen::Moments;

/// Triangles of one leaf belong to one element while their normals differ by less than this
/// (cosine); crossed quads stand at 60 to 90 degrees.
const SAME_SHEET_COSINE: f32 = 0.6;

/// A flat piece of foliage, or a branch chain.
#[derive(Clone, Debug)]
pub struct Element {
    /// Triangles of the model.
    pub triangles: Vec<u32>,
    /// Moments of its surface, weighted by area (opaque share included), normalised units.
    pub moments: Moments,
    /// Area-weighted centre.
    pub center: Vec3,
    /// Surface area, one side, opaque share only, normalised units squared.
    pub area: f32,
    /// The skeleton chain, where the element is wood.
    pub chain: Option<u32>,
    /// The sub-tree that it belongs to (index into [`Tree::subtrees`]).
    pub subtree: u32,
}

/// Splits a tree into elements: foliage first, in the order of the leaves, then wood by chain.
pub fn elements(tree: &Tree) -> Vec<Element> {
    let opacity = opaque_share(tree);
    let subtree_of_chain = subtree_of_chain(tree);
    let mut out = Vec::with_capacity(tree.leaves.len() * 2);
    for leaf in &tree.leaves {
        let subtree = match leaf.node {
            NO_NODE => 0,
            node => subtree_of_chain[tree.skeleton.nodes[node as usize].chain as usize],
        };
        for sheet in sheets(&tree.model, &leaf.triangles) {
            out.push(element(&tree.model, sheet, &opacity, None, subtree));
        }
    }
    for (chain, triangles) in wood_by_chain(tree).into_iter().enumerate() {
        if !triangles.is_empty() {
            let subtree = subtree_of_chain[chain];
            let chain = Some(chain as u32);
            let mut wood = element(&tree.model, triangles, &opacity, chain, subtree);
            // A tube of surface S covers S/4 in the mean over all directions, as a leaf of
            // one-sided area S/2 does (Cauchy): wood and leaves then weigh alike.
            wood.moments.weight *= 0.5;
            wood.moments.scatter *= 0.5;
            wood.area *= 0.5;
            out.push(wood);
        }
    }
    out
}

fn subtree_of_chain(tree: &Tree) -> Vec<u32> {
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
    opacity: &[f32],
    chain: Option<u32>,
    subtree: u32,
) -> Element {
    let mut moments = Moments::default();
    for &t in &triangles {
        let corners = model.corners(t);
        let area = triangle_area(corners) * f64::from(opacity[t as usize]);
        moments.add_triangle(corners, area);
    }
    let center = moments.mean.as_vec3();
    Element {
        area: moments.weight as f32,
        triangles,
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

/// For each triangle the share of its surface that is opaque, from 28 points of its texture.
fn opaque_share(tree: &Tree) -> Vec<f32> {
    use rayon::prelude::*;
    let model = &tree.model;
    (0..model.triangles.len() as u32)
        .into_par_iter()
        .map(|t| {
            let material = model.material_of(t);
            let Some(texture) = material.base_color else {
                return 1.0;
            };
            if material.alpha_mode == AlphaMode::Opaque {
                return 1.0;
            }
            let image = &model.images[texture.image as usize];
            let uvs = &model.uvs[texture.uv_set as usize];
            let corner = model.triangles[t as usize].map(|i| uvs[i as usize]);
            let cutoff = crate::space::texture::cutoff(material);
            let (mut opaque, mut all) = (0, 0);
            const STEPS: usize = 7;
            for i in 0..STEPS {
                for j in 0..STEPS - i {
                    let (s, t) = (
                        (i as f32 + 0.33) / STEPS as f32,
                        (j as f32 + 0.33) / STEPS as f32,
                    );
                    let uv = corner[0] + (corner[1] - corner[0]) * s + (corner[2] - corner[0]) * t;
                    let texel = crate::space::texture::nearest(image, texture.wrap, uv);
                    opaque += u32::from(f32::from(texel[3]) / 255.0 >= cutoff);
                    all += 1;
                }
            }
            // Never zero: a leaf whose sample points all miss still has its place.
            (opaque as f32 / all as f32).max(0.02)
        })
        .collect()
}
