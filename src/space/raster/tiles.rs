//! What is hidden already, by tiles of samples.
//!
//! Most triangles of a crown lie behind others. Once a tile of the picture is full up to some
//! nearness, everything farther is passed over after a look at its corners (a hierarchical z-buffer:
//! Greene, Kass and Miller, SIGGRAPH 1993, of one level). The picture is the same with and without.

use super::camera::{Corner, SUBSAMPLES};

/// Edge of a tile in samples, as a power of two.
const SHIFT: i32 = 4;
/// Edge of a tile in samples.
const SIDE: usize = 1 << SHIFT;
/// A triangle over more tiles than this, along either axis, is drawn without being asked.
const MOST_TILES: i32 = 3;
/// A tile is looked at again after so many triangles.
const PATIENCE: u16 = 32;

/// Tiles of a picture.
pub(super) struct Tiles {
    across: usize,
    width: usize,
    height: usize,
    /// Nearness that all samples of the tile have at least.
    bound: Vec<f32>,
    /// Triangles since it was looked at.
    since: Vec<u16>,
}

impl Tiles {
    /// Of an empty picture of so many samples.
    pub fn new(width: i32, height: i32) -> Self {
        let (width, height) = (width as usize, height as usize);
        let (across, down) = (width.div_ceil(SIDE), height.div_ceil(SIDE));
        Self {
            across,
            width,
            height,
            bound: vec![f32::NEG_INFINITY; across * down],
            since: vec![0; across * down],
        }
    }

    /// Whether a triangle whose nearest corner is at `nearest` is hidden in all tiles that it
    /// touches; `least` tells the least nearness of samples `from..to` of the picture.
    #[inline]
    pub fn hide(
        &mut self,
        corners: &[Corner; 3],
        nearest: f32,
        least: impl Fn(std::ops::Range<usize>) -> f32,
    ) -> bool {
        let [a, b, c] = corners;
        let tile = |sub_samples: i32| sub_samples >> (SHIFT + SUBSAMPLES.trailing_zeros() as i32);
        let (x0, x1) = (tile(a.x.min(b.x).min(c.x)), tile(a.x.max(b.x).max(c.x)));
        let (y0, y1) = (tile(a.y.min(b.y).min(c.y)), tile(a.y.max(b.y).max(c.y)));
        if x1 - x0 >= MOST_TILES || y1 - y0 >= MOST_TILES {
            return false;
        }
        let down = (self.bound.len() / self.across.max(1)) as i32;
        for y in y0.max(0)..=y1.min(down - 1) {
            for x in x0.max(0)..=x1.min(self.across as i32 - 1) {
                let tile = y as usize * self.across + x as usize;
                if self.bound[tile] >= nearest {
                    continue;
                }
                self.since[tile] += 1;
                if self.since[tile] < PATIENCE {
                    return false;
                }
                self.since[tile] = 0;
                self.bound[tile] = self.look(x as usize * SIDE, y as usize * SIDE, &least);
                if self.bound[tile] < nearest {
                    return false;
                }
            }
        }
        true
    }

    /// The least nearness of a tile's samples.
    fn look(&self, x: usize, y: usize, least: impl Fn(std::ops::Range<usize>) -> f32) -> f32 {
        let rows = y..(y + SIDE).min(self.height);
        let columns = x..(x + SIDE).min(self.width);
        let mut found = f32::INFINITY;
        for row in rows {
            found = found.min(least(
                row * self.width + columns.start..row * self.width + columns.end,
            ));
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
