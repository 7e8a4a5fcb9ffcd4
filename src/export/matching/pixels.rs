//! Pixels by the threshold at which they are lost: what a page covers at any, once it was drawn.

use rayon::prelude::*;

use crate::space::raster::Critical;

/// Thresholds beyond these leave no texel out, or none in.
pub const THRESHOLDS: [f32; 2] = [-0.6, 1.6];

/// The pixels that some threshold covers.
pub struct Pixels {
    /// Between these thresholds are told apart.
    range: [f32; 2],
    /// How many are covered at the upper end of the range.
    above: usize,
    /// For each other one the highest threshold that covers it; falling.
    within: Vec<f32>,
}

impl Pixels {
    /// What was drawn to tell thresholds within this range apart.
    pub fn new(critical: Critical, range: [f32; 2]) -> Self {
        let Critical { above, mut within } = critical;
        within.par_sort_unstable_by(|a, b| b.total_cmp(a));
        Self {
            range,
            above,
            within,
        }
    }

    /// The threshold at which as many pixels are covered as `wanted`, and how many are; `None` where it lies beyond
    /// the range.
    pub fn at_count(&self, wanted: f64) -> Option<(f32, usize)> {
        let [least, most] = THRESHOLDS;
        let known = self.range[0] > least || self.range[1] < most;
        let (above, within) = (self.above, &self.within);
        let covered = |threshold: f32| above + within.partition_point(|&c| c >= threshold);
        let index = (wanted.round() as usize).min(above + within.len());
        let Some(&last) = index.checked_sub(above + 1).and_then(|i| within.get(i)) else {
            // None are asked for, or all of those above.
            let none = if above + within.len() == 0 {
                least
            } else {
                most
            };
            return (!known).then_some((none, covered(none)));
        };
        if known && index == above + within.len() {
            return None;
        }
        // Many texels may have the same score: with them or without, whichever is nearer.
        let tied = last.clamp(least, most);
        let next = within[..covered(tied) - above]
            .iter()
            .rev()
            .find(|&&c| c > tied);
        if known && next.is_none() {
            return None;
        }
        let above = next.map_or(most, |c| 0.5 * (tied + c)).clamp(least, most);
        let miss = |threshold: f32| (covered(threshold) as f64 - wanted).abs();
        let best = if miss(above) < miss(tied) {
            above
        } else {
            tied
        };
        Some((best, covered(best)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

    fn counted(above: usize, within: &[f32], range: [f32; 2]) -> Pixels {
        let within = within.to_vec();
        Pixels::new(Critical { above, within }, range)
    }

    #[test]
    fn the_threshold_leaves_as_many_pixels_as_wanted() {
        // One pixel is opaque whatever the threshold.
        let pixels = counted(1, &[0.5, 0.75, 0.25, 0.5, 0.5], ALL);
        let count = |wanted| pixels.at_count(wanted);
        assert_eq!(count(2.0), Some((0.75, 2)));
        // Three are tied: five are nearer to four than two are.
        assert_eq!(count(4.0), Some((0.5, 5)));
        assert_eq!(count(3.0), Some((0.625, 2)));
        assert_eq!(count(9.0), Some((0.25, 6)));
        assert_eq!(count(0.0), Some((THRESHOLDS[1], 1)));
        let nothing = counted(0, &[], ALL).at_count(9.0);
        assert_eq!(nothing, Some((THRESHOLDS[0], 0)));
    }

    #[test]
    fn a_threshold_within_a_range_is_that_of_all_or_not_known() {
        let all = [0.9f32, 0.8, 0.62, 0.6, 0.58, 0.56, 0.3, 0.2];
        let range = [0.5, 0.7];
        for wanted in 0..9 {
            let full = counted(0, &all, ALL).at_count(f64::from(wanted));
            let above = all.iter().filter(|&&c| c >= range[1]).count();
            let within = all.iter().filter(|&&c| c > range[0] && c < range[1]);
            let within: Vec<f32> = within.copied().collect();
            let some = counted(above, &within, range).at_count(f64::from(wanted));
            assert_eq!(some.is_some(), (4..6).contains(&wanted), "{wanted}");
            assert!(some.is_none() || some == full, "{some:?} for {full:?}");
        }
    }
}
