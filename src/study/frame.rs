//! Pictures of a stand: what every sample shows, drawn batch by batch, nearest trees first.

use glam::{Vec2, Vec3};

use crate::runtime::{Drawn, Form};
use crate::space::raster::{
    Camera, Coverage, EMPTY, Geometry, Mask, Material, Mips, Sampling, Scene, Texture, draw,
};

/// Two by two samples of the base level: areas are right at any distance.
const SAMPLING: Sampling = Sampling {
    side: 2,
    mips: Mips::Base,
};

/// A batch of so many triangles is drawn at once.
const BATCH: usize = 200_000;

/// What a sample shows: tree, node, form and triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Key(u64);

impl Key {
    const NONE: Self = Self(u64::MAX);

    pub(super) fn of(d: &Drawn, index: usize) -> Self {
        let form = u64::from(d.form == Form::Geometry);
        Self(
            u64::from(d.tree) << 42
                | u64::from(d.node) << 23
                | form << 22
                | (index as u64 & 0x3f_ffff),
        )
    }

    /// The drawn thing that the triangle belongs to.
    pub fn drawn(self) -> u64 {
        self.0 >> 22
    }

    /// Index of the tree.
    pub fn tree(self) -> u64 {
        self.0 >> 42
    }

    /// As [`Key::drawn`] of every triangle of a drawn thing.
    pub fn drawn_of(d: &Drawn) -> u64 {
        Self::of(d, 0).drawn()
    }
}

/// Triangles that wait to be drawn.
#[derive(Default)]
pub(super) struct Batch {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
    material: Vec<u32>,
    keys: Vec<Key>,
}

impl Batch {
    /// Whether it is time to draw them.
    pub(super) fn is_full(&self) -> bool {
        self.keys.len() >= BATCH
    }

    pub(super) fn push(&mut self, corners: [Vec3; 3], uvs: [Vec2; 3], material: u32, key: Key) {
        let at = self.positions.len() as u32;
        self.positions.extend(corners);
        self.uvs.extend(uvs);
        self.triangles.push([at, at + 1, at + 2]);
        self.material.push(material);
        self.keys.push(key);
    }
}

/// A picture: what every sample shows.
pub struct Frame {
    width: u32,
    height: u32,
    near: Vec<f32>,
    /// What is seen; rows from the top.
    pub keys: Vec<Key>,
}

impl Frame {
    pub(super) fn new(width: u32, height: u32) -> Self {
        let samples = (width * height * SAMPLING.side * SAMPLING.side) as usize;
        Self {
            width,
            height,
            near: vec![f32::NEG_INFINITY; samples],
            keys: vec![Key::NONE; samples],
        }
    }

    pub(super) fn flush(
        &mut self,
        batch: &mut Batch,
        camera: &Camera,
        materials: &[Material],
        textures: &[Texture],
    ) {
        if batch.keys.is_empty() {
            return;
        }
        let scene = Scene {
            geometry: Geometry {
                positions: &batch.positions,
                normals: &[],
                uvs: [&batch.uvs, &[]],
                colors: &[],
                triangles: &batch.triangles,
                triangle_material: &batch.material,
            },
            materials,
            textures,
        };
        let items = draw(&scene, camera, SAMPLING);
        for (i, (&t, &near)) in items.triangle.iter().zip(&items.near).enumerate() {
            if t != EMPTY && near > self.near[i] {
                (self.near[i], self.keys[i]) = (near, batch.keys[t as usize]);
            }
        }
        *batch = Batch::default();
    }

    /// Whether every sample that a sphere could show shows something nearer.
    pub(super) fn hides(&self, camera: &Camera, center: Vec3, radius: f32) -> bool {
        let at = center - camera.origin;
        let depth = at.dot(camera.forward) - radius;
        if depth < 0.1 {
            return false;
        }
        let scale = camera.pixels / depth;
        let side = SAMPLING.side as f32;
        let middle = Vec2::new(self.width as f32, self.height as f32) * 0.5;
        let x = (at.dot(camera.right), -at.dot(camera.up));
        // The nearest depth gives the widest projection on either side.
        let reach = |c: f32| {
            [
                (c - radius) * scale,
                (c + radius) * scale,
                (c - radius) * camera.pixels / (depth + 2.0 * radius),
                (c + radius) * camera.pixels / (depth + 2.0 * radius),
            ]
        };
        let range = |c: f32, middle: f32, most: u32| {
            let ends = reach(c);
            let low = ends.iter().fold(f32::MAX, |a, &b| a.min(b)) + middle;
            let high = ends.iter().fold(f32::MIN, |a, &b| a.max(b)) + middle;
            let most = most * SAMPLING.side;
            ((low * side).floor().max(0.0) as u32).min(most)
                ..((high * side).ceil().max(0.0) as u32).min(most)
        };
        let (columns, rows) = (
            range(x.0, middle.x, self.width),
            range(x.1, middle.y, self.height),
        );
        let row = (self.width * SAMPLING.side) as usize;
        rows.into_iter().all(|y| {
            let line = &self.near[y as usize * row..(y as usize + 1) * row];
            line[columns.start as usize..columns.end as usize]
                .iter()
                .all(|&near| near >= 1.0 / depth)
        })
    }

    /// Share of each pixel that is covered.
    pub fn coverage(&self) -> Coverage {
        let mask = Mask {
            width: self.width,
            height: self.height,
            side: SAMPLING.side,
            samples: self
                .keys
                .iter()
                .map(|&k| u8::from(k != Key::NONE))
                .collect(),
        };
        mask.coverage()
    }

    /// Of the samples that show anything here, the share for which `same` holds of both.
    pub fn agrees(&self, other: &Self, same: impl Fn(Key, Key) -> bool) -> f64 {
        let covered = self
            .keys
            .iter()
            .zip(&other.keys)
            .filter(|(a, _)| **a != Key::NONE);
        let (mut all, mut good) = (0u64, 0u64);
        for (&a, &b) in covered {
            all += 1;
            good += u64::from(b != Key::NONE && same(a, b));
        }
        good as f64 / all.max(1) as f64
    }

    /// All triangles that are seen, each once.
    pub fn visible(&self) -> Vec<Key> {
        let mut out: Vec<Key> = self
            .keys
            .iter()
            .copied()
            .filter(|&k| k != Key::NONE)
            .collect();
        out.sort_unstable();
        out.dedup();
        out
    }

    /// RGBA: every tree in its own green, white where nothing is.
    pub fn picture(&self) -> (u32, u32, Vec<u8>) {
        let (width, height) = (self.width * SAMPLING.side, self.height * SAMPLING.side);
        let color = |&key: &Key| {
            if key == Key::NONE {
                return [255; 4];
            }
            let mixed = key.drawn().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
            let tree = key.tree().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
            let part = |n: u64, from: u64, span: u64| (from + n % span) as u8;
            [
                part(tree, 20, 90),
                part(tree >> 8, 70, 100).saturating_add(part(mixed, 0, 50)),
                part(tree >> 16, 10, 60),
                255,
            ]
        };
        (width, height, self.keys.iter().flat_map(color).collect())
    }
}
