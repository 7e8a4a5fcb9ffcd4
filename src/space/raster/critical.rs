//! The threshold at which each pixel stops being covered, for all thresholds in one drawing.
//!
//! Where the alpha of a texture is 1 above a threshold of some score and a constant elsewhere, a
//! pixel is covered as long as the threshold is at most a certain value: that of the last texel
//! which its best fragment needs to pass the alpha test. These values, once known, tell the
//! covered area at any threshold without drawing again.
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

/// Scores of the base level's texels, with the highest one of each block of them.
#[derive(Clone, Debug)]
pub struct ScorePage {
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
    /// Alpha where the score reaches the threshold, and elsewhere.
    pub alphas: [u8; 2],
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

/// Half of the range of alpha in the units of texture filtering: the cutoff of 0.5.
const CUTOFF: u32 = 255 * 65_536 / 2;

const SAMPLING: Sampling = Sampling {
    side: 1,
    mips: Mips::Base,
};

/// For every pixel that anything can cover the highest threshold at which it is covered, beside what
/// `covered` covers (the mask of opaque triangles from the same camera, an orthographic one). One
/// sample a pixel of the base level; materials with a cutoff have one of 0.5 and all use one texture, that of the scores.
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
            score,
            highest,
            across,
        }
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
    fn critical(&self, texels: [usize; 4], weights: [u32; 4], known: f32) -> f32 {
        let score = &self.page.score;
        let four: [f32; 4] = texels.map(|t| score[t]);
        if four.iter().all(|&s| s <= known) {
            return known;
        }
        let [opaque, other] = self.alphas.map(u32::from);
        let kept = |i: usize| u32::from(four[i] > f32::NEG_INFINITY) * weights[i];
        let least: u32 = (0..4).map(kept).sum::<u32>() * other;
        let mut found = known;
        // Each score in turn is tried as the threshold: four are too few to sort.
        for &threshold in four.iter().filter(|&&s| s > known) {
            let passes = |i: usize| u32::from(four[i] >= threshold) * weights[i];
            let sum = least + (0..4).map(passes).sum::<u32>() * (opaque - other);
            if sum >= CUTOFF && threshold > found {
                found = threshold;
            }
        }
        found
    }
}

/// Weights of four texels, of 65,536, for a place within the first one in 256ths.
#[inline]
fn weights([right, below]: [u32; 2]) -> [u32; 4] {
    let (left, above) = (256 - right, 256 - below);
    [left * above, right * above, left * below, right * below]
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
        for alphas in [[255, 0], [255, 90], [150, 0]] {
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
                        alphas,
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
                    true => alphas[0],
                    false => alphas[1],
                };
                let (area, critical, some) = draw((0..size * size).map(alpha).collect());
                let count = |of: &[f32]| of.iter().filter(|&&c| c >= threshold).count();
                let counted = count(&critical);
                assert_eq!(area, counted as f64, "{alphas:?} at {threshold}");
                if (0.3..0.7).contains(&threshold) {
                    let again = some.above + count(&some.within);
                    assert_eq!(again, counted, "{alphas:?} at {threshold}");
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
