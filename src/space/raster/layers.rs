//! All that a pixel shows: coverage, lit colour, normal and distance, averaged over its samples.

use glam::Vec3;

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

impl Items {
    /// Shades every sample. `reliefs` are the materials' normal maps, as many as materials.
    ///
    /// `scene`, `camera` (an orthographic one) and `sampling` must be those that the items were
    /// drawn with.
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
        let mut cached: Option<(u32, Surface, Option<Bumps>)> = None;
        let row = (self.width * self.side) as usize;
        for (sample, &id) in self.triangle.iter().enumerate() {
            if id == EMPTY {
                continue;
            }
            let (x, y) = (sample % row, sample / row);
            let pixel = y / self.side as usize * self.width as usize + x / self.side as usize;
            if cached.as_ref().is_none_or(|(cached, ..)| *cached != id) {
                cached = Surface::new(scene, &corners, id, sampling).map(|surface| {
                    let indices = &scene.geometry.triangles[id as usize];
                    let at = indices.map(|i| corners[i as usize]);
                    let material = scene.geometry.triangle_material.get(id as usize);
                    let relief = reliefs.get(material.map_or(0, |&m| m as usize));
                    let bumps = relief.and_then(Option::as_ref).and_then(|relief| {
                        let triangle = Triangle::new(at, true)?;
                        Bumps::new(relief, scene, indices, at, &triangle)
                    });
                    (id, surface, bumps)
                });
            }
            let Some((_, surface, bumps)) = &cached else {
                continue;
            };
            let (x, y) = (x as i32, y as i32);
            let (albedo, mut normal) = surface.at(x, y);
            if let Some(bumps) = bumps {
                normal = bumps.at(x, y, normal * surface.side) * surface.side;
            }
            let lit = light.on(normal);
            for (sum, value) in layers.color[pixel].iter_mut().zip(albedo) {
                *sum += value * lit;
            }
            layers.normal[pixel] += normal;
            layers.distance[pixel] -= self.near[sample];
            layers.coverage[pixel] += 1.0;
        }
        layers.scale(1.0 / (self.side * self.side) as f32);
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

    fn scale(&mut self, factor: f32) {
        self.coverage.iter_mut().for_each(|v| *v *= factor);
        self.color
            .as_flattened_mut()
            .iter_mut()
            .for_each(|v| *v *= factor);
        self.normal.iter_mut().for_each(|v| *v *= factor);
        self.distance.iter_mut().for_each(|v| *v *= factor);
    }

    /// As seen from twice as far: four pixels become one. An odd last row or column is dropped.
    pub fn halved(&self) -> Self {
        let mut half = Self::empty(self.width / 2, self.height / 2);
        let row = self.width as usize;
        for pixel in 0..half.coverage.len() {
            let (x, y) = (pixel % half.width as usize, pixel / half.width as usize);
            let first = 2 * y * row + 2 * x;
            for from in [first, first + 1, first + row, first + row + 1] {
                half.coverage[pixel] += self.coverage[from];
                for (sum, value) in half.color[pixel].iter_mut().zip(self.color[from]) {
                    *sum += value;
                }
                half.normal[pixel] += self.normal[from];
                half.distance[pixel] += self.distance[from];
            }
        }
        half.scale(0.25);
        half
    }
}
