//! All that a pixel shows: coverage, lit colour, normal and distance, averaged over its samples.

use glam::{Vec2, Vec3};

use super::camera::Corner;
use super::draw::{EMPTY, Items};
use super::relief::{Bumps, Relief};
use super::shade::{Light, Surface};
use super::triangle::Triangle;
use super::{Camera, Sampling, Scene};

/// Pixels of a drawing, rows from the top. Everything is a mean over *all* samples of the pixel,
/// so that what is covered in part counts in part, and pixels can be averaged.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Share of the pixel that is covered, 0 to 1.
    pub coverage: Vec<f32>,
    /// Linear light times coverage.
    pub color: Vec<[f32; 3]>,
    /// Unit normals times coverage.
    pub normal: Vec<Vec3>,
    /// Distance along the line of sight from the camera's origin times coverage.
    pub distance: Vec<f32>,
}

/// Samples along a pixel's edge that are shaded, at most.
const SHADED: usize = 4;

/// Triangles that are ready to be shaded, at most.
const KNOWN: usize = 1024;

/// A triangle that is ready to be shaded.
struct Known<'a> {
    id: u32,
    surface: Surface<'a>,
    bumps: Option<Bumps<'a>>,
}

impl<'a> Known<'a> {
    fn new(
        scene: &Scene<'a>,
        corners: &[Corner],
        id: u32,
        sampling: Sampling,
        reliefs: &'a [Option<Relief<'a>>],
    ) -> Option<Self> {
        let indices = &scene.geometry.triangles[id as usize];
        let at = indices.map(|i| corners[i as usize]);
        let material = scene.geometry.triangle_material.get(id as usize);
        let relief = reliefs.get(material.map_or(0, |&m| m as usize));
        let bumps = relief.and_then(Option::as_ref).and_then(|relief| {
            let triangle = Triangle::new(at, true)?;
            Bumps::new(relief, scene, indices, at, &triangle)
        });
        Some(Self {
            id,
            surface: Surface::new(scene, corners, id, sampling)?,
            bumps,
        })
    }

    /// Linear base colour and unit normal at a sample.
    fn at(&self, x: i32, y: i32) -> ([f32; 3], Vec3) {
        let (albedo, normal) = self.surface.at(x, y);
        let side = self.surface.side;
        let bumped = self.bumps.as_ref();
        (
            albedo,
            bumped.map_or(normal, |bumps| bumps.at(x, y, normal * side) * side),
        )
    }
}

impl Items {
    /// Averages the samples of every pixel. Of all that are hit 4 x 4 are shaded; where there are
    /// more they tell coverage alone. `reliefs` are the materials' normal maps, as many as materials.
    ///
    /// `scene`, `camera` and `sampling` must be those that the items were drawn with.
    pub fn layers(
        &self,
        scene: &Scene,
        camera: &Camera,
        sampling: Sampling,
        light: Light,
        reliefs: &[Option<Relief>],
    ) -> Layers {
        let corners = camera.project(scene.geometry.positions, sampling.side);
        let mut layers = Layers::empty(self.width, self.height);
        // Rows of samples cross the same triangles as the rows above.
        let mut known: Vec<Option<Known>> = (0..KNOWN).map(|_| None).collect();
        let (side, row) = (self.side as usize, (self.width * self.side) as usize);
        let mut shade = |layers: &mut Layers, sample: usize, pixel: usize| {
            let id = self.triangle[sample];
            let known = &mut known[id as usize % KNOWN];
            if known.as_ref().is_none_or(|known| known.id != id) {
                *known = Known::new(scene, &corners, id, sampling, reliefs);
            }
            let Some(known) = known else { return };
            let (albedo, normal) = known.at((sample % row) as i32, (sample / row) as i32);
            let near = self.near[sample];
            let distance = if camera.perspective {
                1.0 / near
            } else {
                -near
            };
            layers.add(pixel, albedo, light.on(normal), normal, distance);
        };
        // Which samples are shaded: all of 4 x 4, as many of more.
        let stride = (side / SHADED).max(1);
        let chosen = |at: usize| at % stride == stride / 2;
        let mut shaded = vec![0u32; layers.coverage.len()];
        for (y, ids) in self.triangle.chunks_exact(row).enumerate() {
            let first = y / side * self.width as usize;
            for (x, _) in ids.iter().enumerate().filter(|(_, id)| **id != EMPTY) {
                let pixel = first + x / side;
                layers.coverage[pixel] += 1.0;
                if chosen(x) && chosen(y) {
                    shade(&mut layers, y * row + x, pixel);
                    shaded[pixel] += 1;
                }
            }
        }
        for (pixel, shaded) in shaded.into_iter().enumerate() {
            let hits = layers.coverage[pixel];
            let share = hits / (side * side) as f32;
            if hits > 0.0 && shaded == 0 {
                // None of the chosen ones: the first that is hit stands for all.
                let (x, y) = (pixel % self.width as usize, pixel / self.width as usize);
                let mut samples = (0..side * side)
                    .map(|i| (y * side + i / side) * row + x * side + i % side)
                    .filter(|&sample| self.triangle[sample] != EMPTY);
                if let Some(sample) = samples.next() {
                    shade(&mut layers, sample, pixel);
                }
            }
            layers.weigh(pixel, share / shaded.max(1) as f32);
            layers.coverage[pixel] = share;
        }
        for (pixel, distance) in layers.distance.iter_mut().enumerate() {
            let at = Vec2::new(
                (pixel % self.width as usize) as f32 + 0.5 - self.width as f32 / 2.0,
                (pixel / self.width as usize) as f32 + 0.5 - self.height as f32 / 2.0,
            );
            *distance *= camera.slant(at - camera.shift);
        }
        layers
    }
}

impl Layers {
    fn empty(width: u32, height: u32) -> Self {
        let pixels = width as usize * height as usize;
        Self {
            width,
            height,
            coverage: vec![0.0; pixels],
            color: vec![[0.0; 3]; pixels],
            normal: vec![Vec3::ZERO; pixels],
            distance: vec![0.0; pixels],
        }
    }

    fn add(&mut self, pixel: usize, albedo: [f32; 3], lit: f32, normal: Vec3, distance: f32) {
        for (sum, value) in self.color[pixel].iter_mut().zip(albedo) {
            *sum += value * lit;
        }
        self.normal[pixel] += normal;
        self.distance[pixel] += distance;
    }

    /// Multiplies everything but coverage.
    fn weigh(&mut self, pixel: usize, factor: f32) {
        self.color[pixel].iter_mut().for_each(|c| *c *= factor);
        self.normal[pixel] *= factor;
        self.distance[pixel] *= factor;
    }
}
