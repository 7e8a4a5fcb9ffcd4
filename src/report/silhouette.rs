//! Precision, recall and F1 of silhouettes (Kratt et al. 2014, section 4).
//!
//! `P = tp / (tp + fp)`, `R = tp / (tp + fn)`, `F1 = 2 P R / (P + R) = 2 tp / (2 tp + fp + fn)`
//! over pixels that are at least half covered. (The paper's third formula prints tn for fn.)

use crate::space::raster::{Coverage, Mask};

/// How two silhouettes agree, in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Agreement {
    /// Pixels of both.
    pub both: u64,
    /// Pixels of the level that the original does not have (false positives).
    pub extra: u64,
    /// Pixels of the original that the level does not have (false negatives).
    pub missing: u64,
}

/// Compares the half-covered pixels of an original and a level of the same size.
pub fn agreement(original: &Coverage, level: &Coverage) -> Agreement {
    agreement_of(&original.fraction, &level.fraction)
}

/// As [`agreement`], of the covered share of every pixel.
pub(super) fn agreement_of(original: &[f32], level: &[f32]) -> Agreement {
    debug_assert_eq!(original.len(), level.len());
    let mut sum = Agreement::default();
    for (&original, &level) in original.iter().zip(level) {
        match (original >= 0.5, level >= 0.5) {
            (true, true) => sum.both += 1,
            (false, true) => sum.extra += 1,
            (true, false) => sum.missing += 1,
            (false, false) => {}
        }
    }
    sum
}

/// F1 of an original moved by half a pixel against itself, to the right and down (mean of the two).
pub(super) fn moved_f1(mask: &Mask, original: &[f32]) -> f64 {
    // Half a pixel is a number of samples: the moved picture needs no second drawing.
    let half = mask.side as i32 / 2;
    let moved = [(half, 0), (0, half)]
        .map(|(x, y)| agreement_of(original, &mask.coverage_shifted(x, y).fraction).f1());
    0.5 * (moved[0] + moved[1])
}

impl Agreement {
    /// Share of the level's pixels that the original has; 1 if the level has none and none are missing.
    pub fn precision(&self) -> f64 {
        self.share(self.both + self.extra)
    }

    /// Share of the original's pixels that the level has; 1 if there are none on either side.
    pub fn recall(&self) -> f64 {
        self.share(self.both + self.missing)
    }

    /// Harmonic mean of both; two empty pictures agree (1), an empty one and a full one do not (0).
    pub fn f1(&self) -> f64 {
        let whole = 2 * self.both + self.extra + self.missing;
        if whole == 0 {
            1.0
        } else {
            (2 * self.both) as f64 / whole as f64
        }
    }

    /// Half-covered pixels of the level over those of the original; 1 if both have none.
    pub fn pixel_ratio(&self) -> f64 {
        ratio(
            (self.both + self.extra) as f64,
            (self.both + self.missing) as f64,
        )
    }

    fn share(&self, of: u64) -> f64 {
        if of == 0 {
            // Nothing claimed: right only if there was nothing to claim.
            return if self.extra + self.missing == 0 {
                1.0
            } else {
                0.0
            };
        }
        self.both as f64 / of as f64
    }
}

/// `part / whole`, where a whole of nothing is all there.
pub(super) fn share(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { part / whole } else { 1.0 }
}

/// `level / original`, with a floor of a hundredth of a pixel, so that nothing over nothing is 1
/// and something over nothing is large but finite.
pub(super) fn ratio(level: f64, original: f64) -> f64 {
    level.max(0.01) / original.max(0.01)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(fraction: &[f32]) -> Coverage {
        Coverage {
            width: fraction.len() as u32,
            height: 1,
            fraction: fraction.to_vec(),
        }
    }

    #[test]
    fn counts_pixels_that_are_at_least_half_covered() {
        let a = agreement(
            &row(&[1.0, 0.5, 0.49, 0.0, 1.0]),
            &row(&[0.5, 0.0, 1.0, 0.2, 0.6]),
        );
        assert_eq!((a.both, a.extra, a.missing), (2, 1, 1));
        assert_eq!(
            (a.precision(), a.recall(), a.f1()),
            (2.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0)
        );
        assert_eq!(a.pixel_ratio(), 1.0);
    }

    #[test]
    fn a_picture_agrees_with_itself() {
        let picture = row(&[0.3, 0.8, 0.0]);
        let a = agreement(&picture, &picture);
        assert_eq!(
            (a.f1(), a.precision(), a.recall(), a.pixel_ratio()),
            (1.0, 1.0, 1.0, 1.0)
        );
    }

    #[test]
    fn an_empty_level_scores_nothing_and_two_empty_pictures_agree() {
        let (full, empty) = (row(&[1.0]), row(&[0.0]));
        let a = agreement(&full, &empty);
        assert_eq!(
            (a.f1(), a.precision(), a.recall(), a.pixel_ratio()),
            (0.0, 0.0, 0.0, 0.01)
        );
        assert_eq!(agreement(&empty, &full).f1(), 0.0);
        let a = agreement(&empty, &empty);
        assert_eq!(
            (a.f1(), a.precision(), a.recall(), a.pixel_ratio()),
            (1.0, 1.0, 1.0, 1.0)
        );
    }
}
