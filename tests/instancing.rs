//! Level 0 as prototypes and copies: unpacked, it is the original.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec3, I64Vec3, Quat, Vec3};
use pleach::botany::prototype::{Alike, prototypes};
use pleach::space::glb::GlbBuilder;
use serde_json::json;

use pleach::botany::Model;
use pleach::botany::load::{Limits, load, load_slice};
use pleach::botany::recognise::{RecogniseOptions, recognise};
use pleach::botany::tree::Tree;
use pleach::export::gltf::write_glb;
use pleach::export::instanced::{copies_but_for_normals, write_instanced};
use pleach::export::png::encode_images;
use pleach::export::surface::scene_of_model;
use pleach::recipe::Recipe;
use pleach::report::schema::Instancing;
use pleach::report::{Reference, draw_calls};
use pleach::space::view::views;

fn tree(file: &Path) -> Tree {
    recognise(load(file).unwrap(), &RecogniseOptions::default()).unwrap()
}

fn unpacked(tree: &Tree, recipe: &Recipe) -> (Model, Instancing, Vec<u8>) {
    let (bytes, told) = write_instanced(tree, recipe, serde_json::Value::Null)
        .unwrap()
        .unwrap();
    let model = load_slice(&bytes, Path::new("instanced.glb"), &Limits::default()).unwrap();
    (model, told, bytes)
}

/// Corners of all triangles in the world.
fn corners(model: &Model) -> Vec<[DVec3; 3]> {
    let world =
        |i: u32| model.frame.center + model.frame.radius * model.positions[i as usize].as_dvec3();
    model.triangles.iter().map(|t| t.map(world)).collect()
}

/// For each triangle how far its corners may move, world units: 1e-5 of its leaf's size, or two
/// roundings of f32.
fn tolerated(tree: &Tree) -> Vec<f64> {
    let mut out = vec![5e-7; tree.model.triangles.len()];
    for leaf in &tree.leaves {
        let points = || {
            let corners = leaf
                .triangles
                .iter()
                .map(|&t| tree.model.triangles[t as usize]);
            corners.flatten().map(|i| tree.model.positions[i as usize])
        };
        let size = points()
            .map(|p| p.distance(leaf.center))
            .fold(0.0, f32::max);
        for &t in &leaf.triangles {
            out[t as usize] = (1e-5 * f64::from(size)).max(5e-7);
        }
    }
    out.iter().map(|t| t * tree.model.frame.radius).collect()
}

/// Fails unless every triangle of the tree is in `found` once, and nothing else is.
fn assert_equal(tree: &Tree, found: &Model) {
    let (wanted, found) = (corners(&tree.model), corners(found));
    assert_eq!(wanted.len(), found.len());
    let cell = tree.model.frame.radius * 1e-3;
    let center = |t: &[DVec3; 3]| ((t[0] + t[1] + t[2]) / (3.0 * cell)).floor().as_i64vec3();
    let mut cells: HashMap<I64Vec3, Vec<usize>> = HashMap::new();
    for (index, triangle) in found.iter().enumerate() {
        cells.entry(center(triangle)).or_default().push(index);
    }
    let mut taken = vec![false; found.len()];
    for (index, (triangle, most)) in wanted.iter().zip(tolerated(tree)).enumerate() {
        let middle = center(triangle);
        let around = (0..27).map(|i| middle + I64Vec3::new(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
        let near = |&i: &usize| {
            let mut pairs = triangle.iter().zip(&found[i]);
            !taken[i] && pairs.all(|(a, b)| a.distance(*b) <= most)
        };
        let same = around
            .filter_map(|c| cells.get(&c))
            .flatten()
            .find(|i| near(i));
        let same = *same.unwrap_or_else(|| panic!("triangle {index} is not there: {triangle:?}"));
        taken[same] = true;
    }
}

#[test]
fn the_sample_oak_unpacked_is_the_original_and_looks_like_it() {
    let oak = tree(Path::new("assets/oak.glb"));
    // Its normals lean out of the crown.
    let recipe = Recipe {
        instance_normals_deg: 180.0,
        ..Recipe::default()
    };
    assert!(copies_but_for_normals(&oak, &Recipe::default()) > 5900);
    let (model, told, bytes) = unpacked(&oak, &recipe);
    assert!(told.extension && told.prototypes <= 4, "{told:?}");
    assert!(
        told.copies as f64 > 0.99 * oak.leaves.len() as f64,
        "{told:?}"
    );
    assert!(told.largest_deviation < 5e-5, "{told:?}");
    assert_eq!(told.file_bytes, bytes.len() as u64);
    assert_eq!(draw_calls(&model), 1 + told.prototypes);
    assert_equal(&oak, &model);
    let seen = Reference::new(&oak.model, &views(4, 11.0), 256).compare(&model);
    assert!(seen.f1.worst > 0.9995, "{seen:?}");
}

#[test]
fn few_copies_are_plain_nodes_and_the_same_tree() {
    let oak = tree(Path::new("assets/oak.glb"));
    let recipe = Recipe {
        instance_nodes: 1_000_000,
        instance_normals_deg: 180.0,
        ..Recipe::default()
    };
    let (model, told, bytes) = unpacked(&oak, &recipe);
    assert!(!told.extension);
    let text = String::from_utf8_lossy(&bytes);
    assert!(!text.contains("extensionsRequired"));
    assert_equal(&oak, &model);
}

/// A trunk, and leaves that are bent, each made by `place` from a leaf's corner.
fn tree_of(leaves: usize, place: impl Fn(usize, Vec3) -> Vec3) -> Tree {
    let mut glb = GlbBuilder::default();
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for ring in 0..8u32 {
        for side in 0..8u32 {
            let angle = side as f32 * std::f32::consts::FRAC_PI_4;
            points.push(Vec3::new(
                angle.cos() * 0.2,
                ring as f32 * 0.8,
                angle.sin() * 0.2,
            ));
            if ring > 0 {
                let [a, b] = [side, (side + 1) % 8].map(|s| (ring - 1) * 8 + s);
                triangles.extend([[a, a + 8, b], [b, a + 8, b + 8]]);
            }
        }
    }
    let leaf = [
        [0.0, 0.0, 0.0],
        [0.3, 0.1, 0.02],
        [0.5, 0.45, 0.1],
        [0.1, 0.3, -0.04],
    ];
    let mut primitive = |points: &[Vec3], triangles: &[[u32; 3]], material: u32| {
        json!({ "attributes": { "POSITION": glb.positions(points) },
            "indices": glb.indices(triangles, points.len()), "material": material })
    };
    let mut primitives = vec![primitive(&points, &triangles, 0)];
    (points, triangles) = (Vec::new(), Vec::new());
    for i in 0..leaves {
        let at = points.len() as u32;
        points.extend(leaf.map(|p| place(i, Vec3::from_array(p))));
        triangles.extend([[at, at + 1, at + 2], [at, at + 2, at + 3]]);
    }
    primitives.push(primitive(&points, &triangles, 1));
    let bytes = glb.finish(json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }], "meshes": [{ "primitives": primitives }],
        "materials": [{ "name": "bark" }, { "name": "leaves", "doubleSided": true }],
    }));
    let model = load_slice(&bytes, Path::new("made.glb"), &Limits::default()).unwrap();
    recognise(model, &RecogniseOptions::default()).unwrap()
}

/// Turned, scaled and moved, differently for each leaf.
fn placed(i: usize, p: Vec3) -> Vec3 {
    let t = i as f32;
    let turn = Quat::from_euler(glam::EulerRot::XYZ, t * 1.3, t * 2.1, t * 0.7);
    let at = Vec3::new((t * 2.4).sin() * 2.0, 2.0 + t * 0.3, (t * 2.4).cos() * 2.0);
    at + turn * p * (0.8 + 0.05 * t)
}

fn families(tree: &Tree, tolerance: f64) -> Vec<usize> {
    let alike = Alike {
        tolerance,
        normals_deg: 1.0,
        copies: 4,
    };
    let found = prototypes(tree, &alike);
    found.iter().map(|p| p.copies.len()).collect()
}

#[test]
fn turned_scaled_and_moved_leaves_are_copies_of_one() {
    let tree = tree_of(12, placed);
    assert_eq!(tree.leaves.len(), 12);
    assert_eq!(families(&tree, 1e-5), [12]);
}

#[test]
fn mirrored_leaves_have_a_prototype_of_their_own() {
    let mirrored = |i: usize, p: Vec3| placed(i, if i < 5 { Vec3::new(-p.x, p.y, p.z) } else { p });
    let tree = tree_of(12, mirrored);
    assert_eq!(families(&tree, 1e-5), [7, 5]);
}

#[test]
fn a_leaf_that_is_a_little_wider_is_no_copy_unless_that_is_tolerated() {
    let wider = |i: usize, p: Vec3| {
        placed(
            i,
            if i == 3 {
                p * Vec3::new(1.004, 1.0, 1.0)
            } else {
                p
            },
        )
    };
    let tree = tree_of(12, wider);
    assert_eq!(families(&tree, 1e-5), [11]);
    let (model, told, _) = unpacked(&tree, &Recipe::default());
    assert_eq!((told.copies, told.prototypes), (11, 1));
    assert_equal(&tree, &model);
    assert_eq!(families(&tree, 0.01), [12]);
}

#[test]
fn leaves_that_are_all_different_are_left_as_they_are() {
    let own = |i: usize, p: Vec3| placed(i, p * Vec3::new(1.0 + 0.1 * i as f32, 1.0, 1.0));
    let tree = tree_of(12, own);
    assert!(families(&tree, 1e-5).is_empty());
    assert!(
        write_instanced(&tree, &Recipe::default(), serde_json::Value::Null)
            .unwrap()
            .is_none()
    );
}

fn write_level_0(tree: &Tree) -> Vec<u8> {
    let scene = scene_of_model(&tree.model, 0..tree.model.triangles.len() as u32);
    let pngs = encode_images(&scene).unwrap();
    write_glb(
        "all",
        &scene,
        &pngs,
        &tree.model.frame,
        serde_json::Value::Null,
    )
    .unwrap()
}

/// Real trees: what repeats in each.
#[test]
#[ignore = "a study: prints figures"]
fn leaves_of_real_trees() {
    let mut files: Vec<_> =
        std::fs::read_dir(std::env::var("PLEACH_TREES").expect("PLEACH_TREES names a folder"))
            .unwrap()
            .map(|e| e.unwrap().path())
            .filter(|f| f.extension().is_some_and(|e| e == "glb"))
            .collect();
    files.sort();
    for file in files {
        let tree = tree(&file);
        let started = std::time::Instant::now();
        let name = file.file_stem().unwrap().to_string_lossy().into_owned();
        let found = write_instanced(&tree, &Recipe::default(), serde_json::Value::Null).unwrap();
        let took = started.elapsed().as_millis();
        let shapes = copies_but_for_normals(&tree, &Recipe::default());
        print!("{shapes} shapes ");
        let plain = write_level_0(&tree).len() as f64 / 1048576.0;
        match found {
            None => println!(
                "{name}: {} leaves, none repeats, {took} ms",
                tree.leaves.len()
            ),
            Some((bytes, told)) => {
                let mib = bytes.len() as f64 / 1048576.0;
                println!(
                    "| {name} | {} | {} of {} | {plain:.1} | {mib:.1} | {took} ms {told:?}",
                    tree.leaves.len(),
                    told.copies,
                    told.prototypes
                );
                let model = load_slice(&bytes, &file, &Limits::default()).unwrap();
                assert_equal(&tree, &model);
            }
        }
    }
}
