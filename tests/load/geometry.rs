//! Primitives: indices, strips, quantisation, sparse accessors, compression, normals.

use glam::{Vec2, Vec3};
use meshopt::{
    encode_filter_oct, encode_index_buffer, encode_index_sequence, encode_vertex_buffer,
};
use pleach::botany::load::load;
use serde_json::json;

use crate::file::*;

const TRIANGLE: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
const QUAD: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];

fn quad(indices: &[u16], mode: u32) -> File {
    let mut file = File::new();
    let positions = file.floats("VEC3", &QUAD);
    let indices = file.u16s(indices);
    file.mesh(json!({ "attributes": { "POSITION": positions }, "indices": indices, "mode": mode }));
    file
}

#[test]
fn a_triangle_comes_back_in_world_space_and_in_the_unit_ball() {
    let model = File::triangle().load().unwrap();
    assert_eq!(world(&model), [TRIANGLE]);
    // Box centre (1, 1, 0); all corners are sqrt(2) away from it.
    assert_eq!(model.frame.center, glam::DVec3::new(1.0, 1.0, 0.0));
    assert!((model.frame.radius - 2.0f64.sqrt()).abs() < 1e-12);
    assert_eq!(model.normals, [Vec3::Z; 3]);
    assert_eq!(model.uvs[0], [Vec2::ZERO; 3]);
    assert!(model.uvs[1].is_empty() && model.colors.is_empty() && model.images.is_empty());
    assert_eq!(model.materials, [Default::default()]);
    assert_eq!(model.name, "made");
    assert!(model.warnings.is_empty());
}

#[test]
fn indices_of_8_16_and_32_bits_are_equal() {
    let want = world(&quad(&[0, 1, 2, 2, 1, 3], 4).load().unwrap());
    for kind in [U8, U32] {
        let mut file = quad(&[0, 1, 2, 2, 1, 3], 4);
        let size = if kind == U8 { 1 } else { 4 };
        let list = [0u32, 1, 2, 2, 1, 3];
        let bytes: Vec<u8> = list
            .iter()
            .flat_map(|i| i.to_le_bytes()[..size].to_vec())
            .collect();
        let indices = file.accessor(&bytes, kind, "SCALAR", 6);
        file.primitive()["indices"] = json!(indices);
        assert_eq!(world(&file.load().unwrap()), want, "component type {kind}");
    }
}

#[test]
fn strips_and_fans_become_lists_that_face_one_way() {
    let list = world(&quad(&[0, 1, 2, 2, 1, 3], 4).load().unwrap());
    let strip = quad(&[0, 1, 2, 3], 5).load().unwrap();
    assert_eq!(strip.normals, [Vec3::Z; 4]);
    assert_eq!(world(&strip), [list[0], [QUAD3[1], QUAD3[3], QUAD3[2]]]);
    let fan = quad(&[0, 1, 3, 2], 6).load().unwrap();
    assert_eq!(fan.normals, [Vec3::Z; 4]);
    assert_eq!(
        world(&fan),
        [
            [QUAD3[0], QUAD3[1], QUAD3[3]],
            [QUAD3[0], QUAD3[3], QUAD3[2]]
        ]
    );
    // Strips are joined by repeated vertices: no fault, no warning.
    let joined = quad(&[0, 1, 2, 2, 2, 2, 1, 3], 5).load().unwrap();
    assert_eq!(joined.triangles.len(), 2);
    assert!(joined.warnings.is_empty());
}

const QUAD3: [[f64; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [1.0, 1.0, 0.0],
];

#[test]
fn triangles_without_area_are_dropped_and_counted_once() {
    let model = quad(&[0, 1, 2, 1, 1, 3, 0, 0, 0, 2, 1, 3], 4)
        .load()
        .unwrap();
    assert_eq!(model.triangles.len(), 2);
    assert_eq!(model.warnings.len(), 1);
    assert!(
        model.warnings[0].contains("2 times"),
        "{:?}",
        model.warnings
    );
    // Three points of a line, and a stray vertex that must not enlarge the bounds.
    let mut file = File::new();
    let points = [QUAD.as_slice(), &[0.5, 0.0, 0.0, 900.0, 0.0, 0.0]].concat();
    let positions = file.floats("VEC3", &points);
    let indices = file.u16s(&[0, 1, 2, 0, 4, 1]);
    file.mesh(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    let model = file.load().unwrap();
    assert_eq!(world(&model), [[QUAD3[0], QUAD3[1], QUAD3[2]]]);
    assert_eq!(model.positions.len(), 3);
    assert!(model.frame.radius < 1.0);
}

#[test]
fn quantised_attributes_are_restored_as_the_extension_says() {
    let mut file = File::triangle();
    let shorts: Vec<u8> = [0i16, 0, 0, 0, 32767, 0, 0, 0, 0, -32767, 0, 0]
        .iter()
        .flat_map(|s| s.to_le_bytes())
        .collect();
    let positions = file.accessor(&shorts, I16, "VEC3", 3);
    file.json["accessors"][positions]["normalized"] = json!(true);
    let view = file.json["accessors"][positions]["bufferView"]
        .as_u64()
        .unwrap();
    file.json["bufferViews"][view as usize]["byteStride"] = json!(8);
    let normals = file.accessor(&[0, 0, 129, 0, 0, 0, 127, 0, 0, 127, 0, 0], I8, "VEC3", 3);
    let view = file.json["accessors"][normals]["bufferView"]
        .as_u64()
        .unwrap();
    file.json["bufferViews"][view as usize]["byteStride"] = json!(4);
    let colors = file.accessor(&[255, 0, 51, 255, 0, 0, 0, 0, 0, 0, 0, 255], U8, "VEC4", 3);
    let uvs = file.accessor(&[0, 0, 255, 255, 2, 0, 0, 1, 0, 0, 0, 0], U16, "VEC2", 3);
    let attributes =
        json!({ "POSITION": positions, "NORMAL": normals, "COLOR_0": colors, "TEXCOORD_0": uvs });
    file.primitive()["attributes"] = attributes;
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let model = file.load().unwrap();
    assert_eq!(
        world(&model),
        [[[0.0; 3], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]]
    );
    assert_eq!(model.normals, [-Vec3::Z, Vec3::Z, Vec3::Y]);
    assert_eq!(model.colors[0], [1.0, 0.0, 0.2, 1.0]);
    // Not normalised: whole numbers.
    assert_eq!(
        model.uvs[0][..2],
        [Vec2::new(0.0, 65535.0), Vec2::new(2.0, 256.0)]
    );
}

#[test]
fn sparse_accessors_replace_elements_with_and_without_a_base() {
    let mut file = File::triangle();
    let (at, moved) = (
        file.view(&[2, 0]),
        [0.0f32, 6.0, 0.0].map(f32::to_le_bytes).concat(),
    );
    let values = file.view(&moved);
    let sparse = json!({ "count": 1, "indices": { "bufferView": at, "componentType": U16 }, "values": { "bufferView": values } });
    file.json["accessors"][0]["sparse"] = sparse;
    assert_eq!(world(&file.load().unwrap())[0][2], [0.0, 6.0, 0.0]);

    // Without a base all else is zero: two of three corners coincide, so two must be replaced.
    let (at, values) = (
        file.view(&[1, 2]),
        file.view(
            &[1.0f32, 0.0, 0.0, 0.0, 0.0, 3.0]
                .map(f32::to_le_bytes)
                .concat(),
        ),
    );
    file.json["accessors"][0] = json!({
        "componentType": F32, "type": "VEC3", "count": 3,
        "sparse": { "count": 2, "indices": { "bufferView": at, "componentType": U8 }, "values": { "bufferView": values } },
    });
    let want = [[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 3.0]]];
    assert_eq!(world(&file.load().unwrap()), want);
}

/// Puts a compressed stream behind a new view.
fn compressed(
    file: &mut File,
    packed: &[u8],
    stride: usize,
    count: usize,
    mode: &str,
    filter: &str,
) -> usize {
    let view = file.view(packed);
    let source = file.json["bufferViews"][view].clone();
    let extension = json!({ "EXT_meshopt_compression": {
        "buffer": 0, "byteOffset": source["byteOffset"], "byteLength": packed.len(),
        "byteStride": stride, "count": count, "mode": mode, "filter": filter,
    }});
    // As gltfpack writes it: the view itself lies in a buffer that has no bytes.
    file.json["bufferViews"][view] =
        json!({ "buffer": 1, "byteLength": stride * count, "extensions": extension });
    view
}

#[test]
fn meshopt_streams_are_decompressed() {
    let points: Vec<[f32; 3]> = (0..300)
        .map(|i| [(i % 17) as f32, (i / 17) as f32, 0.0])
        .collect();
    let list: Vec<u32> = (0..270u32)
        .filter(|i| i % 17 != 16)
        .flat_map(|i| [i, i + 1, i + 17])
        .collect();
    let mut plain = File::new();
    let positions = plain.floats("VEC3", points.as_flattened());
    let bytes: Vec<u8> = list.iter().flat_map(|i| i.to_le_bytes()).collect();
    let indices = plain.accessor(&bytes, U32, "SCALAR", list.len());
    plain.mesh(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    let want = plain.load().unwrap();

    for sequence in [false, true] {
        let mut file = File::new();
        let packed = encode_vertex_buffer(&points).unwrap();
        let p = compressed(&mut file, &packed, 12, 300, "ATTRIBUTES", "NONE");
        let octahedral = encode_filter_oct::<i8>(&[[0.0, 0.6, 0.8, 0.0]; 300], 8);
        let packed = encode_vertex_buffer(&octahedral).unwrap();
        let n = compressed(&mut file, &packed, 4, 300, "ATTRIBUTES", "OCTAHEDRAL");
        let (packed, mode) = if sequence {
            (encode_index_sequence(&list, 300).unwrap(), "INDICES")
        } else {
            (encode_index_buffer(&list, 300).unwrap(), "TRIANGLES")
        };
        let i = compressed(&mut file, &packed, 4, list.len(), mode, "NONE");
        let accessor = |view, kind, shape, count| json!({ "bufferView": view, "componentType": kind, "type": shape, "count": count });
        file.json["accessors"] = json!([
            accessor(p, F32, "VEC3", 300),
            accessor(n, I8, "VEC3", 300),
            accessor(i, U32, "SCALAR", list.len())
        ]);
        file.json["buffers"] = json!([{ "byteLength": file.binary.len() }, { "byteLength": 9999 }]);
        file.json["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
        file.mesh(json!({ "attributes": { "POSITION": 0, "NORMAL": 1 }, "indices": 2 }));
        let model = file.load().unwrap();
        assert_eq!(model.positions, want.positions);
        let (mut a, mut b) = (world(&model), world(&want));
        // The codec may turn a triangle's corners round, not its facing.
        for t in a.iter_mut().chain(&mut b) {
            let least = (0..3)
                .min_by(|&i, &j| t[i].partial_cmp(&t[j]).unwrap())
                .unwrap();
            t.rotate_left(least);
        }
        assert_eq!(a, b);
        for n in &model.normals {
            assert!(n.distance(Vec3::new(0.0, 0.6, 0.8)) < 0.02, "{n}");
        }
    }
}

#[test]
fn a_buffer_may_be_a_data_uri_or_a_file_beside_the_document() {
    let want = world(&File::triangle().load().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tree.gltf");
    std::fs::write(&path, File::triangle().gltf()).unwrap();
    assert_eq!(world(&load(&path).unwrap()), want);

    let mut file = File::triangle();
    std::fs::create_dir(folder.path().join("my files")).unwrap();
    std::fs::write(folder.path().join("my files/a.bin"), &file.binary).unwrap();
    file.json["buffers"] =
        json!([{ "byteLength": file.binary.len(), "uri": "./my%20files/x/../a.bin" }]);
    let text = file.json.to_string();
    std::fs::write(&path, &text).unwrap();
    let model = load(&path).unwrap();
    assert_eq!(world(&model), want);
    assert_eq!(model.file_bytes, (text.len() + file.binary.len()) as u64);
    assert_eq!(model.name, "tree");
}

#[test]
fn normals_of_length_zero_are_repaired_and_others_made_unit() {
    let mut file = File::triangle();
    let normals = file.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, 5.0, 0.0, -0.1, 0.0]);
    file.primitive()["attributes"]["NORMAL"] = json!(normals);
    let model = file.load().unwrap();
    assert_eq!(model.normals, [Vec3::Z, Vec3::Z, -Vec3::Y]);
    assert_eq!(model.warnings.len(), 1);
}

#[test]
fn made_normals_are_weighted_by_area_and_survive_faces_that_cancel() {
    // A roof: one face to +y (area 2), one to +x (area 0.5), joined along an edge.
    let mut file = File::new();
    let positions = file.floats(
        "VEC3",
        &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -4.0, 0.0, 0.0, 0.0, -1.0, 0.0],
    );
    let indices = file.u16s(&[0, 2, 1, 0, 1, 3]);
    file.mesh(json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    let model = file.load().unwrap();
    let want = [
        Vec3::new(1.0, 4.0, 0.0),
        Vec3::new(1.0, 4.0, 0.0),
        Vec3::Y,
        Vec3::X,
    ];
    for (normal, want) in model.normals.iter().zip(want) {
        assert!(normal.distance(want.normalize()) < 1e-6, "{normal}");
    }
    // A leaf whose two sides share their vertices.
    let both = quad(&[0, 1, 2, 0, 2, 1], 4).load().unwrap();
    assert!(both.normals.iter().all(|n| n.is_normalized()));
}
