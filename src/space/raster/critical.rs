//! The threshold at which each pixel stops being covered, for all thresholds in one drawing.
//!
//! Where the alpha of a texture rises evenly with how much some score is above a threshold, a pixel is
//! covered as long as the threshold is at most a certain value: that at which its best fragment just
//! passes the alpha test. These values, once known, tell the covered area at any threshold without
//! drawing again.
//!
//! Who knows about where the threshold is asks for a range: pixels above it are as good as opaque,
//! texels below it as good as holes, and most fragments are passed over.

use super::bits::BitTiles;
use super::blocks::BLOCK;
use super::edges::{Edges, Reached, TILE, each_tile};
use super::patch::Patch;
use super::seen::{may_reach, seen};
use super::triangle::CENTER;
use super::{Camera, Mask, Mips, Sampling, Scene};

/// Scores of a page's texels, with the highest one of each block of them.
#[derive(Clone, Debug)]
pub struct ScorePage {
    size: [usize; 2],
    score: Vec<f32>,
    /// Of the block's texels and one more to the right and below: what its samples mix.
    highest: Vec<f32>,
    across: usize,
}

/// What alpha scores lead to, and which thresholds matter.
#[derive(Clone, Copy, Debug)]
pub struct Scores<'a> {
    /// The texels' scores.
    pub page: &'a ScorePage,
    /// So much above the threshold alpha is full, so much below it there is none, and it is even between.
    pub reach: f32,
    /// Thresholds between these are told apart.
    pub range: [f32; 2],
}

/// The pixels that some threshold covers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Critical {
    /// How many are covered at the upper end of the range.
    pub above: usize,
    /// For each other one that a threshold within the range covers the highest that does, in no order.
    pub within: Vec<f32>,
}

/// Steps towards the threshold at which a sample just passes: each is at least as good as halving what is left.
const STEPS: usize = 8;

/// Thresholds are told apart by less than this.
const CLOSE: f32 = 1e-3;

/// What is as near to passing as this passes: sums are rounded.
const ROUNDING: f32 = 1e-5;

const SAMPLING: Sampling = Sampling {
    side: 1,
    mips: Mips::Base,
};

/// For every pixel that anything can cover the highest threshold at which it is covered, beside what
/// `covered` covers (the mask of opaque triangles from the same camera, an orthographic one). One
/// sample a pixel of the base level; materials with a cutoff have one of 0.5 and all use one texture, as large as the page of scores.
pub fn critical(scene: &Scene, camera: &Camera, covered: &Mask, scores: Scores) -> Critical {
    let [floor, ceiling] = scores.range;
    let corners = camera.project(scene.geometry.positions, SAMPLING.side);
    let size = [camera.width, camera.height].map(|s| s as i32);
    // Pixels above the range, whatever else covers them.
    let mut settled = BitTiles::new(&covered.samples, size);
    let mut pixels = vec![[f32::NEG_INFINITY; 64]; settled.count()];
    let whole = settled.whole();
    for id in 0..scene.geometry.triangles.len() as u32 {
        let Some(reached) = may_reach(scene, &corners, id, &whole, CENTER) else {
            continue;
        };
        let Some(shown) = seen(scene, &corners, id) else {
            continue;
        };
        let (mut edges, mut fragment) = (None, None);
        each_tile(reached, TILE, |Reached { tile, ys, .. }| {
            let number = settled.number(tile);
            let settled = settled.at(tile);
            // Inside a crown most pixels are settled: edges are not even looked at.
            if *settled == !0 {
                return;
            }
            let first = tile.map(|t| t * TILE);
            let edges = edges.get_or_insert_with(|| Edges::new(&shown.triangle, CENTER));
            let open = edges.samples(first, ys) & !*settled;
            if open == 0 {
                return;
            }
            if shown.material.cutoff.is_none() {
                *settled |= open;
                return;
            }
            let fragment = fragment.get_or_insert_with(|| shown.fragment(scene, SAMPLING));
            if let Some(patch) = fragment.patch(first) {
                *settled |= scores.raise(&patch, open, &mut pixels[number]);
            }
        });
    }
    let within = pixels.into_iter().flatten();
    Critical {
        above: settled.hits() as usize,
        within: within.filter(|&p| p > floor && p < ceiling).collect(),
    }
}

impl ScorePage {
    /// One score a texel, rows from the top; minus infinity where alpha is 0 whatever the threshold.
    pub fn new(width: u32, height: u32, score: Vec<f32>) -> Self {
        let (width, height) = (width as usize, height as usize);
        let block = BLOCK as usize;
        let across = width.div_ceil(block);
        let mut highest = vec![f32::NEG_INFINITY; across * height.div_ceil(block)];
        let mut of_row = vec![f32::NEG_INFINITY; across];
        for (y, row) in score.chunks_exact(width.max(1)).enumerate() {
            for (x, of_block) in of_row.iter_mut().enumerate() {
                let end = ((x + 1) * block + 1).min(width);
                let texels = &row[x * block..end];
                *of_block = texels.iter().fold(f32::NEG_INFINITY, |m, &s| m.max(s));
            }
            // The first row of a block is read together with the block above, too.
            let above = (y % block == 0)
                .then(|| (y / block).checked_sub(1))
                .flatten();
            for blocks in [Some(y / block), above].into_iter().flatten() {
                let blocks = &mut highest[blocks * across..][..across];
                blocks
                    .iter_mut()
                    .zip(&of_row)
                    .for_each(|(h, &s)| *h = h.max(s));
            }
        }
        Self {
            size: [width, height],
            score,
            highest,
            across,
        }
    }

    /// Width and height in texels.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// The score of a texel.
    #[inline]
    pub fn score(&self, [x, y]: [usize; 2]) -> f32 {
        self.score[y * self.size[0] + x]
    }

    /// The texels' scores, rows from the top.
    pub fn scores(&self) -> &[f32] {
        &self.score
    }

    /// The highest score that a sample may mix which lies in this texel's block.
    #[inline]
    fn highest(&self, [x, y]: [i32; 2]) -> f32 {
        self.highest[(y / BLOCK) as usize * self.across + (x / BLOCK) as usize]
    }
}

impl Scores<'_> {
    /// Raises the `open` pixels of a tile to the highest threshold at which these texels cover them;
    /// gives back those that are above the range now.
    #[inline]
    fn raise(&self, patch: &Patch, open: u64, pixels: &mut [f32; 64]) -> u64 {
        let [floor, ceiling] = self.range;
        let mut above = 0;
        patch.each(open, |sample, texel, part| {
            let pixel = &mut pixels[sample as usize];
            let known = pixel.max(floor);
            if patch.level.holds(texel) && self.page.highest(texel) <= known {
                return;
            }
            let four = patch.level.neighbours(texel, patch.address);
            *pixel = pixel.max(self.critical(four, weights(part), known));
            above |= u64::from(*pixel >= ceiling) << sample;
        });
        above
    }

    /// The highest threshold at which four texels pass the test, if it is above `known`.
    #[inline]
    fn critical(&self, texels: [usize; 4], weights: [f32; 4], known: f32) -> f32 {
        let four: [f32; 4] = texels.map(|t| self.page.score[t]);
        let highest = four.iter().fold(f32::NEG_INFINITY, |m, &s| m.max(s));
        if highest <= known {
            return known;
        }
        // Their alpha at a threshold, over the cutoff: it falls as thresholds rise.
        let reach = self.reach;
        let over = |threshold: f32| {
            let of = |i: usize| weights[i] * (four[i] - threshold).clamp(-reach, reach);
            of(0) + of(1) + of(2) + of(3)
        };
        // Below this all are full, but those that never are.
        let lowest = four.iter().filter(|s| s.is_finite());
        let lowest = lowest.fold(highest, |m, &s| m.min(s)) - reach;
        let (mut low, mut high) = (known.max(lowest), highest);
        let mut at_low = over(low);
        if at_low < 0.0 {
            return known;
        }
        let mut at_high = over(high);
        for _ in 0..STEPS {
            if high - low < CLOSE || at_high >= -ROUNDING {
                break;
            }
            // Where a line through both ends is 0, and then the middle of what is left.
            let line = low + (high - low) * at_low / (at_low - at_high);
            for threshold in [line, 0.5 * (low + high)] {
                if threshold <= low || threshold >= high {
                    continue;
                }
                match over(threshold) {
                    passes if passes >= -ROUNDING => (low, at_low) = (threshold, passes),
                    fails => (high, at_high) = (threshold, fails),
                }
            }
        }
        match at_high >= -ROUNDING {
            true => high,
            false => low,
        }
    }
}

/// Weights of four texels, for a place within the first one in 256ths.
#[inline]
fn weights([right, below]: [u32; 2]) -> [f32; 4] {
    let (left, above) = (256 - right, 256 - below);
    [left * above, right * above, left * below, right * below].map(|w| w as f32 / 65_536.0)
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::space::raster::{Geometry, Material, Texture, coverage};

    #[test]
    fn counting_critical_values_is_drawing_at_every_threshold() {
        let size = 64u32;
        let noise = |i: u32| ((i.wrapping_mul(2_654_435_761) >> 8) % 1000) as f32 / 1000.0;
        let outside = |i: u32| i % size < 5;
        let score: Vec<f32> = (0..size * size)
            .map(|i| match outside(i) {
                true => f32::NEG_INFINITY,
                false => 0.7 * noise(i / 3) + 0.3 * noise(i),
            })
            .collect();
        let page = ScorePage::new(size, size, score.clone());
        let corner = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        let positions = [
            corner(-1.0, -1.0, 0.0),
            corner(1.0, -0.9, 0.2),
            corner(0.8, 1.0, 0.0),
            corner(-0.7, 0.2, 0.3),
            corner(0.9, -0.5, -0.3),
            corner(-0.2, 0.9, 0.1),
        ];
        let uvs = [
            Vec2::new(0.0, 1.0),
            Vec2::new(1.0, 1.0),
            Vec2::new(1.0, 0.0),
            Vec2::new(0.1, 0.3),
            Vec2::new(0.9, 0.8),
            Vec2::new(0.4, 0.0),
        ];
        let material = Material {
            texture: Some(0),
            cutoff: Some(0.5),
            double_sided: true,
            ..Material::default()
        };
        let camera = Camera::orthographic(Vec3::NEG_Z, Vec3::Y, Vec3::ZERO, 50.0, 110, 110);
        for reach in [0.05, 0.3, 2.0] {
            let alpha =
                |above: f32| (127.5 + 127.5 * (above / reach).clamp(-1.0, 1.0)).round() as u8;
            let draw = |alpha: Vec<u8>| {
                let textures = [Texture::from_alpha(size, size, alpha)];
                let scene = Scene {
                    geometry: Geometry {
                        positions: &positions,
                        normals: &[],
                        uvs: [&uvs, &[]],
                        colors: &[],
                        triangles: &[[0, 1, 2], [3, 4, 5]],
                        triangle_material: &[],
                    },
                    materials: &[material],
                    textures: &textures,
                };
                let nothing = Mask {
                    width: camera.width,
                    height: camera.height,
                    side: 1,
                    samples: vec![0; 110 * 110],
                };
                let in_range = |range| {
                    let scores = Scores {
                        page: &page,
                        reach,
                        range,
                    };
                    critical(&scene, &camera, &nothing, scores)
                };
                (
                    coverage(&scene, &camera, SAMPLING).area(),
                    in_range([f32::NEG_INFINITY, f32::INFINITY]).within,
                    in_range([0.3, 0.7]),
                )
            };
            let mut seen = Vec::new();
            for threshold in [-1.0, 0.2, 0.45, 0.5, 0.61, 0.9, 1.1] {
                let alpha = |i: u32| match score[i as usize] >= threshold {
                    _ if outside(i) => 0,
                    true => alpha(score[i as usize] - threshold).max(128),
                    false => alpha(score[i as usize] - threshold).min(127),
                };
                let (area, critical, some) = draw((0..size * size).map(alpha).collect());
                let count = |of: &[f32]| of.iter().filter(|&&c| c >= threshold).count();
                let counted = count(&critical);
                // Alpha has whole steps.
                let close = area * 0.02 + 8.0;
                assert!(
                    (area - counted as f64).abs() < close,
                    "{reach} at {threshold}: {area} {counted}"
                );
                if (0.3..0.7).contains(&threshold) {
                    let again = some.above + count(&some.within);
                    assert!(
                        again.abs_diff(counted) < 3,
                        "{reach} at {threshold}: {again} {counted}"
                    );
                }
                seen.push(counted);
            }
            assert!(
                seen[0] > 3000 && seen[6] == 0 && seen[2] < seen[1],
                "{seen:?}"
            );
        }
    }
}
