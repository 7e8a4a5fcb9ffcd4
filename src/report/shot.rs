//! One model from one view at one size, ready to be compared: its layers over a neutral ground.

use std::sync::LazyLock;

use super::flip::{Seen, columns, rows};
use super::schema::ViewAppearance;
use super::silhouette::share;
use crate::space::lab::lab;
use crate::space::raster::{Layers, srgb_from_linear};

/// Light of the ground that trees stand before: half of white, darker than sky, lighter than leaves.
pub const GROUND: f32 = 0.5;

/// A pixel whose coverage is at least this has one distance and one normal.
const INTERIOR: f32 = 0.5;

/// Difference of two equal pictures, decibel: as good as it gets.
const EQUAL_DB: f64 = 100.0;

/// [`srgb_from_linear`] in steps of the square root (fine where it is steep), straight between them:
/// off by less than 1e-6.
struct Encoder(Vec<f32>);

static SRGB: LazyLock<Encoder> = LazyLock::new(|| {
    let step = |i: u32| srgb_from_linear((i as f32 / Encoder::STEPS).powi(2));
    // One more than needed: the last step has an end, too.
    Encoder((0..=Encoder::STEPS as u32 + 1).map(step).collect())
});

impl Encoder {
    const STEPS: f32 = 4096.0;

    /// Of light from 0 to 1.
    fn encode(&self, light: f32) -> f32 {
        let at = light.sqrt() * Self::STEPS;
        let (step, part) = (at as usize, at.fract());
        let (low, high) = (self.0[step], self.0[step + 1]);
        low + (high - low) * part
    }
}

/// A drawing with everything that comparisons of it share.
#[derive(Clone, Debug)]
pub struct Shot {
    /// What was drawn.
    pub layers: Layers,
    /// sRGB over the ground, 0 to 1.
    pub srgb: Vec<[f32; 3]>,
    seen: Seen,
    /// Mean grey in the window of each pixel, and mean square.
    grey: Vec<f32>,
    mean: Vec<f32>,
    square: Vec<f32>,
}

impl Shot {
    /// Blends over the ground and filters.
    pub fn new(layers: Layers) -> Self {
        let over = |(color, cover): (&[f32; 3], &f32)| {
            color.map(|c| (c + GROUND * (1.0 - cover)).clamp(0.0, 1.0))
        };
        let light: Vec<[f32; 3]> = layers
            .color
            .iter()
            .zip(&layers.coverage)
            .map(over)
            .collect();
        let ground = [srgb_from_linear(GROUND); 3];
        let srgb: Vec<[f32; 3]> = light
            .iter()
            .map(|&c| match c == [GROUND; 3] {
                true => ground,
                false => c.map(|c| SRGB.encode(c)),
            })
            .collect();
        let grey: Vec<f32> = srgb
            .iter()
            .map(|[r, g, b]| 0.299 * r + 0.587 * g + 0.114 * b)
            .collect();
        let width = layers.width as usize;
        let squares: Vec<f32> = grey.iter().map(|g| g * g).collect();
        Self {
            seen: Seen::new(&light, width),
            mean: window(&grey, width),
            square: window(&squares, width),
            grey,
            srgb,
            layers,
        }
    }

    /// FLIP at a pixel, 0 to 1.
    pub fn flip(&self, other: &Self, pixel: usize) -> f32 {
        self.seen.difference(&other.seen, pixel)
    }

    /// Compares a level (`other`) with its original; `height` is the tree's in units of distance.
    pub fn compare(&self, other: &Self, view: &str, height: f64) -> ViewAppearance {
        let (a, b) = (&self.layers, &other.layers);
        let structure = self.similarity(other);
        let mut sums = Sums::default();
        for (pixel, similar) in structure.into_iter().enumerate() {
            let (ca, cb) = (a.coverage[pixel], b.coverage[pixel]);
            if ca == 0.0 && cb == 0.0 {
                continue;
            }
            sums.touched += 1;
            sums.original += u64::from(ca > 0.0);
            sums.cover[0] += f64::from(ca);
            sums.cover[1] += f64::from(cb);
            sums.common += f64::from(ca.min(cb));
            let (p, q) = (self.srgb[pixel], other.srgb[pixel]);
            let off = [0, 1, 2].map(|c| (p[c] - q[c]).abs());
            let most = off[0].max(off[1]).max(off[2]) * 255.0;
            sums.wrong_8 += u64::from(most > 8.0);
            sums.wrong_32 += u64::from(most > 32.0);
            sums.square += off.iter().map(|d| f64::from(d * d)).sum::<f64>();
            sums.flip += f64::from(self.flip(other, pixel));
            sums.ssim += f64::from(similar);
            if ca >= INTERIOR && cb >= INTERIOR {
                sums.interior += 1;
                sums.depth += f64::from((a.distance[pixel] / ca - b.distance[pixel] / cb).abs());
                let (n, m) = (a.normal[pixel], b.normal[pixel]);
                let cosine = n.normalize_or_zero().dot(m.normalize_or_zero());
                sums.angle += f64::from(cosine.clamp(-1.0, 1.0).acos().to_degrees());
            }
        }
        sums.figures(view, height, color_shift(a, b))
    }

    /// SSIM at every pixel (Wang, Bovik, Sheikh and Simoncelli 2004) of greys from 0 to 1.
    fn similarity(&self, other: &Self) -> Vec<f32> {
        const C1: f32 = 0.01 * 0.01;
        const C2: f32 = 0.03 * 0.03;
        let products: Vec<f32> = self
            .grey
            .iter()
            .zip(&other.grey)
            .map(|(a, b)| a * b)
            .collect();
        let product = window(&products, self.layers.width as usize);
        (0..product.len())
            .map(|i| {
                let (a, b) = (self.mean[i], other.mean[i]);
                let spread = (self.square[i] - a * a) + (other.square[i] - b * b);
                let common = product[i] - a * b;
                ((2.0 * a * b + C1) * (2.0 * common + C2)) / ((a * a + b * b + C1) * (spread + C2))
            })
            .collect()
    }
}

/// Sums over the pixels that either model touches.
#[derive(Default)]
struct Sums {
    touched: u64,
    original: u64,
    cover: [f64; 2],
    common: f64,
    wrong_8: u64,
    wrong_32: u64,
    square: f64,
    flip: f64,
    ssim: f64,
    interior: u64,
    depth: f64,
    angle: f64,
}

impl Sums {
    fn figures(&self, view: &str, height: f64, color_shift_delta_e: f64) -> ViewAppearance {
        let touched = self.touched.max(1) as f64;
        let original = self.original.max(1) as f64;
        let [a, b] = self.cover;
        let error = self.square / (3.0 * touched);
        let inside = |sum: f64| (self.interior > 0).then(|| sum / self.interior as f64);
        ViewAppearance {
            view: view.into(),
            soft_f1: share(2.0 * self.common, a + b),
            soft_precision: share(self.common, b.max(if a > 0.0 { 1e-9 } else { 0.0 })),
            soft_recall: share(self.common, a.max(if b > 0.0 { 1e-9 } else { 0.0 })),
            incorrect_share_8: self.wrong_8 as f64 / original,
            incorrect_share_32: self.wrong_32 as f64 / original,
            // Nothing to see in either: equal.
            ssim: if self.touched == 0 {
                1.0
            } else {
                self.ssim / touched
            },
            psnr_db: (-10.0 * error.max(1e-12).log10()).min(EQUAL_DB),
            flip: self.flip / touched,
            color_shift_delta_e,
            depth_error: inside(self.depth).map(|d| d / height),
            normal_error_deg: inside(self.angle),
        }
    }
}

/// Distance in L*a*b* of the mean colours of what is covered; 0 where either is empty.
fn color_shift(a: &Layers, b: &Layers) -> f64 {
    let mean = |layers: &Layers| {
        let cover: f64 = layers.coverage.iter().map(|&c| f64::from(c)).sum();
        let sum = |channel: usize| {
            layers
                .color
                .iter()
                .map(|c| f64::from(c[channel]))
                .sum::<f64>()
        };
        (cover > 0.0).then(|| lab([0, 1, 2].map(|c| (sum(c) / cover) as f32)))
    };
    match (mean(a), mean(b)) {
        (Some(p), Some(q)) => {
            let square = |i: usize| f64::from(p[i] - q[i]).powi(2);
            (square(0) + square(1) + square(2)).sqrt()
        }
        _ => 0.0,
    }
}

/// Weighted means over the 11 x 11 pixels around each, a Gaussian of 1.5 pixels.
fn window(plane: &[f32], width: usize) -> Vec<f32> {
    let weights: Vec<f32> = (-5i32..=5)
        .map(|x| (-((x * x) as f32) / 4.5).exp())
        .collect();
    let sum: f32 = weights.iter().sum();
    let weights: Vec<f32> = weights.iter().map(|w| w / sum).collect();
    columns(&rows(plane, width, &weights), width, &weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// A row of pixels between empty ones, all of one colour, normal and distance.
    fn shot(cover: &[f32], light: [f32; 3], normal: Vec3, distance: f32) -> Shot {
        let width = cover.len() as u32;
        let coverage = [&vec![0.0; cover.len()][..], cover, &vec![0.0; cover.len()]].concat();
        Shot::new(Layers {
            width,
            height: 3,
            color: coverage.iter().map(|c| light.map(|l| l * c)).collect(),
            normal: coverage.iter().map(|&c| normal * c).collect(),
            distance: coverage.iter().map(|c| distance * c).collect(),
            coverage,
        })
    }

    const GREEN: [f32; 3] = [0.1, 0.3, 0.05];

    #[test]
    fn the_table_encodes_as_the_formula_does() {
        for i in 0..=100_000 {
            let light = i as f32 / 100_000.0;
            let off = (SRGB.encode(light) - srgb_from_linear(light)).abs();
            assert!(off < 1e-6, "{light}: {off}");
        }
    }

    #[test]
    fn a_shot_does_not_differ_from_itself() {
        let a = shot(&[0.0, 1.0, 0.25, 1.0, 0.0], GREEN, Vec3::Y, 3.0);
        let found = a.compare(&a, "here", 2.0);
        assert_eq!(
            (found.soft_f1, found.soft_precision, found.soft_recall),
            (1.0, 1.0, 1.0)
        );
        assert_eq!(
            (found.incorrect_share_8, found.flip, found.psnr_db),
            (0.0, 0.0, 100.0)
        );
        assert!((found.ssim - 1.0).abs() < 1e-6);
        assert_eq!(
            (found.depth_error, found.color_shift_delta_e),
            (Some(0.0), 0.0)
        );
        assert!(found.normal_error_deg.unwrap() < 0.1);
    }

    #[test]
    fn soft_coverage_counts_parts_of_pixels() {
        // Common: 0.25 + 0.5; original 1.5, level 0.75.
        let a = shot(&[0.0, 1.0, 0.5, 0.0], GREEN, Vec3::Y, 0.0);
        let b = shot(&[0.0, 0.25, 0.5, 0.0], GREEN, Vec3::Y, 0.0);
        let found = a.compare(&b, "", 1.0);
        assert!((found.soft_precision - 1.0).abs() < 1e-9);
        assert!((found.soft_recall - 0.5).abs() < 1e-9);
        assert!((found.soft_f1 - 2.0 * 0.75 / 2.25).abs() < 1e-9);
        // One of the two pixels that the original covers is far off: three quarters of its leaf is
        // ground.
        assert_eq!(
            (found.incorrect_share_8, found.incorrect_share_32),
            (0.5, 0.5)
        );
        // The only pixel that both cover by half.
        assert_eq!(found.depth_error, Some(0.0));
    }

    #[test]
    fn errors_inside_are_in_heights_and_degrees_and_colours() {
        let a = shot(&[0.0, 1.0, 1.0, 0.0], GREEN, Vec3::Y, 1.0);
        let b = shot(&[0.0, 1.0, 1.0, 0.0], [0.2, 0.3, 0.05], Vec3::Z, 1.5);
        let found = a.compare(&b, "", 2.0);
        assert!((found.depth_error.unwrap() - 0.25).abs() < 1e-6);
        assert!((found.normal_error_deg.unwrap() - 90.0).abs() < 1e-3);
        assert_eq!(found.soft_f1, 1.0);
        assert_eq!(found.incorrect_share_32, 1.0);
        // Red: sRGB .3493 against .4845; the mean square of three channels.
        let off = f64::from(srgb_from_linear(0.2) - srgb_from_linear(0.1));
        assert!((found.psnr_db + 10.0 * (off * off / 3.0).log10()).abs() < 1e-3);
        let expected = {
            let (p, q) = (lab(GREEN), lab([0.2, 0.3, 0.05]));
            f64::from(
                ((p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2) + (p[2] - q[2]).powi(2)).sqrt(),
            )
        };
        assert!((found.color_shift_delta_e - expected).abs() < 1e-3);
        assert!(found.color_shift_delta_e > 5.0);
    }

    #[test]
    fn an_empty_level_has_no_interior_and_nothing_right() {
        let a = shot(&[0.0, 1.0, 1.0, 0.0], GREEN, Vec3::Y, 1.0);
        let none = shot(&[0.0; 4], GREEN, Vec3::Y, 1.0);
        let found = a.compare(&none, "", 2.0);
        assert_eq!(
            (found.soft_f1, found.soft_precision, found.soft_recall),
            (0.0, 0.0, 0.0)
        );
        assert_eq!((found.incorrect_share_32, found.depth_error), (1.0, None));
        assert!(
            found.flip > 0.2 && found.ssim < 0.9,
            "{} {}",
            found.flip,
            found.ssim
        );
        let nothing = none.compare(&none, "", 2.0);
        assert_eq!(
            (nothing.soft_f1, nothing.ssim, nothing.psnr_db),
            (1.0, 1.0, 100.0)
        );
    }
}
