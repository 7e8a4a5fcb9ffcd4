//! A billboard cloud as a file: one page for all rectangles, two triangles each.

use std::path::Path;
use std::sync::Arc;

use glam::Vec2;
use guillotiere::{AtlasAllocator, size2};
use pleach::Result;
use pleach::botany::Model;
use pleach::botany::model::{AlphaMode, Image, Material, TextureRef, Wrap};
use pleach::error::Error;
use pleach::export::gltf::write_glb;
use pleach::export::png::encode_images;
use pleach::export::surface::{Scene, Surface};
use rayon::prelude::*;

use crate::decoret::Billboard;
use crate::paint::{Painter, facing, paste};

/// Empty texels between rectangles.
const GUTTER: u32 = 2;

/// Paints the billboards on a page of `side` x `side` texels and writes them with it.
pub fn write(model: &Model, cloud: &[Billboard], side: u32, file: &Path) -> Result<()> {
    let (density, places) = densest(cloud, side);
    let painter = Painter::new(model);
    let images: Vec<Vec<u8>> = cloud
        .par_iter()
        .map(|billboard| {
            let size = texels(billboard, density);
            let to = [-billboard.normal, billboard.half[1]];
            let camera = facing(billboard.center, to, density, size);
            painter.paint(&camera, Some(&billboard.painted))
        })
        .collect();
    let mut page = vec![0; side as usize * side as usize * 4];
    let mut quads = quads();
    for ((billboard, image), &place) in cloud.iter().zip(&images).zip(&places) {
        let size = texels(billboard, density);
        paste(&mut page, side, image, size[0], place);
        add(&mut quads, billboard, density, place, side);
    }
    let scene = Scene {
        surfaces: vec![quads],
        materials: vec![cut_out()],
        images: vec![Image {
            name: "cloud".into(),
            width: side,
            height: side,
            rgba: Arc::new(page),
        }],
    };
    let pngs = encode_images(&scene)?;
    let glb = write_glb("cloud", &scene, &pngs, &model.frame, serde_json::json!({}))?;
    std::fs::write(file, glb).map_err(|e| Error::io(file, "write", e))
}

/// Width and height of a rectangle's image.
fn texels(billboard: &Billboard, density: f32) -> [u32; 2] {
    billboard
        .half
        .map(|half| (2.0 * half.length() * density).ceil().max(1.0) as u32)
}

/// The most texels a unit of length at which all rectangles fit on the page, and where they lie.
fn densest(cloud: &[Billboard], side: u32) -> (f32, Vec<[u32; 2]>) {
    let mut ends = [1.0, side as f32];
    let mut best = placed(cloud, ends[0], side).unwrap_or_default();
    for _ in 0..12 {
        let middle = 0.5 * (ends[0] + ends[1]);
        match placed(cloud, middle, side) {
            Some(places) => (best, ends[0]) = (places, middle),
            None => ends[1] = middle,
        }
    }
    (ends[0], best)
}

fn placed(cloud: &[Billboard], density: f32, side: u32) -> Option<Vec<[u32; 2]>> {
    let mut page = AtlasAllocator::new(size2(side as i32, side as i32));
    let sizes: Vec<[u32; 2]> = cloud.iter().map(|b| texels(b, density)).collect();
    let mut order: Vec<usize> = (0..cloud.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse((sizes[i][0].max(sizes[i][1]), i)));
    let mut places = vec![[0; 2]; cloud.len()];
    for i in order {
        let [width, height] = sizes[i].map(|s| (s + GUTTER) as i32);
        let min = page.allocate(size2(width, height))?.rectangle.min;
        places[i] = [min.x as u32, min.y as u32];
    }
    Some(places)
}

fn quads() -> Surface {
    Surface {
        name: "cloud".into(),
        ..Surface::default()
    }
}

fn add(quads: &mut Surface, billboard: &Billboard, density: f32, place: [u32; 2], side: u32) {
    let first = quads.positions.len() as u32;
    quads.positions.extend(billboard.corners());
    quads.normals.extend([billboard.normal; 4]);
    // The rectangle lies in the middle of its image, whose sides are whole texels.
    let size = texels(billboard, density);
    let corner = |u: f32, v: f32| {
        let half = billboard.half.map(glam::Vec3::length);
        let x = place[0] as f32 + 0.5 * size[0] as f32 + u * half[0] * density;
        let y = place[1] as f32 + 0.5 * size[1] as f32 - v * half[1] * density;
        Vec2::new(x, y) / side as f32
    };
    quads.uvs[0].extend([
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ]);
    quads
        .triangles
        .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
}

fn cut_out() -> Material {
    Material {
        name: "cloud".into(),
        base_color: Some(TextureRef {
            image: 0,
            uv_set: 0,
            wrap: [Wrap::Clamp; 2],
            linear: true,
        }),
        metallic_factor: 0.0,
        alpha_mode: AlphaMode::Mask,
        alpha_cutoff: 0.5,
        double_sided: true,
        ..Material::default()
    }
}
