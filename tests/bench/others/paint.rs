//! Paints a part of a model as a texture: straight RGBA, supersampled, lit by nothing.

use glam::Vec3;
use pleach::botany::Model;
use pleach::report::Drawable;
use pleach::space::raster::{
    Camera, Geometry, Layers, Light, Material, Sampling, Scene, layers, srgb_from_linear,
};

/// A model that can be painted from anywhere.
pub struct Painter<'m> {
    drawable: Drawable<'m>,
    materials: Vec<Material>,
}

impl<'m> Painter<'m> {
    /// Makes a model ready; both sides of every face are painted.
    pub fn new(model: &'m Model) -> Self {
        let drawable = Drawable::shaded(model);
        let materials = drawable.scene().materials.iter().map(|m| Material {
            double_sided: true,
            ..*m
        });
        Self {
            materials: materials.collect(),
            drawable,
        }
    }

    /// The chosen faces (all: `None`) as the camera sees them, 4 bytes a pixel from the top.
    pub fn paint(&self, camera: &Camera, faces: Option<&[u32]>) -> Vec<u8> {
        let scene = self.drawable.scene();
        let whole = scene.geometry;
        let chosen = faces.map(|faces| {
            let index = |&face: &u32| face as usize;
            let corners: Vec<_> = faces.iter().map(|f| whole.triangles[index(f)]).collect();
            let materials: Vec<_> = faces
                .iter()
                .map(|f| whole.triangle_material[index(f)])
                .collect();
            (corners, materials)
        });
        let geometry = match &chosen {
            None => whole,
            Some((triangles, triangle_material)) => Geometry {
                triangles,
                triangle_material,
                ..whole
            },
        };
        let scene = Scene {
            geometry,
            materials: &self.materials,
            ..scene
        };
        let (_, layers) = layers(&scene, camera, Sampling::REFERENCE, Light::Unlit, &[]);
        rgba(&layers)
    }
}

fn rgba(layers: &Layers) -> Vec<u8> {
    let pixels = layers.color.iter().zip(&layers.coverage);
    let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let texel = |(color, &cover): (&[f32; 3], &f32)| {
        let [r, g, b] = color.map(|c| byte(srgb_from_linear(c / cover.max(1e-6))));
        [r, g, b, byte(cover)]
    };
    pixels.flat_map(texel).collect()
}

/// A camera that shows a rectangle around `center` as an image of so many pixels, and nothing else:
/// along `forward`, `up` upwards, at `pixels` for a unit of length.
pub fn facing(center: Vec3, [forward, up]: [Vec3; 2], pixels: f32, size: [u32; 2]) -> Camera {
    Camera::orthographic(forward, up, center, pixels, size[0], size[1])
}

/// Copies an image into a larger one, its left upper corner at `place`.
pub fn paste(page: &mut [u8], page_width: u32, image: &[u8], width: u32, place: [u32; 2]) {
    let row = width as usize * 4;
    for (y, line) in image.chunks_exact(row).enumerate() {
        let from = ((place[1] as usize + y) * page_width as usize + place[0] as usize) * 4;
        page[from..from + row].copy_from_slice(line);
    }
}
