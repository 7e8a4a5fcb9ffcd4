//! FLIP, the difference that a viewer sees when two pictures alternate (Andersson, Nilsson,
//! Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for Alternating
//! Images", HPG 2020), for pictures of low dynamic range.
//!
//! Own implementation of the paper: colours in an opponent space blurred by what the eye resolves
//! (4.1), their distance in a Hunt-adjusted L*a*b* (4.1.2), edges and points found by derivatives
//! of Gaussians (4.2), both combined (4.3). It agrees with NVIDIA's `flip-evaluator` 1.7 within
//! 0.0005 (see the tests) and keeps a picture's own half of the work for several comparisons.

use std::f32::consts::{FRAC_1_SQRT_2, PI};
use std::sync::LazyLock;

use crate::space::lab::{lab, opponent, rgb_of_opponent};

/// Pixels a degree of visual angle: 0.7 m from a screen of 0.7 m with 3840 pixels, the default of
/// the paper.
const PIXELS_PER_DEGREE: f32 = 3840.0 * PI / 180.0;
/// Exponent on colour distances.
const COLOR_POWER: f32 = 0.7;
/// Colour distances under this share of the largest take most of the range ...
const KNEE: f32 = 0.4;
/// ... up to this.
const KNEE_VALUE: f32 = 0.95;
/// Width of the edge and point detectors, degrees.
const FEATURE_WIDTH: f32 = 0.082;

/// A picture ready to be compared: filtered colours, edges and points.
#[derive(Clone, Debug)]
pub struct Seen {
    color: Vec<[f32; 3]>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

/// Weights of the filters; all have an odd number of taps.
struct Filters {
    /// Contrast sensitivity for lightness, red-green, and blue-yellow in two parts.
    sight: [Vec<f32>; 4],
    gauss: Vec<f32>,
    /// First derivative.
    edge: Vec<f32>,
    /// Second derivative.
    point: Vec<f32>,
    /// Largest colour distance there is, to the power: from green to blue.
    farthest: f32,
}

static FILTERS: LazyLock<Filters> = LazyLock::new(Filters::new);

impl Filters {
    fn new() -> Self {
        // Amplitude and width of the Gaussians (table 1 of the paper; the second ones that are
        // zero there are left out).
        let widths = [0.0047f32, 0.0053, 0.04, 0.025];
        let amplitudes = [1.0f32, 1.0, 34.1, 13.5];
        let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
        let mut sight = [0, 1, 2, 3].map(|i| -> Vec<f32> {
            // The root of the two-dimensional filter: rows and columns multiply.
            let scale = (amplitudes[i] * (PI / widths[i]).sqrt()).sqrt();
            let value = |x: i32| {
                let x = x as f32 / PIXELS_PER_DEGREE;
                scale * (-PI * PI * x * x / widths[i]).exp()
            };
            (-radius..=radius).map(value).collect()
        });
        let sum = |filter: &[f32]| filter.iter().sum::<f32>();
        let sums = [0, 1, 2, 3].map(|i| sum(&sight[i]));
        let both = sums[2].hypot(sums[3]);
        for (filter, sum) in sight.iter_mut().zip([sums[0], sums[1], both, both]) {
            filter.iter_mut().for_each(|w| *w /= sum);
        }
        let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
        let radius = (3.0 * deviation).ceil() as i32;
        let bell = |x: i32| (-((x * x) as f32) / (2.0 * deviation * deviation)).exp();
        let taps = |f: &dyn Fn(i32) -> f32| (-radius..=radius).map(f).collect::<Vec<f32>>();
        let mut gauss = taps(&bell);
        let total = sum(&gauss);
        gauss.iter_mut().for_each(|w| *w /= total);
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|c| hunt(lab(c)));
        Self {
            sight,
            gauss,
            edge: balanced(taps(&|x| -x as f32 * bell(x))),
            point: balanced(taps(&|x| {
                ((x * x) as f32 / (deviation * deviation) - 1.0) * bell(x)
            })),
            farthest: distance(green, blue).powf(COLOR_POWER),
        }
    }
}

/// Positive weights sum to 1, negative ones to -1.
fn balanced(mut weights: Vec<f32>) -> Vec<f32> {
    let part = |sign: f32| weights.iter().map(|w| (w * sign).max(0.0)).sum::<f32>();
    let (above, below) = (part(1.0), part(-1.0));
    for w in &mut weights {
        *w /= if *w > 0.0 { above } else { below };
    }
    weights
}

/// Chroma counts less where it is dark (the Hunt effect).
fn hunt([l, a, b]: [f32; 3]) -> [f32; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// HyAB: city-block in lightness, Euclidean in chroma.
fn distance(p: [f32; 3], q: [f32; 3]) -> f32 {
    (p[0] - q[0]).abs() + hypot(p[1] - q[1], p[2] - q[2])
}

impl Seen {
    /// From linear RGB within 0 to 1, rows of `width`. What lies outside is as the nearest pixel.
    pub fn new(rgb: &[[f32; 3]], width: usize) -> Self {
        let filters = &*FILTERS;
        let opponents: Vec<[f32; 3]> = rgb.iter().map(|&c| opponent(c)).collect();
        let channel = |i: usize| opponents.iter().map(|c| c[i]).collect::<Vec<f32>>();
        let both = |plane: &[f32], across: &[f32], down: &[f32]| {
            columns(&rows(plane, width, across), width, down)
        };
        let [light, red_green, blue_yellow] = [0, 1, 2].map(channel);
        let [sight_l, sight_rg, sight_by, sight_by2] = &filters.sight;
        let blurred = [
            both(&light, sight_l, sight_l),
            both(&red_green, sight_rg, sight_rg),
            both(&blue_yellow, sight_by, sight_by),
            both(&blue_yellow, sight_by2, sight_by2),
        ];
        let color = (0..rgb.len()).map(|i| {
            let [l, rg, by, by2] = [0, 1, 2, 3].map(|c| blurred[c][i]);
            let rgb = rgb_of_opponent([l, rg, by + by2]).map(|c| c.clamp(0.0, 1.0));
            hunt(lab(rgb))
        });
        let grey: Vec<f32> = light.iter().map(|l| (l + 16.0) / 116.0).collect();
        let smooth = rows(&grey, width, &filters.gauss);
        let strength = |derivative: &[f32]| -> Vec<f32> {
            let x = both(&grey, derivative, &filters.gauss);
            let y = columns(&smooth, width, derivative);
            x.iter().zip(&y).map(|(&x, &y)| hypot(x, y)).collect()
        };
        Self {
            color: color.collect(),
            edge: strength(&filters.edge),
            point: strength(&filters.point),
        }
    }

    /// The difference at a pixel, 0 (none) to 1.
    pub fn difference(&self, other: &Self, pixel: usize) -> f32 {
        let farthest = FILTERS.farthest;
        let color = distance(self.color[pixel], other.color[pixel]).powf(COLOR_POWER);
        let knee = KNEE * farthest;
        let color = if color < knee {
            color * KNEE_VALUE / knee
        } else {
            KNEE_VALUE + (color - knee) / (farthest - knee) * (1.0 - KNEE_VALUE)
        };
        let edge = (self.edge[pixel] - other.edge[pixel]).abs();
        let point = (self.point[pixel] - other.point[pixel]).abs();
        let feature = (FRAC_1_SQRT_2 * edge.max(point)).sqrt().min(1.0);
        color.powf(1.0 - feature)
    }
}

/// Filters every row.
pub(super) fn rows(plane: &[f32], width: usize, weights: &[f32]) -> Vec<f32> {
    let radius = weights.len() / 2;
    let mut out = vec![0.0; plane.len()];
    let mut padded = vec![0.0; width + 2 * radius];
    for (row, out) in plane.chunks_exact(width).zip(out.chunks_exact_mut(width)) {
        padded[..radius].fill(row[0]);
        padded[radius..radius + width].copy_from_slice(row);
        padded[radius + width..].fill(row[width - 1]);
        weighted(out, weights, |k| &padded[k..k + width]);
    }
    out
}

/// Filters every column.
pub(super) fn columns(plane: &[f32], width: usize, weights: &[f32]) -> Vec<f32> {
    let (radius, height) = (weights.len() / 2, plane.len() / width);
    let mut out = vec![0.0; plane.len()];
    for (y, out) in out.chunks_exact_mut(width).enumerate() {
        weighted(out, weights, |k| {
            let from = (y + k).saturating_sub(radius).min(height - 1) * width;
            &plane[from..from + width]
        });
    }
    out
}

/// Sums of rows by weight. So many sums at a time stay in registers while all rows pass by.
fn weighted<'a>(out: &mut [f32], weights: &[f32], row: impl Fn(usize) -> &'a [f32]) {
    const WIDE: usize = 16;
    let (wide, rest) = out.as_chunks_mut::<WIDE>();
    let done = wide.len() * WIDE;
    for (i, out) in wide.iter_mut().enumerate() {
        let mut sums = [0.0; WIDE];
        for (k, weight) in weights.iter().enumerate() {
            if let Some(values) = row(k)[i * WIDE..].first_chunk::<WIDE>() {
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum += weight * value;
                }
            }
        }
        *out = sums;
    }
    for (k, weight) in weights.iter().enumerate() {
        for (out, value) in rest.iter_mut().zip(&row(k)[done..]) {
            *out += weight * value;
        }
    }
}

/// Length of the hypotenuse, of numbers whose squares are numbers.
fn hypot(x: f32, y: f32) -> f32 {
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::raster::linear_from_srgb;

    const SIDE: usize = 96;

    /// The mean of NVIDIA's map for two pictures of sRGB bytes.
    fn mean(
        picture: impl Fn(usize, usize) -> [u8; 3],
        other: impl Fn(usize, usize) -> [u8; 3],
    ) -> f32 {
        let seen = |f: &dyn Fn(usize, usize) -> [u8; 3]| {
            let light = |b: u8| linear_from_srgb(f32::from(b) / 255.0);
            let pixels: Vec<[f32; 3]> = (0..SIDE * SIDE)
                .map(|i| f(i % SIDE, i / SIDE).map(light))
                .collect();
            Seen::new(&pixels, SIDE)
        };
        let (a, b) = (seen(&picture), seen(&other));
        (0..SIDE * SIDE).map(|i| a.difference(&b, i)).sum::<f32>() / (SIDE * SIDE) as f32
    }

    fn gradient(x: usize, y: usize) -> [u8; 3] {
        [(x * 2) as u8, (y * 2) as u8, 90]
    }

    /// Discs of a texture, some shifted: edges, points and colours all differ.
    fn leaves(x: usize, y: usize, shift: usize) -> [u8; 3] {
        let (u, v) = ((x + shift) % 17, (y + 2 * shift) % 13);
        let inside = (u as i32 - 8).pow(2) + (v as i32 - 6).pow(2) < 25;
        if inside {
            [60, (90 + 5 * u) as u8, 40]
        } else {
            [188, 188, 188]
        }
    }

    #[test]
    fn agrees_with_nvidias_own() {
        // `flip_evaluator.evaluate(a, b, "LDR")` 1.7 of the same bytes.
        let cases = [
            (mean(gradient, |x, y| gradient(y, x)), 0.638_074_76),
            (
                mean(|x, y| leaves(x, y, 0), |x, y| leaves(x, y, 1)),
                0.304_165_54,
            ),
            (mean(|x, y| leaves(x, y, 0), |_, _| [188; 3]), 0.458_199_23),
            (mean(|_, _| [0, 255, 0], |_, _| [0, 0, 255]), 1.0),
        ];
        for (ours, theirs) in cases {
            assert!((ours - theirs).abs() < 5e-4, "{ours} against {theirs}");
        }
    }

    #[test]
    fn a_picture_does_not_differ_from_itself() {
        assert_eq!(mean(gradient, gradient), 0.0);
    }
}
