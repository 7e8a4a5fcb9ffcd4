//! A picture in panes so small that what is drawn there stays in the nearest caches.
//!
//! A picture of a tree with 16 samples a pixel is tens of megabytes, and neighbours in a list of
//! triangles are anywhere in it. Sorted by panes (Fuchs and others, "Pixel-Planes 5", SIGGRAPH 1989)
//! the same triangles meet the same samples in the same order, a pane at a time.

use super::Scene;
use super::camera::Corner;
use super::triangle::{may_hit, reach};

/// Bytes that the samples of a pane take at most.
const BYTES: usize = 1 << 18;

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

    /// Where a sample's row starts in a buffer that holds this pane alone, less the first column:
    /// add the column.
    #[inline]
    pub fn row(&self, y: i32) -> usize {
        (y - self.y[0]) as usize * self.width()
    }
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
    /// Of a picture of so many samples of type `T`, `side` along a pixel's edge: no pane cuts a pixel.
    /// `corners` are the scene's positions, projected; `places` as in [`Triangle::rows`](super::triangle::Triangle::rows).
    pub fn new<T, const N: usize>(
        scene: &Scene,
        corners: &[Corner],
        size: [i32; 2],
        side: i32,
        places: [[i32; 2]; N],
    ) -> Self {
        let edge = (BYTES / size_of::<T>()).isqrt() as i32;
        let edge = (edge / side).max(1) * side;
        let [across, down] = size.map(|s| (s + edge - 1) / edge);
        let whole = Pane::of(size);
        if across * down == 1 {
            return Self::one(scene, corners, size, places);
        }
        let mut ends = vec![0u32; (across * down) as usize];
        let mut pairs: Vec<[u32; 2]> = Vec::with_capacity(scene.geometry.triangles.len());
        for (id, indices) in scene.geometry.triangles.iter().enumerate() {
            let Some(reached) = shown(indices, corners, &whole, places) else {
                continue;
            };
            let [[x0, x1], [y0, y1]] = reached.map(|ends| ends.map(|s| s / edge));
            for pane in (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| (y * across + x) as u32)) {
                ends[pane as usize] += 1;
                pairs.push([pane, id as u32]);
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

    /// A picture that is small enough as it is.
    fn one<const N: usize>(
        scene: &Scene,
        corners: &[Corner],
        size: [i32; 2],
        places: [[i32; 2]; N],
    ) -> Self {
        let whole = Pane::of(size);
        let hits =
            |(_, indices): &(u32, &[u32; 3])| shown(indices, corners, &whole, places).is_some();
        let all = (0..).zip(scene.geometry.triangles).filter(hits);
        let triangles: Vec<u32> = all.map(|(id, _)| id).collect();
        Self {
            size,
            edge: size[0].max(size[1]),
            across: 1,
            ends: vec![triangles.len() as u32],
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

/// Where a triangle may hit a picture; most triangles of a far tree do not.
#[inline]
fn shown<const N: usize>(
    indices: &[u32; 3],
    corners: &[Corner],
    whole: &Pane,
    places: [[i32; 2]; N],
) -> Option<[[i32; 2]; 2]> {
    let at: [Corner; 3] = indices.map(|i| corners[i as usize]);
    reach(&at, whole, places).filter(|_| N == 1 || may_hit(&at, places))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::raster::triangle::CENTER;
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
        let panes = Panes::new::<[u32; 2], 1>(&scene, &corners, [300, 210], 3, CENTER);
        let found: Vec<(Pane, Vec<u32>)> =
            panes.each().map(|(pane, ids)| (pane, ids.into())).collect();
        // Of whole pixels: 180 samples along an edge of a pane of 8 bytes a sample.
        let samples: usize = found.iter().map(|(p, _)| p.width() * p.height()).sum();
        assert_eq!((found.len(), samples), (4, 300 * 210));
        let first = Pane {
            x: [0, 180],
            y: [0, 180],
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
