//! What the manifest says of a tree and its levels.

use glam::Vec3;
use rayon::prelude::*;

use crate::botany::model::Frame;
use crate::botany::tree::{self, NO_NODE, Organ, Tree};
use crate::cloud::coverage::{coverage, epsilon};
use crate::cloud::foliage::{Face, Foliage};
use crate::cloud::occlusion::Occlusion;
use crate::detail::element::Element;
use crate::detail::likeness::representatives;
use crate::detail::optimal_distance::{Aspect, Own, aspects};
use crate::export::chart::Chart;
use crate::export::foliage::CardGroup;
use crate::export::manifest::{self, Card, Level, Original, Range, Subtree};
use crate::export::share::owners;
use crate::level;
use crate::scene::Scene;

/// `epsilon` of a card's coverage, in pixels at the distance where its level starts.
const TOLERANCE_PX: f64 = 4.0;

/// A tree, and what describing many cards of it needs.
pub struct Describer<'a> {
    tree: &'a Tree,
    elements: &'a [Element],
    scene: &'a Scene,
    /// `sigma` at the centre of each element.
    sigma: Vec<f64>,
    /// Depth of each sub-tree under the whole tree.
    depth: Vec<u32>,
}

impl<'a> Describer<'a> {
    /// Looks up the visibility of every element once.
    pub fn new(tree: &'a Tree, elements: &'a [Element], scene: &'a Scene) -> Self {
        let centers: Vec<Vec3> = tree.leaves.iter().map(|l| l.center).collect();
        let occlusion = Occlusion::of_leaves(&centers, tree.model.height());
        let mut depth = vec![0; tree.subtrees.len()];
        for (i, subtree) in tree.subtrees.iter().enumerate() {
            depth[i] = subtree.parent.map_or(0, |p| depth[p as usize] + 1);
        }
        Self {
            tree,
            elements,
            scene,
            sigma: elements
                .par_iter()
                .map(|e| occlusion.sigma(e.center))
                .collect(),
            depth,
        }
    }

    /// The original.
    pub fn original(&self) -> Original {
        let model = &self.tree.model;
        let warnings = model.warnings.iter().chain(&self.tree.warnings);
        Original {
            name: model.name.clone(),
            triangles: model.triangles.len() as u64,
            leaves: self.tree.leaves.len() as u64,
            height_m: f64::from(model.height()) * model.frame.radius,
            center: model.frame.center.to_array(),
            radius_m: model.frame.radius,
            warnings: warnings.cloned().collect(),
        }
    }

    /// The hierarchy.
    pub fn subtrees(&self) -> Vec<Subtree> {
        let frame = &self.tree.model.frame;
        let metres = |length: f32| (f64::from(length) * frame.radius) as f32;
        let own = |own: Own| manifest::Own {
            center: world(frame, own.sphere.0),
            radius_m: metres(own.sphere.1),
            optimal_distance_m: metres(own.optimal_distance),
            geometric_distance_m: metres(own.geometric_distance),
        };
        let describe = |((s, aspect), representative): ((&tree::Subtree, Aspect), u32)| Subtree {
            parent: s.parent,
            children: s.children.clone(),
            order: s.order,
            connector: world(frame, s.connector),
            center: world(frame, s.sphere.0),
            radius_m: metres(s.sphere.1),
            leaves: s.leaf_count,
            optimal_distance_m: metres(aspect.optimal_distance),
            geometric_distance_m: metres(aspect.geometric_distance),
            branch: aspect.branch.to_array(),
            density: aspect.density,
            representative,
            own: aspect.own.map(own),
        };
        let aspects = aspects(self.tree, self.scene.focal_px());
        self.tree
            .subtrees
            .iter()
            .zip(aspects)
            .zip(representatives(self.tree))
            .map(describe)
            .collect()
    }

    /// Root of the mean squared error of a level, metres.
    pub fn error_m(&self, made: &level::Level) -> f64 {
        let area: f64 = self.elements.iter().map(|e| f64::from(e.area)).sum();
        (made.plan.error / area.max(1e-30)).sqrt() * self.tree.model.frame.radius
    }

    /// One level beside level 0.
    pub fn level(&self, number: usize, file: &str, made: &level::Level, range: Range) -> Level {
        let error_m = self.error_m(made);
        let height_m = f64::from(self.tree.model.height()) * self.tree.model.frame.radius;
        let foliage = made.charts.iter().map(|c| c.corners.len() as u64 - 2).sum();
        let groups = made.plan.cards.iter().zip(&made.plan.members);
        Level {
            level: number as u32,
            file: file.into(),
            triangles: made.scene.triangles(),
            range,
            error_m,
            error_px: error_m / height_m * range.height_px,
            atlas: made.atlas,
            wood_triangles: made.scene.triangles().saturating_sub(foliage),
            cards: groups
                .zip(&made.charts)
                .zip(owners(&made.charts, made.atlas))
                .enumerate()
                .collect::<Vec<_>>()
                .into_par_iter()
                .map(|(index, (((group, members), chart), copy_of))| Card {
                    copy_of,
                    back: made.back_of(index as u32).map(Chart::rectangle_in_atlas),
                    ..self.card(group, members, chart, &range)
                })
                .collect(),
        }
    }

    fn card(&self, group: &CardGroup, members: &[u32], chart: &Chart, range: &Range) -> Card {
        let frame = &self.tree.model.frame;
        let faces: Vec<Face> = group
            .triangles
            .iter()
            .filter(|&&t| self.tree.organ[t as usize] == Organ::Foliage)
            .filter_map(|&t| Face::new(self.tree.model.corners(t)))
            .collect();
        let foliage = Foliage {
            faces: &faces,
            connector: Vec3::ZERO,
        };
        let fov = self.scene.fov_deg.to_radians();
        let lines = self.scene.screen_height_px;
        let epsilon = epsilon(range.distance_m, fov, lines, TOLERANCE_PX) / frame.radius;
        let shown = coverage(&foliage, std::slice::from_ref(&group.card), epsilon);
        let weight: f64 = members
            .iter()
            .map(|&e| f64::from(self.elements[e as usize].area))
            .sum();
        let hidden: f64 = members
            .iter()
            .map(|&e| self.sigma[e as usize] * f64::from(self.elements[e as usize].area))
            .sum();
        let sigma = if weight > 0.0 { hidden / weight } else { 1.0 };
        let square = frame.radius * frame.radius;
        let texels = chart.to_x.length().max(chart.to_y.length()) / frame.radius as f32;
        Card {
            subtree: self.common_subtree(members),
            corners: chart.corners.iter().map(|&p| world(frame, p)).collect(),
            copy_of: None,
            copy_in: None,
            atlas: chart.rectangle_in_atlas(),
            back: None,
            shows: group.triangles.len() as u32,
            error_m: shown.rms_distance() * frame.radius,
            area_m2: shown.total * square,
            coverage_m2: shown.covered() * square,
            sigma,
            quality: shown.quality(sigma) * square,
            optimal_distance_m: self.scene.focal_px() / f64::from(texels.max(1e-30)),
        }
    }

    /// The deepest sub-tree that holds all elements.
    fn common_subtree(&self, members: &[u32]) -> u32 {
        let mut all = members.iter().map(|&e| self.elements[e as usize].subtree);
        let Some(first) = all.next() else { return 0 };
        all.fold(first, |a, b| self.join(a, b))
    }

    fn join(&self, mut a: u32, mut b: u32) -> u32 {
        let up = |s: u32| self.tree.subtrees[s as usize].parent.unwrap_or(0);
        while a != b {
            if self.depth[a as usize] >= self.depth[b as usize] {
                a = up(a);
            } else {
                b = up(b);
            }
            if a == 0 || b == 0 {
                return 0;
            }
        }
        a
    }
}

fn world(frame: &Frame, p: Vec3) -> [f32; 3] {
    (frame.center + p.as_dvec3() * frame.radius)
        .as_vec3()
        .to_array()
}

/// Triangles of the trunks: wood on chains of order 0.
pub fn trunk(tree: &Tree) -> Vec<u32> {
    let order = |node: u32| {
        let chain = tree.skeleton.nodes[node as usize].chain;
        tree.skeleton.chains[chain as usize].order
    };
    (0..tree.model.triangles.len() as u32)
        .filter(|&t| matches!(tree.wood_node[t as usize], n if n != NO_NODE && order(n) == 0))
        .collect()
}
