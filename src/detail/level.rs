//! One level of detail: which cards and which tubes draw the tree for a budget of triangles.

use glam::Vec3;
use rayon::prelude::*;

use super::element::Element;
use super::merge::Hierarchy;
use super::opaque::Opaque;
use super::optimal_cut::{Choice, Drawn, Pruning};
use super::reassign::{Reassign, reassign};
use crate::botany::model::Model;
use crate::cloud::card::{Card, Outline};
use crate::export::foliage::CardGroup;
use crate::space::eigen::Moments;

/// What a level draws.
#[derive(Clone, Debug, Default)]
pub struct LevelPlan {
    /// Cards with the triangles projected on them.
    pub cards: Vec<CardGroup>,
    /// The elements of each card.
    pub members: Vec<Vec<u32>>,
    /// Cards that are drawn once for each side, in order.
    pub sided: Vec<u32>,
    /// Whether cards are seen from their front alone, as leaves whose material is not double-sided are.
    pub one_sided: bool,
    /// Wood elements drawn as geometry: element and index of its choice.
    pub tubes: Vec<(u32, u32)>,
    /// Error of the cut, area times length squared, normalised units.
    pub error: f64,
}

/// All that planning a level needs.
pub struct Planner<'a> {
    /// The polygons.
    pub model: &'a Model,
    /// Leaves and wood.
    pub elements: &'a [Element],
    /// How they group.
    pub hierarchy: &'a Hierarchy,
    /// Choices of wood elements.
    pub choices: &'a [Vec<Choice>],
    /// What of their triangles is opaque.
    pub opaque: &'a Opaque,
    /// Outlines of cards.
    pub outline: Outline,
    /// How leaves move after the cut.
    pub reassign: Reassign,
}

impl Planner<'_> {
    /// The best level of at most `budget` triangles; `None` where even the coarsest cut has more
    /// (each thick branch needs a tube of its own).
    pub fn plan(&self, budget: u64) -> Option<LevelPlan> {
        let pruning = Pruning {
            hierarchy: self.hierarchy,
            card_error: &self.hierarchy.error,
            card_triangles: match self.outline {
                Outline::Triangle => 1,
                Outline::Quad => 2,
                Outline::Corners(n) => u32::from(n).max(3) - 2,
            },
            choices: self.choices,
        };
        let cut = pruning.cut(budget);
        if cut.triangles > budget {
            return None;
        }
        let mut plan = LevelPlan {
            error: cut.error,
            ..LevelPlan::default()
        };
        for drawn in &cut.drawn {
            match *drawn {
                Drawn::Card(node) => plan.members.push(self.hierarchy.members(node)),
                Drawn::Own(element, choice) => plan.tubes.push((element, choice)),
            }
        }
        reassign(self.elements, &mut plan.members, self.reassign);
        plan.cards = plan.members.par_iter().map(|m| self.card(m)).collect();
        Some(plan)
    }

    /// The least-squares card of some elements.
    pub fn card(&self, members: &[u32]) -> CardGroup {
        let mut moments = Moments::default();
        for &e in members {
            moments = moments.merged(&self.elements[e as usize].moments);
        }
        let triangles: Vec<u32> = members
            .iter()
            .flat_map(|&e| self.elements[e as usize].triangles.iter().copied())
            .collect();
        let (u, v) = plane_axes(&moments);
        let points = self.points(members);
        let card = Card::around(moments.mean.as_vec3(), u, v, points, self.outline);
        CardGroup { card, triangles }
    }

    /// Points whose convex hull holds all that is opaque of some elements.
    pub(super) fn points(&self, members: &[u32]) -> impl Iterator<Item = Vec3> {
        let elements = members.iter().map(|&e| &self.elements[e as usize]);
        elements.flat_map(|e| {
            let (leaf, wood) = match e.chain {
                None => (&e.triangles[..], &[][..]),
                Some(_) => (&[][..], &e.triangles[..]),
            };
            let corners = wood.iter().flat_map(|&t| self.model.corners(t));
            let opaque = leaf
                .iter()
                .flat_map(|&t| self.opaque.outline(self.model, t));
            opaque.chain(corners)
        })
    }
}

/// Unit directions in the least-squares plane, turned so that the front looks out of the tree.
fn plane_axes(moments: &Moments) -> (Vec3, Vec3) {
    let Some(axes) = moments.axes() else {
        return (Vec3::X, Vec3::Y);
    };
    let (u, v) = (axes.axes[2].as_vec3(), axes.axes[1].as_vec3());
    let outwards = moments.mean.as_vec3() + Vec3::Y * 0.1;
    if u.cross(v).dot(outwards) < 0.0 {
        (v, u)
    } else {
        (u, v)
    }
}
