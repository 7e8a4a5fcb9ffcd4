//! Materials, textures, their coordinates and images.

use glam::Vec2;
use pleach::botany::model::{AlphaMode, Wrap};
use serde_json::{Value, json};

use crate::file::*;

/// A triangle with texture coordinates (0,0), (1,0), (0,1) and a material.
fn textured(material: Value, images: &[&[u8]]) -> File {
    let mut file = File::triangle();
    let uvs = file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    file.primitive()["attributes"]["TEXCOORD_0"] = json!(uvs);
    let material = file.add("materials", material);
    file.primitive()["material"] = json!(material);
    for bytes in images {
        let view = file.view(bytes);
        let image = file.add(
            "images",
            json!({ "bufferView": view, "mimeType": "image/png" }),
        );
        file.add("textures", json!({ "source": image }));
    }
    file
}

#[test]
fn a_material_is_carried_as_the_file_says() {
    let png = png(2, 3, [10, 20, 30, 140]);
    let mut file = textured(
        json!({
            "name": "leaf", "alphaMode": "MASK", "alphaCutoff": 0.3, "doubleSided": true,
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 0.25, 1, 0.75], "metallicFactor": 0, "roughnessFactor": 0.9,
                "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 1 },
            },
            "normalTexture": { "index": 1, "scale": 0.5 },
            "occlusionTexture": { "index": 1, "strength": 0.25 },
            "emissiveTexture": { "index": 0 }, "emissiveFactor": [0, 0.5, 1],
            "extensions": { "KHR_materials_unlit": {} },
        }),
        &[&png, &png],
    );
    let sampler = json!({ "magFilter": 9728, "wrapS": 33071, "wrapT": 33648 });
    file.add("samplers", sampler);
    file.json["textures"][1]["sampler"] = json!(0);
    let model = file.load().unwrap();
    let m = &model.materials[0];
    assert_eq!(
        (m.name.as_str(), m.alpha_mode, m.alpha_cutoff),
        ("leaf", AlphaMode::Mask, 0.3)
    );
    assert_eq!(m.base_color_factor, [0.5, 0.25, 1.0, 0.75]);
    assert_eq!((m.metallic_factor, m.roughness_factor), (0.0, 0.9));
    assert_eq!((m.normal_scale, m.occlusion_strength), (0.5, 0.25));
    assert_eq!(m.emissive_factor, [0.0, 0.5, 1.0]);
    assert!(m.double_sided && m.unlit);
    let (base, normal) = (m.base_color.unwrap(), m.normal.unwrap());
    assert_eq!(
        (base.image, base.wrap, base.linear),
        (0, [Wrap::Repeat; 2], true)
    );
    assert_eq!(
        (normal.image, normal.wrap, normal.linear),
        (1, [Wrap::Clamp, Wrap::Mirror], false)
    );
    assert_eq!([m.metallic_roughness, m.occlusion], [Some(normal); 2]);
    assert_eq!(m.emissive, Some(base));
    assert_eq!((model.images[0].width, model.images[0].height), (2, 3));
    // Straight alpha, colour untouched.
    assert_eq!(*model.images[0].rgba, [10, 20, 30, 140].repeat(6));
    assert!(model.warnings.is_empty());
}

#[test]
fn alpha_modes_are_kept_and_factors_clamped() {
    for (said, want) in [
        ("OPAQUE", AlphaMode::Opaque),
        ("BLEND", AlphaMode::Blend),
        ("MASK", AlphaMode::Mask),
    ] {
        let model = textured(json!({ "alphaMode": said }), &[]).load().unwrap();
        assert_eq!(model.materials[0].alpha_mode, want);
        assert_eq!(model.materials[0].alpha_cutoff, 0.5);
    }
    let wild = json!({ "pbrMetallicRoughness": { "metallicFactor": -3, "baseColorFactor": [2, 0, 0, 1e39] } });
    let model = textured(wild, &[]).load().unwrap();
    assert_eq!(model.materials[0].metallic_factor, 0.0);
    assert_eq!(model.materials[0].base_color_factor, [1.0, 0.0, 0.0, 1.0]);
    assert_eq!(model.warnings.len(), 1);
}

#[test]
fn what_no_alpha_test_lets_pass_is_left_out_and_said() {
    let two = |alpha: u8, mode: &str, factor: f64| {
        let mut file = textured(
            json!({
                "name": "leaf", "alphaMode": mode,
                "pbrMetallicRoughness": {
                    "baseColorTexture": { "index": 0 }, "baseColorFactor": [1, 1, 1, factor],
                },
            }),
            &[&png(2, 2, [9, 9, 9, alpha])],
        );
        let bark = file.floats("VEC3", &[0.0, 5.0, 0.0, 2.0, 5.0, 0.0, 0.0, 7.0, 0.0]);
        file.mesh(json!({ "attributes": { "POSITION": bark } }));
        file
    };
    let triangles = |file: File| file.load().unwrap().triangles.len();
    assert_eq!(triangles(two(128, "MASK", 1.0)), 2);
    assert_eq!(triangles(two(0, "OPAQUE", 1.0)), 2);
    for (alpha, mode, factor) in [(127, "MASK", 1.0), (255, "MASK", 0.4), (0, "BLEND", 1.0)] {
        let model = two(alpha, mode, factor).load().unwrap();
        assert_eq!(model.triangles.len(), 1);
        let [warning] = model.warnings.as_slice() else {
            panic!("{:?}", model.warnings);
        };
        assert!(
            warning.contains("left out (material \"leaf\")"),
            "{warning}"
        );
    }
    let mut alone = two(0, "MASK", 1.0);
    alone.json["scenes"][0]["nodes"] = json!([0]);
    let error = alone.load().unwrap_err().to_string();
    assert!(error.contains("no triangle shows anything"), "{error}");
}

#[test]
fn texture_transforms_are_applied_to_the_coordinates() {
    // The extension's own example: the lower left quadrant, turned a quarter clockwise.
    let transform =
        json!({ "offset": [0, 1], "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.5] });
    let info = json!({ "index": 0, "extensions": { "KHR_texture_transform": transform } });
    let image = png(1, 1, [9; 4]);
    let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": info } });
    let model = textured(material, &[&image]).load().unwrap();
    let want = [[0.0, 1.0], [0.0, 0.5], [0.5, 1.0]].map(Vec2::from_array);
    for (uv, want) in model.uvs[0].iter().zip(want) {
        assert!(uv.distance(want) < 1e-6, "{uv} {want}");
    }
    assert!(model.uvs[1].is_empty());
}

#[test]
fn two_mappings_a_material_are_carried_and_a_third_is_left_out() {
    let image = png(1, 1, [9; 4]);
    let scaled = |s: f64| json!({ "index": 0, "texCoord": 7, "extensions": { "KHR_texture_transform": { "texCoord": 1, "scale": [s, s] } } });
    let mut file = textured(
        json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } }, "normalTexture": scaled(2.0), "occlusionTexture": scaled(2.0), "emissiveTexture": scaled(3.0) }),
        &[&image],
    );
    let second = file.accessor(&[0, 255, 0, 0, 51, 0, 0, 0, 255, 255, 0, 0], U8, "VEC2", 3);
    file.json["accessors"][second]["normalized"] = json!(true);
    let view = file.json["accessors"][second]["bufferView"]
        .as_u64()
        .unwrap() as usize;
    file.json["bufferViews"][view]["byteStride"] = json!(4);
    file.primitive()["attributes"]["TEXCOORD_1"] = json!(second);
    // A second primitive without texture coordinates, in another material.
    file.mesh(json!({ "attributes": { "POSITION": 0 } }));
    let model = file.load().unwrap();
    let m = &model.materials[0];
    assert_eq!(m.base_color.unwrap().uv_set, 0);
    assert_eq!(
        [m.normal.unwrap().uv_set, m.occlusion.unwrap().uv_set],
        [1, 1]
    );
    assert_eq!(m.emissive, None);
    assert_eq!(model.uvs[0].len(), 6);
    assert_eq!(
        model.uvs[1][..3],
        [[0.0, 2.0], [0.4, 0.0], [2.0, 2.0]].map(Vec2::from_array)
    );
    assert_eq!(model.uvs[1][3..], [Vec2::ZERO; 3]);
    assert_eq!(model.materials.len(), 2);
    assert_eq!(model.objects[1].material, 1);
    assert!(model.warnings[0].contains("third mapping"));
}

#[test]
fn only_materials_and_images_in_use_are_read_and_thousands_are_fine() {
    let image = png(4, 4, [1, 2, 3, 0]);
    let mut file = textured(json!({}), &[b"no image at all", &image]);
    for i in 0..5000 {
        file.add("materials", json!({ "name": format!("m{i}"), "pbrMetallicRoughness": { "baseColorTexture": { "index": 1 } } }));
    }
    let primitives: Vec<Value> = (1..5001)
        .rev()
        .map(|m| json!({ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "material": m }))
        .collect();
    file.json["meshes"][0]["primitives"] = json!(primitives);
    let model = file.load().unwrap();
    assert_eq!(
        (
            model.materials.len(),
            model.images.len(),
            model.objects.len()
        ),
        (5000, 1, 5000)
    );
    assert_eq!(model.materials[0].name, "m0");
    assert_eq!(model.material_of(0).name, "m4999");
    // Black or not, colour under alpha 0 stays as it is.
    assert_eq!(model.images[0].rgba[..4], [1, 2, 3, 0]);
}

#[test]
fn jpeg_and_webp_are_read_by_their_bytes() {
    let jpeg = {
        let mut out = Vec::new();
        let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut out, 95);
        encoder
            .encode(
                &[200, 100, 50].repeat(64),
                8,
                8,
                image::ExtendedColorType::Rgb8,
            )
            .unwrap();
        out
    };
    let mut webp = Vec::new();
    let encoder = image_webp::WebPEncoder::new(&mut webp);
    encoder
        .encode(&[1, 2, 3, 77].repeat(6), 3, 2, image_webp::ColorType::Rgba8)
        .unwrap();
    let mut opaque = Vec::new();
    let encoder = image_webp::WebPEncoder::new(&mut opaque);
    encoder
        .encode(&[1, 2, 3].repeat(6), 3, 2, image_webp::ColorType::Rgb8)
        .unwrap();

    let material = json!({
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 2 } },
        "normalTexture": { "index": 1 },
    });
    let mut file = textured(material, &[&webp, &jpeg, &opaque]);
    // Image 0 by the extension alone; image 1 as a data URI.
    file.json["textures"][0] = json!({ "extensions": { "EXT_texture_webp": { "source": 0 } } });
    file.json["images"][1] = json!({ "uri": data_uri(&jpeg) });
    file.json["extensionsRequired"] = json!(["EXT_texture_webp"]);
    let model = file.load().unwrap();
    assert_eq!(*model.images[0].rgba, [1, 2, 3, 77].repeat(6));
    let jpeg = &model.images[1].rgba;
    assert_eq!((jpeg.len(), jpeg[3]), (256, 255));
    assert!(
        jpeg[0].abs_diff(200) < 4 && jpeg[1].abs_diff(100) < 4,
        "{:?}",
        &jpeg[..4]
    );
    assert_eq!(*model.images[2].rgba, [1, 2, 3, 255].repeat(6));
}

#[test]
fn textures_that_are_not_read_are_refused_or_left_out() {
    let mut file = textured(
        json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }),
        &[],
    );
    file.add("images", json!({ "uri": "leaf.ktx2" }));
    file.add(
        "textures",
        json!({ "extensions": { "KHR_texture_basisu": { "source": 0 } } }),
    );
    file.json["extensionsRequired"] = json!(["KHR_texture_basisu"]);
    let error = file.error();
    assert!(
        error.contains("material 0, baseColorTexture")
            && error.contains("KTX2")
            && error.contains("gltf-transform"),
        "{error}"
    );
    file.json["materials"][0] = json!({ "normalTexture": { "index": 0 } });
    let model = file.load().unwrap();
    assert_eq!(model.materials[0].normal, None);
    assert!(model.warnings[0].contains("KTX2"));
    // A fallback beside the extension is used.
    let image = png(1, 1, [5; 4]);
    let view = file.view(&image);
    let source = file.add("images", json!({ "bufferView": view }));
    file.json["textures"][0]["source"] = json!(source);
    assert_eq!(*file.load().unwrap().images[0].rgba, [5; 4]);
    for (mime, name) in [
        ("image/avif", "AVIF"),
        ("image/ktx2", "KTX2"),
        ("image/vnd-ms.dds", "DDS"),
    ] {
        file.json["images"][source]["mimeType"] = json!(mime);
        assert!(file.load().unwrap().warnings[0].contains(name));
    }
}

#[test]
fn missing_coordinates_and_colours_are_filled() {
    let image = png(1, 1, [5; 4]);
    let mut file = textured(
        json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }),
        &[&image],
    );
    file.primitive()["attributes"]
        .as_object_mut()
        .unwrap()
        .remove("TEXCOORD_0");
    let colors = file.floats("VEC3", &[0.5; 9]);
    file.mesh(json!({ "attributes": { "POSITION": 0, "COLOR_0": colors } }));
    let model = file.load().unwrap();
    assert_eq!(model.uvs[0], [Vec2::ZERO; 6]);
    assert_eq!(model.colors[..3], [[1.0; 4]; 3]);
    assert_eq!(model.colors[3..], [[0.5, 0.5, 0.5, 1.0]; 3]);
    assert!(model.warnings[0].contains("no texture coordinates"));
}

#[test]
fn palettes_grey_and_16_bit_images_become_straight_rgba() {
    let encode = |color, depth, data: &[u8]| {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, 2, 1);
        encoder.set_color(color);
        encoder.set_depth(depth);
        if color == png::ColorType::Indexed {
            encoder.set_palette(vec![10, 20, 30, 40, 50, 60]);
            encoder.set_trns(vec![255, 0]);
        }
        encoder
            .write_header()
            .unwrap()
            .write_image_data(data)
            .unwrap();
        out
    };
    let cases = [
        (
            encode(png::ColorType::Indexed, png::BitDepth::Eight, &[1, 0]),
            [40, 50, 60, 0, 10, 20, 30, 255],
        ),
        (
            encode(
                png::ColorType::Grayscale,
                png::BitDepth::One,
                &[0b0100_0000],
            ),
            [0, 0, 0, 255, 255, 255, 255, 255],
        ),
        (
            encode(
                png::ColorType::GrayscaleAlpha,
                png::BitDepth::Sixteen,
                &[255, 255, 0, 0, 0, 0, 255, 255],
            ),
            [255, 255, 255, 0, 0, 0, 0, 255],
        ),
    ];
    for (bytes, want) in cases {
        let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } });
        let model = textured(material, &[&bytes]).load().unwrap();
        assert_eq!(*model.images[0].rgba, want);
    }
}
