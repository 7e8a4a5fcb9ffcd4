//! Level 0 as prototypes of leaves and their places: what the file's leaves repeat is held once.
//!
//! A few hundred copies are plain nodes that share a mesh, which every client reads; more are
//! instances by EXT_mesh_gpu_instancing, which the file then requires.

use glam::Vec3;
use serde_json::{Value, json};

use super::gltf::FileBuilder;
use super::png::encode_images;
use super::surface::scene_of_groups;
use crate::botany::prototype::{Alike, Placed, Prototype, prototypes};
use crate::botany::tree::Tree;
use crate::error::Result;
use crate::recipe::Recipe;
use crate::report::schema::Instancing;

/// Copies under which a leaf stays where it is: its place takes about as much as a quad.
const LEAST_COPIES: usize = 4;

/// Writes the tree with its leaves as copies; `None` where no leaf has enough of them. What is said
/// of the file lacks its name and the size of the file that it stands beside.
///
/// # Errors
/// Those of encoding images.
pub fn write_instanced(
    tree: &Tree,
    recipe: &Recipe,
    extras: Value,
) -> Result<Option<(Vec<u8>, Instancing)>> {
    let found = prototypes(tree, &alike(recipe));
    if found.is_empty() {
        return Ok(None);
    }
    let rest = rest(tree, &found);
    let leaf = |p: &Prototype| tree.leaves[p.leaf as usize].triangles.as_slice();
    let groups = [rest.as_slice()].into_iter().chain(found.iter().map(leaf));
    let (mut scene, ranges) = scene_of_groups(&tree.model, groups);
    for (prototype, range) in found.iter().zip(&ranges[1..]) {
        for surface in &mut scene.surfaces[range.clone()] {
            for p in &mut surface.positions {
                *p = ((p.as_dvec3() - prototype.origin) / prototype.unit).as_vec3();
            }
        }
    }
    let copies: usize = found.iter().map(|p| p.copies.len()).sum();
    let as_nodes = copies <= recipe.instance_nodes as usize;

    let mut file = FileBuilder::default();
    let numbers = file.materials(&scene, encode_images(&scene)?);
    let mut children = Vec::new();
    if !rest.is_empty() {
        let surfaces = &scene.surfaces[ranges[0].clone()];
        let mesh = file.mesh_of("rest", surfaces, &scene.materials, &numbers)?;
        children.push(file.child(json!({ "name": "rest", "mesh": mesh })));
    }
    for (number, (prototype, range)) in found.iter().zip(&ranges[1..]).enumerate() {
        let (name, surfaces) = (format!("leaf {number}"), &scene.surfaces[range.clone()]);
        let mesh = file.mesh_of(&name, surfaces, &scene.materials, &numbers)?;
        let node = json!({ "name": name, "mesh": mesh });
        match as_nodes {
            true => children.extend(nodes(&mut file, &node, prototype)),
            false => children.push(instances(&mut file, node, prototype)),
        }
    }
    if !as_nodes {
        file.require_extension("EXT_mesh_gpu_instancing");
    }
    let root = json!({ "name": tree.model.name, "children": children });
    let root = file.placed(root, &tree.model.frame, extras);
    let bytes = file.finish(vec![root])?;
    let deviations = found.iter().flat_map(|p| &p.copies).map(|c| c.deviation);
    let told = Instancing {
        leaves: tree.leaves.len() as u64,
        prototypes: found.len() as u64,
        copies: copies as u64,
        plain_triangles: rest.len() as u64,
        extension: !as_nodes,
        largest_deviation: deviations.fold(0.0, f64::max),
        file_bytes: bytes.len() as u64,
        ..Instancing::default()
    };
    Ok(Some((bytes, told)))
}

/// What the recipe asks of copies.
fn alike(recipe: &Recipe) -> Alike {
    Alike {
        tolerance: recipe.instance_tolerance,
        normals_deg: recipe.instance_normals_deg,
        copies: LEAST_COPIES,
    }
}

/// Copies that there would be if normals did not count.
pub fn copies_but_for_normals(tree: &Tree, recipe: &Recipe) -> usize {
    let any = Alike {
        normals_deg: 180.0,
        ..alike(recipe)
    };
    prototypes(tree, &any).iter().map(|p| p.copies.len()).sum()
}

/// The triangles that no copy stands for.
fn rest(tree: &Tree, found: &[Prototype]) -> Vec<u32> {
    let mut plain = vec![true; tree.model.triangles.len()];
    for copy in found.iter().flat_map(|p| &p.copies) {
        for &t in &tree.leaves[copy.leaf as usize].triangles {
            plain[t as usize] = false;
        }
    }
    (0..plain.len() as u32)
        .filter(|&t| plain[t as usize])
        .collect()
}

/// A node for each copy.
fn nodes(file: &mut FileBuilder, node: &Value, prototype: &Prototype) -> Vec<usize> {
    let copy = |copy: &Placed| {
        let mut node = node.clone();
        let p = &copy.placement;
        node["translation"] = json!(p.translation.as_vec3().to_array());
        node["rotation"] = json!(p.rotation.as_quat().to_array());
        node["scale"] = json!(Vec3::splat(p.scale as f32).to_array());
        file.child(node)
    };
    prototype.copies.iter().map(copy).collect()
}

/// One node for all copies.
fn instances(file: &mut FileBuilder, mut node: Value, prototype: &Prototype) -> usize {
    let places = || prototype.copies.iter().map(|c| &c.placement);
    let moved: Vec<Vec3> = places().map(|p| p.translation.as_vec3()).collect();
    let turned: Vec<[f32; 4]> = places().map(|p| p.rotation.as_quat().to_array()).collect();
    let scaled: Vec<Vec3> = places().map(|p| Vec3::splat(p.scale as f32)).collect();
    node["extensions"] = file.instances(&moved, &turned, &scaled);
    file.child(node)
}
