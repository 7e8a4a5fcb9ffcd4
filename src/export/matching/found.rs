//! What the matching finds.

use super::rule::{MIPS, Rule};

/// Both alphas stay this far from the cutoff of 128: room for rounding in mips.
pub(super) const HIGHEST_CONTRAST: f64 = 120.0;

/// What areas from afar grow by with a step of contrast: on an oak's levels it is .0005 to .0007.
pub(super) const AREA_A_STEP: f64 = 5e-4;

/// What was found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matched {
    /// Score from which a texel is opaque.
    pub threshold: f32,
    /// Positive: alpha of the other texels; negative: what opaque texels lack of 255.
    pub contrast: i32,
    /// Covered area over the original's, supersampled from the base level, before mips ask for anything.
    pub near_ratio: f64,
    /// Covered area over the original's as a client draws it: where the level starts, and at each twice
    /// the distance of the one before.
    pub ratios: Vec<f64>,
}

impl Matched {
    /// Alpha of opaque texels and of the others.
    pub fn alphas(&self) -> [u8; 2] {
        [
            (255 + self.contrast.min(0)) as u8,
            self.contrast.max(0) as u8,
        ]
    }

    /// What makes these alphas, and nothing else.
    pub(super) fn rule(&self) -> Rule {
        Rule {
            threshold: self.threshold,
            alphas: self.alphas(),
            passes: [None; MIPS],
        }
    }

    /// Mean of the areas that a client covers where the level starts and at twice that distance.
    pub(super) fn balance(&self) -> f64 {
        (self.ratios[0] + self.ratios[1]) / 2.0
    }
}
