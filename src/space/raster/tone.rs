//! The mean base colour of what is seen, without light.

use std::iter::Sum;

use rayon::prelude::*;

use super::front::Front;
use super::pane::Panes;
use super::shade::Light;
use super::shader::Shader;
use super::{Camera, Sampling, Scene};

/// Sums over pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tone {
    /// Linear RGB of the base colour.
    pub light: [f64; 3],
    /// Pixels that are covered.
    pub covered: f64,
}

impl Tone {
    /// Adds what is seen elsewhere.
    pub fn add(&mut self, other: &Self) {
        for (sum, value) in self.light.iter_mut().zip(other.light) {
            *sum += value;
        }
        self.covered += other.covered;
    }

    /// Linear RGB of what is covered; `None`: nothing is.
    pub fn mean(&self) -> Option<[f64; 3]> {
        (self.covered > 0.0).then(|| self.light.map(|c| c / self.covered))
    }
}

impl Sum for Tone {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        let mut out = Self::default();
        all.for_each(|tone| out.add(&tone));
        out
    }
}

/// What a camera sees of each triangle of a scene that it sees, in the order of triangles; of 4 x 4 samples a pixel at
/// most.
fn tones(scene: &Scene, camera: &Camera, sampling: Sampling) -> Vec<(u32, Tone)> {
    let corners = camera.project(scene.geometry.positions, sampling.side);
    let side = sampling.side as i32;
    let size = [camera.width as i32 * side, camera.height as i32 * side];
    let pixels = 1.0 / f64::from(sampling.side * sampling.side);
    let mut shader = Shader::new(scene, &corners, sampling, Light::Unlit, &[]);
    let mut front = Front::default();
    let mut out: Vec<(u32, Tone)> = Vec::new();
    for (pane, ids) in Panes::new(scene, &corners, size, side).each() {
        front.draw(scene, &corners, sampling, &pane, ids);
        let mut sums = vec![Tone::default(); ids.len()];
        shader.shade(&front, &pane, ids, |_, seen| {
            let share = f64::from(seen.samples) * pixels;
            sums[seen.item as usize].add(&Tone {
                light: seen.light.map(|c| f64::from(c) * share),
                covered: share,
            });
        });
        let seen = ids.iter().copied().zip(sums);
        out.extend(seen.filter(|(_, tone)| tone.covered > 0.0));
    }
    // A triangle may lie in several panes.
    out.sort_by_key(|&(triangle, _)| triangle);
    out.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1.add(&next.1);
        }
        same
    });
    out
}

/// Visits what each camera sees of each triangle that it sees, camera after camera.
pub fn each_tone(
    scene: &Scene,
    cameras: &[Camera],
    sampling: Sampling,
    mut visit: impl FnMut(u32, &Tone),
) {
    // A few cameras at a time: what they see waits, and of a large tree that is megabytes each.
    let at_a_time = 2 * rayon::current_num_threads();
    for some in cameras.chunks(at_a_time) {
        let seen = some.par_iter().map(|camera| tones(scene, camera, sampling));
        let seen: Vec<Vec<(u32, Tone)>> = seen.collect();
        for (triangle, tone) in seen.iter().flatten() {
            visit(*triangle, tone);
        }
    }
}

/// What a camera sees of a scene.
pub fn tone(scene: &Scene, camera: &Camera, sampling: Sampling) -> Tone {
    tones(scene, camera, sampling)
        .into_iter()
        .map(|(_, tone)| tone)
        .sum()
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::space::raster::{Geometry, Material, layers};

    /// A rectangle facing +z.
    fn rectangle([left, bottom, right, top]: [f32; 4], z: f32) -> [Vec3; 4] {
        [(left, bottom), (right, bottom), (right, top), (left, top)]
            .map(|(x, y)| Vec3::new(x, y, z))
    }

    #[test]
    fn every_triangle_has_the_pixels_in_which_it_is_seen() {
        // A red square of 16 x 16 pixels, and a grey one of 8 x 8 before its upper left quarter.
        let positions = [
            rectangle([-8.0, -8.0, 8.0, 8.0], 0.0),
            rectangle([-8.0, 0.0, 0.0, 8.0], 1.0),
        ];
        let positions = positions.as_flattened();
        let material = |factor| Material {
            factor,
            ..Material::default()
        };
        let materials = [
            material([0.5, 0.0, 0.0, 1.0]),
            material([0.25, 0.25, 0.25, 1.0]),
        ];
        let scene = Scene {
            geometry: Geometry {
                positions,
                normals: &[],
                uvs: [&[], &[]],
                colors: &[],
                triangles: &[[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
                triangle_material: &[0, 0, 1, 1],
            },
            materials: &materials,
            textures: &[],
        };
        let camera = Camera::orthographic(Vec3::NEG_Z, Vec3::Y, Vec3::ZERO, 1.0, 40, 40);
        for side in [1, 2, 4] {
            let sampling = Sampling {
                side,
                ..Sampling::CLIENT
            };
            let seen = tones(&scene, &camera, sampling);
            let triangles: Vec<u32> = seen.iter().map(|&(triangle, _)| triangle).collect();
            assert_eq!(triangles, [0, 1, 2, 3]);
            let pixels =
                |triangles: [usize; 2]| triangles.map(|t| seen[t].1.covered).iter().sum::<f64>();
            assert_eq!([pixels([0, 1]), pixels([2, 3])], [192.0, 64.0]);
            let all = tone(&scene, &camera, sampling);
            assert_eq!((all.light, all.covered), ([112.0, 16.0, 16.0], 256.0));
            assert_eq!(all.mean(), Some([0.4375, 0.0625, 0.0625]));
            let (_, drawn) = layers(&scene, &camera, sampling, Light::Unlit, &[]);
            let red: f32 = drawn.color.iter().map(|c| c[0]).sum();
            assert_eq!(f64::from(red), all.light[0]);
        }
        assert_eq!(Tone::default().mean(), None);
    }
}
