//! Writes binary glTF 2.0 containers: JSON beside one buffer of views, accessors and images.

use std::borrow::Cow;

use glam::{Vec2, Vec3};
use serde_json::{Value, json};

/// Collects buffer views, accessors and the objects that refer to them, then writes a GLB.
///
/// The JSON keeps the order of insertion, so the same calls give the same bytes. Images may stay where they are until the
/// file is written: those of all levels are as large as the file.
#[derive(Default)]
pub struct GlbBuilder<'b> {
    /// The buffer: own pieces, and such as stay where they are.
    pieces: Vec<Cow<'b, [u8]>>,
    /// Length of all of them.
    bytes: usize,
    /// What own pieces may still take.
    room: usize,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

/// A container in pieces: its bytes are theirs, one after the other.
pub struct Glb<'b>(Vec<Cow<'b, [u8]>>);

impl Glb<'_> {
    /// The pieces.
    pub fn pieces(&self) -> impl Iterator<Item = &[u8]> {
        self.0.iter().map(|piece| &piece[..])
    }

    /// All in one.
    pub fn into_bytes(self) -> Vec<u8> {
        self.0.concat()
    }
}

const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const UNSIGNED_SHORT: u32 = 5123;

impl<'b> GlbBuilder<'b> {
    /// As an empty one, with room for so many bytes of its own.
    pub fn with_capacity(room: usize) -> Self {
        Self {
            room,
            ..Self::default()
        }
    }

    /// Bytes of all views so far.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// The piece that takes what is added next.
    fn own(&mut self) -> &mut Vec<u8> {
        if !matches!(self.pieces.last(), Some(Cow::Owned(_))) {
            self.pieces.push(Cow::Owned(Vec::with_capacity(self.room)));
        }
        let last = self.pieces.len() - 1;
        self.pieces[last].to_mut()
    }

    /// As [`view`](Self::view), of bytes that stay where they are.
    pub fn view_of(&mut self, bytes: Cow<'b, [u8]>, target: Option<u32>) -> usize {
        let offset = self.bytes;
        self.bytes += bytes.len();
        self.pieces.push(bytes);
        self.view_from(offset, target)
    }

    /// Adds bytes as a buffer view, aligned to four bytes, and returns its index.
    pub fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let offset = self.bytes;
        self.own().extend_from_slice(bytes);
        self.bytes += bytes.len();
        self.view_from(offset, target)
    }

    /// Makes all bytes from an offset on a view.
    fn view_from(&mut self, offset: usize, target: Option<u32>) -> usize {
        let length = self.bytes - offset;
        let odd = self.bytes.next_multiple_of(4) - self.bytes;
        if odd > 0 {
            self.own().extend(&[0; 4][..odd]);
            self.bytes += odd;
        }
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
        let (offset, length) = (self.bytes, values.len() * BYTES * NUMBERS);
        let own = self.own();
        own.reserve(length);
        for value in values {
            own.extend_from_slice(value.as_flattened());
        }
        self.bytes += length;
        self.room = self.room.saturating_sub(length);
        let view = self.view_from(offset, Some(target));
        self.accessors.push(json!({
            "bufferView": view, "componentType": kind, "count": count, "type": shape,
        }));
        self.accessors.len() - 1
    }

    /// Puts buffers, views and accessors into `root` (an object with "asset", "nodes", ...) and
    /// returns the whole file.
    pub fn finish(self, root: Value) -> Vec<u8> {
        self.finish_in_pieces(root).into_bytes()
    }

    /// As [`finish`](Self::finish), with what stays where it is.
    pub fn finish_in_pieces(self, mut root: Value) -> Glb<'b> {
        if self.bytes > 0 {
            root["buffers"] = json!([{ "byteLength": self.bytes }]);
            root["bufferViews"] = Value::Array(self.views);
        }
        if !self.accessors.is_empty() {
            root["accessors"] = Value::Array(self.accessors);
        }
        let mut text = root.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let total = 20 + text.len() + if self.bytes > 0 { 8 + self.bytes } else { 0 };
        let mut head = Vec::with_capacity(28 + text.len());
        head.extend_from_slice(b"glTF");
        head.extend_from_slice(&2u32.to_le_bytes());
        head.extend_from_slice(&(total as u32).to_le_bytes());
        head.extend_from_slice(&(text.len() as u32).to_le_bytes());
        head.extend_from_slice(b"JSON");
        head.extend_from_slice(&text);
        if self.bytes > 0 {
            head.extend_from_slice(&(self.bytes as u32).to_le_bytes());
            head.extend_from_slice(b"BIN\0");
        }
        let head = [Cow::Owned(head)].into_iter();
        Glb(head.chain(self.pieces).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stays_where_it_is_lies_in_the_file_as_what_was_copied() {
        let (image, points) = ([7u8, 8, 9, 10, 11], [Vec3::X, Vec3::Y]);
        let file = |add: &dyn Fn(&mut GlbBuilder<'static>)| {
            let mut glb = GlbBuilder::with_capacity(1);
            glb.positions(&points);
            add(&mut glb);
            glb.vec3(&points);
            assert_eq!(glb.bytes(), 24 + 8 + 24);
            glb.finish_in_pieces(json!({ "asset": { "version": "2.0" } }))
        };
        let copied = file(&|glb| assert_eq!(glb.view(&image, None), 1)).into_bytes();
        let kept = file(&|glb| {
            const IMAGE: &[u8] = &[7, 8, 9, 10, 11];
            assert_eq!(glb.view_of(IMAGE.into(), None), 1);
        });
        assert_eq!(kept.pieces().count(), 4);
        assert_eq!(kept.into_bytes(), copied);
        let length = u32::from_le_bytes([copied[8], copied[9], copied[10], copied[11]]);
        assert_eq!(length as usize, copied.len());
        let end = &copied[copied.len() - 24 - 8..][..8];
        assert_eq!(end, [7, 8, 9, 10, 11, 0, 0, 0]);
    }
}
