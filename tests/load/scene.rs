//! Nodes, instances, skins, and the move to normalised space.

use glam::Vec3;
use serde_json::{Value, json};

use crate::file::*;

#[test]
fn transforms_compose_down_the_hierarchy() {
    let mut file = File::triangle();
    file.json["scenes"][0]["nodes"] = json!([1]);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // Scale by 3, turn a quarter about z, move; then the parent's matrix moves by (0, 0, 7).
    file.json["nodes"] = json!([
        { "mesh": 0, "scale": [3, 3, 3], "rotation": [0, 0, half, half], "translation": [10, 0, 0], "name": "twig" },
        { "children": [0], "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 7, 1] },
    ]);
    let model = file.load().unwrap();
    assert_eq!(
        world(&model),
        [[[10.0, 0.0, 7.0], [10.0, 6.0, 7.0], [4.0, 0.0, 7.0]]]
    );
    assert_eq!(model.objects[0].name, "twig");
}

#[test]
fn a_mirror_turns_triangles_round_and_keeps_normals_outside() {
    let mut file = File::triangle();
    file.json["nodes"][0]["scale"] = json!([-1, 1, 1]);
    let model = file.load().unwrap();
    assert_eq!(
        world(&model),
        [[[0.0; 3], [0.0, 2.0, 0.0], [-2.0, 0.0, 0.0]]]
    );
    let [a, b, c] = model.corners(0);
    assert!((b - a).cross(c - a).normalize().distance(Vec3::Z) < 1e-6);
    assert_eq!(model.normals, [Vec3::Z; 3]);
}

#[test]
fn normals_stay_perpendicular_under_uneven_scale() {
    let mut file = File::new();
    let p = file.floats("VEC3", &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    file.mesh(json!({ "attributes": { "POSITION": p } }));
    file.json["nodes"][0]["scale"] = json!([1, 2, -5]);
    let model = file.load().unwrap();
    let [a, b, c] = model.corners(0);
    let face = (b - a).cross(c - a).normalize();
    assert!(
        model.normals[0].distance(face) < 1e-5,
        "{} {face}",
        model.normals[0]
    );
    // Flattened leaves still have a normal.
    file.json["nodes"][0]["scale"] = json!([1, 1, 0]);
    let model = file.load().unwrap();
    assert!(model.normals[0].distance(Vec3::Z) < 1e-6);
}

#[test]
fn shared_meshes_and_instances_are_expanded_and_tell_their_objects() {
    let mut file = File::triangle();
    let t = file.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 4.0]);
    let s = file.floats("VEC3", &[1.0, 1.0, 1.0, 0.5, 0.5, 0.5]);
    // Half a turn about x, as normalised bytes.
    let r = file.accessor(&[0, 0, 0, 127, 127, 0, 0, 0], I8, "VEC4", 2);
    let attributes = json!({ "TRANSLATION": t, "SCALE": s, "ROTATION": r });
    file.node(json!({ "mesh": 0, "name": "i", "extensions": { "EXT_mesh_gpu_instancing": { "attributes": attributes } } }));
    file.node(json!({ "mesh": 0, "translation": [0, 0, -1] }));
    let model = file.load().unwrap();
    let want = [
        [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]],
        [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 2.0, 1.0]],
        [[0.0, 0.0, 4.0], [1.0, 0.0, 4.0], [0.0, -1.0, 4.0]],
        [[0.0, 0.0, -1.0], [2.0, 0.0, -1.0], [0.0, 2.0, -1.0]],
    ];
    assert_eq!(world(&model), want);
    assert_eq!(model.triangle_object, [0, 1, 2, 3]);
    let names: Vec<&str> = model.objects.iter().map(|o| o.name.as_str()).collect();
    assert_eq!(names, ["", "i", "i", ""]);
}

#[test]
fn a_mesh_that_is_in_the_scene_twice_at_one_place_is_there_once() {
    let mut file = File::triangle();
    let once = file.load().unwrap();
    file.node(json!({ "mesh": 0 }));
    let twice = file.load().unwrap();
    assert_eq!(world(&twice), world(&once));
    let [warning] = twice.warnings.as_slice() else {
        panic!("{:?}", twice.warnings);
    };
    assert!(warning.contains("lies exactly on another"), "{warning}");
}

#[test]
fn coarser_levels_and_shapes_for_collisions_beside_a_tree_are_left_out() {
    let mut file = File::triangle();
    file.json["nodes"][0]["name"] = json!("Oak_LOD0");
    let finest = file.load().unwrap();
    let below = file.add("nodes", json!({ "mesh": 0, "translation": [0, 3, 0] }));
    file.node(json!({ "name": "Oak_LOD1", "translation": [0, 0, 9], "children": [below] }));
    file.node(json!({ "mesh": 0, "name": "Oak_LOD2", "scale": [3, 3, 3] }));
    file.node(json!({ "mesh": 0, "name": "UCX_Oak_LOD0_00", "scale": [2, 2, 2] }));
    let model = file.load().unwrap();
    assert_eq!(world(&model), world(&finest));
    let [levels, collisions] = model.warnings.as_slice() else {
        panic!("{:?}", model.warnings);
    };
    assert!(
        levels.contains("2 times, first: node 2 (Oak_LOD1)"),
        "{levels}"
    );
    assert!(
        collisions.contains("node 4 (UCX_Oak_LOD0_00)"),
        "{collisions}"
    );
    // Of another name they are parts of the tree.
    file.json["nodes"][2]["name"] = json!("crown");
    assert_eq!(file.load().unwrap().triangles.len(), 2);
}

#[test]
fn levels_that_another_node_names_are_left_out_of_the_scene() {
    let mut file = File::triangle();
    let finest = file.load().unwrap();
    let level = file.add(
        "nodes",
        json!({ "mesh": 0, "name": "far", "scale": [3, 3, 3] }),
    );
    file.json["scenes"][0]["nodes"] = json!([0, level]);
    assert_eq!(file.load().unwrap().triangles.len(), 2);
    file.json["nodes"][0]["extensions"] = json!({ "MSFT_lod": { "ids": [level] } });
    let model = file.load().unwrap();
    assert_eq!(world(&model), world(&finest));
    let [warning] = model.warnings.as_slice() else {
        panic!("{:?}", model.warnings);
    };
    assert!(
        warning.contains("MSFT_lod") && warning.contains("(far)"),
        "{warning}"
    );
    let mut loads = |first: Value, second: Value, roots: Value| {
        let ids = |ids: Value| json!({ "MSFT_lod": { "ids": ids } });
        file.json["nodes"][0]["extensions"] = ids(first);
        file.json["nodes"][1]["extensions"] = ids(second);
        file.json["scenes"][0]["nodes"] = roots;
        file.load().map(|model| model.triangles.len())
    };
    // A node that names itself stays, and so do two that name each other, and one whose finer level is not shown.
    assert_eq!(loads(json!([0, 99]), json!([]), json!([0, 1])).unwrap(), 2);
    assert_eq!(loads(json!([1]), json!([0]), json!([0, 1])).unwrap(), 2);
    assert_eq!(loads(json!([1]), json!([]), json!([1])).unwrap(), 1);
    // The finer one need not come first.
    assert_eq!(loads(json!([]), json!([0]), json!([0, 1])).unwrap(), 1);
    // A node that is not there is an error, also where another one names it.
    let error = loads(json!([99]), json!([]), json!([0, 99])).unwrap_err();
    assert!(error.to_string().contains("there is no node 99"), "{error}");
}

#[test]
fn levels_that_name_the_next_coarser_one_each_are_all_left_out() {
    let mut file = File::triangle();
    let finest = file.load().unwrap();
    let ids = |ids: &[usize]| json!({ "MSFT_lod": { "ids": ids } });
    file.json["nodes"][0]["extensions"] = ids(&[1]);
    let levels: Vec<usize> = [(2, 2), (3, 3), (2, 4)]
        .into_iter()
        .map(|(next, scale)| {
            let scale = [scale; 3];
            file.add(
                "nodes",
                json!({ "mesh": 0, "scale": scale, "extensions": ids(&[next]) }),
            )
        })
        .collect();
    assert_eq!(levels, [1, 2, 3]);
    file.json["scenes"][0]["nodes"] = json!([3, 2, 1, 0]);
    let model = file.load().unwrap();
    assert_eq!(world(&model), world(&finest));
    // Of two that name each other, and that no finer one names, both stay.
    file.json["scenes"][0]["nodes"] = json!([3, 2]);
    assert_eq!(file.load().unwrap().triangles.len(), 2);
}

/// Two sheets that cross, ten high and two wide, on a square of 20 by 20 whose node has this place.
fn post_on(square: Value) -> pleach::botany::Model {
    let mut file = File::new();
    let sheets = [
        [-1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 10.0, 0.0],
        [0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 10.0, 0.0],
    ];
    let p = file.floats("VEC3", sheets.as_flattened());
    file.mesh(json!({ "attributes": { "POSITION": p } }));
    let square_corners = [
        -10.0, 0.0, -10.0, -10.0, 0.0, 10.0, 10.0, 0.0, 10.0, 10.0, 0.0, -10.0,
    ];
    let p = file.floats("VEC3", &square_corners);
    let indices = file.u16s(&[0, 1, 2, 0, 2, 3]);
    file.mesh(json!({ "attributes": { "POSITION": p }, "indices": indices }));
    for (key, value) in square.as_object().unwrap() {
        file.json["nodes"][1][key] = value.clone();
    }
    file.load().unwrap()
}

#[test]
fn ground_under_a_tree_is_left_out_and_other_sheets_are_not() {
    let tree = post_on(json!({ "name": "lawn", "translation": [3, -0.2, 3] }));
    assert_eq!(tree.triangles.len(), 2);
    // The frame is that of the tree alone.
    assert!((tree.frame.center.y - 5.0).abs() < 1e-6);
    assert!(tree.frame.radius < 5.5, "{}", tree.frame.radius);
    let [warning] = tree.warnings.as_slice() else {
        panic!("{:?}", tree.warnings);
    };
    assert!(
        warning.contains("ground") && warning.contains("(lawn, mesh 1, primitive 0)"),
        "{warning}"
    );
    let others = [
        // Beside the tree, half way up, at its top, steep, and as small as a leaf.
        json!({ "translation": [30, 0, 0] }),
        json!({ "translation": [0, 5, 0] }),
        json!({ "translation": [0, 10, 0] }),
        json!({ "rotation": [0.38, 0, 0, 0.92] }),
        json!({ "scale": [0.02, 1, 0.02] }),
    ];
    for place in others {
        let model = post_on(place.clone());
        assert_eq!(model.triangles.len(), 4, "{place}: {:?}", model.warnings);
    }
}

/// A small tree-like heap of triangles in one mesh under two nodes.
fn heap(change: impl Fn(&mut Value)) -> pleach::botany::Model {
    let mut file = File::new();
    let mut seed = 7u32;
    let mut next = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (seed >> 8) as f32 / (1 << 24) as f32
    };
    let values: Vec<f32> = (0..600 * 9).map(|_| next() * 20.0 - 3.0).collect();
    let p = file.floats("VEC3", &values);
    let mesh = file.add(
        "meshes",
        json!({ "primitives": [{ "attributes": { "POSITION": p } }] }),
    );
    let child = file.add(
        "nodes",
        json!({ "mesh": mesh, "rotation": [0.1, 0.7, 0.2, 0.6], "translation": [1, 2, 3] }),
    );
    let root = file.node(json!({ "children": [child] }));
    change(&mut file.json["nodes"][root]);
    file.load().unwrap()
}

#[test]
fn metres_centimetres_and_100_km_away_give_the_same_model() {
    let here = heap(|_| ());
    let cases: [(&str, Value, f64); 4] = [
        ("centimetres", json!({ "scale": [100, 100, 100] }), 100.0),
        (
            "kilometres",
            json!({ "scale": [0.001, 0.001, 0.001] }),
            0.001,
        ),
        (
            "100 km away",
            json!({ "translation": [1e5, -3e4, 1e5] }),
            1.0,
        ),
        (
            "far and in millimetres",
            json!({ "scale": [1e3, 1e3, 1e3], "translation": [1e8, 0, -1e8] }),
            1e3,
        ),
    ];
    for (name, place, scale) in cases {
        let there = heap(|node| {
            for (key, value) in place.as_object().unwrap() {
                node[key] = value.clone();
            }
        });
        assert_eq!(here.triangles, there.triangles, "{name}");
        assert!(
            (there.frame.radius / here.frame.radius / scale - 1.0).abs() < 1e-9,
            "{name}"
        );
        let furthest = |a: &[Vec3], b: &[Vec3]| {
            a.iter()
                .zip(b)
                .map(|(a, b)| a.distance(*b))
                .fold(0.0, f32::max)
        };
        assert!(furthest(&here.positions, &there.positions) < 2e-7, "{name}");
        assert!(furthest(&here.normals, &there.normals) < 2e-7, "{name}");
    }
    assert!(here.positions.iter().all(|p| p.length() < 1.0 + 1e-6));
    assert!(here.positions.iter().any(|p| p.length() > 1.0 - 1e-6));
}

#[test]
fn a_deep_chain_of_nodes_loads_and_circles_are_refused() {
    let mut file = File::triangle();
    let depth = 100_000;
    let chain = |i: usize| json!({ "children": [i + 2] });
    let mut nodes: Vec<Value> = (0..depth).map(chain).collect();
    nodes.insert(0, json!({}));
    nodes.push(json!({ "mesh": 0 }));
    file.json["nodes"] = json!(nodes);
    file.json["scenes"][0]["nodes"] = json!([1]);
    assert_eq!(file.load().unwrap().triangles.len(), 1);

    for children in [json!([0]), json!([1]), json!([2, 2])] {
        let mut file = File::triangle();
        file.json["nodes"] = json!([{ "mesh": 0, "children": [1] }, { "children": children }, {}]);
        assert!(file.error().contains("twice") || file.error().contains("two parents"));
    }
}

#[test]
fn a_skinned_mesh_in_bind_pose_is_read_and_a_bent_one_refused() {
    let mut file = File::triangle();
    // Both bones undo their binding up to a scale of 2; the mesh's own node must not count.
    let bind = |x: f32| {
        [
            1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -x, 0.0, 0.0, 1.0,
        ]
    };
    let binds = file.floats("MAT4", &[bind(1.0), bind(3.0)].concat());
    file.add(
        "skins",
        json!({ "joints": [1, 2], "inverseBindMatrices": binds }),
    );
    file.json["nodes"] = json!([
        { "mesh": 0, "skin": 0, "translation": [50, 50, 50] },
        { "scale": [2, 2, 2], "translation": [2, 0, 0], "children": [2] },
        { "translation": [2, 0, 0] },
    ]);
    file.json["scenes"][0]["nodes"] = json!([0, 1]);
    let model = file.load().unwrap();
    assert_eq!(
        world(&model),
        [[[0.0; 3], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]]
    );
    assert!(model.warnings[0].contains("bind pose"));
    file.json["nodes"][2]["rotation"] = json!([0, 0, 0.1, 0.99]);
    assert!(file.error().contains("bent by bones"));
}

#[test]
fn what_is_not_shown_is_not_read() {
    let mut file = File::triangle();
    let lines = file.add(
        "meshes",
        json!({ "primitives": [{ "attributes": { "POSITION": 0 }, "mode": 1 }] }),
    );
    file.node(json!({ "mesh": lines }));
    file.node(json!({ "mesh": 0, "extensions": { "KHR_node_visibility": { "visible": false } } }));
    file.node(json!({ "mesh": 0, "scale": [0, 0, 0], "translation": [1e6, 0, 0] }));
    // In no scene, and broken: nobody looks at it.
    file.add("nodes", json!({ "mesh": 99 }));
    let model = file.load().unwrap();
    assert_eq!(model.triangles.len(), 1);
    assert!(model.frame.radius < 2.0);
    assert_eq!(model.warnings.len(), 3, "{:?}", model.warnings);
    assert_eq!(model.objects.len(), 1);
}

#[test]
fn what_a_file_had_lost_before_it_was_read_is_said() {
    // Largest coordinates 2, 2 and 0: below 2, f32 has steps of 2^-23.
    let model = File::triangle().load().unwrap();
    let step = 2f64.sqrt() / f64::from(1 << 23);
    assert!((model.position_step / step - 1.0).abs() < 1e-9);
    assert!(model.warnings.is_empty());
    // 100 km away by its node nothing is lost, in its numbers steps of 2^-7.
    let far = |x: f32, node: Value| {
        let mut file = File::new();
        let p = file.floats("VEC3", &[x, 0.0, 0.0, x + 2.0, 0.0, 0.0, x, 2.0, 0.0]);
        file.mesh(json!({ "attributes": { "POSITION": p } }));
        file.json["nodes"][0]["translation"] = node;
        file.load().unwrap()
    };
    let by_node = far(0.0, json!([1e5, 0, 0]));
    assert_eq!(by_node.position_step, model.position_step);
    assert!(by_node.warnings.is_empty());
    let in_numbers = far(1e5, json!([0, 0, 0]));
    assert!((in_numbers.position_step * 128.0 - 1.0).abs() < 1e-6);
    let [warning] = in_numbers.warnings.as_slice() else {
        panic!("{:?}", in_numbers.warnings);
    };
    assert!(warning.contains("5.5e-3 of the tree's radius"), "{warning}");
    // Integers have steps of one: KHR_mesh_quantization.
    let mut file = File::new();
    let corners = [0u8, 0, 0, 0, 200, 0, 0, 0, 0, 100, 0, 0];
    let p = file.accessor(&corners, super::file::U8, "VEC3", 3);
    let view = file.json["accessors"][p]["bufferView"].as_u64().unwrap();
    file.json["bufferViews"][view as usize]["byteStride"] = json!(4);
    file.mesh(json!({ "attributes": { "POSITION": p } }));
    file.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    let model = file.load().unwrap();
    assert!((model.position_step - 3f64.sqrt()).abs() < 1e-12);
}
