//! Rings through given knots of a path: least squares over linear splines.
//!
//! A chord between points of a bend lies wholly on its inner side; the best broken line crosses
//! the bend and has a sixth of the squared error. The normal equations of hat functions are
//! tridiagonal, so a fit costs O(points).

use glam::{DVec3, DVec4};

use super::path::Path;
use super::rings::Sample;

/// A ring of a simplified tube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ring {
    /// Point of the path that it stands at (for bark and orientation).
    pub knot: u32,
    /// Centre.
    pub center: DVec3,
    /// Radius of the circle with the ring's perimeter; zero at a pointed tip.
    pub radius: f64,
}

/// Rings with what they cost.
pub(super) struct Fit {
    /// Rings from base to tip.
    pub rings: Vec<Ring>,
    /// Integral over the surface of squared displacement (centre and radius).
    pub displacement: f64,
    /// Integral over the surface of the squared radius: the scale of a polygon's deviation.
    pub roundness: f64,
    /// What a flat piece is off in place of both: [`THICKNESS`] times as much for errors of the radius, and the scale of
    /// its deviation by the path's own radius. By the fitted radius spikes would be as good for rods as ribbons: what
    /// they lack in roundness makes up for what their taper misses.
    pub flat: f64,
}

/// What stands for the mean squared deviation of a ribbon from a circle of radius one. The
/// circle's points have the mean squared height 1/2 over the ribbon's plane; as much again is for
/// the change with the direction of view. Measured at 3 % of the wood's triangles: with 1/2
/// trunks become ribbons and a view loses a fifth of the covered area; with 4 twigs become
/// three-sided too soon and F1 falls by up to .06.
const RIBBON_DEVIATION: f64 = 1.0;

/// What an error of the radius of a flat piece weighs over one as long of the centre: where a rod is drawn as a spike,
/// half of it is missing and not just displaced. Tubes are never spikes: what they are off is as it was measured above.
/// Measured with 1: at 10 % the bars of EZ-Tree's trellis become spikes (F1 .889, with 9 .901), and of 18 other trees five
/// lose .001 or .002 at 3 or 1 %; no level of any gains.
const THICKNESS: f64 = 9.0;

/// Fits rings at `knots` (first and last point included); `pointed` closes the tip.
pub(super) fn fit(path: &Path, samples: &[Sample], knots: &[u32], pointed: bool) -> Fit {
    let count = knots.len();
    let (mut system, spans) = normal_equations(path, samples, knots);
    let value = |i: u32| path.points[i as usize].extend(path.radii[i as usize]);
    // Pinned: the foot stays where the branch is attached.
    let mut centers = system.clone();
    centers.pin(0, value(knots[0]));
    if pointed {
        system.pin(count - 1, DVec4::ZERO);
    }
    let radii = system.solve();
    let thinnest = 0.02 * path.radii.iter().fold(0.0f64, |a, &b| a.max(b));
    let rings: Vec<_> = centers
        .solve()
        .iter()
        .zip(&radii)
        .enumerate()
        .map(|(i, (center, radius))| Ring {
            knot: knots[i],
            center: center.truncate(),
            radius: match pointed && i == count - 1 {
                true => 0.0,
                false => radius.w.max(thinnest),
            },
        })
        .collect();
    let (mut displacement, mut roundness, mut flat) = (0.0, 0.0, 0.0);
    for (sample, &(span, t)) in samples.iter().zip(&spans) {
        let at = |r: &Ring| r.center.extend(r.radius);
        let fitted = at(&rings[span]).lerp(at(&rings[span + 1]), t);
        let off = sample.value - fitted;
        displacement += sample.weight * off.length_squared();
        roundness += sample.weight * fitted.w * fitted.w;
        let (astray, thick) = (off.truncate().length_squared(), off.w * off.w);
        let deviation = RIBBON_DEVIATION * sample.value.w * sample.value.w;
        flat += sample.weight * (astray + THICKNESS * thick + deviation);
    }
    Fit {
        rings,
        displacement,
        roundness,
        flat,
    }
}

/// A symmetric tridiagonal system with right sides of four numbers.
#[derive(Clone)]
struct Tridiagonal {
    diagonal: Vec<f64>,
    beside: Vec<f64>,
    right: Vec<DVec4>,
}

impl Tridiagonal {
    /// Fixes an unknown.
    fn pin(&mut self, i: usize, value: DVec4) {
        if i > 0 {
            self.right[i - 1] -= self.beside[i - 1] * value;
            self.beside[i - 1] = 0.0;
        }
        if i < self.beside.len() {
            self.right[i + 1] -= self.beside[i] * value;
            self.beside[i] = 0.0;
        }
        self.diagonal[i] = 1.0;
        self.right[i] = value;
    }

    /// Thomas's algorithm; the matrix is positive definite.
    fn solve(mut self: Tridiagonal) -> Vec<DVec4> {
        let count = self.diagonal.len();
        for i in 1..count {
            let factor = self.beside[i - 1] / self.diagonal[i - 1];
            self.diagonal[i] -= factor * self.beside[i - 1];
            let before = self.right[i - 1];
            self.right[i] -= factor * before;
        }
        for i in (0..count).rev() {
            if i + 1 < count {
                let after = self.right[i + 1];
                self.right[i] -= self.beside[i] * after;
            }
            self.right[i] /= self.diagonal[i];
        }
        self.right
    }
}

/// The normal equations of hat functions at the knots, and each sample's span and place in it.
fn normal_equations(
    path: &Path,
    samples: &[Sample],
    knots: &[u32],
) -> (Tridiagonal, Vec<(usize, f64)>) {
    let count = knots.len();
    let along = |k: usize| path.along[knots[k] as usize];
    let mut system = Tridiagonal {
        diagonal: vec![0.0; count],
        beside: vec![0.0; count - 1],
        right: vec![DVec4::ZERO; count],
    };
    let mut spans = Vec::with_capacity(samples.len());
    let mut span = 0;
    let total: f64 = samples.iter().map(|s| s.weight).sum();
    for sample in samples {
        while span + 2 < count && sample.along > along(span + 1) {
            span += 1;
        }
        let t = ((sample.along - along(span)) / (along(span + 1) - along(span))).clamp(0.0, 1.0);
        spans.push((span, t));
        system.diagonal[span] += sample.weight * (1.0 - t) * (1.0 - t);
        system.diagonal[span + 1] += sample.weight * t * t;
        system.beside[span] += sample.weight * t * (1.0 - t);
        system.right[span] += sample.weight * (1.0 - t) * sample.value;
        system.right[span + 1] += sample.weight * t * sample.value;
    }
    // A faint pull to the path's own points keeps knots defined where the surface is zero.
    let pull = 1e-6 * total.max(f64::MIN_POSITIVE) / count as f64;
    for (k, &knot) in knots.iter().enumerate() {
        let i = knot as usize;
        system.diagonal[k] += pull;
        system.right[k] += pull * path.points[i].extend(path.radii[i]);
    }
    (system, spans)
}
