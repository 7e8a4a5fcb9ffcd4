//! Multisampling as engines do it: four geometry samples a pixel, one shading.
//!
//! A triangle's edges are smoothed, but its material is read once, in the middle of the pixel, and
//! the alpha test keeps or discards all samples that the triangle hits there. This is what a page
//! with three.js shows by default.

use super::camera::SUBSAMPLES;
use super::coverage::Coverage;
use super::edges::{Edges, PIXELS, Reached, each_tile, only_tile};
use super::pane::Pane;
use super::seen::{Seen, may_reach, seen};
use super::{Camera, Mips, Sampling, Scene};

/// The standard places of four samples, in 16ths of a pixel from its corner (Vulkan 1.3, 26.4
/// "Multisampling"; the same in Direct3D and in what OpenGL drivers do).
const PLACES: [(i32, i32); 4] = [(6, 2), (14, 6), (2, 10), (10, 14)];

/// One shading a pixel, from mips by derivative between pixels.
const SHADING: Sampling = Sampling {
    side: 1,
    mips: Mips::Linear,
};

/// The samples of a pixel.
const PIXEL: u64 = 0xf;

/// For every pixel which of its four samples are hit. What does not change is drawn once, and the
/// rest over copies of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Multisampled {
    width: u32,
    height: u32,
    /// Tiles of 4 x 4 pixels, rows from the top: bit `16 y + 4 x + place` each. Beyond the picture
    /// everything counts as hit, so that a tile that is full inside is full.
    tiles: Vec<u64>,
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
        let Camera { width, height, .. } = *camera;
        let [across, down] = [width, height].map(|s| s.div_ceil(PIXELS as u32));
        let outside = |tile: u32| {
            let first = [tile % across, tile / across].map(|t| t * PIXELS as u32);
            pixels_of_tile(first, [width, height]).fold(!0, |hit, (_, at)| hit & !(PIXEL << at))
        };
        Self {
            width,
            height,
            tiles: (0..across * down).map(outside).collect(),
        }
    }

    /// Adds what a scene covers, seen by a camera of the same size.
    pub fn draw(&mut self, scene: &Scene, camera: &Camera) {
        let corners = camera.project(scene.geometry.positions, SHADING.side);
        let places = PLACES.map(|(x, y)| [x, y].map(|p| p * SUBSAMPLES / 16));
        let whole = Pane::of([self.width, self.height].map(|s| s as i32));
        for id in 0..scene.geometry.triangles.len() as u32 {
            let Some(reached) = may_reach(scene, &corners, id, &whole, places) else {
                continue;
            };
            // Most triangles of a crown lie within one tile, and that is full.
            if only_tile(reached, PIXELS).is_some_and(|tile| self.tiles[self.number(tile)] == !0) {
                continue;
            }
            if let Some(shown) = seen(scene, &corners, id) {
                self.add(&shown, reached, scene, places);
            }
        }
    }

    /// The place of a tile among all.
    fn number(&self, [x, y]: [i32; 2]) -> usize {
        y as usize * self.width.div_ceil(PIXELS as u32) as usize + x as usize
    }

    #[inline]
    fn add(&mut self, shown: &Seen, reached: [[i32; 2]; 2], scene: &Scene, places: [[i32; 2]; 4]) {
        let (mut edges, mut fragment) = (None, None);
        each_tile(reached, PIXELS, |Reached { tile, xs, ys }| {
            let first = tile.map(|t| t * PIXELS);
            let number = self.number(tile);
            let hits = &mut self.tiles[number];
            // Inside a crown most tiles are full: edges are not even looked at.
            if *hits == !0 {
                return;
            }
            let edges = edges.get_or_insert_with(|| Edges::new(&shown.triangle, places));
            let mut open = edges.pixels(first, xs, ys) & !*hits;
            if shown.material.cutoff.is_none() {
                *hits |= open;
                return;
            }
            // One shading a pixel, as a client does: all its samples share the answer.
            while open != 0 {
                let pixel = open.trailing_zeros() as i32 / 4;
                let samples = open & PIXEL << (4 * pixel);
                open &= !samples;
                let [x, y] = [first[0] + pixel % PIXELS, first[1] + pixel / PIXELS];
                let fragment = fragment.get_or_insert_with(|| shown.fragment(scene, SHADING));
                if fragment.passes(x, y) {
                    *hits |= samples;
                }
            }
        });
    }

    /// Covered area in pixels.
    pub fn area(&self) -> f64 {
        let hit: u64 = self.tiles.iter().map(|t| u64::from(t.count_ones())).sum();
        let side = PIXELS as u32;
        let all =
            self.width.next_multiple_of(side) as u64 * self.height.next_multiple_of(side) as u64;
        let outside = all - self.width as u64 * self.height as u64;
        hit as f64 / PLACES.len() as f64 - outside as f64
    }

    /// For every pixel the share of its samples that are hit.
    pub fn coverage(&self) -> Coverage {
        let size = [self.width, self.height];
        let across = self.width.div_ceil(PIXELS as u32);
        let mut fraction = vec![0.0; self.width as usize * self.height as usize];
        for (number, tile) in (0..).zip(&self.tiles) {
            let first = [number % across, number / across].map(|t| t * PIXELS as u32);
            for (pixel, at) in pixels_of_tile(first, size) {
                fraction[pixel] = (tile >> at & PIXEL).count_ones() as f32 / PLACES.len() as f32;
            }
        }
        Coverage {
            width: self.width,
            height: self.height,
            fraction,
        }
    }
}

/// The pixels of a picture of this size that lie in the tile which begins at one, each with the
/// place of its first bit.
fn pixels_of_tile(
    [x, y]: [u32; 2],
    [width, height]: [u32; 2],
) -> impl Iterator<Item = (usize, u32)> {
    let side = PIXELS as u32;
    let rows = (0..side).take_while(move |down| y + down < height);
    rows.flat_map(move |down| {
        let columns = (0..side).take_while(move |right| x + right < width);
        columns.map(move |right| {
            let pixel = (y + down) as usize * width as usize + (x + right) as usize;
            (pixel, 4 * (side * down + right))
        })
    })
}
