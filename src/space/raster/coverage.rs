//! Which samples a scene hits: alpha without colour or depth, the fast path.

use super::bits::BitTiles;
use super::edges::{Edges, Reached, TILE, each_tile, only_tile};
use super::seen::{Seen, may_reach, seen};
use super::triangle::CENTER;
use super::{Camera, Mips, Sampling, Scene};

/// For every sample, whether anything hits it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Samples along a pixel's edge.
    pub side: u32,
    /// One byte a sample, 0 or 1, rows of `width * side` from the top.
    pub samples: Vec<u8>,
}

/// For every pixel, the share of its samples that are hit.
#[derive(Clone, Debug, PartialEq)]
pub struct Coverage {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// 0 to 1, rows from the top.
    pub fraction: Vec<f32>,
}

/// What a drawing cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stats {
    /// Samples inside triangles that face the eye, before alpha test: what a GPU shades.
    pub fragments: u64,
    /// Samples that are hit at least once.
    pub covered: u64,
}

/// Draws where the scene is.
pub fn coverage(scene: &Scene, camera: &Camera, sampling: Sampling) -> Mask {
    let mut mask = Mask::empty(camera, sampling.side);
    let picture = BitTiles::empty(mask.size());
    mask.add::<false>(picture, scene, camera, sampling.mips);
    mask
}

/// As [`coverage`], with the number of fragments.
pub fn coverage_with_stats(scene: &Scene, camera: &Camera, sampling: Sampling) -> (Mask, Stats) {
    let mut mask = Mask::empty(camera, sampling.side);
    let picture = BitTiles::empty(mask.size());
    let fragments = mask.add::<true>(picture, scene, camera, sampling.mips);
    let covered = mask.samples.iter().map(|&s| s as u64).sum();
    (mask, Stats { fragments, covered })
}

impl Mask {
    /// Nothing, with so many samples along a pixel's edge.
    pub fn empty(camera: &Camera, side: u32) -> Self {
        let samples = (camera.width * side) as usize * (camera.height * side) as usize;
        Self {
            width: camera.width,
            height: camera.height,
            side,
            samples: vec![0; samples],
        }
    }

    /// Adds what a scene covers, seen by a camera of the same size.
    pub fn draw(&mut self, scene: &Scene, camera: &Camera, mips: Mips) {
        let picture = BitTiles::new(&self.samples, self.size());
        self.add::<false>(picture, scene, camera, mips);
    }

    /// Columns and rows of samples.
    fn size(&self) -> [i32; 2] {
        [self.width, self.height].map(|pixels| (pixels * self.side) as i32)
    }

    /// As [`Mask::draw`], over a picture of what is hit already; returns the samples inside triangles that face the eye, if they are counted.
    fn add<const COUNTED: bool>(
        &mut self,
        mut picture: BitTiles,
        scene: &Scene,
        camera: &Camera,
        mips: Mips,
    ) -> u64 {
        let side = self.side;
        let sampling = Sampling { side, mips };
        let corners = camera.project(scene.geometry.positions, side);
        let whole = picture.whole();
        let mut fragments = 0;
        for id in 0..scene.geometry.triangles.len() as u32 {
            let Some(reached) = may_reach(scene, &corners, id, &whole, CENTER) else {
                continue;
            };
            // Most triangles of a crown lie within one tile, and that is full.
            if !COUNTED && only_tile(reached, TILE).is_some_and(|tile| *picture.at(tile) == !0) {
                continue;
            }
            if let Some(shown) = seen(scene, &corners, id) {
                fragments += hit::<COUNTED>(&shown, reached, scene, sampling, &mut picture);
            }
        }
        picture.write(&mut self.samples);
        fragments
    }

    /// Averages the samples of every pixel.
    pub fn coverage(&self) -> Coverage {
        self.coverage_shifted(0, 0)
    }

    /// As if the content had been drawn so many samples farther right and down.
    ///
    /// Exactly what a shifted camera would draw, since corners snap to parts of a sample; only
    /// what would come in from outside is missing.
    pub fn coverage_shifted(&self, right: i32, down: i32) -> Coverage {
        let (side, row) = (self.side as usize, (self.width * self.side) as usize);
        let shift = right.clamp(-(row as i32), row as i32);
        let mut moved = vec![0u8; row];
        let mut sums = vec![0u32; (self.width * self.height) as usize];
        for (y, samples) in self.samples.chunks_exact(row).enumerate() {
            let y = (y as i64 + down as i64).div_euclid(side as i64);
            if y < 0 || y >= self.height as i64 {
                continue;
            }
            let samples = if shift == 0 {
                samples
            } else {
                let (gap, kept) = (
                    shift.unsigned_abs() as usize,
                    row - shift.unsigned_abs() as usize,
                );
                if shift > 0 {
                    moved[gap..].copy_from_slice(&samples[..kept]);
                } else {
                    moved[..kept].copy_from_slice(&samples[gap..]);
                }
                &moved
            };
            let at = y as usize * self.width as usize;
            let sums = &mut sums[at..at + self.width as usize];
            match side {
                1 => add_row::<1>(sums, samples),
                2 => add_row::<2>(sums, samples),
                4 => add_row::<4>(sums, samples),
                _ => {
                    for (sum, pixel) in sums.iter_mut().zip(samples.chunks_exact(side)) {
                        *sum += pixel.iter().map(|&s| s as u32).sum::<u32>();
                    }
                }
            }
        }
        let scale = 1.0 / (side * side) as f32;
        Coverage {
            width: self.width,
            height: self.height,
            fraction: sums.into_iter().map(|sum| sum as f32 * scale).collect(),
        }
    }

    /// Covered area in pixels.
    pub fn area(&self) -> f64 {
        let covered: u64 = self.samples.iter().map(|&s| s as u64).sum();
        covered as f64 / (self.side * self.side) as f64
    }
}

impl Coverage {
    /// Covered area in pixels.
    pub fn area(&self) -> f64 {
        self.fraction.iter().map(|&c| c as f64).sum()
    }

    /// Whether a pixel is at least half covered.
    pub fn silhouette(&self) -> Vec<bool> {
        self.fraction.iter().map(|&c| c >= 0.5).collect()
    }
}

/// Sets the samples that a triangle hits; returns those inside it, if they are counted.
#[inline]
fn hit<const COUNTED: bool>(
    shown: &Seen,
    reached: [[i32; 2]; 2],
    scene: &Scene,
    sampling: Sampling,
    picture: &mut BitTiles,
) -> u64 {
    let mut fragments = 0;
    let (mut edges, mut fragment) = (None, None);
    each_tile(reached, TILE, |Reached { tile, ys, .. }| {
        let outside = if COUNTED { picture.outside(tile) } else { 0 };
        let hits = picture.at(tile);
        // Inside a crown most tiles are full: edges are not even looked at.
        if !COUNTED && *hits == !0 {
            return;
        }
        let first = tile.map(|t| t * TILE);
        let edges = edges.get_or_insert_with(|| Edges::new(&shown.triangle, CENTER));
        let inside = edges.samples(first, ys);
        fragments += u64::from((inside & !outside).count_ones());
        let open = inside & !*hits;
        if open == 0 {
            return;
        }
        *hits |= match shown.material.cutoff {
            None => open,
            Some(_) => fragment
                .get_or_insert_with(|| shown.fragment(scene, sampling))
                .test_tile(first, open),
        };
    });
    fragments
}

/// Adds a row of samples to the pixels' sums; a fixed side lets the compiler use wide registers.
fn add_row<const SIDE: usize>(sums: &mut [u32], samples: &[u8]) {
    let (pixels, _) = samples.as_chunks::<SIDE>();
    for (sum, pixel) in sums.iter_mut().zip(pixels) {
        *sum += pixel.iter().map(|&s| s as u32).sum::<u32>();
    }
}
