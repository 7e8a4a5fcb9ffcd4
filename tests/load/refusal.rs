//! What can't be read ends in an error that names the place and what to do.

use std::path::Path;

use pleach::botany::load::{Limits, load, load_slice, load_with};
use serde_json::{Value, json};

use crate::file::*;

/// The error of a triangle after a change.
fn error(change: impl FnOnce(&mut File)) -> String {
    let mut file = File::triangle();
    change(&mut file);
    file.error()
}

fn has(error: &str, parts: &[&str]) {
    assert!(error.contains("help: "), "{error}");
    for part in parts {
        assert!(error.contains(part), "\"{part}\" is not in: {error}");
    }
}

#[test]
fn numbers_that_are_not_finite_are_named() {
    let e = error(|f| f.binary[16..20].copy_from_slice(&f32::NAN.to_le_bytes()));
    has(
        &e,
        &["mesh 0, primitive 0, POSITION, accessor 0, index 1", "NaN"],
    );
    let e = error(|f| {
        let n = f.floats(
            "VEC3",
            &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, f32::INFINITY, 1.0],
        );
        f.json["meshes"][0]["name"] = json!("leaf");
        f.primitive()["attributes"]["NORMAL"] = json!(n);
    });
    has(
        &e,
        &[
            "mesh 0 (leaf), primitive 0, NORMAL, accessor 1, index 2",
            "inf",
        ],
    );
    has(
        &error(|f| f.json["nodes"][0]["scale"] = json!([1e200, 1e200, 1e200])),
        &["scene"],
    );
    has(
        &error(|f| f.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0])),
        &["node 0", "rotation"],
    );
}

#[test]
fn indices_out_of_range_and_wrapped_ones_are_named() {
    let e = error(|f| {
        let indices = f.u16s(&[0, 1, 2, 0, 1, 3]);
        f.primitive()["indices"] = json!(indices);
    });
    has(
        &e,
        &[
            "mesh 0, primitive 0, indices, accessor 1, index 5",
            "vertex 3 of 3",
        ],
    );
    let wrapped = |f: &mut File, kind: u32| {
        let points: Vec<f32> = (0..70_000 * 3).map(|i| (i * i % 101) as f32).collect();
        let positions = f.floats("VEC3", &points);
        let indices = f.accessor(&[0, 0, 0, 0, 1, 0, 0, 0, 5, 0, 0, 0], kind, "SCALAR", 3);
        *f.primitive() = json!({ "attributes": { "POSITION": positions }, "indices": indices });
    };
    has(
        &error(|f| wrapped(f, U16)),
        &["70000 vertices", "wrapped", "32-bit"],
    );
    let mut file = File::triangle();
    wrapped(&mut file, U32);
    assert!(file.load().is_ok());
}

#[test]
fn accessors_that_leave_their_bytes_are_refused() {
    let cases: [(&str, Value, &str); 8] = [
        ("count", json!(4), "don't fit"),
        ("count", json!(u64::MAX), "don't fit"),
        ("count", json!(-1), "invalid value"),
        ("byteOffset", json!(4), "don't fit"),
        ("byteOffset", json!(u64::MAX), "don't fit"),
        ("bufferView", json!(9), "no bufferView 9"),
        ("componentType", json!(1234), "component type 1234"),
        ("type", json!("VEC2"), "VEC2"),
    ];
    for (key, value, want) in cases {
        has(&error(|f| f.json["accessors"][0][key] = value), &[want]);
    }
    has(
        &error(|f| f.json["bufferViews"][0]["byteStride"] = json!(8)),
        &["byteStride 8 is less"],
    );
    has(
        &error(|f| f.json["bufferViews"][0]["byteOffset"] = json!(1u64 << 63)),
        &["outside buffer 0"],
    );
    has(
        &error(|f| f.json["bufferViews"][0]["buffer"] = json!(3)),
        &["buffer 3 has no bytes"],
    );
    has(
        &error(|f| f.json["buffers"] = json!([{ "byteLength": 1000 }])),
        &["1000", "cut off"],
    );
    has(
        &error(|f| f.primitive()["attributes"]["POSITION"] = json!(7)),
        &["no accessor 7"],
    );
    // A zero-filled accessor costs nothing in the file, so its count is bounded.
    let zeros = json!({ "componentType": F32, "type": "VEC3", "count": 90_000_000 });
    has(
        &error(|f| f.json["accessors"][0] = zeros),
        &["no bufferView"],
    );
}

#[test]
fn references_to_nothing_are_refused() {
    has(
        &error(|f| f.json["nodes"][0]["mesh"] = json!(5)),
        &["node 0", "no mesh 5"],
    );
    has(
        &error(|f| f.json["nodes"][0]["skin"] = json!(5)),
        &["no skin 5"],
    );
    has(
        &error(|f| f.json["scenes"][0]["nodes"] = json!([9])),
        &["no node 9"],
    );
    has(&error(|f| f.json["scene"] = json!(3)), &["no scene 3"]);
    has(
        &error(|f| f.primitive()["material"] = json!(0)),
        &["no material 0"],
    );
    has(
        &error(|f| f.primitive()["mode"] = json!(17)),
        &["mode is 17"],
    );
    let textured = |f: &mut File| {
        f.add("materials", json!({ "normalTexture": { "index": 0 } }));
        f.primitive()["material"] = json!(0);
    };
    has(
        &error(textured),
        &["material 0, normalTexture", "no texture 0"],
    );
    has(
        &error(|f| {
            textured(f);
            f.add("textures", json!({ "source": 4 }));
        }),
        &["no image 4"],
    );
    has(
        &error(|f| {
            textured(f);
            f.add("textures", json!({ "source": 0 }));
            f.add("images", json!({}));
        }),
        &["neither bufferView nor uri"],
    );
    has(&error(|f| f.json["nodes"] = json!([])), &["no node 0"]);
    has(
        &error(|f| f.json["scenes"][0]["nodes"] = json!([])),
        &["no triangles"],
    );
}

#[test]
fn what_pleach_does_not_read_says_what_to_do() {
    let e = error(|f| {
        f.json["accessors"][0]
            .as_object_mut()
            .unwrap()
            .remove("bufferView");
        f.primitive()["extensions"] =
            json!({ "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": {} } });
        f.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    });
    has(&e, &["mesh 0, primitive 0", "Draco", "gltf-transform"]);
    let e = error(|f| f.json["extensionsRequired"] = json!(["ACME_splines"]));
    has(&e, &["requires the extension ACME_splines"]);
    has(
        &error(|f| f.json["asset"]["version"] = json!("1.0")),
        &["1.0", "gltf-pipeline"],
    );
    has(
        &error(|f| f.primitive()["mode"] = json!(3)),
        &["no triangles", "curve"],
    );

    let mut file = File::triangle();
    file.json["extensionsRequired"] = json!(["KHR_materials_sheen"]);
    file.primitive()["targets"] = json!([{ "POSITION": 0 }]);
    let warnings = file.load().unwrap().warnings;
    assert!(warnings[0].contains("KHR_materials_sheen") && warnings[1].contains("morph"));
}

#[test]
fn uris_that_leave_the_folder_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("inner");
    std::fs::create_dir(&inner).unwrap();
    std::fs::write(folder.path().join("secret.bin"), [0; 36]).unwrap();
    let path = inner.join("tree.gltf");
    let absolute = folder.path().join("secret.bin");
    let mut uris = vec![
        "../secret.bin",
        "a/../../secret.bin",
        "%2e%2e/secret.bin",
        "..\\secret.bin",
        "/etc/passwd",
        "file:///etc/passwd",
        "http://example.com/a.bin",
        "HTTPS://example.com/a.bin",
        "c:\\a.bin",
        "//host/share/a.bin",
        "",
        "%00",
        absolute.to_str().unwrap(),
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../secret.bin", inner.join("link.bin")).unwrap();
        uris.push("link.bin");
    }
    for uri in uris {
        let mut file = File::triangle();
        file.json["buffers"] = json!([{ "byteLength": 36, "uri": uri }]);
        std::fs::write(&path, file.json.to_string()).unwrap();
        let error = load(&path).unwrap_err();
        assert!(
            matches!(error, pleach::Error::Input { .. }),
            "{uri}: {error}"
        );
        has(&error.to_string(), &["buffer 0", "the URI"]);
    }
    let mut file = File::triangle();
    file.json["buffers"] = json!([{ "byteLength": 36, "uri": "not there.bin" }]);
    std::fs::write(&path, file.json.to_string()).unwrap();
    assert!(matches!(load(&path), Err(pleach::Error::Io { .. })));
    assert!(matches!(
        load(&inner.join("none.glb")),
        Err(pleach::Error::Io { .. })
    ));
    assert!(matches!(load(&inner), Err(pleach::Error::Input { .. })));
}

/// Gives the file's primitive a texture of these bytes.
fn bark(file: &mut File, image: &[u8]) {
    let view = file.view(image);
    file.add("images", json!({ "bufferView": view, "name": "bark" }));
    file.add("textures", json!({ "source": 0 }));
    let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } });
    file.add("materials", material);
    file.primitive()["material"] = json!(0);
}

#[test]
fn broken_data_uris_containers_and_images_are_refused() {
    for uri in ["data:nothing", "data:;base64,@@@@", "data:;base64"] {
        has(
            &error(|f| f.json["buffers"] = json!([{ "byteLength": 3, "uri": uri }])),
            &["buffer 0", "data URI"],
        );
    }
    let refuse = |bytes: &[u8]| {
        load_slice(bytes, Path::new("x.glb"), &Limits::default())
            .unwrap_err()
            .to_string()
    };
    has(&refuse(b""), &["neither a GLB"]);
    has(&refuse(b"solid stl"), &["neither a GLB", "Blender"]);
    has(&refuse(b"glTF\x01\0\0\0\0\0\0\0"), &["version 1"]);
    has(&refuse(b"{ \"asset\": 3 }"), &["JSON", "line 1"]);
    has(&refuse("[".repeat(100_000).as_bytes()), &["neither"]);
    let deep = format!(
        "{{\"asset\":{{\"version\":\"2.0\",\"extras\":{}1{}}}}}",
        "[".repeat(9000),
        "]".repeat(9000)
    );
    has(&refuse(deep.as_bytes()), &["no triangles"]);
    for image in [
        &b"not an image"[..],
        b"\x89PNG\r\n\x1a\ngarbage",
        b"RIFF\0\0\0\0WEBPVP8 ",
        b"\xff\xd8\xff\xe0",
    ] {
        has(&error(|f| bark(f, image)), &["image 0 (bark)", "PNG"]);
    }
}

#[test]
fn limits_end_a_load_before_the_work() {
    let small = |change: fn(&mut Limits)| {
        let mut limits = Limits::default();
        change(&mut limits);
        limits
    };
    let mut file = File::triangle();
    let image = file.view(&png(64, 64, [0; 4]));
    file.add("images", json!({ "bufferView": image }));
    file.add("textures", json!({ "source": 0 }));
    file.add("materials", json!({ "normalTexture": { "index": 0 } }));
    file.primitive()["material"] = json!(0);
    for _ in 0..9 {
        file.node(json!({ "mesh": 0 }));
    }
    let glb = file.glb();
    assert!(load_slice(&glb, Path::new("x.glb"), &Limits::default()).is_ok());
    for (limits, word) in [
        (small(|l| l.triangles = 9), "triangles"),
        (small(|l| l.pixels = 4095), "texels"),
        (small(|l| l.nodes = 9), "nodes"),
        (small(|l| l.bytes = 100), "too many"),
    ] {
        let error = load_slice(&glb, Path::new("x.glb"), &limits)
            .unwrap_err()
            .to_string();
        has(&error, &[word]);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.glb");
    std::fs::write(&path, &glb).unwrap();
    let error = load_with(&path, &small(|l| l.bytes = 500))
        .unwrap_err()
        .to_string();
    has(&error, &["limit of 500"]);
    // Few bytes that claim to hold many instances, or many decompressed elements.
    let e = error_of_claims(
        json!({ "buffer": 0, "byteLength": 36, "byteStride": 16, "count": 1 << 30, "mode": "ATTRIBUTES" }),
    );
    has(&e, &["bytes are more than the limit"]);
    let e = error_of_claims(
        json!({ "buffer": 0, "byteLength": 36, "byteStride": 4, "count": 1 << 20, "mode": "ATTRIBUTES" }),
    );
    has(&e, &["can't be in 36 compressed bytes"]);
    let e = error_of_claims(
        json!({ "buffer": 0, "byteLength": 36, "byteStride": 6, "count": 4, "mode": "ATTRIBUTES" }),
    );
    has(&e, &["byteStride 6"]);
}

fn error_of_claims(extension: Value) -> String {
    error(|f| {
        f.json["bufferViews"][0]["extensions"] = json!({ "EXT_meshopt_compression": extension })
    })
}

/// CRC-32 as PNG chunks end with.
fn crc(bytes: &[u8]) -> u32 {
    let bits = |start: u32| (0..8).fold(start, |c, _| (c >> 1) ^ (0xEDB8_8320 * (c & 1)));
    !bytes
        .iter()
        .fold(u32::MAX, |c, &b| (c >> 8) ^ bits((c ^ u32::from(b)) & 0xff))
}

#[test]
fn images_that_claim_to_be_huge_are_refused_before_they_are_decoded() {
    let mut bomb = png(1, 1, [9; 4]);
    for at in [16, 20] {
        bomb[at..at + 4].copy_from_slice(&65_535u32.to_be_bytes());
    }
    let sum = crc(&bomb[12..29]);
    bomb[29..33].copy_from_slice(&sum.to_be_bytes());
    let e = error(|f| bark(f, &bomb));
    has(&e, &["image 0 (bark)", "65535", "texels"]);
}

#[test]
fn text_that_is_no_utf_8_is_refused_and_extensions_named_twice_are_one() {
    let glb = File::triangle().glb();
    let name = b"POSITION";
    let at = glb.windows(name.len()).position(|w| w == name).unwrap();
    let mut bytes = glb.clone();
    bytes[at] = 0xff;
    let refused = load_slice(&bytes, Path::new("x.glb"), &Limits::default()).unwrap_err();
    assert_eq!(refused.exit_code(), 2);
    has(&refused.to_string(), &["JSON"]);
    let mut file = File::triangle();
    file.json["extensionsUsed"] = json!(["KHR_mesh_quantization", "KHR_mesh_quantization"]);
    file.json["extensionsRequired"] = file.json["extensionsUsed"].clone();
    assert_eq!(file.load().unwrap().triangles.len(), 1);
}
