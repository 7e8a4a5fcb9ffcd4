//! Levels of trees whose leaves are drawn from one side alone, as their material says.
//!
//! Two layers of leaves back to back look the same from both sides, and then cards that do so, too, are half as
//! many: the pictures decide.

use super::fit::Fitted;
use super::{Baker, LevelRequest};
use crate::detail::facing::{have_one_side, split};
use crate::detail::level::LevelPlan;
use crate::detail::whole_tree::whole_tree;
use crate::error::Result;
use crate::ladder::{LEAST_TRIANGLES, WHOLE_TREE_TRIANGLES};
use crate::recipe::Method;
use crate::watch::{Watch, part};

/// Times that a smaller budget is tried, until what comes of each card fits.
const TRIES: u32 = 8;

impl Baker<'_> {
    /// The level that was made, or one of cards with one side where its leaves have one and it is nearer.
    pub(super) fn facing(
        &self,
        made: Fitted,
        request: LevelRequest,
        watch: &dyn Watch,
    ) -> Result<Fitted> {
        // Tiles share one material; what shares texels is seen from both sides.
        let whole_levels = request.most_error_px.is_none() && self.recipe.sharing == 0.0;
        if !whole_levels || self.recipe.method != Method::OptimalCut {
            return Ok(made);
        }
        if !have_one_side(&self.tree.model, self.elements) {
            return Ok(made);
        }
        part(watch, "cut")?;
        let Some(plan) = self.one_sided_within(request.triangles) else {
            return Ok(made);
        };
        let other = self.fit(plan, request, watch)?;
        let nearer = self.agreement(&other) > self.agreement(&made);
        Ok(if nearer { other } else { made })
    }

    /// A plan of at most so many triangles whose cards are seen from one side.
    fn one_sided_within(&self, triangles: u64) -> Option<LevelPlan> {
        let (model, elements, radii) = (&self.tree.model, self.elements, self.radii());
        let choices = self.choices();
        let planner = self.planner(&choices);
        let mut budget = triangles;
        for _ in 0..TRIES {
            let cut = (budget > WHOLE_TREE_TRIANGLES).then(|| planner.plan(budget));
            let plan = match cut.flatten() {
                Some(cut) => split(model, elements, cut, |side| Some(planner.card(side).card)),
                None => {
                    let whole = whole_tree(model, elements, &radii, budget);
                    split(model, elements, whole, |_| None)
                }
            };
            let cost = self.cost(&plan);
            if cost <= triangles {
                return Some(plan);
            }
            budget = (budget * triangles / cost).min(budget - 1);
            if budget < LEAST_TRIANGLES {
                return None;
            }
        }
        None
    }
}
