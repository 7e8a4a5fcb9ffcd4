//! Reads .glb and .gltf into a [`Model`]; every check of the input is here.
//!
//! After this step all indices are in range, all numbers finite, all triangles have an area and
//! all normals length one: nobody downstream checks again. A file that can't be read is an error
//! that names the place and what to do; what can be left out is a warning in [`Model::warnings`].
//!
//! ```text
//! container  bytes        -> JSON and binary chunk
//! buffer     JSON, URIs   -> bytes of every buffer view (meshopt decompressed)
//! scene      nodes        -> placements: which mesh stands where
//! aside      names        -> nodes that are no part of the tree: coarser levels, shapes for collisions
//! primitive  accessors    -> parts: the triangles of one primitive in its own space
//! ground     placed parts -> those that are not the lawn under the tree
//! material   textures     -> materials and decoded images
//! normalise  placed parts -> the model in normalised space
//! ```

mod accessor;
mod aside;
mod buffer;
mod container;
mod copies;
mod ground;
mod image;
mod json;
mod material;
mod meshopt;
mod normalise;
mod primitive;
mod scene;
mod settled;
mod skin;
mod triangle;
mod unseen;
mod uri;
mod warning;

use std::path::Path;

use glam::DMat4;

use super::model::Model;
use crate::{Error, Result};
use buffer::Asset;
use image::Texels;
use warning::Warnings;

/// How large an input may be; beyond it, [`load_with`] ends with an error that names the limit.
///
/// The defaults are far above any tree that was seen, and low enough that a broken or hostile
/// file ends in an error instead of an exhausted machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Triangles after instances are expanded.
    pub triangles: usize,
    /// Texels of all decoded images together (4 bytes each).
    pub pixels: u64,
    /// Nodes of the scene, and placed primitives (instances count one each).
    pub nodes: usize,
    /// Bytes of the file, its external files, and of all decompressed buffers, each for itself.
    pub bytes: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            triangles: 50_000_000,
            pixels: 1 << 29,
            nodes: 8_000_000,
            bytes: 1 << 32,
        }
    }
}

/// Reads a .glb or .gltf file with its external buffers and images, within the default [`Limits`].
///
/// # Errors
/// [`Error::Io`] where a file can't be read, [`Error::Input`] where its content can't be used.
pub fn load(path: &Path) -> Result<Model> {
    load_with(path, &Limits::default())
}

/// As [`load`], but of images that are no material's base colour only the sizes: enough to measure silhouettes and costs.
///
/// # Errors
/// As [`load`].
pub fn load_base_colors(path: &Path) -> Result<Model> {
    let limits = Limits::default();
    base_colors_of(&read(path, &limits)?, path, &limits)
}

/// As [`load_slice`], of what [`load_base_colors`] reads.
///
/// # Errors
/// As [`load`].
pub fn base_colors_of(bytes: &[u8], path: &Path, limits: &Limits) -> Result<Model> {
    model(bytes, path, limits, Texels::OfBaseColors)
}

/// Reads a .glb or .gltf file within the given limits.
///
/// # Errors
/// As [`load`].
pub fn load_with(path: &Path, limits: &Limits) -> Result<Model> {
    let bytes = read(path, limits)?;
    load_slice(&bytes, path, limits)
}

/// The bytes of a .glb or .gltf, without the files that it refers to.
///
/// # Errors
/// [`Error::Io`], or [`Error::Input`] where it is no regular file or too large.
pub fn read(path: &Path, limits: &Limits) -> Result<Vec<u8>> {
    container::read_file(path, limits)
}

/// The files that a .glb or .gltf in memory refers to: each URI and its bytes.
///
/// # Errors
/// As [`load`], where a file can't be read or lies outside the document's folder.
pub fn references(bytes: &[u8], path: &Path, limits: &Limits) -> Result<Vec<(String, Vec<u8>)>> {
    let (document, _) = container::open(bytes, path, limits)?;
    let buffers = document.buffers.iter().enumerate();
    let buffers = buffers.map(|(i, b)| (format!("buffer {i}"), &b.uri));
    let images = document.images.iter().enumerate();
    let images = images.map(|(i, image)| (format!("image {i}"), &image.uri));
    let mut out = Vec::new();
    for (place, uri) in buffers.chain(images) {
        if let Some(uri) = uri
            && !uri
                .get(..5)
                .is_some_and(|s| s.eq_ignore_ascii_case("data:"))
        {
            out.push((uri.clone(), uri::fetch(path, uri, &place, limits)?.0));
        }
    }
    Ok(out)
}

/// Reads a .glb or .gltf that is already in memory; `path` names it and anchors relative URIs.
///
/// # Errors
/// As [`load`].
pub fn load_slice(bytes: &[u8], path: &Path, limits: &Limits) -> Result<Model> {
    model(bytes, path, limits, Texels::All)
}

fn model(bytes: &[u8], path: &Path, limits: &Limits, texels: Texels) -> Result<Model> {
    let (document, chunk) = container::open(bytes, path, limits)?;
    let mut warnings = Warnings::default();
    container::check_extensions(&document, path, &mut warnings)?;
    let asset = Asset::open(path, &document, bytes.len() as u64, chunk, limits)?;

    let placements = scene::placements(&asset, &mut warnings)?;
    let mut materials = material::Materials::new(&asset, &placements, &mut warnings)?;
    let mut parts = primitive::read_all(&asset, &placements, &materials, &mut warnings)?;
    ground::drop_ground(&placements, &mut parts, &mut warnings);
    let mut model = normalise::assemble(&asset, placements, parts, &mut warnings)?;
    let mut file_bytes = asset.file_bytes;
    model.images = image::decode_all(&asset, &materials, texels, &mut file_bytes)?;
    model.materials = std::mem::take(&mut materials.list);
    unseen::drop_unseen(&asset, &mut model, &mut warnings)?;
    let copies = copies::drop_copies(&mut model);
    warnings.count("a triangle lies exactly on another: dropped", copies, "");
    model.file_bytes = file_bytes;
    model.name = path
        .file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default();
    model.warnings = warnings.into_lines();
    Ok(model)
}

/// Where a .glb or .gltf places its meshes: the transform of each node with a mesh, and of each of its
/// instances (EXT_mesh_gpu_instancing). The meshes themselves are not read.
///
/// # Errors
/// As [`load`].
pub fn places(path: &Path, limits: &Limits) -> Result<Vec<DMat4>> {
    let bytes = read(path, limits)?;
    let (document, chunk) = container::open(&bytes, path, limits)?;
    let mut warnings = Warnings::default();
    container::check_extensions(&document, path, &mut warnings)?;
    let asset = Asset::open(path, &document, bytes.len() as u64, chunk, limits)?;
    let all = scene::placements(&asset, &mut warnings)?;
    Ok(all.into_iter().map(|p| p.world_from_mesh).collect())
}

/// Shorthand for an input error of one file.
fn fault(
    path: &Path,
    place: impl Into<String>,
    what: impl Into<String>,
    help: impl Into<String>,
) -> Error {
    Error::input(path, place, what, help)
}
