//! Writes binary glTF 2.0 containers: JSON beside one buffer of views, accessors and images.

use glam::{Vec2, Vec3};
use serde_json::{Value, json};

/// Collects buffer views, accessors and the objects that refer to them, then writes a GLB.
///
/// The JSON keeps the order of insertion, so the same calls give the same bytes.
#[derive(Default)]
pub struct GlbBuilder {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const UNSIGNED_SHORT: u32 = 5123;

impl GlbBuilder {
    /// As an empty one, with room for so many bytes of views.
    pub fn with_capacity(bytes: usize) -> Self {
        Self {
            binary: Vec::with_capacity(bytes),
            ..Self::default()
        }
    }

    /// Bytes of all views so far.
    pub fn bytes(&self) -> usize {
        self.binary.len()
    }

    /// Adds bytes as a buffer view, aligned to four bytes, and returns its index.
    pub fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        self.view_from(offset, target)
    }

    /// Makes all bytes from an offset on a view.
    fn view_from(&mut self, offset: usize, target: Option<u32>) -> usize {
        let length = self.binary.len() - offset;
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.views.len() - 1
    }

    /// Adds positions (with the bounds that the specification asks for).
    pub fn positions(&mut self, points: &[Vec3]) -> usize {
        let low = points.iter().fold(Vec3::MAX, |a, &p| a.min(p));
        let high = points.iter().fold(Vec3::MIN, |a, &p| a.max(p));
        let accessor = self.vec3(points);
        self.accessors[accessor]["min"] = json!(low.to_array());
        self.accessors[accessor]["max"] = json!(high.to_array());
        accessor
    }

    /// Adds vectors of three floats.
    pub fn vec3(&mut self, values: &[Vec3]) -> usize {
        let bytes = values.iter().map(|v| v.to_array().map(f32::to_le_bytes));
        self.accessor(bytes, ("VEC3", FLOAT), values.len(), ARRAY_BUFFER)
    }

    /// Adds vectors of two floats.
    pub fn vec2(&mut self, values: &[Vec2]) -> usize {
        let bytes = values.iter().map(|v| v.to_array().map(f32::to_le_bytes));
        self.accessor(bytes, ("VEC2", FLOAT), values.len(), ARRAY_BUFFER)
    }

    /// Adds vectors of four floats (tangents, colours).
    pub fn vec4(&mut self, values: &[[f32; 4]]) -> usize {
        let bytes = values.iter().map(|v| v.map(f32::to_le_bytes));
        self.accessor(bytes, ("VEC4", FLOAT), values.len(), ARRAY_BUFFER)
    }

    /// Adds triangle indices, as u16 where `vertex_count` allows it.
    pub fn indices(&mut self, triangles: &[[u32; 3]], vertex_count: usize) -> usize {
        let count = triangles.len() * 3;
        if vertex_count < 65_535 {
            let bytes = triangles
                .iter()
                .map(|t| t.map(|i| (i as u16).to_le_bytes()));
            let kind = ("SCALAR", UNSIGNED_SHORT);
            self.accessor(bytes, kind, count, ELEMENT_ARRAY_BUFFER)
        } else {
            let bytes = triangles.iter().map(|t| t.map(u32::to_le_bytes));
            let kind = ("SCALAR", UNSIGNED_INT);
            self.accessor(bytes, kind, count, ELEMENT_ARRAY_BUFFER)
        }
    }

    fn accessor<const BYTES: usize, const NUMBERS: usize>(
        &mut self,
        values: impl ExactSizeIterator<Item = [[u8; BYTES]; NUMBERS]>,
        (shape, kind): (&str, u32),
        count: usize,
        target: u32,
    ) -> usize {
        let offset = self.binary.len();
        self.binary.reserve(values.len() * BYTES * NUMBERS);
        for value in values {
            self.binary.extend_from_slice(value.as_flattened());
        }
        let view = self.view_from(offset, Some(target));
        self.accessors.push(json!({
            "bufferView": view, "componentType": kind, "count": count, "type": shape,
        }));
        self.accessors.len() - 1
    }

    /// Puts buffers, views and accessors into `root` (an object with "asset", "nodes", ...) and
    /// returns the whole file.
    pub fn finish(self, mut root: Value) -> Vec<u8> {
        if !self.binary.is_empty() {
            root["buffers"] = json!([{ "byteLength": self.binary.len() }]);
            root["bufferViews"] = Value::Array(self.views);
        }
        if !self.accessors.is_empty() {
            root["accessors"] = Value::Array(self.accessors);
        }
        let mut text = root.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let binary = self.binary.len();
        let total = 20 + text.len() + if binary > 0 { 8 + binary } else { 0 };
        let mut head = Vec::with_capacity(28 + text.len());
        head.extend_from_slice(b"glTF");
        head.extend_from_slice(&2u32.to_le_bytes());
        head.extend_from_slice(&(total as u32).to_le_bytes());
        head.extend_from_slice(&(text.len() as u32).to_le_bytes());
        head.extend_from_slice(b"JSON");
        head.extend_from_slice(&text);
        if binary > 0 {
            head.extend_from_slice(&(binary as u32).to_le_bytes());
            head.extend_from_slice(b"BIN\0");
        }
        // Moved up in place: a second copy would be as large as the file.
        let mut out = self.binary;
        out.splice(0..0, head);
        out
    }
}
