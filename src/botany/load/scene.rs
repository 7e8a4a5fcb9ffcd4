//! Nodes: which mesh stands where in the world.

use std::collections::HashSet;
use std::rc::Rc;

use glam::{DMat4, DQuat, DVec3};

use super::accessor::Integers;
use super::aside::{self, Aside};
use super::buffer::{Asset, BROKEN};
use super::json::Node;
use super::skin;
use super::warning::Warnings;
use crate::Result;

/// One mesh, placed once.
pub(super) struct Placement {
    pub name: Rc<str>,
    pub mesh: usize,
    /// Which of its node's instances it is.
    pub instance: u32,
    pub world_from_mesh: DMat4,
}

/// Walks the scene (a loop, not a recursion: depth is the file's choice) and expands instances.
pub(super) fn placements(asset: &Asset, warnings: &mut Warnings) -> Result<Vec<Placement>> {
    let nodes = &asset.json.nodes;
    let mut seen = vec![false; nodes.len()];
    let roots = roots(asset, warnings)?;
    let coarser = aside::named(nodes, &roots);
    let roots = of_the_tree(asset, &roots, &coarser, warnings);
    let root = |node| (node, DMat4::IDENTITY);
    let mut stack: Vec<(usize, DMat4)> = roots.into_iter().rev().map(root).collect();
    let mut out = Vec::new();
    let mut worlds: Vec<Option<DMat4>> = vec![None; nodes.len()];
    let mut skinned = Vec::new();
    while let Some((index, world_from_parent)) = stack.pop() {
        let Some(node) = nodes.get(index) else {
            return Err(asset.fault("nodes", format!("there is no node {index}"), BROKEN));
        };
        let place = node_place(index, node);
        if std::mem::replace(&mut seen[index], true) {
            let what = "the node is reached twice: it has two parents, or is its own ancestor";
            return Err(asset.fault(place, what, BROKEN));
        }
        let extensions = node.extensions.as_deref();
        let visibility = extensions.and_then(|e| e.visibility.as_ref());
        if visibility.is_some_and(|v| v.visible == Some(false)) {
            warnings.say("a hidden node and all below it is skipped", &place);
            continue;
        }
        let world_from_node = world_from_parent * parent_from_node(node, asset, &place)?;
        if !world_from_node.is_finite() {
            let what = "its transform in the world is not finite";
            return Err(asset.fault(place, what, "apply transforms before the export"));
        }
        if let Some(mesh) = node.mesh {
            let first = out.len();
            place_mesh(asset, node, mesh, world_from_node, &place, &mut out)?;
            if let Some(skin) = node.skin {
                skinned.push((skin, first..out.len(), place.clone()));
            }
        }
        worlds[index] = Some(world_from_node);
        let children = of_the_tree(asset, &node.children, &coarser, warnings);
        stack.extend(children.into_iter().rev().map(|c| (c, world_from_node)));
        if stack.len() > nodes.len() {
            let what = "its children are more than the file's nodes: a node has two parents";
            return Err(asset.fault(place, what, BROKEN));
        }
    }
    // Bones may come after the mesh that they carry.
    for (skin, range, place) in skinned {
        let world_from_mesh = skin::rest(asset, skin, &worlds, &place, warnings)?;
        for placement in &mut out[range] {
            placement.world_from_mesh = world_from_mesh;
        }
    }
    Ok(out)
}

/// Those of some nodes that stand beside each other which are not left out: neither by their names, nor as `coarser`
/// levels of others.
fn of_the_tree(
    asset: &Asset,
    siblings: &[usize],
    coarser: &HashSet<usize>,
    warnings: &mut Warnings,
) -> Vec<usize> {
    let nodes = &asset.json.nodes;
    let asides = aside::among(siblings, nodes, &asset.json.meshes);
    let mut kept = Vec::with_capacity(siblings.len());
    for (&node, aside) in siblings.iter().zip(asides) {
        let named = coarser.contains(&node).then_some(Aside::Named);
        match aside.or(named) {
            Some(aside) => warnings.say(aside.what(), &node_place(node, &nodes[node])),
            None => kept.push(node),
        }
    }
    kept
}

/// Root nodes of the scene to show; without scenes, all nodes that are nobody's child.
fn roots(asset: &Asset, warnings: &mut Warnings) -> Result<Vec<usize>> {
    let json = asset.json;
    if json.nodes.len() > asset.limits.nodes {
        let (n, most) = (json.nodes.len(), asset.limits.nodes);
        let what = format!("{n} nodes are more than the limit of {most}");
        return Err(asset.fault(
            "nodes",
            what,
            "join objects before the export; or raise nodes in the recipe's limits",
        ));
    }
    if let Some(scene) = json.scenes.get(json.scene.unwrap_or(0)) {
        if json.scenes.len() > 1 {
            let what = "the file has several scenes; only the default one is read";
            warnings.say(what, &format!("scene {}", json.scene.unwrap_or(0)));
        }
        return Ok(scene.nodes.clone());
    }
    if let Some(scene) = json.scene {
        return Err(asset.fault("scene", format!("there is no scene {scene}"), BROKEN));
    }
    let mut child = vec![false; json.nodes.len()];
    for &c in json.nodes.iter().flat_map(|n| &n.children) {
        if let Some(flag) = child.get_mut(c) {
            *flag = true;
        }
    }
    Ok((0..json.nodes.len()).filter(|&i| !child[i]).collect())
}

fn parent_from_node(node: &Node, asset: &Asset, place: &str) -> Result<DMat4> {
    if let Some(matrix) = &node.matrix {
        return Ok(DMat4::from_cols_array(matrix));
    }
    let translation = node.translation.as_deref().copied().unwrap_or([0.0; 3]);
    let rotation = node
        .rotation
        .as_deref()
        .copied()
        .unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let scale = node.scale.as_deref().copied().unwrap_or([1.0; 3]);
    let rotation = unit(DQuat::from_array(rotation))
        .ok_or_else(|| asset.fault(place, "its rotation has the length zero", BROKEN))?;
    Ok(DMat4::from_scale_rotation_translation(
        scale.into(),
        rotation,
        translation.into(),
    ))
}

/// Exporters round quaternions; glam needs them normalised.
fn unit(q: DQuat) -> Option<DQuat> {
    let length = q.length();
    (length > 1e-9 && length.is_finite()).then(|| q / length)
}

fn place_mesh(
    asset: &Asset,
    node: &Node,
    mesh: usize,
    world_from_node: DMat4,
    place: &str,
    out: &mut Vec<Placement>,
) -> Result<()> {
    let Some(content) = asset.json.meshes.get(mesh) else {
        return Err(asset.fault(place, format!("there is no mesh {mesh}"), BROKEN));
    };
    let name = node.name.as_ref().or(content.name.as_ref());
    // A hostile name times a million instances would fill the memory.
    let name: String = name.map_or("", String::as_str).chars().take(200).collect();
    let name: Rc<str> = name.into();
    let extensions = node.extensions.as_deref();
    let instances = match extensions.and_then(|e| e.instancing.as_ref()) {
        None => vec![DMat4::IDENTITY],
        Some(i) => instances(asset, &i.attributes, place)?,
    };
    let objects = (out.len() + instances.len()).saturating_mul(content.primitives.len().max(1));
    if objects > asset.limits.nodes {
        let most = asset.limits.nodes;
        let what = format!("more than {most} placed primitives");
        return Err(asset.fault(
            place,
            what,
            "join objects before the export; or raise nodes in the recipe's limits",
        ));
    }
    let numbered = (0u32..).zip(instances);
    out.extend(numbered.map(|(instance, node_from_instance)| Placement {
        name: name.clone(),
        mesh,
        instance,
        world_from_mesh: world_from_node * node_from_instance,
    }));
    Ok(())
}

/// EXT_mesh_gpu_instancing: translation, rotation and scale, each optional, of equal count.
fn instances(
    asset: &Asset,
    attributes: &std::collections::BTreeMap<String, usize>,
    place: &str,
) -> Result<Vec<DMat4>> {
    let mut count = None;
    for (name, &accessor) in attributes {
        let n = asset.count(accessor, place)?;
        if *count.get_or_insert(n) != n {
            let what = format!("instance attribute {name} has {n} elements, others differ");
            return Err(asset.fault(place, what, BROKEN));
        }
    }
    let count = count.unwrap_or(0);
    if count > asset.limits.nodes {
        let what = format!(
            "{count} instances are more than the limit of {}",
            asset.limits.nodes
        );
        return Err(asset.fault(
            place,
            what,
            "split the scene: one tree a file; or raise nodes in the recipe's limits",
        ));
    }
    let select: Vec<u32> = (0..count as u32).collect();
    let vec3 = |name: &str| {
        let place = format!("{place}, instance {name}");
        let read = |&a| asset.floats::<3>(a, &select, Integers::AsSaid, &place);
        attributes.get(name).map(read).transpose()
    };
    let (translations, scales) = (vec3("TRANSLATION")?, vec3("SCALE")?);
    let read = |&a| asset.floats::<4>(a, &select, Integers::Normalized, place);
    let rotations = attributes.get("ROTATION").map(read).transpose()?;

    let vector = |list: &Option<Vec<[f32; 3]>>, i: usize, none: DVec3| {
        list.as_ref()
            .map_or(none, |l| DVec3::from_array(l[i].map(f64::from)))
    };
    let one = |i: usize| {
        let rotation = match &rotations {
            None => DQuat::IDENTITY,
            Some(r) => unit(DQuat::from_array(r[i].map(f64::from))).ok_or_else(|| {
                let place = format!("{place}, instance ROTATION, index {i}");
                asset.fault(place, "its length is zero", BROKEN)
            })?,
        };
        let translation = vector(&translations, i, DVec3::ZERO);
        let scale = vector(&scales, i, DVec3::ONE);
        Ok(DMat4::from_scale_rotation_translation(
            scale,
            rotation,
            translation,
        ))
    };
    (0..count).map(one).collect()
}

fn node_place(index: usize, node: &Node) -> String {
    match &node.name {
        Some(name) => format!("node {index} ({name})"),
        None => format!("node {index}"),
    }
}
