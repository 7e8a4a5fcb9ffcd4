//! Leaves that are drawn from one side alone.
//!
//! Where a material is not double-sided, a crown shows from each side only the leaves that face it. Cards that
//! show all their leaves from both sides then show twice as many as they should, wherever alpha puts them: each
//! card becomes two, back to back, of the leaves that face one way and the other, and culled as these are.

use glam::Vec3;

use super::element::Element;
use super::level::LevelPlan;
use crate::botany::model::Model;
use crate::cloud::card::Card;
use crate::export::foliage::CardGroup;

/// Share of the leaves' area that has to have one side; what a few others show from behind is lost.
const MOST: f64 = 0.99;

/// Whether the leaves among some elements are drawn from one side alone.
pub fn have_one_side(model: &Model, elements: &[Element]) -> bool {
    let leaves = elements.iter().filter(|e| e.chain.is_none());
    let (mut one, mut all) = (0.0, 0.0);
    for leaf in leaves {
        let area = f64::from(leaf.area);
        let is_double = |&t: &u32| model.material_of(t).double_sided;
        all += area;
        one += match leaf.triangles.first().is_none_or(is_double) {
            true => 0.0,
            false => area,
        };
    }
    all > 0.0 && one >= MOST * all
}

/// Twice the area of an element's triangles, towards where they face, normalised units squared.
fn facing(model: &Model, element: &Element) -> Vec3 {
    let of_triangle = |&t: &u32| {
        let [a, b, c] = model.corners(t);
        (b - a).cross(c - a)
    };
    element.triangles.iter().map(of_triangle).sum()
}

/// Makes of each card the one or two that its leaves face: the same card again, or the one that `fitted` has for
/// those elements. Wood has no side: it is drawn on both.
pub fn split(
    model: &Model,
    elements: &[Element],
    plan: LevelPlan,
    fitted: impl Fn(&[u32]) -> Option<Card>,
) -> LevelPlan {
    let mut out = LevelPlan {
        cards: Vec::with_capacity(plan.cards.len()),
        members: Vec::with_capacity(plan.members.len()),
        one_sided: true,
        ..plan
    };
    for (group, members) in plan.cards.into_iter().zip(plan.members) {
        let normal = group.card.normal();
        let faces = |e: u32, way: f32| {
            let element = &elements[e as usize];
            element.chain.is_some() || facing(model, element).dot(normal) * way >= 0.0
        };
        let leafy = |members: &[u32]| {
            members
                .iter()
                .any(|&e| elements[e as usize].chain.is_none())
        };
        let of_side = |way: f32| -> Vec<u32> {
            let side = members.iter().copied();
            side.filter(|&e| faces(e, way)).collect()
        };
        let [front, back] = [of_side(1.0), of_side(-1.0)];
        // Twigs alone are worth a card of their own on either side only where no leaves are.
        let bare = !leafy(&members);
        for (side, way) in [(front, normal), (back, -normal)] {
            if !bare && !leafy(&side) {
                continue;
            }
            let card = fitted(&side).unwrap_or_else(|| group.card.clone());
            let triangles = side.iter();
            let triangles = triangles.flat_map(|&e| elements[e as usize].triangles.iter().copied());
            out.cards.push(CardGroup {
                triangles: triangles.collect(),
                card: match card.normal().dot(way) < 0.0 {
                    true => card.turned(),
                    false => card,
                },
            });
            out.members.push(side);
        }
    }
    out
}
