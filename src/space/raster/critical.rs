//! The threshold at which each pixel stops being covered, for all thresholds in one drawing.
//!
//! Where the alpha of a texture is 1 above a threshold of some score and a constant elsewhere, a
//! pixel is covered as long as the threshold is at most a certain value: that of the last texel
//! which its best fragment needs to pass the alpha test. These values, once known, tell the
//! covered area at any threshold without drawing again.

use super::seen::seen;
use super::triangle::CENTER;
use super::{Camera, Mips, Sampling, Scene};

/// Scores of the base level's texels, and what alpha they lead to.
#[derive(Clone, Copy, Debug)]
pub struct Scores<'a> {
    /// One a texel; minus infinity where alpha is 0 whatever the threshold.
    pub score: &'a [f32],
    /// Alpha where the score reaches the threshold, and elsewhere.
    pub alphas: [u8; 2],
}

/// Half of the range of alpha in the units of texture filtering: the cutoff of 0.5.
const CUTOFF: u32 = 255 * 65_536 / 2;

/// For every pixel that anything can cover the highest threshold at which it is covered, in no
/// order; infinite where opaque triangles do. One sample a pixel of the base level; materials with
/// a cutoff have one of 0.5 and all use one texture, that of the scores.
pub fn critical(scene: &Scene, camera: &Camera, scores: Scores) -> Vec<f32> {
    let sampling = Sampling {
        side: 1,
        mips: Mips::Base,
    };
    let corners = camera.project(scene.geometry.positions, sampling.side);
    let (width, height) = (camera.width as i32, camera.height as i32);
    let mut pixels = vec![f32::NEG_INFINITY; width as usize * height as usize];
    for shown in seen(scene, &corners, CENTER) {
        let mut fragment = None;
        shown.triangle.scan(width, height, |y, from, to| {
            let row = y as usize * width as usize;
            let row = &mut pixels[row + from as usize..row + to as usize];
            if shown.material.cutoff.is_none() {
                return row.fill(f32::INFINITY);
            }
            let fragment = fragment.get_or_insert_with(|| shown.fragment(scene, sampling));
            for (pixel, x) in row.iter_mut().zip(from..) {
                if let Some((texels, weights)) = fragment.texels(x, y) {
                    let found = scores.critical(texels, weights, *pixel);
                    *pixel = pixel.max(found);
                }
            }
        });
    }
    pixels.retain(|&p| p > f32::NEG_INFINITY);
    pixels
}

impl Scores<'_> {
    /// The highest threshold at which four texels pass the test, if it is above `known`.
    fn critical(&self, texels: [usize; 4], weights: [u32; 4], known: f32) -> f32 {
        let mut four: [(f32, u32); 4] =
            std::array::from_fn(|i| (self.score[texels[i]], weights[i]));
        if four.iter().all(|f| f.0 <= known) {
            return known;
        }
        let [opaque, other] = self.alphas.map(u32::from);
        four.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        let kept = four.iter().filter(|f| f.0 > f32::NEG_INFINITY);
        let mut sum: u32 = kept.clone().map(|f| f.1 * other).sum();
        for (score, weight) in kept {
            sum += weight * (opaque - other);
            if sum >= CUTOFF {
                return *score;
            }
        }
        f32::NEG_INFINITY
    }
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
                let sampling = Sampling {
                    side: 1,
                    mips: Mips::Base,
                };
                let scores = Scores {
                    score: &score,
                    alphas,
                };
                (
                    coverage(&scene, &camera, sampling).area(),
                    critical(&scene, &camera, scores),
                )
            };
            let mut seen = Vec::new();
            for threshold in [-1.0, 0.2, 0.45, 0.5, 0.61, 0.9, 1.1] {
                let alpha = |i: u32| match score[i as usize] >= threshold {
                    _ if outside(i) => 0,
                    true => alphas[0],
                    false => alphas[1],
                };
                let (area, critical) = draw((0..size * size).map(alpha).collect());
                let counted = critical.iter().filter(|&&c| c >= threshold).count();
                assert_eq!(area, counted as f64, "{alphas:?} at {threshold}");
                seen.push(counted);
            }
            assert!(
                seen[0] > 3000 && seen[6] == 0 && seen[2] < seen[1],
                "{seen:?}"
            );
        }
    }
}
