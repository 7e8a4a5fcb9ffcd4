//! The hierarchy of sub-trees as files: all tiles in one GLB, and each tile in one of its own.
//!
//! In the one GLB all billboards share a page, hence a material; the first scene is the geometry of
//! all tips (there is none where nothing is ever opened), the second holds the billboards of all
//! tiles, each in a node that is named in the manifest. A viewer shows the tree; an engine takes the
//! nodes that its cut names.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec2;
use serde_json::Value;

use super::blocks;
use super::gltf::{FileBuilder, write_glb};
use super::maps::Maps;
use super::png::encode_images;
use super::surface::{Scene, Surface, scene_of_groups};
use crate::botany::model::{Frame, Image, Model};
use crate::error::Result;
use crate::level::Level;

/// A tile that is ready to be written.
pub struct TileFiles {
    /// Name of its node.
    pub node: String,
    /// What stands for it from afar.
    pub billboards: Option<Level>,
    /// Where its normalised space lies in the world.
    pub frame: Frame,
    /// Its triangles, where it is a tip.
    pub geometry: Option<Vec<u32>>,
    /// What its nodes say of it.
    pub extras: Value,
}

impl TileFiles {
    /// Name of the node of its triangles.
    pub fn geometry_node(&self) -> String {
        self.node.clone() + " geometry"
    }
}

/// The triangles of all tips, with their images encoded once for all files.
pub struct Tips<'t> {
    tiles: Vec<&'t TileFiles>,
    scene: Scene,
    /// Surfaces of each tip.
    ranges: Vec<Range<usize>>,
    /// The scene's images as PNG.
    pub pngs: Vec<Vec<u8>>,
}

impl<'t> Tips<'t> {
    /// Of those tiles that have geometry.
    ///
    /// # Errors
    /// Those of encoding images.
    pub fn new(model: &Model, tiles: &'t [TileFiles]) -> Result<Self> {
        let triangles = tiles.iter().filter_map(|t| t.geometry.as_deref());
        let (scene, ranges) = scene_of_groups(model, triangles);
        Ok(Self {
            tiles: tiles.iter().filter(|t| t.geometry.is_some()).collect(),
            pngs: encode_images(&scene)?,
            scene,
            ranges,
        })
    }

    /// Each tip with its surfaces.
    fn each(&self) -> impl Iterator<Item = (&'t TileFiles, &[Surface])> {
        let ranges = self.ranges.iter().cloned();
        let surfaces = ranges.map(|range| &self.scene.surfaces[range]);
        self.tiles.iter().copied().zip(surfaces)
    }
}

/// Where the billboards of each tile lie on a page for all: left, top, width, height in texels; and
/// the page's size.
pub fn places(tiles: &[TileFiles]) -> (Vec<[u32; 4]>, [u32; 2]) {
    let size = |t: &TileFiles| t.billboards.as_ref().map_or([0; 2], |l| l.atlas);
    let carded: Vec<usize> = (0..tiles.len())
        .filter(|&i| size(&tiles[i]) != [0; 2])
        .collect();
    let sizes: Vec<[u32; 2]> = carded.iter().map(|&i| size(&tiles[i])).collect();
    let (corners, page) = blocks::place(&sizes);
    let mut out = vec![[0; 4]; tiles.len()];
    for ((&i, [x, y]), [w, h]) in carded.iter().zip(corners).zip(sizes) {
        out[i] = [x, y, w, h];
    }
    (out, page)
}

/// Writes all tiles into one GLB, their billboards on a page of the given size.
///
/// # Errors
/// Those of encoding images.
pub fn write_hierarchy(
    model: &Model,
    tiles: &[TileFiles],
    tips: &Tips,
    places: &[[u32; 4]],
    page: [u32; 2],
) -> Result<Vec<u8>> {
    let mut file = FileBuilder::default();
    let billboards = add_billboards(&mut file, tiles, places, page, Maps::of(model))?;
    let numbers = file.materials(&tips.scene, &tips.pngs);
    let mut geometry = Vec::with_capacity(tips.tiles.len());
    for (tile, surfaces) in tips.each() {
        let name = tile.geometry_node();
        let mesh = file.mesh_of(&name, surfaces, &tips.scene.materials, &numbers)?;
        geometry.push(file.node(&name, mesh, &model.frame, tile.extras.clone()));
    }
    // Where nothing is ever opened there is no geometry, and a scene without nodes is none.
    let mut scenes = vec![("geometry", geometry), ("billboards", billboards)];
    scenes.retain(|(_, nodes)| !nodes.is_empty());
    file.finish_scenes(&scenes)
}

/// Adds a node for the billboards of each tile that has some.
fn add_billboards(
    file: &mut FileBuilder,
    tiles: &[TileFiles],
    places: &[[u32; 4]],
    page: [u32; 2],
    maps: Maps,
) -> Result<Vec<usize>> {
    let names = maps.names();
    let mut texels = vec![vec![0; page[0] as usize * page[1] as usize * 4]; names.len()];
    let mut nodes = Vec::new();
    let mut scenes = Vec::new();
    for (tile, &[x, y, w, h]) in tiles.iter().zip(places) {
        let Some(level) = &tile.billboards else {
            continue;
        };
        let mut scene = level.scene.clone();
        if w > 0 {
            // Cards come last, and so do their images.
            let cards = scene.images.split_off(scene.images.len() - names.len());
            for (page_texels, image) in texels.iter_mut().zip(cards) {
                blocks::copy(page_texels, page[0], &image.rgba, [w, h], [x, y]);
            }
            scene.materials.pop();
            if let Some(surface) = scene.surfaces.last_mut() {
                let (at, size) = (Vec2::new(x as f32, y as f32), Vec2::new(w as f32, h as f32));
                let all = Vec2::new(page[0] as f32, page[1] as f32);
                for uv in &mut surface.uvs[0] {
                    *uv = (*uv * size + at) / all;
                }
            }
        }
        scenes.push((tile, scene, w > 0));
    }
    let page_scene = Scene {
        materials: vec![maps.material(0, true)],
        images: names
            .iter()
            .zip(texels)
            .map(|(name, rgba)| Image {
                name: (*name).into(),
                width: page[0],
                height: page[1],
                rgba: Arc::new(rgba),
            })
            .collect(),
        ..Scene::default()
    };
    let with_cards = scenes.iter().any(|s| s.2);
    let shared = match with_cards {
        true => file.materials(&page_scene, encode_images(&page_scene)?),
        false => Vec::new(),
    };
    for (tile, mut scene, carded) in scenes {
        let mut numbers = file.materials(&scene, encode_images(&scene)?);
        if carded {
            numbers.extend(&shared);
            scene.materials.extend(page_scene.materials.iter().cloned());
        }
        let mesh = file.mesh_of(&tile.node, &scene.surfaces, &scene.materials, &numbers)?;
        nodes.push(file.node(&tile.node, mesh, &tile.frame, tile.extras.clone()));
    }
    Ok(nodes)
}

/// The billboards of one tile as a GLB of its own; `None` where it has none.
///
/// # Errors
/// Those of encoding images.
pub fn write_billboards(tile: &TileFiles) -> Result<Option<Vec<u8>>> {
    let Some(level) = &tile.billboards else {
        return Ok(None);
    };
    let pngs = encode_images(&level.scene)?;
    let extras = tile.extras.clone();
    write_glb(&tile.node, &level.scene, &pngs, &tile.frame, extras).map(Some)
}

/// The triangles of the tips as GLBs of their own, in order; their images are files of these names.
///
/// # Errors
/// Those of writing meshes.
pub fn write_geometry(model: &Model, tips: &Tips, images: &[String]) -> Result<Vec<Vec<u8>>> {
    let scene = &tips.scene;
    let written = tips.each().map(|(tile, surfaces)| {
        let name = tile.geometry_node();
        let mut file = FileBuilder::default();
        let numbers = file.linked_materials(scene, surfaces, images);
        let mesh = file.mesh_of(&name, surfaces, &scene.materials, &numbers)?;
        let node = file.node(&name, mesh, &model.frame, tile.extras.clone());
        file.finish(vec![node])
    });
    written.collect()
}
