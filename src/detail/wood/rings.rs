//! Which points of a path keep a ring: greedy removal of the point that costs least.
//!
//! As Visvalingam and Whyatt, "Line generalisation by repeated elimination of points" (1993),
//! with the integral of squared deviation instead of a triangle's area, radius included.
//! The removal order makes all ring counts nested: one pass serves every option.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use glam::DVec4;

use super::path::Path;

/// A point of the tube's surface strip: arc length, position and radius, area weight.
#[derive(Clone, Copy)]
pub(super) struct Sample {
    /// Arc length from the base.
    pub along: f64,
    /// Position and radius.
    pub value: DVec4,
    /// Surface that it stands for.
    pub weight: f64,
}

/// Points and middles of a path with Simpson's weights, which integrate the square of a
/// piecewise linear deviation without error.
pub(super) fn samples(path: &Path) -> Vec<Sample> {
    let at = |i: usize| path.points[i].extend(path.radii[i]);
    let mut samples = Vec::with_capacity(3 * path.points.len());
    for i in 1..path.points.len() {
        let (a, b) = (at(i - 1), at(i));
        let (start, length) = (path.along[i - 1], path.along[i] - path.along[i - 1]);
        for (t, share) in [(0.0, 1.0 / 6.0), (0.5, 4.0 / 6.0), (1.0, 1.0 / 6.0)] {
            let value = a + (b - a) * t;
            samples.push(Sample {
                along: start + t * length,
                value,
                weight: std::f64::consts::TAU * value.w * length * share,
            });
        }
    }
    samples
}

/// The inner points of a path in the order of their removal, cheapest first.
pub(super) fn removal_order(path: &Path, samples: &[Sample]) -> Vec<u32> {
    let count = path.points.len();
    let moments = Moments::new(path, samples);
    let (mut before, mut after): (Vec<_>, Vec<_>) = (0..count)
        .map(|i| (i.saturating_sub(1), (i + 1).min(count - 1)))
        .unzip();
    let rise = |before: &[usize], after: &[usize], i: usize| {
        moments.cost(path, before[i], after[i])
            - moments.cost(path, before[i], i)
            - moments.cost(path, i, after[i])
    };
    let mut version = vec![0u32; count];
    let mut heap: BinaryHeap<_> = (1..count - 1)
        .map(|i| Reverse((Cost(rise(&before, &after, i)), i, 0)))
        .collect();
    let mut order = Vec::with_capacity(count);
    while let Some(Reverse((_, i, seen))) = heap.pop() {
        if seen != version[i] {
            continue;
        }
        order.push(i as u32);
        let (a, b) = (before[i], after[i]);
        (after[a], before[b]) = (b, a);
        for j in [a, b] {
            if j > 0 && j + 1 < count {
                version[j] += 1;
                heap.push(Reverse((Cost(rise(&before, &after, j)), j, version[j])));
            }
        }
    }
    order
}

/// A cost with a total order.
#[derive(PartialEq)]
pub(super) struct Cost(pub f64);
impl Eq for Cost {}
impl PartialOrd for Cost {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Cost {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// Prefix sums over the path's segments, from which the deviation from any chord follows in O(1).
struct Moments {
    /// w, w s, w s^2, w |p|^2.
    scalars: Vec<[f64; 4]>,
    /// w p, w s p.
    vectors: Vec<[DVec4; 2]>,
}

impl Moments {
    fn new(path: &Path, samples: &[Sample]) -> Self {
        let origin = path.points[0].extend(0.0);
        let (mut scalars, mut vectors) = (vec![[0.0; 4]], vec![[DVec4::ZERO; 2]]);
        for segment in samples.chunks(3) {
            let (mut s, mut v) = (scalars[scalars.len() - 1], vectors[vectors.len() - 1]);
            for sample in segment {
                let (w, along, p) = (sample.weight, sample.along, sample.value - origin);
                s[0] += w;
                s[1] += w * along;
                s[2] += w * along * along;
                s[3] += w * p.length_squared();
                v[0] += w * p;
                v[1] += w * along * p;
            }
            scalars.push(s);
            vectors.push(v);
        }
        Self { scalars, vectors }
    }

    /// Integral of the squared deviation of points a..b from the chord between them, both run
    /// through at even speed.
    fn cost(&self, path: &Path, a: usize, b: usize) -> f64 {
        if b <= a + 1 {
            return 0.0;
        }
        let origin = path.points[0].extend(0.0);
        let start = path.points[a].extend(path.radii[a]) - origin;
        let end = path.points[b].extend(path.radii[b]) - origin;
        let slope = (end - start) / (path.along[b] - path.along[a]);
        let zero = start - slope * path.along[a];
        let s: [f64; 4] = std::array::from_fn(|k| self.scalars[b][k] - self.scalars[a][k]);
        let v: [DVec4; 2] = std::array::from_fn(|k| self.vectors[b][k] - self.vectors[a][k]);
        let cost = s[3] - 2.0 * zero.dot(v[0]) - 2.0 * slope.dot(v[1])
            + zero.length_squared() * s[0]
            + 2.0 * zero.dot(slope) * s[1]
            + slope.length_squared() * s[2];
        cost.max(0.0)
    }
}
