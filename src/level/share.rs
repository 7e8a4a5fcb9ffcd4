//! Levels whose cards share texels.

use super::fit::{Fitted, merge_wood, wood_scene};
use super::{Baker, Level};
use crate::error::Result;
use crate::export::matching::match_area;
use crate::export::refine::{f1, refine};
use crate::export::share::{self, Cards, Plan};
use crate::watch::{Watch, part};

/// So many times the allowed loss may show in the fit's own measure, which sees single texels: it loses more than
/// pictures where the level starts, and what passes here is measured there.
const PASSES: f64 = 6.0;

impl Baker<'_> {
    /// A level with all that shares its texels.
    pub(super) fn finished(&self, fitted: Fitted, watch: &dyn Watch) -> Result<Level> {
        let height = self.original.height;
        let shared = self.shared(&fitted, watch)?;
        Ok(Level {
            shared: shared.into_iter().rev().map(|f| f.level(height)).collect(),
            ..fitted.level(height)
        })
    }

    /// The level on pages of half the size, a quarter and so on, while it may lose no more
    /// than the recipe allows.
    fn shared(&self, fitted: &Fitted, watch: &dyn Watch) -> Result<Vec<Fitted>> {
        let mut out = Vec::new();
        if self.recipe.sharing == 0.0 || fitted.foliage.charts.len() < 2 {
            return Ok(out);
        }
        part(watch, "share")?;
        let taken = merge_wood(&fitted.wood);
        let pool = self.pool(fitted.request);
        let targets = self.original.targets(pool, Some(&wood_scene(&taken)));
        let goal = self.goal(fitted.request);
        let least = f1(&fitted.foliage, &targets) - PASSES * self.recipe.sharing;
        let cards = Cards {
            model: &self.tree.model,
            groups: &fitted.plan.cards,
            samples: self.recipe.samples,
            pad: self.recipe.gutter_texels,
        };
        let opacity: Vec<f32> = fitted
            .score
            .iter()
            .map(|score| (score - fitted.matched.threshold + 0.5).clamp(0.0, 1.0))
            .collect();
        let wanted = share::Fitted {
            foliage: &fitted.foliage,
            opacity: &opacity,
        };
        let mut size = fitted.foliage.size;
        while let Some(plan) =
            half(&mut size).and_then(|()| Plan::new(cards, self.density(fitted.request), size))
        {
            part(watch, "share")?;
            let Some(mut foliage) = plan.share(cards, wanted) else {
                break;
            };
            let score = refine(&foliage, &targets, self.refining());
            let wood = &fitted.wood.surfaces;
            let matched = match_area(&mut foliage, score, wood, &goal, fitted.matched.contrast);
            if f1(&foliage, &targets) < least {
                break;
            }
            out.push(Fitted {
                request: fitted.request,
                plan: fitted.plan.clone(),
                wood: fitted.wood.clone(),
                foliage,
                matched,
                density: plan.density,
                score: Vec::new(),
            });
        }
        Ok(out)
    }
}

/// A page's fewest texels along a side.
const LEAST_SIDE: u32 = 16;

/// Halves the longer side.
fn half(size: &mut [u32; 2]) -> Option<()> {
    let longer = usize::from(size[1] > size[0]);
    size[longer] /= 2;
    (size[longer] >= LEAST_SIDE).then_some(())
}
