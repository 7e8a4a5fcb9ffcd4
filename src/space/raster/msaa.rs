//! Multisampling as engines do it: four geometry samples a pixel, one shading.
//!
//! A triangle's edges are smoothed, but its material is read once, in the middle of the pixel, and
//! the alpha test keeps or discards all samples that the triangle hits there. This is what a page
//! with three.js shows by default.

use super::camera::{Corner, SUBSAMPLES};
use super::coverage::Coverage;
use super::fragment::Fragment;
use super::triangle::Triangle;
use super::{Camera, Mips, Sampling, Scene};

/// The standard places of four samples, in 16ths of a pixel from its corner (Vulkan 1.3, 26.4
/// "Multisampling"; the same in Direct3D and in what OpenGL drivers do).
const PLACES: [(i32, i32); 4] = [(6, 2), (14, 6), (2, 10), (10, 14)];

/// One shading a pixel, from mips by derivative between pixels.
const SHADING: Sampling = Sampling {
    side: 1,
    mips: Mips::Linear,
};

/// Draws where the scene is, as a client with fourfold multisampling does.
pub fn coverage_multisampled(scene: &Scene, camera: &Camera) -> Coverage {
    let corners = camera.project(scene.geometry.positions, SHADING.side);
    let (width, height) = (camera.width as i32, camera.height as i32);
    let mut hits = vec![0u8; width as usize * height as usize];
    // The last triangle that was shaded at a pixel, and how its alpha test went.
    let mut shaded = vec![0u32; hits.len()];
    for (id, indices) in scene.geometry.triangles.iter().enumerate() {
        let material = scene.material(id);
        let at: [Corner; 3] = indices.map(|i| corners[i as usize]);
        let Some(triangle) = Triangle::new(at, material.double_sided) else {
            continue;
        };
        let mut fragment = None;
        let (failed, passed) = (2 * id as u32 + 1, 2 * id as u32 + 2);
        for (bit, (x, y)) in PLACES.into_iter().enumerate() {
            // The scan asks at pixel centres: the triangle moves instead of the sample.
            let grain = SUBSAMPLES / 16;
            let moved = triangle.moved((8 - x) * grain, (8 - y) * grain);
            moved.scan(width, height, |y, from, to| {
                for x in from..to {
                    let hit = &mut hits[(y * width + x) as usize];
                    if *hit & 1 << bit != 0 {
                        continue;
                    }
                    let shaded = &mut shaded[(y * width + x) as usize];
                    // One shading a pixel, as a client does: the other samples ask for its answer.
                    if material.cutoff.is_some() && *shaded != failed && *shaded != passed {
                        let fragment = fragment.get_or_insert_with(|| {
                            Fragment::new(scene, material, indices, &at, &triangle, SHADING)
                        });
                        *shaded = if fragment.passes(x, y) {
                            passed
                        } else {
                            failed
                        };
                    }
                    let seen = material.cutoff.is_none() || *shaded == passed;
                    *hit |= (seen as u8) << bit;
                }
            });
        }
    }
    Coverage {
        width: camera.width,
        height: camera.height,
        fraction: hits.iter().map(|h| h.count_ones() as f32 / 4.0).collect(),
    }
}
