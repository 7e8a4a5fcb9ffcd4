//! What is hidden already, by tiles of samples.
//!
//! Most triangles of a crown lie behind others. Once a tile of the picture is full up to some
//! nearness, everything farther is passed over after a look at its corners (a hierarchical z-buffer:
//! Greene, Kass and Miller, SIGGRAPH 1993, of one level). The picture is the same with and without.

use std::ops::Range;

use super::pane::Pane;
use super::triangle::{Plane, Triangle};

/// Edge of a tile in samples, as a power of two.
const SHIFT: i32 = 3;
/// Edge of a tile in samples.
const SIDE: i32 = 1 << SHIFT;
/// A tile is looked at again after so many triangles.
const PATIENCE: u16 = 8;
/// Over more tiles than this, along either axis, a triangle's nearness is asked tile by tile.
const FEW_TILES: i32 = 2;

/// Tiles of a pane.
#[derive(Default)]
pub(super) struct Tiles {
    /// The pane's first column and row.
    origin: [i32; 2],
    across: usize,
    width: usize,
    height: usize,
    /// Nearness that all samples of the tile have at least.
    bound: Vec<f32>,
    /// Triangles since it was looked at.
    since: Vec<u16>,
}

impl Tiles {
    /// Of an empty picture.
    pub fn new(whole: &Pane) -> Self {
        let mut tiles = Self::default();
        tiles.clear(whole);
        tiles
    }

    /// Starts with an empty pane.
    pub fn clear(&mut self, pane: &Pane) {
        (self.width, self.height) = (pane.width(), pane.height());
        let side = SIDE as usize;
        let (across, down) = (self.width.div_ceil(side), self.height.div_ceil(side));
        self.origin = [pane.x[0], pane.y[0]];
        self.across = across;
        self.bound.clear();
        self.bound.resize(across * down, f32::NEG_INFINITY);
        self.since.clear();
        self.since.resize(across * down, 0);
    }

    /// Calls `draw` for parts of the pane that hold all of the triangle that is not hidden. `nearest`
    /// is the nearness of its nearest corner, `near` how it varies; `samples` is the pane's, and
    /// `least` tells the least nearness of some.
    #[inline]
    pub fn visible<T>(
        &mut self,
        triangle: &Triangle,
        pane: &Pane,
        (nearest, near): (f32, impl Fn() -> Plane),
        samples: &mut [T],
        least: impl Fn(&[T]) -> f32,
        mut draw: impl FnMut(&Pane, &mut [T]),
    ) {
        let Some([xs, ys]) = triangle.reach(pane) else {
            return;
        };
        let tile = |axis: usize, at: i32| (at - self.origin[axis]) >> SHIFT;
        let ([x0, x1], [y0, y1]) = (xs.map(|x| tile(0, x)), ys.map(|y| tile(1, y)));
        let near = (x1 - x0 >= FEW_TILES || y1 - y0 >= FEW_TILES).then(near);
        for y in y0..=y1 {
            let mut shown = [i32::MAX, i32::MIN];
            for x in x0..=x1 {
                let first = [x, y].map(|t| t << SHIFT);
                let first = [first[0] + self.origin[0], first[1] + self.origin[1]];
                let nearest = near.map_or(nearest, |near| near.highest(first, SIDE).min(nearest));
                if !self.hides([x, y], nearest, |range| least(&samples[range])) {
                    shown = [shown[0].min(x), x + 1];
                }
            }
            if shown[0] < shown[1] {
                let part = Pane {
                    x: self.clipped(0, shown, pane.x),
                    y: self.clipped(1, [y, y + 1], pane.y),
                };
                draw(&part, samples);
            }
        }
    }

    /// Samples of tiles along an axis.
    fn clipped(&self, axis: usize, tiles: [i32; 2], pane: [i32; 2]) -> [i32; 2] {
        let [from, to] = tiles.map(|t| self.origin[axis] + (t << SHIFT));
        [from, to.min(pane[1])]
    }

    #[inline]
    fn hides(
        &mut self,
        [x, y]: [i32; 2],
        nearest: f32,
        least: impl Fn(Range<usize>) -> f32,
    ) -> bool {
        let tile = y as usize * self.across + x as usize;
        if self.bound[tile] >= nearest {
            return true;
        }
        self.since[tile] += 1;
        if self.since[tile] < PATIENCE {
            return false;
        }
        self.since[tile] = 0;
        self.bound[tile] = self.look((x << SHIFT) as usize, (y << SHIFT) as usize, least);
        self.bound[tile] >= nearest
    }

    /// The least nearness of a tile's samples.
    fn look(&self, x: usize, y: usize, least: impl Fn(Range<usize>) -> f32) -> f32 {
        let side = SIDE as usize;
        let rows = y..(y + side).min(self.height);
        let columns = x..(x + side).min(self.width);
        let mut found = f32::INFINITY;
        for row in rows {
            let first = row * self.width;
            found = found.min(least(first + columns.start..first + columns.end));
            if found == f32::NEG_INFINITY {
                break;
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use crate::space::raster::{
        Camera, Geometry, Items, Material, Sampling, Scene, coverage, coverage_with_stats, draw,
    };

    /// A cube full of small triangles: most are hidden.
    fn thicket() -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let random = |i: u32| {
            let mixed = (i ^ (i >> 15)).wrapping_mul(0x2c1b_3c6d);
            let mixed = (mixed ^ (mixed >> 12)).wrapping_mul(0x297a_2d39);
            (mixed ^ (mixed >> 15)) as f32 / u32::MAX as f32
        };
        let corner = |i: u32| {
            let center = i / 3 * 8;
            let around = |k: u32| random(center + k) * 1.6 - 0.8;
            let off = |k: u32| (random(1_000_000 + i * 8 + k) - 0.5) * 0.2;
            Vec3::new(around(1) + off(1), around(2) + off(2), around(3) + off(3))
        };
        let count = 12_000;
        let positions = (0..3 * count).map(corner).collect();
        let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        (positions, triangles)
    }

    #[test]
    fn what_is_passed_over_would_not_have_been_seen() {
        let (positions, triangles) = thicket();
        let materials = [Material {
            double_sided: true,
            ..Material::default()
        }];
        let scene = |triangles| Scene {
            geometry: Geometry {
                positions: &positions,
                normals: &[],
                uvs: [&[], &[]],
                colors: &[],
                triangles,
                triangle_material: &[],
            },
            materials: &materials,
            textures: &[],
        };
        let eye = Vec3::new(0.3, 0.8, 2.2);
        let camera = Camera::perspective(eye, Vec3::ZERO, Vec3::Y, 0.9, 60, 60);
        let sampling = Sampling::REFERENCE;
        let whole = draw(&scene(&triangles), &camera, sampling);
        // So few at a time that none is asked whether it is hidden.
        let parts: Vec<Items> = triangles
            .chunks(30)
            .map(|few| draw(&scene(few), &camera, sampling))
            .collect();
        let mut covered = 0;
        for sample in 0..whole.near.len() {
            let nearest = parts.iter().map(|p| p.near[sample]);
            assert_eq!(
                whole.near[sample],
                nearest.fold(f32::NEG_INFINITY, f32::max)
            );
            covered += u32::from(whole.near[sample] > f32::MIN);
        }
        assert!(covered > 20_000, "{covered}");
        let (all, stats) = coverage_with_stats(&scene(&triangles), &camera, sampling);
        assert!(stats.fragments > 5 * stats.covered, "{stats:?}");
        assert_eq!(all, coverage(&scene(&triangles), &camera, sampling));
    }
}
