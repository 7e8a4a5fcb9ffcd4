//! Makes small glTF files, good or broken, piece by piece.

use std::path::Path;

use base64::Engine as _;
use pleach::botany::Model;
use pleach::botany::load::{Limits, load_slice};
use serde_json::{Value, json};

pub const I8: u32 = 5120;
pub const U8: u32 = 5121;
pub const I16: u32 = 5122;
pub const U16: u32 = 5123;
pub const U32: u32 = 5125;
pub const F32: u32 = 5126;

/// A document whose JSON can be bent at will before it is written.
pub struct File {
    pub json: Value,
    pub binary: Vec<u8>,
}

impl File {
    /// One scene without nodes.
    pub fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [] }], "nodes": [],
            "meshes": [], "materials": [], "accessors": [], "bufferViews": [], "buffers": [],
            "textures": [], "images": [], "samplers": [], "skins": [],
        });
        Self {
            json,
            binary: Vec::new(),
        }
    }

    /// One triangle (0,0,0), (2,0,0), (0,2,0) in one node: what most tests start from.
    pub fn triangle() -> Self {
        let mut file = Self::new();
        let positions = file.floats("VEC3", &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0]);
        file.mesh(json!({ "attributes": { "POSITION": positions } }));
        file
    }

    /// Adds an element to one of the document's lists and returns its index.
    pub fn add(&mut self, list: &str, element: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(element);
        list.len() - 1
    }

    pub fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        self.add("bufferViews", view)
    }

    pub fn accessor(&mut self, bytes: &[u8], kind: u32, shape: &str, count: usize) -> usize {
        let view = self.view(bytes);
        let accessor =
            json!({ "bufferView": view, "componentType": kind, "type": shape, "count": count });
        self.add("accessors", accessor)
    }

    pub fn floats(&mut self, shape: &str, values: &[f32]) -> usize {
        let width = match shape {
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            _ => 1,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, F32, shape, values.len() / width)
    }

    pub fn u16s(&mut self, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, U16, "SCALAR", values.len())
    }

    /// A mesh of one primitive, in a node of its own in the scene.
    pub fn mesh(&mut self, primitive: Value) -> usize {
        let mesh = self.add("meshes", json!({ "primitives": [primitive] }));
        self.node(json!({ "mesh": mesh }));
        mesh
    }

    /// A node at the root of the scene.
    pub fn node(&mut self, node: Value) -> usize {
        let node = self.add("nodes", node);
        self.json["scenes"][0]["nodes"]
            .as_array_mut()
            .unwrap()
            .push(json!(node));
        node
    }

    /// The first mesh's first primitive.
    pub fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if json["buffers"].as_array().unwrap().is_empty() {
            json["buffers"] = json!([{ "byteLength": self.binary.len() }]);
        }
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let total = 28 + text.len() + self.binary.len();
        let word = |n: usize| (n as u32).to_le_bytes();
        let mut out = b"glTF\x02\0\0\0".to_vec();
        out.extend_from_slice(&word(total));
        out.extend_from_slice(&word(text.len()));
        out.extend_from_slice(b"JSON");
        out.extend_from_slice(&text);
        out.extend_from_slice(&word(self.binary.len()));
        out.extend_from_slice(b"BIN\0");
        out.extend_from_slice(&self.binary);
        out
    }

    /// The same as .gltf, its buffer in a data URI.
    pub fn gltf(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] =
            json!([{ "byteLength": self.binary.len(), "uri": data_uri(&self.binary) }]);
        json.to_string().into_bytes()
    }

    pub fn load(&self) -> pleach::Result<Model> {
        load_slice(&self.glb(), Path::new("made.glb"), &Limits::default())
    }

    /// The message of the error that loading ends with.
    pub fn error(&self) -> String {
        match self.load() {
            Ok(model) => panic!("it loaded: {} triangles", model.triangles.len()),
            Err(error) => {
                assert_eq!(error.exit_code(), 2, "{error}");
                error.to_string()
            }
        }
    }
}

pub fn data_uri(bytes: &[u8]) -> String {
    let text = base64::engine::general_purpose::STANDARD.encode(bytes);
    format!("data:application/octet-stream;base64,{text}")
}

/// Triangles as corners in world space, rounded to 1e-4.
pub fn world(model: &Model) -> Vec<[[f64; 3]; 3]> {
    let frame = model.frame;
    let round = |p: glam::DVec3| p.to_array().map(|x| (x * 1e4).round() / 1e4 + 0.0);
    let corner = |p: glam::Vec3| round(frame.center + frame.radius * p.as_dvec3());
    let triangles = 0..model.triangles.len() as u32;
    triangles.map(|t| model.corners(t).map(corner)).collect()
}

/// A PNG of `width` x `height` texels, all of one colour.
pub fn png(width: u32, height: u32, rgba: [u8; 4]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().unwrap();
    writer
        .write_image_data(&rgba.repeat((width * height) as usize))
        .unwrap();
    drop(writer);
    out
}
