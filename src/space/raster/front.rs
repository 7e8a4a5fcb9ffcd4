//! What is nearest in one pane, in tiles of 8 x 8 samples.
//!
//! Most triangles of a crown lie behind others. Once a tile of the picture is full up to some
//! nearness, everything farther is passed over after a look at its corners (a hierarchical z-buffer:
//! Greene, Kass and Miller, SIGGRAPH 1993, of one level). The picture is the same with and without.

use wide::f32x4;

use super::camera::Corner;
use super::edges::{Edges, Reached, TILE, each_tile};
use super::pane::Pane;
use super::seen::{Seen, may_reach, seen};
use super::triangle::{CENTER, Plane};
use super::{Sampling, Scene};

/// The triangle of a sample that nothing hits.
pub const EMPTY: u32 = u32::MAX;

/// A tile is looked at again after so many triangles.
const PATIENCE: u16 = 8;
/// Over more tiles than this, along either axis, a triangle's nearness is asked tile by tile.
const FEW_TILES: i32 = 2;

/// What is nearest in one pane.
#[derive(Default)]
pub(super) struct Front {
    tiles: Vec<Tile>,
    across: i32,
}

/// The samples of a tile, rows from the top; at the pane's right and lower ends some lie beyond it.
#[derive(Clone)]
struct Tile {
    /// Places of triangles in the pane's list, or [`EMPTY`].
    items: [u32; 64],
    /// As [`super::Items::near`].
    near: [f32; 64],
    /// Nearness that all samples have at least.
    bound: f32,
    /// Triangles since it was looked at.
    since: u16,
}

impl Tile {
    const NOTHING: Self = Self {
        items: [EMPTY; 64],
        near: [f32::NEG_INFINITY; 64],
        bound: f32::NEG_INFINITY,
        since: 0,
    };

    /// Whether nothing that is no nearer than this can be seen.
    #[inline]
    fn hides(&mut self, nearest: f32) -> bool {
        if self.bound >= nearest {
            return true;
        }
        self.since += 1;
        if self.since < PATIENCE {
            return false;
        }
        self.since = 0;
        self.bound = self.near.iter().copied().fold(f32::INFINITY, f32::min);
        self.bound >= nearest
    }

    /// Those of the samples at which a triangle is nearer than what is there; the tile begins at `first`.
    #[inline]
    fn nearer(&self, samples: u64, depth: &Plane, first: [i32; 2]) -> u64 {
        let mut nearer = 0;
        let across = |x: i32| depth.across(first[0] + x);
        let four = |x: i32| f32x4::new([across(x), across(x + 1), across(x + 2), across(x + 3)]);
        let columns = [four(0), four(4)];
        let (rows, _) = self.near.as_chunks::<8>();
        for (y, row) in (0..).zip(rows) {
            if samples >> (8 * y) & 0xff == 0 {
                continue;
            }
            let at = f32x4::splat(depth.left(first[1] + y));
            let &[a, b, c, d, e, f, g, h] = row;
            let left = (at + columns[0]).simd_gt(f32x4::new([a, b, c, d]));
            let right = (at + columns[1]).simd_gt(f32x4::new([e, f, g, h]));
            let row = left.to_bitmask() | right.to_bitmask() << 4;
            nearer |= u64::from(row) << (8 * y);
        }
        samples & nearer
    }

    /// Puts a triangle there.
    #[inline]
    fn set(&mut self, mut samples: u64, depth: &Plane, first: [i32; 2], place: u32) {
        while samples != 0 {
            let sample = samples.trailing_zeros();
            samples &= samples - 1;
            let (x, y) = (sample as i32 % TILE, sample as i32 / TILE);
            self.near[sample as usize] = depth.value(first[0] + x, first[1] + y);
            self.items[sample as usize] = place;
        }
    }
}

impl Front {
    /// Draws those of the scene's triangles that have the numbers `ids`.
    pub fn draw(
        &mut self,
        scene: &Scene,
        corners: &[Corner],
        sampling: Sampling,
        pane: &Pane,
        ids: &[u32],
    ) {
        let [across, down] = [pane.width(), pane.height()].map(|s| s.div_ceil(TILE as usize));
        self.across = across as i32;
        self.tiles.clear();
        self.tiles.resize(across * down, Tile::NOTHING);
        for (place, &id) in (0..).zip(ids) {
            let Some(reached) = may_reach(scene, corners, id, pane, CENTER) else {
                continue;
            };
            if let Some(shown) = seen(scene, corners, id) {
                self.add(&shown, reached, scene, sampling, pane, place);
            }
        }
    }

    /// What is seen at a sample of the pane, counted from its first: the place of a triangle in the
    /// pane's list, or [`EMPTY`], and its nearness.
    #[inline]
    pub fn at(&self, [x, y]: [usize; 2]) -> (u32, f32) {
        let side = TILE as usize;
        let tile = &self.tiles[y / side * self.across as usize + x / side];
        let sample = y % side * side + x % side;
        (tile.items[sample], tile.near[sample])
    }

    fn add(
        &mut self,
        shown: &Seen,
        [xs, ys]: [[i32; 2]; 2],
        scene: &Scene,
        sampling: Sampling,
        pane: &Pane,
        place: u32,
    ) {
        let nears = shown.corners.iter().map(|c| c.near);
        let nearest = nears.fold(f32::MIN, f32::max);
        let plane = || shown.triangle.near_plane(shown.corners);
        let reached = [0, 1].map(|axis| {
            let first = [pane.x, pane.y][axis][0];
            [xs, ys][axis].map(|at| at - first)
        });
        let is_long = |[first, last]: [i32; 2]| last / TILE - first / TILE >= FEW_TILES;
        let is_large = reached.into_iter().any(is_long);
        let mut depth = is_large.then(plane);
        let (mut edges, mut fragment) = (None, None);
        each_tile(
            reached,
            TILE,
            |Reached {
                 tile: [x, y], ys, ..
             }| {
                let first = [pane.x[0] + x * TILE, pane.y[0] + y * TILE];
                let tile = &mut self.tiles[(y * self.across + x) as usize];
                let nearest = match &depth {
                    Some(depth) if is_large => depth.highest(first, TILE).min(nearest),
                    _ => nearest,
                };
                if tile.hides(nearest) {
                    return;
                }
                let edges = edges.get_or_insert_with(|| Edges::new(&shown.triangle, CENTER));
                let inside = edges.samples(first, ys);
                if inside == 0 {
                    return;
                }
                let depth = depth.get_or_insert_with(plane);
                let mut seen = tile.nearer(inside, depth, first);
                if seen != 0 && shown.material.cutoff.is_some() {
                    seen = fragment
                        .get_or_insert_with(|| shown.fragment(scene, sampling))
                        .test_tile(first, seen);
                }
                tile.set(seen, depth, first, place);
            },
        );
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
