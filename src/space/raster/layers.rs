//! All that a pixel shows: coverage, lit colour, normal and distance, averaged over its samples.

use glam::{Vec2, Vec3};

use super::front::{EMPTY, Front};
use super::pane::Panes;
use super::relief::Relief;
use super::shade::Light;
use super::shader::{Shaded, Shader};
use super::{Camera, Mask, Sampling, Scene};

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

/// Draws where the scene is and how it looks. Of all samples that are hit 4 x 4 a pixel have a colour; where
/// there are more they tell coverage alone. Four neighbours of these that show one triangle are shaded once. `reliefs` are the materials' normal maps, as many as materials or none.
pub fn layers(
    scene: &Scene,
    camera: &Camera,
    sampling: Sampling,
    light: Light,
    reliefs: &[Option<Relief>],
) -> (Mask, Layers) {
    let corners = camera.project(scene.geometry.positions, sampling.side);
    let side = sampling.side as i32;
    let size = [camera.width as i32 * side, camera.height as i32 * side];
    let mut mask = Mask::empty(camera, sampling.side);
    let mut layers = Layers::empty(camera.width, camera.height);
    let mut samples = vec![0u32; layers.color.len()];
    let mut shader = Shader::new(scene, &corners, sampling, light, reliefs);
    let mut front = Front::default();
    for (pane, ids) in Panes::new(scene, &corners, size, side).each() {
        front.draw(scene, &corners, sampling, &pane, ids);
        for y in 0..pane.height() {
            let at = (pane.y[0] as usize + y) * size[0] as usize + pane.x[0] as usize;
            for (x, hit) in mask.samples[at..at + pane.width()].iter_mut().enumerate() {
                *hit = u8::from(front.at([x, y]).0 != EMPTY);
            }
        }
        shader.shade(&front, &pane, ids, |[x, y], seen| {
            let pixel = (y / side * camera.width as i32 + x / side) as usize;
            layers.add(pixel, &seen, camera.perspective);
            samples[pixel] += seen.samples;
        });
    }
    layers.coverage = mask.coverage().fraction;
    layers.finish(camera, &samples);
    (mask, layers)
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

    /// Adds what is seen at a sample of a pixel.
    fn add(&mut self, pixel: usize, seen: &Shaded, perspective: bool) {
        let share = seen.samples as f32;
        for (sum, value) in self.color[pixel].iter_mut().zip(seen.light) {
            *sum += value * share;
        }
        self.normal[pixel] += seen.normal * share;
        let distance = if perspective {
            1.0 / seen.near
        } else {
            -seen.near
        };
        self.distance[pixel] += distance * share;
    }

    /// From sums over so many samples of each pixel to means over all that it has.
    fn finish(&mut self, camera: &Camera, samples: &[u32]) {
        for (pixel, &samples) in samples.iter().enumerate() {
            let share = self.coverage[pixel] / samples.max(1) as f32;
            let (x, y) = (pixel % self.width as usize, pixel / self.width as usize);
            let middle = Vec2::new(self.width as f32, self.height as f32) / 2.0;
            let at = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - middle;
            self.color[pixel].iter_mut().for_each(|c| *c *= share);
            self.normal[pixel] *= share;
            self.distance[pixel] *= share * camera.slant(at - camera.shift);
        }
    }
}
