//! The last level: the whole tree on a handful of upright cards and a few level ones.
//!
//! Freely fitted planes have the best mean error and tear the trunk to dashes, so the planes of
//! this level are upright: their normals are horizontal, fitted to the leaves by k-planes rounds
//! as in [`super::reassign`]. Seen from above upright cards vanish; level cards at the heights
//! where the foliage is hold the view from the top. Every leaf is on its nearest upright and on
//! its nearest level card; thick wood is on two upright cards that cross at the trunk, thin wood
//! on its nearest.

use glam::{DVec3, Vec3};

use super::element::Element;
use super::level::LevelPlan;
use crate::botany::model::Model;
use crate::cloud::card::{Card, Outline};
use crate::export::foliage::CardGroup;
use crate::space::eigen::Moments;

/// Rounds of assignment and refit.
const ROUNDS: u32 = 20;
/// Share of the cards that lie level.
const LEVEL_SHARE: f64 = 0.25;
/// A chain whose mean radius is above this share of the thickest one's is a trunk.
const TRUNK_SHARE: f32 = 0.6;

/// A plane with a fixed kind of normal.
#[derive(Clone, Copy, Debug)]
struct Plane {
    center: DVec3,
    normal: DVec3,
}

impl Plane {
    /// Mean squared distance of a surface from the plane, and a little of the way along it.
    fn cost(&self, moments: &Moments, locality: f64) -> f64 {
        let offset = moments.mean - self.center;
        let height = offset.dot(self.normal);
        let spread = self.normal.dot(moments.scatter * self.normal) / moments.weight.max(1e-300);
        spread + height * height + locality * (offset.length_squared() - height * height)
    }
}

/// Plans the level with at most `budget` triangles (two a card, at least three cards).
/// `radius` gives the mean radius of a wood element, normalised units.
pub fn whole_tree(model: &Model, elements: &[Element], radius: &[f32], budget: u64) -> LevelPlan {
    let cards = (budget / 2).clamp(3, 64) as usize;
    let level = ((cards as f64 * LEVEL_SHARE).round() as usize).max(1);
    let thickest = radius.iter().fold(0.0f32, |m, &r| m.max(r));
    let thick = |e: usize| {
        elements[e].chain.is_some() && elements[e].solid && radius[e] >= TRUNK_SHARE * thickest
    };
    let trunk: Moments = (0..elements.len())
        .filter(|&e| thick(e))
        .fold(Moments::default(), |m, e| m.merged(&elements[e].moments));
    let through = (trunk.weight > 0.0 && cards - level >= 3).then_some(trunk.mean);
    let upright = upright_planes(elements, cards - level, through);
    let all: Vec<&Element> = elements.iter().collect();
    let level = level_planes(&all, level);
    let mut members = vec![Vec::new(); upright.len() + level.len()];
    for (e, element) in elements.iter().enumerate() {
        let nearest = nearest(&upright, element);
        if thick(e) && through.is_some() {
            // The first two planes cross at the trunk.
            members[0].push(e as u32);
            members[1].push(e as u32);
        } else {
            members[nearest].push(e as u32);
        }
        members[upright.len() + self::nearest(&level, element)].push(e as u32);
    }
    let mut plan = LevelPlan::default();
    for (plane, members) in upright.iter().chain(&level).zip(members) {
        if members.is_empty() {
            continue;
        }
        plan.error += members
            .iter()
            .map(|&e| {
                elements[e as usize].moments.weight * plane.cost(&elements[e as usize].moments, 0.0)
            })
            .sum::<f64>();
        plan.cards.push(group(model, elements, plane, &members));
        plan.members.push(members);
    }
    plan
}

/// What trees are made of where nothing better is at hand: `count` upright rectangles that cross on
/// the tree's axis at equal angles, each with the whole tree on it. A baseline.
pub fn crossed_quads(model: &Model, elements: &[Element], count: usize) -> LevelPlan {
    let all = elements
        .iter()
        .fold(Moments::default(), |m, e| m.merged(&e.moments));
    let members: Vec<u32> = (0..elements.len() as u32).collect();
    let mut plan = LevelPlan::default();
    for i in 0..count.max(1) {
        let angle = std::f64::consts::PI * i as f64 / count.max(1) as f64;
        let plane = Plane {
            center: all.mean,
            normal: DVec3::new(angle.sin(), 0.0, angle.cos()),
        };
        plan.error += elements
            .iter()
            .map(|e| e.moments.weight * plane.cost(&e.moments, 0.0))
            .sum::<f64>()
            / count.max(1) as f64;
        plan.cards.push(group(model, elements, &plane, &members));
        plan.members.push(members.clone());
    }
    plan
}

/// Level cards that show all `members`, each on its nearest: for trees whose best planes are
/// upright, so that they would vanish from above.
pub fn level_cards(
    model: &Model,
    elements: &[Element],
    members: &[u32],
    count: usize,
) -> LevelPlan {
    let shown: Vec<&Element> = members.iter().map(|&e| &elements[e as usize]).collect();
    let planes = level_planes(&shown, count);
    let mut groups = vec![Vec::new(); planes.len()];
    for (&member, element) in members.iter().zip(shown) {
        groups[nearest(&planes, element)].push(member);
    }
    let mut plan = LevelPlan::default();
    for (plane, members) in planes.iter().zip(groups) {
        if !members.is_empty() {
            plan.cards.push(group(model, elements, plane, &members));
            plan.members.push(members);
        }
    }
    plan
}

fn group(model: &Model, elements: &[Element], plane: &Plane, members: &[u32]) -> CardGroup {
    let triangles: Vec<u32> = members
        .iter()
        .flat_map(|&e| elements[e as usize].triangles.iter().copied())
        .collect();
    CardGroup {
        card: card(model, plane, &triangles),
        triangles,
    }
}

/// A rectangle in the plane; upright cards have level edges, so that nothing leans.
fn card(model: &Model, plane: &Plane, triangles: &[u32]) -> Card {
    let normal = plane.normal.as_vec3();
    let (u, v) = if normal.y.abs() > 0.5 {
        (Vec3::X, Vec3::NEG_Z)
    } else {
        (Vec3::Y.cross(normal).normalize_or(Vec3::X), Vec3::Y)
    };
    let points = || triangles.iter().flat_map(|&t| model.corners(t));
    if normal.y.abs() > 0.5 {
        return Card::around(plane.center.as_vec3(), u, v, points(), Outline::Quad);
    }
    let origin = plane.center.as_vec3();
    let (mut low, mut high) = (glam::Vec2::MAX, glam::Vec2::MIN);
    for p in points() {
        let at = glam::Vec2::new((p - origin).dot(u), (p - origin).dot(v));
        (low, high) = (low.min(at), high.max(at));
    }
    let (middle, half) = (
        (low + high) / 2.0,
        ((high - low) / 2.0).max(glam::Vec2::splat(1e-6)),
    );
    Card::rectangle(origin + u * middle.x + v * middle.y, u, v, half)
}

fn nearest(planes: &[Plane], element: &Element) -> usize {
    let mut best = (f64::MAX, 0);
    for (i, plane) in planes.iter().enumerate() {
        let cost = plane.cost(&element.moments, 0.02);
        if cost < best.0 {
            best = (cost, i);
        }
    }
    best.1
}

/// Planes with horizontal normals, fitted to all elements by alternating assignment and fit. With
/// a trunk `through` which they go, the first two keep their place there, square to each other.
fn upright_planes(elements: &[Element], count: usize, through: Option<DVec3>) -> Vec<Plane> {
    let all = elements
        .iter()
        .fold(Moments::default(), |m, e| m.merged(&e.moments));
    let mut planes: Vec<Plane> = (0..count)
        .map(|i| {
            let angle = std::f64::consts::PI * i as f64 / count as f64;
            Plane {
                center: all.mean,
                normal: DVec3::new(angle.cos(), 0.0, angle.sin()),
            }
        })
        .collect();
    if let Some(center) = through {
        let first = least_horizontal(&all, DVec3::X);
        planes[0] = Plane {
            center,
            normal: first,
        };
        planes[1] = Plane {
            center,
            normal: DVec3::Y.cross(first),
        };
    }
    let fixed = if through.is_some() { 2 } else { 0 };
    for _ in 0..ROUNDS {
        let mut moments = vec![Moments::default(); count];
        for element in elements {
            let plane = nearest(&planes, element);
            moments[plane] = moments[plane].merged(&element.moments);
        }
        for (plane, m) in planes.iter_mut().zip(&moments).skip(fixed) {
            if m.weight > 0.0 {
                *plane = Plane {
                    center: m.mean,
                    normal: least_horizontal(m, plane.normal),
                };
            }
        }
    }
    planes
}

/// The horizontal direction of least spread; `before` where all directions are alike.
fn least_horizontal(m: &Moments, before: DVec3) -> DVec3 {
    let (xx, zz, xz) = (m.scatter.x_axis.x, m.scatter.z_axis.z, m.scatter.x_axis.z);
    if (xx - zz).hypot(2.0 * xz) < 1e-9 * (xx + zz) {
        return before;
    }
    // The direction of largest spread lies at half the angle of (xx - zz, 2 xz); least is across.
    let angle = 0.5 * (2.0 * xz).atan2(xx - zz) + std::f64::consts::FRAC_PI_2;
    DVec3::new(angle.cos(), 0.0, angle.sin())
}

/// Level planes at the heights where the foliage (or, without foliage, the wood) is.
fn level_planes(elements: &[&Element], count: usize) -> Vec<Plane> {
    let leafy = elements.iter().any(|e| e.chain.is_none());
    let counted: Vec<&Element> = elements
        .iter()
        .copied()
        .filter(|e| e.chain.is_none() || !leafy)
        .collect();
    let mut by_height: Vec<(f64, f64)> = counted
        .iter()
        .map(|e| (e.moments.mean.y, e.moments.weight))
        .collect();
    by_height.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = by_height.iter().map(|h| h.1).sum();
    let middle = counted
        .iter()
        .fold(Moments::default(), |m, e| m.merged(&e.moments))
        .mean;
    // Each plane stands for an equal share of the foliage, at that share's mean height.
    let (mut sums, mut seen) = (vec![(0.0, 0.0); count], 0.0);
    for (y, weight) in by_height {
        let slot = ((seen + weight / 2.0) / total.max(1e-300) * count as f64) as usize;
        let slot = &mut sums[slot.min(count - 1)];
        (slot.0, slot.1) = (slot.0 + y * weight, slot.1 + weight);
        seen += weight;
    }
    sums.iter()
        .filter(|s| s.1 > 0.0)
        .map(|s| Plane {
            center: DVec3::new(middle.x, s.0 / s.1, middle.z),
            normal: DVec3::Y,
        })
        .collect()
}
