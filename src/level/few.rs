//! Where few triangles are asked for, a billboard of the whole tree may be nearer than the best cut.
//!
//! A cut pays for wood as geometry, shows each leaf on one card, and what its last few cards leave out
//! is missing from whole views; a billboard shows each leaf on two cards. Between the two nothing but
//! the pictures decides: at 48 triangles the cut of EZ-Tree's oak has an F1 of .844.

use super::fit::Fitted;
use super::{Baker, LevelRequest};
use crate::detail::whole_tree::whole_tree;
use crate::error::Result;
use crate::export::refine::f1;
use crate::recipe::Method;
use crate::watch::Watch;

/// Both are tried for up to so many triangles.
const FEW: u64 = 160;

/// What a billboard has to gain, F1 over the training views: wood is better off as geometry.
const WORTH: f64 = 0.005;

impl Baker<'_> {
    /// The level that was made of a cut, or that of the whole tree's billboard where it is nearer.
    pub(super) fn nearer(
        &self,
        made: Fitted,
        request: LevelRequest,
        watch: &dyn Watch,
    ) -> Result<Fitted> {
        let whole_levels = request.most_error_px.is_none();
        if request.triangles > FEW || !whole_levels || self.recipe.method != Method::OptimalCut {
            return Ok(made);
        }
        let (model, radii) = (&self.tree.model, self.radii());
        let plan = whole_tree(model, self.elements, &radii, request.triangles);
        let whole = self.fit(plan, request, watch)?;
        let gain = self.agreement(&whole) - self.agreement(&made);
        Ok(if gain > WORTH { whole } else { made })
    }

    /// F1 against the original's silhouettes, mean over the training views.
    pub(super) fn agreement(&self, fitted: &Fitted) -> f64 {
        let charts = 0..fitted.foliage.charts.len();
        let targets = self.targets(fitted, charts.clone());
        f1(&fitted.foliage, charts, &targets)
    }
}
