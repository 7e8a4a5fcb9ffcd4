//! Cards whose sides differ visibly are drawn once for each side, within the level's budget.

use super::Baker;
use crate::botany::model::Model;
use crate::detail::level::LevelPlan;
use crate::export::foliage::CardGroup;
use crate::export::sides::{VISIBLE_DELTA_E, differences};

/// Share of the cards' area that has to differ before a level pays for it: a second side costs as much as
/// the first, and what a few cards show from behind is lost in the crown.
const LEAST_SHARE: f64 = 0.05;

/// Cards that are asked first, at least: where few of them differ, no others are asked. The level with a tenth
/// of 444,633 triangles has 20,000, and asking all takes a quarter of its cut.
const ASKED_FIRST: usize = 512;

/// Times that a smaller budget is tried.
const TRIES: u32 = 3;

impl Baker<'_> {
    /// The plan that `make` gives for so many triangles, less where some go to second sides.
    pub(super) fn sided(
        &self,
        budget: u64,
        make: impl Fn(u64) -> Option<LevelPlan>,
    ) -> Option<LevelPlan> {
        let mut plan = make(budget)?;
        // Copies of tiles are seen from behind as well: they have no side of their own.
        if !self.recipe.second_sides || self.recipe.sharing > 0.0 {
            return Some(plan);
        }
        let differing = |plan: &LevelPlan| {
            let seen = |card: &u32| {
                let normal = plan.cards[*card as usize].card.normal();
                self.original.eyes.sides(normal) == [true; 2]
            };
            let mut found = differing(&self.tree.model, plan);
            found.retain(seen);
            found
        };
        let mut sided = differing(&plan);
        for _ in 0..TRIES {
            let (own, more) = (self.cost(&plan), triangles_of(&plan, &sided));
            if own + more <= budget {
                break;
            }
            let Some(coarser) = make(budget * own / (own + more)) else {
                break;
            };
            plan = coarser;
            sided = differing(&plan);
        }
        let mut left = budget.saturating_sub(self.cost(&plan));
        sided.retain(|&card| {
            let cost = triangles_of(&plan, &[card]);
            let fits = cost <= left;
            left -= if fits { cost } else { 0 };
            fits
        });
        plan.sided = sided;
        Some(plan)
    }

    /// Turns cards of which only the back is seen: texels are those of the front.
    pub(super) fn face_the_eye(&self, plan: &mut LevelPlan) {
        let eyes = &self.original.eyes;
        if eyes.are_everywhere() || plan.one_sided {
            return;
        }
        for group in &mut plan.cards {
            if eyes.sides(group.card.normal()) == [false, true] {
                group.card = group.card.turned();
            }
        }
    }

    /// Triangles of a plan.
    pub(super) fn cost(&self, plan: &LevelPlan) -> u64 {
        let cards = plan.cards.iter().map(|g| g.card.triangles() as u64);
        let tubes = plan.tubes.iter().filter_map(|&(element, choice)| {
            let chain = self.elements[element as usize].chain?;
            let options = &self.wood.tube_options(chain).options;
            Some(u64::from(options[choice as usize].triangles))
        });
        cards.sum::<u64>() + tubes.sum::<u64>()
    }
}

/// Cards whose sides differ visibly; none where that is little of them all, or of those asked first.
fn differing(model: &Model, plan: &LevelPlan) -> Vec<u32> {
    let all = 0..plan.cards.len() as u32;
    let every = (plan.cards.len() / ASKED_FIRST).max(1);
    if every > 1 {
        let some: Vec<u32> = all.clone().step_by(every).collect();
        if differing_among(model, plan, &some).1 < LEAST_SHARE / 2.0 {
            return Vec::new();
        }
    }
    match differing_among(model, plan, &all.collect::<Vec<u32>>()) {
        (differing, share) if share >= LEAST_SHARE => differing,
        _ => Vec::new(),
    }
}

/// Those of some cards whose sides differ visibly, and their share of the area of these.
fn differing_among(model: &Model, plan: &LevelPlan, cards: &[u32]) -> (Vec<u32>, f64) {
    let groups: Vec<&CardGroup> = cards.iter().map(|&c| &plan.cards[c as usize]).collect();
    let found = differences(model, &groups);
    let areas = groups.iter().map(|g| f64::from(g.card.area()));
    let all: f64 = areas.clone().sum();
    let mut differing = Vec::new();
    let mut sum = 0.0;
    for ((&card, area), difference) in cards.iter().zip(areas).zip(found) {
        if difference >= VISIBLE_DELTA_E {
            differing.push(card);
            sum += area;
        }
    }
    (differing, sum / all.max(f64::MIN_POSITIVE))
}

fn triangles_of(plan: &LevelPlan, cards: &[u32]) -> u64 {
    let cost = |&card: &u32| plan.cards[card as usize].card.triangles() as u64;
    cards.iter().map(cost).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sides::tests::leaf;

    #[test]
    fn sides_differ_where_a_share_of_all_cards_says_so() {
        let (model, two) = leaf(true);
        // One sheet: the front alone, which the model draws from both sides.
        let one = CardGroup {
            triangles: vec![0, 0],
            ..two.clone()
        };
        let plan = |is_two: fn(u32) -> bool| LevelPlan {
            cards: (0..1500)
                .map(|card| if is_two(card) { &two } else { &one }.clone())
                .collect(),
            ..LevelPlan::default()
        };
        let found = differing(&model, &plan(|card| card >= 1000));
        assert_eq!(found, (1000..1500).collect::<Vec<u32>>());
        assert_eq!(differing(&model, &plan(|card| card % 50 == 0)), [0; 0]);
        assert_eq!(differing(&model, &plan(|_| true)).len(), 1500);
    }
}
