//! A picture in panes so small that what is drawn there stays in the nearest caches.
//!
//! A picture of a tree with 16 samples a pixel is tens of megabytes, and neighbours in a list of
//! triangles are anywhere in it. Sorted by panes (Fuchs and others, "Pixel-Planes 5", SIGGRAPH 1989)
//! the same triangles meet the same samples in the same order, a pane at a time.

use super::Scene;
use super::camera::{Corner, SUBSAMPLES};
use super::triangle::CENTER;

/// Edge of a pane in samples: depths and items of one take 288 kilobytes.
const EDGE: i32 = 192;

/// A rectangle of samples (or of pixels with several places).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pane {
    /// First column, and the one after the last.
    pub x: [i32; 2],
    /// First row, and the one after the last.
    pub y: [i32; 2],
}

impl Pane {
    /// A whole picture.
    pub fn of([width, height]: [i32; 2]) -> Self {
        let (x, y) = ([0, width], [0, height]);
        Self { x, y }
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        (self.x[1] - self.x[0]) as usize
    }

    /// Number of rows.
    pub fn height(&self) -> usize {
        (self.y[1] - self.y[0]) as usize
    }

    /// The picture's sample that is so many columns and rows from the pane's first.
    #[inline]
    pub fn place(&self, [x, y]: [usize; 2]) -> [i32; 2] {
        [self.x[0] + x as i32, self.y[0] + y as i32]
    }
}

/// The first and last column, and row, of a pane that may have samples inside; `None` where none
/// has.
pub(super) fn reach<const N: usize>(
    corners: &[Corner; 3],
    pane: &Pane,
    places: [[i32; 2]; N],
) -> Option<[[i32; 2]; 2]> {
    let [a, b, c] = corners;
    if a.is_outside() || b.is_outside() || c.is_outside() {
        return None;
    }
    let ends = |axis: usize, values: [i32; 3], [first, end]: [i32; 2]| {
        let low = values[0].min(values[1]).min(values[2]);
        let high = values[0].max(values[1]).max(values[2]);
        // Whole numbers k with low <= 256 k + place <= high, of all places.
        let most = places.iter().fold(i32::MIN, |m, p| m.max(p[axis]));
        let least = places.iter().fold(i32::MAX, |m, p| m.min(p[axis]));
        let from = (low - most + SUBSAMPLES - 1).div_euclid(SUBSAMPLES);
        let to = (high - least).div_euclid(SUBSAMPLES);
        [from.max(first), to.min(end - 1)]
    };
    let x = ends(0, [a.x, b.x, c.x], pane.x);
    let y = ends(1, [a.y, b.y, c.y], pane.y);
    (x[0] <= x[1] && y[0] <= y[1]).then_some([x, y])
}

/// Whether any sample may be inside, each of several places of a pixel asked for itself.
pub(super) fn may_hit<const N: usize>(corners: &[Corner; 3], places: [[i32; 2]; N]) -> bool {
    let [a, b, c] = corners;
    let (x0, x1) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
    let (y0, y1) = (a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y));
    // Whether there is a whole number k with low <= 256 k + place <= high.
    let between = |low: i32, high: i32, place: i32| {
        high.saturating_sub(place).div_euclid(SUBSAMPLES)
            > low.saturating_sub(place + 1).div_euclid(SUBSAMPLES)
    };
    places
        .iter()
        .any(|&[x, y]| between(x0, x1, x) && between(y0, y1, y))
}

/// The panes of a picture, each with the triangles that may hit it.
pub(super) struct Panes {
    size: [i32; 2],
    edge: i32,
    across: i32,
    /// For each pane the end of its triangles.
    ends: Vec<u32>,
    triangles: Vec<u32>,
}

impl Panes {
    /// Of a picture of so many samples, `side` along a pixel's edge: no pane cuts a pixel. `corners`
    /// are the scene's positions, projected.
    pub fn new(scene: &Scene, corners: &[Corner], size: [i32; 2], side: i32) -> Self {
        let edge = (EDGE / side).max(1) * side;
        let [across, down] = size.map(|s| (s + edge - 1) / edge);
        let whole = Pane::of(size);
        let mut ends = vec![0u32; (across * down) as usize];
        let mut pairs: Vec<[u32; 2]> = Vec::with_capacity(scene.geometry.triangles.len());
        for (id, indices) in (0..).zip(scene.geometry.triangles) {
            let at = indices.map(|i| corners[i as usize]);
            let Some(reached) = reach(&at, &whole, CENTER) else {
                continue;
            };
            let [[x0, x1], [y0, y1]] = reached.map(|ends| ends.map(|s| s / edge));
            for pane in (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| (y * across + x) as u32)) {
                ends[pane as usize] += 1;
                pairs.push([pane, id]);
            }
        }
        // From numbers to starts; each start moves to its end while triangles are put there.
        let mut start = 0;
        for end in &mut ends {
            start += std::mem::replace(end, start);
        }
        let mut triangles = vec![0; pairs.len()];
        for [pane, id] in pairs {
            let at = &mut ends[pane as usize];
            triangles[*at as usize] = id;
            *at += 1;
        }
        Self {
            size,
            edge,
            across,
            ends,
            triangles,
        }
    }

    /// Every pane that anything may hit with its triangles, in the scene's order.
    pub fn each(&self) -> impl Iterator<Item = (Pane, &[u32])> {
        let starts = [0].into_iter().chain(self.ends.iter().copied());
        let filled = starts
            .zip(&self.ends)
            .enumerate()
            .filter(|(_, (start, end))| start < end);
        filled.map(|(number, (start, &end))| {
            let at = [number as i32 % self.across, number as i32 / self.across];
            let [x, y] = std::array::from_fn(|axis| {
                let from = at[axis] * self.edge;
                [from, (from + self.edge).min(self.size[axis])]
            });
            (Pane { x, y }, &self.triangles[start as usize..end as usize])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::raster::{Camera, Geometry, Material, Sampling, coverage};
    use glam::Vec3;

    #[test]
    fn panes_share_a_picture_and_each_has_what_may_hit_it_in_order() {
        // A triangle in the left upper corner, one over everything, one outside.
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let positions = [
            [at(-0.9, 0.6), at(-0.9, 0.5), at(-0.8, 0.6)],
            [at(-3.0, -1.0), at(3.0, -1.0), at(0.0, 5.0)],
            [at(1.5, 0.0), at(1.6, 0.0), at(1.5, 0.1)],
        ];
        let camera = Camera::orthographic(Vec3::NEG_Z, Vec3::Y, Vec3::ZERO, 50.0, 100, 70);
        let scene = Scene {
            geometry: Geometry {
                positions: positions.as_flattened(),
                normals: &[],
                uvs: [&[], &[]],
                colors: &[],
                triangles: &[[0, 1, 2], [3, 4, 5], [6, 7, 8]],
                triangle_material: &[],
            },
            materials: &[Material::default()],
            textures: &[],
        };
        let corners = camera.project(scene.geometry.positions, 3);
        let panes = Panes::new(&scene, &corners, [300, 210], 3);
        let found: Vec<(Pane, Vec<u32>)> =
            panes.each().map(|(pane, ids)| (pane, ids.into())).collect();
        let samples: usize = found.iter().map(|(p, _)| p.width() * p.height()).sum();
        assert_eq!((found.len(), samples), (4, 300 * 210));
        let first = Pane {
            x: [0, 192],
            y: [0, 192],
        };
        assert_eq!(found[0], (first, vec![0, 1]));
        assert!(found[1..].iter().all(|(_, ids)| ids == &[1]));
        let sampling = Sampling {
            side: 3,
            ..Sampling::REFERENCE
        };
        let mask = coverage(&scene, &camera, sampling);
        assert!(mask.samples.iter().all(|&hit| hit == 1));
    }
}
