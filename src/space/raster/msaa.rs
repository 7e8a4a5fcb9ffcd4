//! Multisampling as engines do it: four geometry samples a pixel, one shading.
//!
//! A triangle's edges are smoothed, but its material is read once, in the middle of the pixel, and
//! the alpha test keeps or discards all samples that the triangle hits there. This is what a page
//! with three.js shows by default.

use super::camera::SUBSAMPLES;
use super::coverage::Coverage;
use super::seen::seen;
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
    let places = PLACES.map(|(x, y)| [x, y].map(|p| p * SUBSAMPLES / 16));
    for shown in seen(scene, &corners, places) {
        let mut fragment = None;
        shown
            .triangle
            .scan_places(width, height, places, |y, spans| {
                let inside = |s: &&(i32, i32)| s.0 < s.1;
                let from = spans.iter().filter(inside).map(|s| s.0).min().unwrap_or(0);
                let to = spans.iter().filter(inside).map(|s| s.1).max().unwrap_or(0);
                for x in from..to {
                    let hit = &mut hits[(y * width + x) as usize];
                    let mut here = 0u8;
                    for (bit, span) in spans.iter().enumerate() {
                        here |= u8::from(span.0 <= x && x < span.1) << bit;
                    }
                    // One shading a pixel, as a client does: all its samples share the answer.
                    let seen = here & !*hit != 0
                        && (shown.material.cutoff.is_none()
                            || fragment
                                .get_or_insert_with(|| shown.fragment(scene, SHADING))
                                .passes(x, y));
                    if seen {
                        *hit |= here;
                    }
                }
            });
    }
    Coverage {
        width: camera.width,
        height: camera.height,
        fraction: hits.iter().map(|h| h.count_ones() as f32 / 4.0).collect(),
    }
}
