//! Multisampling as engines do it: four geometry samples a pixel, one shading.
//!
//! A triangle's edges are smoothed, but its material is read once, in the middle of the pixel, and
//! the alpha test keeps or discards all samples that the triangle hits there. This is what a page
//! with three.js shows by default.

use super::camera::SUBSAMPLES;
use super::coverage::Coverage;
use super::pane::Pane;
use super::row::is_all;
use super::seen::hitting;
use super::{Camera, Mips, Sampling, Scene};

/// The standard places of four samples, in 16ths of a pixel from its corner (Vulkan 1.3, 26.4
/// "Multisampling"; the same in Direct3D and in what OpenGL drivers do).
const PLACES: [(i32, i32); 4] = [(6, 2), (14, 6), (2, 10), (10, 14)];

/// One shading a pixel, from mips by derivative between pixels.
const SHADING: Sampling = Sampling {
    side: 1,
    mips: Mips::Linear,
};

/// A bit for each sample of a pixel.
const ALL: u8 = (1 << PLACES.len()) - 1;

/// For every pixel which of its four samples are hit. What does not change is drawn once, and the
/// rest over copies of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Multisampled {
    width: u32,
    height: u32,
    /// A bit for each sample, rows of pixels from the top.
    hits: Vec<u8>,
}

/// Draws where the scene is, as a client with fourfold multisampling does.
pub fn coverage_multisampled(scene: &Scene, camera: &Camera) -> Coverage {
    let mut pixels = Multisampled::empty(camera);
    pixels.draw(scene, camera);
    pixels.coverage()
}

impl Multisampled {
    /// A picture of nothing.
    pub fn empty(camera: &Camera) -> Self {
        Self {
            width: camera.width,
            height: camera.height,
            hits: vec![0; camera.width as usize * camera.height as usize],
        }
    }

    /// Adds what a scene covers, seen by a camera of the same size.
    pub fn draw(&mut self, scene: &Scene, camera: &Camera) {
        let corners = camera.project(scene.geometry.positions, SHADING.side);
        let (width, height) = (self.width as i32, self.height as i32);
        let hits = &mut self.hits;
        let places = PLACES.map(|(x, y)| [x, y].map(|p| p * SUBSAMPLES / 16));
        let whole = Pane::of([width, height]);
        for shown in hitting(scene, &corners, places) {
            let mut fragment = None;
            shown.triangle.rows(&whole, places, |y, row| {
                let first = (y * width) as usize;
                let [from, to] = row.reach().map(|x| first + x as usize);
                // Inside a crown most pixels are full: edges are not even looked at.
                if is_all::<ALL>(&hits[from..to]) {
                    return;
                }
                let spans = row.spans();
                let inside = |s: &&(i32, i32)| s.0 < s.1;
                let from = spans.iter().filter(inside).map(|s| s.0).min().unwrap_or(0);
                let to = spans.iter().filter(inside).map(|s| s.1).max().unwrap_or(0);
                let row = &mut hits[first + from as usize..first + to as usize];
                for (hit, x) in row.iter_mut().zip(from..).filter(|(hit, _)| **hit != ALL) {
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
    }

    /// Covered area in pixels.
    pub fn area(&self) -> f64 {
        let hit: u64 = self.hits.iter().map(|h| u64::from(h.count_ones())).sum();
        hit as f64 / PLACES.len() as f64
    }

    /// For every pixel the share of its samples that are hit.
    pub fn coverage(&self) -> Coverage {
        let share = |h: &u8| h.count_ones() as f32 / PLACES.len() as f32;
        Coverage {
            width: self.width,
            height: self.height,
            fraction: self.hits.iter().map(share).collect(),
        }
    }
}
