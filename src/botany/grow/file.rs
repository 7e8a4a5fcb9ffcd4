//! Writes the tree as GLB.

use glam::{Mat3, Quat, Vec3};
use serde_json::{Value, json};

use super::foliage::{Placement, crown_center};
use super::mesh::Mesh;
use super::paint::Painted;
use super::species::Species;
use super::stem::Stem;
use super::{Foliage, Nodes, Options, Wood, bark, skin, tube};
use crate::space::glb::GlbBuilder;
use crate::{Error, Result};

/// How far normals of leaves lean outwards.
const ROUND_NORMALS: f32 = 0.55;

const BARK: usize = 0;
const LEAF: usize = 1;

/// Placements, the leaf that they place, and its texture.
pub(super) type Leaves = (Vec<Placement>, Mesh, Option<Painted>);

/// The file under construction.
#[derive(Default)]
struct Parts {
    glb: GlbBuilder<'static>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
}

impl Parts {
    /// Adds a mesh with one primitive.
    fn mesh(&mut self, name: &str, mesh: &Mesh, material: usize) -> usize {
        let glb = &mut self.glb;
        let mut attributes = json!({
            "POSITION": glb.positions(&mesh.positions),
            "NORMAL": glb.vec3(&mesh.normals),
            "TEXCOORD_0": glb.vec2(&mesh.uvs),
        });
        // Bark has a normal map.
        if material == BARK {
            attributes["TANGENT"] = json!(glb.vec4(&mesh.tangents()));
        }
        let indices = glb.indices(&mesh.triangles, mesh.positions.len());
        self.meshes.push(json!({ "name": name, "primitives": [
            { "attributes": attributes, "indices": indices, "material": material },
        ]}));
        self.meshes.len() - 1
    }

    fn node(&mut self, name: &str, mesh: usize) -> &mut Value {
        self.nodes.push(json!({ "name": name, "mesh": mesh }));
        let last = self.nodes.len() - 1;
        &mut self.nodes[last]
    }
}

/// The file and its triangles of wood and of foliage.
pub(super) fn write(
    species: &Species,
    options: &Options,
    stems: &[Stem],
    leaves: Option<Leaves>,
) -> Result<(Vec<u8>, [usize; 2])> {
    let mut parts = Parts::default();
    let wood = add_wood(&mut parts, species, options, stems);
    let mut images: Vec<(&str, Painted)> = Vec::new();
    let [color, relief] = bark::paint_bark(&species.bark);
    images.extend([("bark", color), ("bark_normal", relief)]);
    let mut foliage = 0;
    if let Some((placements, prototype, texture)) = leaves {
        foliage = placements.len() * prototype.triangles.len();
        let center = crown_center(stems);
        add_foliage(
            &mut parts,
            species,
            options,
            &placements,
            &prototype,
            center,
        );
        images.extend(texture.map(|t| ("leaf", t)));
    }
    let root = document(&mut parts, species, options, images)?;
    Ok((parts.glb.finish(root), [wood, foliage]))
}

fn add_wood(parts: &mut Parts, species: &Species, options: &Options, stems: &[Stem]) -> usize {
    let meshes: Vec<Mesh> = match options.wood {
        Wood::Skin => skin::skin(species, stems),
        Wood::Tubes => stems.iter().map(|s| tube::tube(species, s)).collect(),
        Wood::Soup => {
            let tubes = stems.iter().map(|s| tube::tube(species, s));
            tubes.map(Mesh::into_soup).collect()
        }
    };
    let count = meshes.iter().map(|m| m.triangles.len()).sum();
    // A skin is one piece, so it stays in one node.
    if options.nodes == Nodes::One || options.wood == Wood::Skin {
        let mut all = Mesh::default();
        for mesh in &meshes {
            all.append(mesh);
        }
        let name = format!("{}_wood", species.name);
        let mesh = parts.mesh(&name, &all, BARK);
        parts.node(&name, mesh);
        return count;
    }
    for (i, (mesh, stem)) in meshes.into_iter().zip(stems).enumerate() {
        let origin = stem.points[0];
        let name = format!("{}_branch_{i}", species.name);
        let mesh = parts.mesh(&name, &mesh.relative_to(origin), BARK);
        parts.node(&name, mesh)["translation"] = json!(origin.to_array());
    }
    count
}

fn add_foliage(
    parts: &mut Parts,
    species: &Species,
    options: &Options,
    placements: &[Placement],
    prototype: &Mesh,
    center: Vec3,
) {
    let name = format!("{}_leaves", species.name);
    if options.nodes == Nodes::One {
        let mut all = Mesh::default();
        for leaf in placements {
            let outwards = (leaf.origin - center).normalize_or(Vec3::Y);
            leaf.place(prototype, &mut all, outwards, ROUND_NORMALS);
        }
        let mesh = parts.mesh(&name, &all, LEAF);
        parts.node(&name, mesh);
        return;
    }
    let mesh = parts.mesh(&name, prototype, LEAF);
    for (i, leaf) in placements.iter().enumerate() {
        let [x, y, z] = leaf.axes;
        let turn = Quat::from_mat3(&Mat3::from_cols(x, y, z)).normalize();
        let mirror = if leaf.mirrored { -1.0 } else { 1.0 };
        let node = parts.node(&format!("{}_leaf_{i}", species.name), mesh);
        node["translation"] = json!(leaf.origin.to_array());
        node["rotation"] = json!(turn.to_array());
        node["scale"] = json!([mirror * leaf.scale, leaf.scale, leaf.scale]);
    }
}

/// Everything of the JSON but buffers, views and accessors.
fn document(
    parts: &mut Parts,
    species: &Species,
    options: &Options,
    images: Vec<(&str, Painted)>,
) -> Result<Value> {
    let mut list = Vec::new();
    for (name, painted) in &images {
        let png = painted.png().map_err(|e| Error::Internal {
            step: "grow",
            what: format!("the texture {name} can't be encoded: {e}"),
        })?;
        let view = parts.glb.view(&png, None);
        list.push(json!({ "name": name, "bufferView": view, "mimeType": "image/png" }));
    }
    let textures: Vec<Value> = (0..list.len())
        .map(|i| json!({ "source": i, "sampler": usize::from(i == 2) }))
        .collect();
    let mut materials = vec![json!({
        "name": "bark",
        "pbrMetallicRoughness": {
            "baseColorTexture": { "index": 0 }, "metallicFactor": 0.0, "roughnessFactor": 0.9,
        },
        "normalTexture": { "index": 1 },
    })];
    if list.len() > 2 {
        let mut leaf = json!({
            "name": "leaves",
            "pbrMetallicRoughness": {
                "baseColorTexture": { "index": 2 }, "metallicFactor": 0.0, "roughnessFactor": 0.75,
            },
            "doubleSided": true,
        });
        if options.foliage != Foliage::Polygons {
            leaf["alphaMode"] = json!("MASK");
            leaf["alphaCutoff"] = json!(0.5);
        }
        materials.push(leaf);
    }
    // REPEAT for bark, CLAMP_TO_EDGE for leaves.
    let wraps: &[u32] = if list.len() > 2 {
        &[10497, 33071]
    } else {
        &[10497]
    };
    let samplers: Vec<Value> = wraps
        .iter()
        .map(|w| json!({ "magFilter": 9729, "minFilter": 9987, "wrapS": w, "wrapT": w }))
        .collect();
    let roots: Vec<usize> = (0..parts.nodes.len()).collect();
    Ok(json!({
        "asset": { "version": "2.0", "generator": concat!("pleach grow ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "name": species.name, "nodes": roots }],
        "nodes": std::mem::take(&mut parts.nodes),
        "meshes": std::mem::take(&mut parts.meshes),
        "materials": materials,
        "textures": textures,
        "images": list,
        "samplers": samplers,
    }))
}
