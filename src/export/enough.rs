//! How large a texture has to be: texels as fine as pixels, and no finer.

use glam::{Vec2, Vec3};

use super::mip::halve;
use super::surface::{Scene, Surface, textures_of};

/// Texels over pixels along a line: bark is seen from nearer than on average, and its mips blur.
const FINER: f32 = 2.0;

/// No texture gets smaller than this, texels.
const LEAST: u32 = 16;

/// Halves the images of a scene while they keep two texels a pixel, in the mean over the surface,
/// where one unit of space is so many pixels; `most` is the longest side that any may keep.
pub fn enough(scene: &mut Scene, pixels_per_unit: f32, most: u32) {
    let mut wanted = vec![Vec2::ZERO; scene.images.len()];
    for surface in &scene.surfaces {
        let mut material = scene.materials[surface.material as usize].clone();
        for texture in textures_of(&mut material).into_iter().flatten() {
            let texels = extent(surface, texture.uv_set) * pixels_per_unit * FINER;
            let all = &mut wanted[texture.image as usize];
            *all = all.max(texels);
        }
    }
    let colored = scene.colored_images();
    for ((image, wanted), colored) in scene.images.iter_mut().zip(wanted).zip(colored) {
        let finer = |side: u32, wanted: f32| side >= 2 * LEAST && (side / 2) as f32 >= wanted;
        while image.width > most
            || image.height > most
            || (finer(image.width, wanted.x) && finer(image.height, wanted.y))
        {
            halve(image, colored);
        }
    }
}

/// What one repeat of a texture measures on a surface along its two sides: mean over the area. Endless
/// where no triangle tells.
fn extent(surface: &Surface, uv_set: u8) -> Vec2 {
    let uvs = &surface.uvs[usize::from(uv_set)];
    let (mut sum, mut area) = (glam::DVec2::ZERO, 0.0f64);
    for &corners in &surface.triangles {
        let [p, q, r] = corners.map(|i| surface.positions[i as usize]);
        let (a, b) = (q - p, r - p);
        let [p, q, r] = corners.map(|i| uvs.get(i as usize).copied().unwrap_or_default());
        let (u, v) = (q - p, r - p);
        let determinant = u.perp_dot(v);
        // Change of place with the one coordinate while the other stays.
        let along = [(a * v.y - b * u.y), (b * u.x - a * v.x)].map(|d: Vec3| d / determinant);
        let along = Vec2::from(along.map(Vec3::length)).as_dvec2();
        if along.is_finite() {
            let weight = f64::from(a.cross(b).length());
            sum += along * weight;
            area += weight;
        }
    }
    match area > 0.0 {
        true => (sum / area).as_vec2(),
        false => Vec2::INFINITY,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::botany::model::{Image, Material, TextureRef, Wrap};

    /// A square of 1 x 2 on which the texture of 512 x 512 repeats 4 x 2 times.
    fn bark() -> Scene {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(Vec2::from);
        let texture = TextureRef {
            image: 0,
            uv_set: 0,
            wrap: [Wrap::Repeat; 2],
            linear: true,
        };
        Scene {
            surfaces: vec![Surface {
                positions: corners.map(|c| Vec3::new(c.x, 2.0 * c.y, 0.0)).to_vec(),
                uvs: [
                    corners.map(|c| Vec2::new(4.0 * c.x, 2.0 * c.y)).to_vec(),
                    Vec::new(),
                ],
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                ..Surface::default()
            }],
            materials: vec![Material {
                base_color: Some(texture),
                ..Material::default()
            }],
            images: vec![Image {
                name: "bark".into(),
                width: 512,
                height: 512,
                rgba: Arc::new(vec![128; 512 * 512 * 4]),
            }],
        }
    }

    #[test]
    fn a_texture_keeps_two_texels_a_pixel_along_its_larger_side() {
        let side = |pixels_per_unit: f32, most: u32| {
            let mut scene = bark();
            enough(&mut scene, pixels_per_unit, most);
            [scene.images[0].width, scene.images[0].height]
        };
        // A repeat is 1/4 by 1 unit: 100 pixels high where a unit is 100, so 200 texels are enough.
        assert_eq!(side(100.0, 2048), [256, 256]);
        assert_eq!(side(64.0, 2048), [128, 128]);
        assert_eq!(side(1000.0, 2048), [512, 512]);
        assert_eq!(side(1000.0, 64), [64, 64]);
        assert_eq!(side(0.001, 2048), [LEAST; 2]);
    }

    #[test]
    fn without_texture_coordinates_nothing_is_known_and_only_the_limit_holds() {
        let mut scene = bark();
        scene.surfaces[0].uvs[0].fill(Vec2::ONE);
        enough(&mut scene, 1.0, 256);
        assert_eq!(scene.images[0].width, 256);
    }
}
