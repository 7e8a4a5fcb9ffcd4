//! The original's silhouettes, rendered once and pooled for every level.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::refine::Target;
use crate::botany::model::{Model, Wrap};
use crate::space::directions::{Direction, training};
use crate::space::raster::{
    Camera, Geometry, Mask, Material, Mips, Sampling, Scene, Texture, coverage,
};
use crate::space::texture::cutoff;

/// Masks of the original from the training directions.
pub struct Original {
    /// The directions.
    pub directions: Vec<Direction>,
    /// One mask a direction, at `samples_per_unit`.
    masks: Vec<Mask>,
    /// Samples for a normalised unit.
    samples_per_unit: f32,
    /// Height of the tree in normalised units.
    pub height: f32,
}

/// A view of the unit sphere around the tree at `pixels` pixels a unit.
pub fn camera(direction: &Direction, pixels: f32) -> Camera {
    let side = (pixels * 2.0).ceil() as u32 + 2;
    Camera::orthographic(
        direction.forward,
        direction.up,
        Vec3::ZERO,
        pixels,
        side,
        side,
    )
}

/// Draws where `scene` is, one mask a camera.
pub fn masks(scene: &Scene, cameras: &[Camera], sampling: Sampling) -> Vec<Mask> {
    cameras
        .par_iter()
        .map(|c| coverage(scene, c, sampling))
        .collect()
}

impl Original {
    /// Renders `model` from `views` directions, the tree `height_samples` samples high.
    pub fn new(model: &Model, views: u32, height_samples: f32) -> Self {
        let textures: Vec<Texture> = model
            .images
            .par_iter()
            .map(|i| {
                let alpha = i.rgba.chunks_exact(4).map(|t| t[3]).collect();
                Texture::from_alpha(i.width, i.height, alpha)
            })
            .collect();
        let materials: Vec<Material> = model.materials.iter().map(raster_material).collect();
        let triangle_material: Vec<u32> = model
            .triangle_object
            .iter()
            .map(|&o| model.objects[o as usize].material)
            .collect();
        let scene = Scene {
            geometry: Geometry {
                positions: &model.positions,
                normals: &[],
                uvs: [&model.uvs[0], &model.uvs[1]],
                colors: &model.colors,
                triangles: &model.triangles,
                triangle_material: &triangle_material,
            },
            materials: &materials,
            textures: &textures,
        };
        let height = model.height().max(1e-6);
        let samples_per_unit = height_samples / height;
        let directions = training(views);
        let cameras: Vec<Camera> = directions
            .iter()
            .map(|d| camera(d, samples_per_unit))
            .collect();
        let sampling = Sampling {
            side: 1,
            mips: Mips::Base,
        };
        Self {
            masks: masks(&scene, &cameras, sampling),
            directions,
            samples_per_unit,
            height,
        }
    }

    /// Height of the tree in samples of its masks.
    pub fn height_samples(&self) -> f32 {
        self.samples_per_unit * self.height
    }

    /// Covered area in normalised units squared, one for each direction.
    pub fn areas(&self) -> Vec<f64> {
        let unit = f64::from(self.samples_per_unit);
        self.masks
            .iter()
            .map(|m| m.area() / (unit * unit))
            .collect()
    }

    /// Targets with cells of `pool` x `pool` samples; `taken` draws what covers cells beside cards.
    pub fn targets(&self, pool: u32, wood: Option<&Scene>) -> Vec<Target> {
        self.directions
            .par_iter()
            .zip(&self.masks)
            .map(|(direction, mask)| {
                let view = camera(direction, self.samples_per_unit);
                let size = [mask.width / pool, mask.height / pool];
                let cells = self.samples_per_unit / pool as f32;
                let taken = match wood {
                    Some(scene) => pooled(
                        &coverage(
                            scene,
                            &view,
                            Sampling {
                                side: 1,
                                mips: Mips::Base,
                            },
                        ),
                        pool,
                    ),
                    None => vec![false; (size[0] * size[1]) as usize],
                };
                Target {
                    right: view.right * cells,
                    down: -view.up * cells,
                    base: Vec2::new(mask.width as f32, mask.height as f32) / (2.0 * pool as f32),
                    size,
                    wanted: pooled(mask, pool),
                    taken,
                }
            })
            .collect()
    }
}

/// Cells of which at least half of the samples are covered.
fn pooled(mask: &Mask, pool: u32) -> Vec<bool> {
    let (w, h) = (mask.width / pool, mask.height / pool);
    let mut out = Vec::with_capacity((w * h) as usize);
    for y in 0..h {
        for x in 0..w {
            let rows = (y * pool..(y + 1) * pool).map(|r| {
                let from = (r * mask.width + x * pool) as usize;
                mask.samples[from..from + pool as usize]
                    .iter()
                    .map(|&s| u32::from(s))
                    .sum::<u32>()
            });
            out.push(rows.sum::<u32>() * 2 >= pool * pool);
        }
    }
    out
}

/// The raster's view of a material: where it is a hole and whether its back shows.
pub fn raster_material(m: &crate::botany::model::Material) -> Material {
    let cutoff = cutoff(m);
    Material {
        texture: m.base_color.map(|t| t.image),
        uv_set: m.base_color.map_or(0, |t| t.uv_set),
        wrap: m
            .base_color
            .map_or([crate::space::raster::Wrap::Repeat; 2], |t| {
                t.wrap.map(wrap)
            }),
        linear: m.base_color.is_none_or(|t| t.linear),
        factor: m.base_color_factor,
        cutoff: (cutoff > 0.0).then_some(cutoff),
        double_sided: m.double_sided,
    }
}

fn wrap(w: Wrap) -> crate::space::raster::Wrap {
    match w {
        Wrap::Repeat => crate::space::raster::Wrap::Repeat,
        Wrap::Mirror => crate::space::raster::Wrap::Mirror,
        Wrap::Clamp => crate::space::raster::Wrap::Clamp,
    }
}
