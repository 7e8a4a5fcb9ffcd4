//! A tree as a hierarchy that can be drawn: billboards for every node, geometry for the tips.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::botany::model::Model;
use crate::botany::tree::Tree;
use crate::cloud::card::{Card, Outline};
use crate::cloud::foliage::{Face, Foliage};
use crate::cloud::plane::{plane, planes};
use crate::detail::optimal_distance::{aspects, own_triangles};
use crate::error::{Error, Result};
use crate::export::chart::Chart;
use crate::export::project::project;
use crate::report::Drawable;
use crate::runtime::{Cells, Hierarchy, OwnLeaves, Subtree};
use crate::solid;
use crate::space::raster::{Material, Texture};

/// Samples along a texel's edge.
const SAMPLES: u32 = 3;

/// A billboard of a node.
#[derive(Clone, Debug)]
pub struct Billboard {
    /// Corners, normalised units.
    pub corners: [Vec3; 4],
    /// Their texture coordinates.
    pub uvs: [Vec2; 4],
    /// What it looks like: alpha alone.
    pub texture: Texture,
    /// Texels of its texture.
    pub texels: u64,
}

/// What stands for a node of the hierarchy.
#[derive(Clone, Debug, Default)]
pub struct Looks {
    /// Its billboards.
    pub billboards: Vec<Billboard>,
    /// All triangles under it.
    pub triangles: Vec<u32>,
}

/// A tree whose every node can be drawn.
pub struct Species {
    /// The tree.
    pub tree: Tree,
    /// Its nodes, in normalised units.
    pub hierarchy: Hierarchy,
    /// What stands for each node.
    pub looks: Vec<Looks>,
    /// Materials of the model, without colours.
    pub materials: Vec<Material>,
    /// Their textures.
    pub textures: Vec<Texture>,
    /// For each triangle its material.
    pub triangle_material: Vec<u32>,
}

impl Species {
    /// Makes billboards of `texels` texels along their longer side for every node, and lets each switch at its
    /// optimal distance for a camera of so many pixels of focal length.
    ///
    /// # Errors
    /// [`Error::Internal`] where the hierarchy has a flaw.
    pub fn new(tree: Tree, focal_px: f64, texels: u32) -> Result<Self> {
        let hierarchy = hierarchy(&tree, focal_px, texels)?;
        let triangles = triangles(&tree, &hierarchy);
        let looks = triangles
            .into_par_iter()
            .enumerate()
            .map(|(node, triangles)| Looks {
                billboards: billboards(&tree.model, &triangles, node == 0, texels),
                triangles,
            })
            .collect();
        let drawable = Drawable::silhouette(&tree.model);
        let scene = drawable.scene();
        Ok(Self {
            materials: scene.materials.to_vec(),
            textures: scene.textures.to_vec(),
            triangle_material: scene.geometry.triangle_material.to_vec(),
            hierarchy,
            looks,
            tree,
        })
    }

    /// Solidity of the tree in a grid with `longest` cells along its longest side.
    pub fn cells(&self, longest: u32, rays: Option<u32>) -> Cells {
        solid::cells(&self.tree.model, longest, rays)
    }
}

fn hierarchy(tree: &Tree, focal_px: f64, texels: u32) -> Result<Hierarchy> {
    let scale = crate::detail::optimal_distance::TEXELS as f32 / texels.max(1) as f32;
    let list: Vec<Subtree> = tree
        .subtrees
        .iter()
        .zip(aspects(tree, focal_px))
        .map(|(s, aspect)| Subtree {
            parent: s.parent,
            center: s.sphere.0,
            radius: s.sphere.1,
            leaves: s.leaf_count,
            switch_distance: aspect.optimal_distance * scale,
            branch: aspect.branch,
            density: aspect.density,
            own: aspect.own.map(|own| OwnLeaves {
                center: own.sphere.0,
                radius: own.sphere.1,
                switch_distance: own.optimal_distance * scale,
            }),
        })
        .collect();
    Hierarchy::new(&list).map_err(|flaw| Error::Internal {
        step: "order sub-trees",
        what: flaw.to_string(),
    })
}

/// All triangles under each node.
fn triangles(tree: &Tree, hierarchy: &Hierarchy) -> Vec<Vec<u32>> {
    let own = own_triangles(tree);
    let mut out: Vec<Vec<u32>> = vec![Vec::new(); hierarchy.nodes().len()];
    for node in (0..out.len()).rev() {
        let origin = hierarchy.origins()[node];
        if hierarchy.is_tip(node as u32) {
            out[node] = own[origin.subtree as usize].clone();
        }
        if node > 0 {
            let up = out[node].clone();
            out[origin.parent as usize].extend(up);
        }
    }
    out
}

/// Planes through what grows under a node: four for the whole tree, else one where it is flat, two where not.
fn billboards(model: &Model, triangles: &[u32], whole: bool, texels: u32) -> Vec<Billboard> {
    let (mut faces, mut ids) = (Vec::new(), Vec::new());
    for &t in triangles {
        if let Some(face) = Face::new(model.corners(t)) {
            faces.push(face);
            ids.push(t);
        }
    }
    let foliage = Foliage {
        faces: &faces,
        connector: Vec3::ZERO,
    };
    let Some(axes) = foliage.moments().axes() else {
        return Vec::new();
    };
    let flat = axes.variances[0] < 0.02 * axes.variances[2];
    let cards = match (whole, flat) {
        (true, _) => planes(&foliage, 4, Outline::Quad),
        (_, true) => plane(&foliage, Outline::Quad),
        (_, false) => planes(&foliage, 2, Outline::Quad),
    }
    .unwrap_or_default();
    let mut shown: Vec<Vec<u32>> = vec![Vec::new(); cards.len()];
    for (face, &t) in faces.iter().zip(&ids) {
        let distance = |card: &Card| {
            face.corners
                .iter()
                .map(|&p| card.height(p).powi(2))
                .sum::<f32>()
        };
        let nearest =
            (0..cards.len()).min_by(|&a, &b| distance(&cards[a]).total_cmp(&distance(&cards[b])));
        if let Some(nearest) = nearest {
            shown[nearest].push(t);
        }
    }
    let made = cards
        .iter()
        .zip(&shown)
        .filter(|(_, shown)| !shown.is_empty());
    made.map(|(card, shown)| billboard(model, card, shown, texels))
        .collect()
}

fn billboard(model: &Model, card: &Card, shown: &[u32], texels: u32) -> Billboard {
    let corners: Vec<Vec3> = card.corners().collect();
    let edges = [
        corners[0].distance(corners[1]),
        corners[1].distance(corners[2]),
    ];
    let density = texels as f32 / edges[0].max(edges[1]).max(1e-9);
    let chart = Chart::new(card, density, 1.0);
    let projected = project(model, shown.iter().copied(), &chart, SAMPLES);
    let size = Vec2::new(chart.size[0] as f32, chart.size[1] as f32);
    let [a, b, c, d] = [0, 1, 2, 3].map(|i| corners[i]);
    Billboard {
        corners: [a, b, c, d],
        uvs: [a, b, c, d].map(|p| chart.texel(p) / size),
        texture: Texture::from_alpha(chart.size[0], chart.size[1], alpha(&projected.texels)),
        texels: u64::from(chart.size[0]) * u64::from(chart.size[1]),
    }
}

/// As many opaque texels as the coverage sums up to, the most covered ones.
fn alpha(texels: &[crate::export::project::Texel]) -> Vec<u8> {
    let sum: f64 = texels.iter().map(|t| f64::from(t.coverage)).sum();
    let mut order: Vec<usize> = (0..texels.len())
        .filter(|&i| texels[i].coverage > 0.0)
        .collect();
    order.sort_by(|&a, &b| {
        texels[b]
            .coverage
            .total_cmp(&texels[a].coverage)
            .then(a.cmp(&b))
    });
    let mut out = vec![0; texels.len()];
    for &i in order.iter().take(sum.round().max(1.0) as usize) {
        out[i] = 255;
    }
    out
}
