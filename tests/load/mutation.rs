//! Thousands of broken files: each ends in a model or an error, never in a panic.

use std::path::Path;

use meshopt::encode_vertex_buffer;
use pleach::botany::load::{Limits, load_slice};
use serde_json::{Value, json};

use crate::file::*;

/// Xorshift (Marsaglia 2003): the same cases on every machine.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % n.max(1)
    }
}

/// A file that uses every feature at once.
fn everything() -> File {
    let mut file = File::triangle();
    let uvs = file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let colors = file.accessor(&[255; 12], U8, "VEC4", 3);
    let normals = file.floats("VEC3", &[0.0, 0.0, 1.0].repeat(3));
    let indices = file.u16s(&[0, 1, 2, 2, 1, 0]);
    let (at, values) = (
        file.view(&[2, 0]),
        file.view(&[0.0f32, 3.0, 0.0].map(f32::to_le_bytes).concat()),
    );
    file.json["accessors"][0]["sparse"] = json!({
        "count": 1, "indices": { "bufferView": at, "componentType": U16 }, "values": { "bufferView": values },
    });
    *file.primitive() = json!({
        "attributes": { "POSITION": 0, "NORMAL": normals, "TEXCOORD_0": uvs, "COLOR_0": colors },
        "indices": indices, "material": 0, "mode": 4,
    });
    let mut webp = Vec::new();
    let encoder = image_webp::WebPEncoder::new(&mut webp);
    encoder
        .encode(&[9; 24], 3, 2, image_webp::ColorType::Rgba8)
        .unwrap();
    let mut jpeg = Vec::new();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new(&mut jpeg);
    encoder
        .encode(&[9; 192], 8, 8, image::ExtendedColorType::Rgb8)
        .unwrap();
    for bytes in [&png(4, 4, [1, 2, 3, 200]), &webp, &jpeg] {
        let view = file.view(bytes);
        file.add(
            "images",
            json!({ "bufferView": view, "mimeType": "image/png" }),
        );
    }
    file.json["textures"] = json!([
        { "source": 0, "sampler": 0 }, { "source": 2, "extensions": { "EXT_texture_webp": { "source": 1 } } }, { "source": 2 },
    ]);
    file.add("samplers", json!({ "wrapS": 33071 }));
    file.add("materials", json!({
        "alphaMode": "MASK",
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": { "scale": [2, 2], "rotation": 1 } } } },
        "normalTexture": { "index": 1 }, "occlusionTexture": { "index": 2 },
    }));
    let t = file.floats("VEC3", &[0.0, 1.0, 2.0, 1.0, 1.0, 2.0]);
    file.node(json!({ "mesh": 0, "scale": [-1, 1, 1], "extensions": { "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": t } } } }));
    // A compressed strip, skinned.
    let packed = encode_vertex_buffer(&[
        [0.0f32, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 1.0, 0.0],
    ])
    .unwrap();
    let view = file.view(&packed);
    let source = file.json["bufferViews"][view].clone();
    file.json["bufferViews"][view]["extensions"] = json!({ "EXT_meshopt_compression": {
        "buffer": 0, "byteOffset": source["byteOffset"], "byteLength": packed.len(),
        "byteStride": 12, "count": 4, "mode": "ATTRIBUTES", "filter": "NONE",
    }});
    let strip = file.add(
        "accessors",
        json!({ "bufferView": view, "componentType": F32, "type": "VEC3", "count": 4 }),
    );
    let mesh = file.mesh(json!({ "attributes": { "POSITION": strip }, "mode": 5 }));
    file.add("skins", json!({ "joints": [0] }));
    let node = file.json["nodes"].as_array().unwrap().len() - 1;
    file.json["nodes"][node] = json!({ "mesh": mesh, "skin": 0 });
    file
}

fn try_load(bytes: &[u8]) -> bool {
    let limits = Limits {
        triangles: 10_000,
        pixels: 1 << 16,
        nodes: 1000,
        bytes: 1 << 20,
    };
    match load_slice(bytes, Path::new("mutant.glb"), &limits) {
        Ok(model) => {
            // What passes keeps the promises of the model.
            let n = model.positions.len();
            assert!(model.triangles.iter().flatten().all(|&i| (i as usize) < n));
            assert_eq!((model.normals.len(), model.uvs[0].len()), (n, n));
            assert!(model.uvs[1].is_empty() || model.uvs[1].len() == n);
            assert!(model.colors.is_empty() || model.colors.len() == n);
            assert_eq!(model.triangle_object.len(), model.triangles.len());
            assert!(
                model
                    .positions
                    .iter()
                    .all(|p| p.is_finite() && p.length() < 1.001)
            );
            assert!(
                model
                    .normals
                    .iter()
                    .all(|p| (p.length() - 1.0).abs() < 1e-3),
                "{:?}",
                model.normals
            );
            assert!(
                model
                    .objects
                    .iter()
                    .all(|o| (o.material as usize) < model.materials.len())
            );
            assert!(
                model
                    .images
                    .iter()
                    .all(|i| i.rgba.len() == (i.width * i.height * 4) as usize)
            );
            true
        }
        Err(error) => {
            assert_eq!(error.exit_code(), 2, "{error}");
            false
        }
    }
}

#[test]
fn the_file_itself_loads() {
    let model = everything().load().unwrap();
    assert_eq!(model.triangles.len(), 2 * 3 + 2);
    assert_eq!(model.images.len(), 3);
}

#[test]
fn every_truncated_prefix_ends_in_an_error() {
    let glb = everything().glb();
    for end in 0..glb.len() {
        assert!(!try_load(&glb[..end]), "a prefix of {end} bytes loaded");
    }
}

#[test]
fn changed_bytes_never_panic() {
    let (glb, mut random, mut loaded) = (everything().glb(), Random(0x9E37_79B9), 0);
    for _ in 0..20_000 {
        let mut bytes = glb.clone();
        for _ in 0..1 + random.below(4) {
            let at = random.below(bytes.len());
            bytes[at] = match random.below(4) {
                0 => 0,
                1 => 0xff,
                2 => bytes[at] ^ (1 << random.below(8)),
                _ => random.below(256) as u8,
            };
        }
        loaded += usize::from(try_load(&bytes));
    }
    // Both ends are reached: harmless changes load, others are refused.
    assert!((100..19_900).contains(&loaded), "{loaded}");
}

/// Paths of all values in a document.
fn pointers(value: &Value, path: String, out: &mut Vec<String>) {
    match value {
        Value::Array(list) => list
            .iter()
            .enumerate()
            .for_each(|(i, v)| pointers(v, format!("{path}/{i}"), out)),
        Value::Object(map) => map
            .iter()
            .for_each(|(k, v)| pointers(v, format!("{path}/{k}"), out)),
        _ => {}
    }
    out.push(path);
}

#[test]
fn changed_json_values_never_panic() {
    let file = everything();
    let mut paths = Vec::new();
    pointers(&file.json, String::new(), &mut paths);
    let evil = [
        json!(0),
        json!(1),
        json!(2),
        json!(3),
        json!(5),
        json!(7),
        json!(255),
        json!(65_536),
        json!(4_294_967_295u64),
        json!(u64::MAX),
        json!(-1),
        json!(0.5),
        json!(1e300),
        json!(-1e-300),
        json!(null),
        json!([]),
        json!({}),
        json!(""),
        json!("VEC4"),
        json!("SCALAR"),
        json!([0, 0, 0]),
        json!([1e38, 1e38, 1e38]),
        json!(true),
        json!(5125),
        json!(5120),
    ];
    for path in &paths {
        for value in &evil {
            let mut mutant = File {
                json: file.json.clone(),
                binary: file.binary.clone(),
            };
            if let Some(place) = mutant.json.pointer_mut(path) {
                *place = value.clone();
            }
            if mutant.json["buffers"].is_array() {
                try_load(&mutant.glb());
            }
        }
        // And without the value.
        let (parent, key) = path.rsplit_once('/').unwrap_or(("", ""));
        let mut mutant = File {
            json: file.json.clone(),
            binary: file.binary.clone(),
        };
        if let Some(Value::Object(map)) = mutant.json.pointer_mut(parent) {
            map.remove(key);
        }
        if mutant.json["buffers"].is_array() {
            try_load(&mutant.glb());
        }
    }
}

#[test]
fn seeds_of_the_fuzzer_load() {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/seeds");
    let mut count = 0;
    for entry in std::fs::read_dir(seeds).unwrap() {
        let file = entry.unwrap().path();
        assert!(
            try_load(&std::fs::read(&file).unwrap()),
            "{}",
            file.display()
        );
        count += 1;
    }
    assert!(count >= 3, "{count}");
}

/// Writes the file that uses every feature as a seed for the fuzzer.
#[test]
#[ignore = "writes tests/fuzz/seeds"]
fn write_a_seed() {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/seeds");
    std::fs::write(seeds.join("everything.glb"), everything().glb()).unwrap();
    let file = File::triangle();
    std::fs::write(seeds.join("triangle.glb"), file.glb()).unwrap();
}
