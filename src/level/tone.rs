//! The mean colour of cards, matched to that of what they stand for.
//!
//! What is opaque on a card is not what lies there in the mean: of sparse leaves beside a branch the branch passes the
//! alpha test, and a white birch turns whiter from level to level. So all texels of a page become as much lighter or darker,
//! channel by channel, that cards have the mean base colour of their triangles as they are seen
//! in the original. Light is left alone: engines have their own.

use std::sync::Arc;

use fixedbitset::FixedBitSet;
use glam::Vec2;
use rayon::prelude::*;

use super::{Baker, Level};
use crate::botany::model::Image;
use crate::export::original::{Original, raster_material};
use crate::export::surface::{Scene, Surface};
use crate::space::raster::{
    self, Camera, Geometry, Material, Sampling, Texture, Tone, each_tone, linear_from_srgb,
    srgb_from_linear,
};

/// Most that a channel's light is multiplied with, or divided by.
const MOST: f64 = 2.0;

/// What is seen of a level's cards, and in the original of what they stand for.
#[derive(Default)]
struct Seen {
    original: Tone,
    cards: Tone,
}

impl Baker<'_> {
    /// Gives the page of a level the colours that bring it to the original's mean.
    pub(super) fn toned(&self, mut level: Level) -> Level {
        let gain = gain(&[seen(&level, self.original)]);
        if let Some(page) = level.page_images_mut().first_mut() {
            multiply(page, gain);
        }
        level
    }
}

/// The same for levels that show one page.
pub(super) fn toned(levels: &mut [Level], originals: &[&Original]) {
    let both = levels.iter().zip(originals);
    let all: Vec<Seen> = both
        .map(|(level, original)| seen(level, original))
        .collect();
    let Some(mut page) = levels.iter().find_map(Level::page).cloned() else {
        return;
    };
    multiply(&mut page, gain(&all));
    for level in levels {
        if let Some(shown) = level.page_images_mut().first_mut() {
            shown.clone_from(&page);
        }
    }
}

/// What a level and its original show.
fn seen(level: &Level, original: &Original) -> Seen {
    // Crossed cards show a triangle each.
    let groups = level.plan.cards.iter();
    let shown: FixedBitSet = groups
        .flat_map(|card| card.triangles.iter().map(|&t| t as usize))
        .collect();
    let wanted = original.tone(&shown);
    if wanted.covered == 0.0 || level.page().is_none() {
        return Seen::default();
    }
    // As a client draws them where the level starts: what passes in mips is not what passes in the base level.
    let pixels = level.request.height_px / original.height;
    let cameras: Vec<Camera> = original.toned_from(pixels).collect();
    Seen {
        original: wanted,
        cards: Drawn::new(&level.scene).last_surface(&cameras),
    }
}

/// What light of each channel is to be multiplied with.
fn gain(all: &[Seen]) -> [f64; 3] {
    let original: Tone = all.iter().map(|s| s.original).sum();
    let cards: Tone = all.iter().map(|s| s.cards).sum();
    let (Some(wanted), Some(found)) = (original.mean(), cards.mean()) else {
        return [1.0; 3];
    };
    [0, 1, 2].map(|c| match found[c] > 0.0 {
        true => (wanted[c] / found[c]).clamp(1.0 / MOST, MOST),
        false => 1.0,
    })
}

/// Multiplies the light of an image's colours.
fn multiply(image: &mut Image, gain: [f64; 3]) {
    let table = gain.map(|gain| {
        let byte = |v: usize| {
            let light = linear_from_srgb(v as f32 / 255.0) * gain as f32;
            (srgb_from_linear(light.min(1.0)) * 255.0 + 0.5) as u8
        };
        std::array::from_fn::<u8, 256, _>(byte)
    });
    // In place where nothing else shows it: a page of 4096 x 4096 has 67 MB.
    let rgba = Arc::make_mut(&mut image.rgba);
    rgba.par_chunks_exact_mut(4).for_each(|texel| {
        for (value, table) in texel.iter_mut().zip(&table) {
            *value = table[usize::from(*value)];
        }
    });
}

/// A level's scene as one mesh for the raster.
struct Drawn {
    mesh: Surface,
    triangle_material: Vec<u32>,
    materials: Vec<Material>,
    textures: Vec<Texture>,
    /// The first triangle of the last surface.
    first_of_last: u32,
}

impl Drawn {
    fn new(scene: &Scene) -> Self {
        let mut mesh = Surface::default();
        let mut triangle_material = Vec::new();
        let mut first_of_last = 0;
        for part in &scene.surfaces {
            first_of_last = mesh.triangles.len() as u32;
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(&part.positions);
            let count = mesh.positions.len();
            for (all, own) in mesh.uvs.iter_mut().zip(&part.uvs) {
                all.extend(own);
                all.resize(count, Vec2::ZERO);
            }
            mesh.colors.extend(&part.colors);
            mesh.colors.resize(count, [1.0; 4]);
            let triangles = part.triangles.iter().map(|t| t.map(|i| i + first));
            mesh.triangles.extend(triangles);
            triangle_material.resize(mesh.triangles.len(), part.material);
        }
        let is_seen = scene.colored_images();
        let texture = |(image, is_seen): (&Image, bool)| match is_seen {
            true => Texture::from_rgba(image.width, image.height, &image.rgba),
            false => Texture::from_alpha(1, 1, vec![255]),
        };
        Self {
            first_of_last,
            mesh,
            triangle_material,
            materials: scene.materials.iter().map(raster_material).collect(),
            textures: scene.images.iter().zip(is_seen).map(texture).collect(),
        }
    }

    /// What all cameras see of the last surface.
    fn last_surface(&self, cameras: &[Camera]) -> Tone {
        let scene = raster::Scene {
            geometry: Geometry {
                positions: &self.mesh.positions,
                normals: &[],
                uvs: [&self.mesh.uvs[0], &self.mesh.uvs[1]],
                colors: &self.mesh.colors,
                triangles: &self.mesh.triangles,
                triangle_material: &self.triangle_material,
            },
            materials: &self.materials,
            textures: &self.textures,
        };
        let mut sum = Tone::default();
        each_tone(&scene, cameras, Sampling::CLIENT, |triangle, tone| {
            if triangle >= self.first_of_last {
                sum.add(tone);
            }
        });
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cards_get_the_mean_colour_of_what_they_stand_for() {
        let tone = |light, covered| Tone { light, covered };
        // Of two trees: six pixels of the original with means of .4, .2 and .1, ten of cards with .3, .8 and 0.
        let all = [
            Seen {
                original: tone([1.0, 0.2, 0.3], 2.0),
                cards: tone([1.0, 4.0, 0.0], 5.0),
            },
            Seen {
                original: tone([1.4, 1.0, 0.3], 4.0),
                cards: tone([2.0, 4.0, 0.0], 5.0),
            },
        ];
        let [red, green, blue] = gain(&all);
        assert!((red - 4.0 / 3.0).abs() < 1e-9, "{red}");
        // A quarter is more than is done; black stays black.
        assert_eq!([green, blue], [1.0 / MOST, 1.0]);
        // Nothing was seen.
        assert_eq!(gain(&[Seen::default()]), [1.0; 3]);
    }

    #[test]
    fn light_is_multiplied_and_alpha_is_not() {
        let mut image = Image {
            width: 1,
            height: 1,
            rgba: Arc::new(vec![188, 188, 250, 77]),
            ..Image::default()
        };
        multiply(&mut image, [1.0, 0.5, 1.5]);
        // sRGB 188 is light .503, half of which is sRGB 137; what is over 1 is 1.
        assert_eq!(*image.rgba, [188, 137, 255, 77]);
    }
}
