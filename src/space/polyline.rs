//! A continuous polyline fitted to weighted points over an axis.

/// Solutions of the linear system; the slopes hardly change after the third.
const FIT_ROUNDS: usize = 3;

/// A weighted point over an axis; any unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Position along the axis.
    pub along: f64,
    /// Height over it.
    pub height: f64,
    /// Weight, not negative.
    pub weight: f64,
}

/// A polyline of heights over the axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyline {
    /// Positions along the axis, ascending, two or more.
    pub knots: Vec<f64>,
    /// Height at each knot.
    pub heights: Vec<f64>,
}

impl Polyline {
    /// The continuous polyline over the knots (two or more, ascending) with the least weighted
    /// sum of squared distances from its sections' lines.
    ///
    /// Least squares of *heights* is a tridiagonal system; steep sections would count too much in
    /// it, so it is solved again with each section's weights scaled by the slope found before.
    pub fn fit(samples: &[Sample], knots: Vec<f64>) -> Self {
        let (offset, slope) = line(samples);
        let heights = knots.iter().map(|t| offset + slope * t).collect();
        let straight = Self { knots, heights };
        (0..FIT_ROUNDS).fold(straight.clone(), |last, _| last.refit(samples, &straight))
    }

    /// One least-squares solution with the weights that the slopes of `self` give.
    fn refit(&self, samples: &[Sample], straight: &Self) -> Self {
        let n = self.knots.len();
        let total: f64 = samples.iter().map(|s| s.weight).sum();
        // A weak pull towards the common line decides where a section holds no sample.
        let pull = (total * 1e-6 / n as f64).max(f64::MIN_POSITIVE);
        let (mut diagonal, mut beside, mut right) = (vec![pull; n], vec![0.0; n], vec![0.0; n]);
        for s in samples {
            let (i, share) = self.place(s.along);
            let weight = s.weight / (1.0 + self.slope(i).powi(2));
            let rest = s.height - straight.height(s.along);
            let (a, b) = (1.0 - share, share);
            diagonal[i] += weight * a * a;
            diagonal[i + 1] += weight * b * b;
            beside[i] += weight * a * b;
            right[i] += weight * a * rest;
            right[i + 1] += weight * b * rest;
        }
        solve_tridiagonal(&mut diagonal, &beside, &mut right);
        let heights = straight.heights.iter().zip(right).map(|(h, r)| h + r);
        Self {
            heights: heights.collect(),
            knots: self.knots.clone(),
        }
    }

    /// Rise over run of a section.
    pub fn slope(&self, section: usize) -> f64 {
        let (i, j) = (section, section + 1);
        (self.heights[j] - self.heights[i]) / (self.knots[j] - self.knots[i])
    }

    /// Section that holds a position (an end section for one outside), and the position's share
    /// of the way through it.
    pub fn place(&self, along: f64) -> (usize, f64) {
        let knots = &self.knots;
        let after = knots.partition_point(|&t| t <= along);
        let i = after.clamp(1, knots.len() - 1) - 1;
        (i, (along - knots[i]) / (knots[i + 1] - knots[i]))
    }

    /// Height at a position; the end sections go on outside.
    pub fn height(&self, along: f64) -> f64 {
        let (i, share) = self.place(along);
        self.heights[i] * (1.0 - share) + self.heights[i + 1] * share
    }

    /// Root of the weighted mean of squared distances to the polyline's lines.
    pub fn error(&self, samples: &[Sample]) -> f64 {
        let (mut sum, mut total) = (0.0, 0.0);
        for s in samples {
            let (i, _) = self.place(s.along);
            let apart = (s.height - self.height(s.along)) / self.slope(i).hypot(1.0);
            sum += s.weight * apart * apart;
            total += s.weight;
        }
        (sum / total.max(f64::MIN_POSITIVE)).sqrt()
    }

    /// Joins neighbouring sections, cheapest first, while the error stays within `limit`.
    pub fn merged(mut self, samples: &[Sample], limit: f64) -> Self {
        while self.knots.len() > 2 {
            let without = (1..self.knots.len() - 1).map(|i| {
                let mut knots = self.knots.clone();
                knots.remove(i);
                let profile = Self::fit(samples, knots);
                (profile.error(samples), profile)
            });
            match without.min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((error, profile)) if error <= limit => self = profile,
                _ => break,
            }
        }
        self
    }
}

/// Thomas' algorithm for a symmetric positive definite matrix; the solution is left in `right`.
fn solve_tridiagonal(diagonal: &mut [f64], beside: &[f64], right: &mut [f64]) {
    let n = diagonal.len();
    for i in 1..n {
        let factor = beside[i - 1] / diagonal[i - 1];
        diagonal[i] -= factor * beside[i - 1];
        right[i] -= factor * right[i - 1];
    }
    for i in (0..n).rev() {
        let after = if i + 1 < n {
            beside[i] * right[i + 1]
        } else {
            0.0
        };
        right[i] = (right[i] - after) / diagonal[i];
    }
}

/// Offset and slope of the least-squares line of height over position.
fn line(samples: &[Sample]) -> (f64, f64) {
    let total: f64 = samples.iter().map(|s| s.weight).sum();
    if total <= 0.0 {
        return (0.0, 0.0);
    }
    let mean = |f: fn(&Sample) -> f64| samples.iter().map(|s| s.weight * f(s)).sum::<f64>() / total;
    let (t, h) = (mean(|s| s.along), mean(|s| s.height));
    let (mut tt, mut th) = (0.0, 0.0);
    for s in samples {
        tt += s.weight * (s.along - t).powi(2);
        th += s.weight * (s.along - t) * (s.height - h);
    }
    let slope = if tt > 0.0 { th / tt } else { 0.0 };
    (h - slope * t, slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(f: impl Fn(f64) -> f64) -> Vec<Sample> {
        let at = |i: i32| f64::from(i) / 100.0;
        let sample = |t: f64| Sample {
            along: t,
            height: f(t),
            weight: 0.5,
        };
        (0..=200).map(at).map(sample).collect()
    }

    #[test]
    fn a_roof_is_met_exactly() {
        let roof = samples(|t| 3.0 - (t - 1.0).abs());
        let polyline = Polyline::fit(&roof, vec![0.0, 1.0, 2.0]);
        for (height, expected) in polyline.heights.iter().zip([2.0, 3.0, 2.0]) {
            assert!((height - expected).abs() < 1e-4, "{polyline:?}");
        }
        assert!(polyline.error(&roof) < 1e-4);
        // Merging keeps the ridge while the limit is small, and one line at any limit above.
        assert_eq!(polyline.clone().merged(&roof, 0.01).knots.len(), 3);
        assert_eq!(polyline.merged(&roof, 1.0).knots.len(), 2);
    }

    #[test]
    fn superfluous_knots_of_a_roof_are_merged_away() {
        let roof = samples(|t| 3.0 - (t - 1.0).abs());
        let many = Polyline::fit(&roof, (0..=8).map(|i| f64::from(i) / 4.0).collect());
        assert_eq!(many.merged(&roof, 1e-3).knots, [0.0, 1.0, 2.0]);
    }

    #[test]
    fn a_section_without_samples_follows_the_common_line() {
        let mut gap = samples(|t| 2.0 * t);
        gap.retain(|s| s.along < 0.4 || s.along > 1.6);
        let polyline = Polyline::fit(&gap, vec![0.0, 0.5, 1.0, 1.5, 2.0]);
        assert!((polyline.height(1.0) - 2.0).abs() < 1e-6);
    }

    #[test]
    fn nothing_is_flat() {
        let polyline = Polyline::fit(&[], vec![0.0, 1.0]);
        assert_eq!(polyline.heights, [0.0, 0.0]);
        assert_eq!(polyline.error(&[]), 0.0);
    }
}
