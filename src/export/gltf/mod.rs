//! Writes one level as glTF: stock materials, PNG textures, float attributes.
//!
//! Single files carry no required extension, because that is the only form that every client
//! shows right. The root node holds the similarity from normalised space back to the world.

mod material;

use std::borrow::Cow;

use glam::Vec3;
use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};
use serde_json::{Map, Value, json};

use super::joined::joined;
use super::surface::{Scene, Surface, textures_of};
use super::tangent::tangents;
use crate::botany::model::{Frame, Material};
use crate::error::{Error, Result};
use crate::space::glb::{Glb, GlbBuilder};
use crate::space::sha256::sha256;

/// Writes `scene` with its encoded images as a GLB named `name`; `extras` go on the root node.
pub fn write_glb(
    name: &str,
    scene: &Scene,
    pngs: &[Vec<u8>],
    frame: &Frame,
    extras: Value,
) -> Result<Vec<u8>> {
    glb(name, scene, pngs, frame, extras).map(Glb::into_bytes)
}

/// As [`write_glb`], with images where they are.
pub fn glb<'b>(
    name: &str,
    scene: &Scene,
    pngs: &'b [Vec<u8>],
    frame: &Frame,
    extras: Value,
) -> Result<Glb<'b>> {
    let mut file = FileBuilder::for_scenes([scene].into_iter());
    let mesh = file.mesh(name, scene, pngs)?;
    let node = file.node(name, mesh, frame, extras);
    file.finish_in_pieces(vec![node])
}

/// Writes `scene` as [`write_glb`] does, with images in files of their own (`uris`).
pub fn write_linked(
    name: &str,
    scene: &Scene,
    uris: &[String],
    frame: &Frame,
    extras: &Value,
) -> Result<Vec<u8>> {
    let mut file = FileBuilder::default();
    let mesh = file.linked_mesh(name, scene, uris)?;
    let node = file.node(name, mesh, frame, extras.clone());
    file.finish(vec![node])
}

/// Collects what goes into one file; several levels may share it.
#[derive(Default)]
pub struct FileBuilder<'b> {
    glb: GlbBuilder<'b>,
    meshes: Vec<Value>,
    /// Nodes in order; `MSFT_lod` is wired by the caller through [`Self::node_mut`].
    nodes: Vec<Value>,
    materials: Vec<Value>,
    textures: Vec<Value>,
    images: Vec<Value>,
    /// SHA-256 of each image; of those in files of their own the name.
    digests: Vec<String>,
    samplers: Vec<Value>,
    unlit: bool,
    used: Vec<&'static str>,
    required: Vec<&'static str>,
}

impl<'b> FileBuilder<'b> {
    /// As an empty one, with room for scenes: files of large trees are not copied while they grow.
    pub fn for_scenes<'s>(scenes: impl Iterator<Item = &'s Scene>) -> Self {
        let bytes = scenes.flat_map(|s| &s.surfaces).map(Surface::bytes);
        Self {
            glb: GlbBuilder::with_capacity(bytes.sum()),
            ..Self::default()
        }
    }

    /// Adds all surfaces of a scene as one mesh and returns its index; `pngs` are its images.
    /// Images and materials that an earlier mesh has brought are shared.
    pub fn mesh(&mut self, name: &str, scene: &Scene, pngs: &'b [Vec<u8>]) -> Result<usize> {
        let materials = self.materials(scene, pngs);
        self.mesh_of(name, &scene.surfaces, &scene.materials, &materials)
    }

    /// [`FileBuilder::mesh`] with images in files of their own (`uris`).
    pub fn linked_mesh(&mut self, name: &str, scene: &Scene, uris: &[String]) -> Result<usize> {
        let materials = self.linked_materials(scene, &scene.surfaces, uris);
        self.mesh_of(name, &scene.surfaces, &scene.materials, &materials)
    }

    /// Adds a scene's materials and images; returns the number of each material in the file.
    pub fn materials(
        &mut self,
        scene: &Scene,
        pngs: impl IntoIterator<Item = impl Into<Cow<'b, [u8]>>>,
    ) -> Vec<usize> {
        let images: Vec<usize> = scene
            .images
            .iter()
            .zip(pngs)
            .map(|(image, png)| self.image(&image.name, png.into()))
            .collect();
        scene
            .materials
            .iter()
            .map(|material| {
                let value = self.material(material, &images);
                find_or_push(&mut self.materials, value)
            })
            .collect()
    }

    /// Adds those of a scene's materials that `surfaces` use, with images in files of their own
    /// (`uris`); returns the number of each material in the file, of unused ones 0.
    pub fn linked_materials(
        &mut self,
        scene: &Scene,
        surfaces: &[Surface],
        uris: &[String],
    ) -> Vec<usize> {
        let mut numbers = vec![0; scene.materials.len()];
        let mut images = vec![0; scene.images.len()];
        for surface in surfaces {
            let mut material = scene.materials[surface.material as usize].clone();
            for texture in textures_of(&mut material).into_iter().flatten() {
                let image = texture.image as usize;
                images[image] = self.linked_image(&scene.images[image].name, &uris[image]);
            }
            let value = self.material(&material, &images);
            numbers[surface.material as usize] = find_or_push(&mut self.materials, value);
        }
        numbers
    }

    /// Adds surfaces as one mesh and returns its index, those of one material as one primitive; `numbers` are those of
    /// their materials in the file ([`FileBuilder::materials`]).
    pub fn mesh_of(
        &mut self,
        name: &str,
        surfaces: &[Surface],
        materials: &[Material],
        numbers: &[usize],
    ) -> Result<usize> {
        let mut primitives = Vec::new();
        for surface in &joined(surfaces, numbers) {
            let uses = uv_sets(&materials[surface.material as usize]);
            let mut attributes = Map::new();
            attributes.insert(
                "POSITION".into(),
                json!(self.glb.positions(&surface.positions)),
            );
            attributes.insert("NORMAL".into(), json!(self.glb.vec3(&surface.normals)));
            if let Some(tangents) = tangents_of(surface, &materials[surface.material as usize]) {
                attributes.insert("TANGENT".into(), json!(self.glb.vec4(&tangents)));
            }
            if uses[0] || uses[1] {
                attributes.insert("TEXCOORD_0".into(), json!(self.glb.vec2(&surface.uvs[0])));
            }
            if uses[1] && !surface.uvs[1].is_empty() {
                attributes.insert("TEXCOORD_1".into(), json!(self.glb.vec2(&surface.uvs[1])));
            }
            if !surface.colors.is_empty() {
                attributes.insert("COLOR_0".into(), json!(self.glb.vec4(&surface.colors)));
            }
            let indices = self
                .glb
                .indices(&surface.triangles, surface.positions.len());
            primitives.push(json!({
                "attributes": attributes,
                "indices": indices,
                "material": numbers[surface.material as usize],
            }));
        }
        if primitives.is_empty() {
            return Err(Error::Internal {
                step: "write glTF",
                what: format!("level {name} has no triangle"),
            });
        }
        self.meshes
            .push(json!({ "name": name, "primitives": primitives }));
        Ok(self.meshes.len() - 1)
    }

    fn image(&mut self, name: &str, png: Cow<'b, [u8]>) -> usize {
        let digest = sha256(&png);
        if let Some(index) = self.digests.iter().position(|d| *d == digest) {
            return index;
        }
        let view = self.glb.view_of(png, None);
        let mut entry = json!({ "bufferView": view, "mimeType": "image/png" });
        if !name.is_empty() {
            entry["name"] = json!(name);
        }
        self.images.push(entry);
        self.digests.push(digest);
        self.images.len() - 1
    }

    fn linked_image(&mut self, name: &str, uri: &str) -> usize {
        // A name is no digest: both kinds share one list.
        if let Some(index) = self.digests.iter().position(|d| d == uri) {
            return index;
        }
        let mut entry = json!({ "uri": reference(uri) });
        if !name.is_empty() {
            entry["name"] = json!(name);
        }
        self.images.push(entry);
        self.digests.push(uri.into());
        self.images.len() - 1
    }

    /// Adds a node that places a mesh in the world and returns its index.
    pub fn node(&mut self, name: &str, mesh: usize, frame: &Frame, extras: Value) -> usize {
        let node = json!({ "name": name, "mesh": mesh });
        self.placed(node, frame, extras)
    }

    /// Adds a node that is not placed: its children are in normalised space where their parent is
    /// [`FileBuilder::placed`].
    pub fn child(&mut self, node: Value) -> usize {
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// Places a node in the world, adds it and returns its index.
    pub fn placed(&mut self, mut node: Value, frame: &Frame, extras: Value) -> usize {
        let c = frame.center.to_array().map(|v| v as f32);
        let r = frame.radius as f32;
        if c != [0.0; 3] {
            node["translation"] = json!(c);
        }
        if r != 1.0 {
            node["scale"] = json!([r, r, r]);
        }
        if !extras.is_null() {
            node["extras"] = extras;
        }
        self.child(node)
    }

    /// What EXT_mesh_gpu_instancing says of a node: translations, rotations (x, y, z, w), scales.
    pub fn instances(&mut self, moved: &[Vec3], turned: &[[f32; 4]], scaled: &[Vec3]) -> Value {
        json!({ "EXT_mesh_gpu_instancing": { "attributes": {
            "TRANSLATION": self.glb.vec3(moved),
            "ROTATION": self.glb.vec4(turned),
            "SCALE": self.glb.vec3(scaled),
        } } })
    }

    /// The JSON of a node, for extensions.
    pub fn node_mut(&mut self, node: usize) -> &mut Value {
        &mut self.nodes[node]
    }

    /// Names an extension in `extensionsUsed`.
    pub fn use_extension(&mut self, name: &'static str) {
        if !self.used.contains(&name) {
            self.used.push(name);
        }
    }

    /// Names an extension without which the file shows something else.
    pub fn require_extension(&mut self, name: &'static str) {
        self.use_extension(name);
        self.required.push(name);
    }

    /// The file with a scene of the given nodes.
    ///
    /// # Errors
    /// [`Error::Usage`] where it is too large for a GLB.
    pub fn finish(self, scene_nodes: Vec<usize>) -> Result<Vec<u8>> {
        self.finish_in_pieces(scene_nodes).map(Glb::into_bytes)
    }

    /// As [`FileBuilder::finish`], with images where they are.
    ///
    /// # Errors
    /// As [`FileBuilder::finish`].
    pub fn finish_in_pieces(self, scene_nodes: Vec<usize>) -> Result<Glb<'b>> {
        self.with_scenes(vec![json!({ "nodes": scene_nodes })])
    }

    /// The file with several scenes by name, the first of which is shown; no node is in two.
    ///
    /// # Errors
    /// As [`FileBuilder::finish`].
    pub fn finish_scenes(self, scenes: &[(&str, Vec<usize>)]) -> Result<Vec<u8>> {
        let scene = |(name, nodes): &(&str, Vec<usize>)| json!({ "name": name, "nodes": nodes });
        self.with_scenes(scenes.iter().map(scene).collect())
            .map(Glb::into_bytes)
    }

    fn with_scenes(mut self, scenes: Vec<Value>) -> Result<Glb<'b>> {
        fits(self.glb.bytes() as u64)?;
        if self.unlit {
            self.use_extension("KHR_materials_unlit");
        }
        let generator = concat!("pleach ", env!("CARGO_PKG_VERSION"));
        let mut root = json!({
            "asset": { "version": "2.0", "generator": generator },
            "scene": 0,
            "scenes": scenes,
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
        });
        for (key, list) in [
            ("textures", self.textures),
            ("images", self.images),
            ("samplers", self.samplers),
        ] {
            if !list.is_empty() {
                root[key] = Value::Array(list);
            }
        }
        if !self.used.is_empty() {
            root["extensionsUsed"] = json!(self.used);
        }
        if !self.required.is_empty() {
            root["extensionsRequired"] = json!(self.required);
        }
        Ok(self.glb.finish_in_pieces(root))
    }
}

/// Bytes that the views of a GLB may have together: all lengths in it are numbers of 32 bits, and the JSON takes some, too.
const MOST_BYTES: u64 = u32::MAX as u64 - (1 << 28);

fn fits(bytes: u64) -> Result<()> {
    match bytes <= MOST_BYTES {
        true => Ok(()),
        false => Err(Error::Usage {
            what: format!(
                "a file of this package would have {:.1} GB beside its JSON, and in a GLB there is room for {:.1}",
                bytes as f64 / 1e9,
                MOST_BYTES as f64 / 1e9
            ),
            help: "start with fewer triangles, bake without --hierarchy, or lower texel_density in the recipe".into(),
        }),
    }
}

/// A file's name as a URI says it: letters that mean something there, and those that ASCII lacks, encoded.
pub fn reference(file: &str) -> String {
    const TOLD: AsciiSet = NON_ALPHANUMERIC
        .remove(b'-')
        .remove(b'_')
        .remove(b'.')
        .remove(b'~');
    utf8_percent_encode(file, &TOLD).to_string()
}

/// The surface's tangents; made where a normal map needs them and the source has none, because
/// engines would each make their own.
fn tangents_of(surface: &Surface, material: &Material) -> Option<Vec<[f32; 4]>> {
    if !surface.tangents.is_empty() {
        return Some(surface.tangents.clone());
    }
    let uvs = &surface.uvs[usize::from(material.normal?.uv_set)];
    let complete = uvs.len() == surface.positions.len();
    complete.then(|| {
        tangents(
            &surface.positions,
            &surface.normals,
            uvs,
            &surface.triangles,
        )
    })
}

fn uv_sets(m: &Material) -> [bool; 2] {
    let mut copy = m.clone();
    let mut uses = [false; 2];
    for texture in textures_of(&mut copy).into_iter().flatten() {
        uses[usize::from(texture.uv_set)] = true;
    }
    uses
}

fn find_or_push(list: &mut Vec<Value>, value: Value) -> usize {
    match list.iter().position(|v| *v == value) {
        Some(index) => index,
        None => {
            list.push(value);
            list.len() - 1
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_whose_lengths_would_not_fit_is_an_error_that_says_its_size() {
        assert!(fits(0).is_ok() && fits(4_000_000_000).is_ok());
        let Err(error) = fits(5_100_000_000) else {
            panic!("5.1 GB are too many");
        };
        assert!(
            error
                .to_string()
                .contains("would have 5.1 GB beside its JSON, and in a GLB there is room for 4.0"),
            "{error}"
        );
        assert_eq!(error.exit_code(), 2);
    }
}
