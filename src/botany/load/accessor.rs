//! Accessors: checked reading of typed elements, sparse or not, quantised or not.

use glam::{DVec3, Vec3};

use super::buffer::{Asset, BROKEN};
use super::json::Accessor;
use crate::Result;

/// How integers become numbers.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Integers {
    /// As the accessor's `normalized` says.
    AsSaid,
    /// Always to 0..1 or -1..1: colours and rotations, where exporters forget the flag.
    Normalized,
}

/// Elements of an accessor as bytes at a distance.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
}

impl<'a> Elements<'a> {
    fn at<const B: usize>(&self, i: usize, component: usize) -> [u8; B] {
        let start = i * self.stride + component * B;
        // The length was checked when the elements were opened; zeros can't be reached.
        self.bytes
            .get(start..start + B)
            .and_then(|b| b.try_into().ok())
            .unwrap_or([0; B])
    }
}

fn component_size(kind: u32) -> Option<usize> {
    match kind {
        5120 | 5121 => Some(1),
        5122 | 5123 => Some(2),
        5125 | 5126 => Some(4),
        _ => None,
    }
}

fn component_count(shape: &str) -> Option<usize> {
    Some(match shape {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        _ => return None,
    })
}

impl<'a> Asset<'a> {
    /// The accessor with this index.
    pub fn accessor(&self, index: usize, place: &str) -> Result<&'a Accessor> {
        self.json
            .accessors
            .get(index)
            .ok_or_else(|| self.fault(place, format!("there is no accessor {index}"), BROKEN))
    }

    /// Components of an accessor's elements: 3 of a VEC3.
    pub fn components(&self, index: usize, place: &str) -> Result<usize> {
        let accessor = self.accessor(index, place)?;
        component_count(&accessor.shape).ok_or_else(|| {
            let what = format!("accessor {index} has the type \"{}\"", accessor.shape);
            self.fault(place, what, BROKEN)
        })
    }

    /// Opens `count` elements of `size` bytes in a view; all of them are inside it.
    fn elements(
        &self,
        view: usize,
        offset: usize,
        stride: Option<usize>,
        (count, size): (usize, usize),
        place: &str,
    ) -> Result<Elements<'_>> {
        let bytes = self.view(view, place)?;
        let stride = stride.unwrap_or(size);
        if stride < size {
            let what = format!("byteStride {stride} is less than the element's {size} bytes");
            return Err(self.fault(place, what, BROKEN));
        }
        let end = match count {
            0 => Some(offset),
            n => (n - 1)
                .checked_mul(stride)
                .and_then(|d| d.checked_add(size)?.checked_add(offset)),
        };
        match end {
            Some(end) if end <= bytes.len() => Ok(Elements {
                bytes: &bytes[offset..],
                stride,
            }),
            _ => {
                let what = format!(
                    "{count} elements of {size} bytes from byte {offset} don't fit bufferView {view} of {} bytes",
                    bytes.len()
                );
                Err(self.fault(place, what, BROKEN))
            }
        }
    }

    /// The base elements of an accessor; `None` means zeros.
    fn base(&self, index: usize, size: usize, place: &str) -> Result<Option<Elements<'_>>> {
        let accessor = self.accessor(index, place)?;
        let Some(view) = accessor.buffer_view else {
            // Zeros cost a file nothing, so they are held to what the file could have stored.
            if accessor.count as u64 > self.file_bytes {
                let what = format!(
                    "accessor {index} has {} elements and no bufferView",
                    accessor.count
                );
                return Err(self.fault(place, what, BROKEN));
            }
            return Ok(None);
        };
        let stride = self.stride(view);
        self.elements(
            view,
            accessor.byte_offset,
            stride,
            (accessor.count, size),
            place,
        )
        .map(Some)
    }

    /// Number of an accessor's elements, which are all there: what may be allocated for them.
    pub fn count(&self, index: usize, place: &str) -> Result<usize> {
        let accessor = self.accessor(index, place)?;
        let component = component_size(accessor.component_type).unwrap_or(1);
        let size = component * self.components(index, place)?;
        self.base(index, size, place)?;
        Ok(accessor.count)
    }

    /// Positions at which a sparse accessor replaces elements: ascending, in range.
    fn sparse_positions(&self, index: usize, place: &str) -> Result<Vec<u32>> {
        let accessor = self.accessor(index, place)?;
        let Some(sparse) = &accessor.sparse else {
            return Ok(Vec::new());
        };
        let at = &sparse.indices;
        let size = match at.component_type {
            5121 | 5123 | 5125 => component_size(at.component_type).unwrap_or(4),
            other => {
                let what = format!("sparse indices have the component type {other}");
                return Err(self.fault(place, what, BROKEN));
            }
        };
        let shape = (sparse.count, size);
        let elements = self.elements(at.buffer_view, at.byte_offset, None, shape, place)?;
        let positions: Vec<u32> = (0..sparse.count)
            .map(|i| read_index(&elements, at.component_type, i))
            .collect();
        let ascending = positions.windows(2).all(|w| w[0] < w[1]);
        let inside = positions
            .last()
            .is_none_or(|&p| (p as usize) < accessor.count);
        if !(ascending && inside) {
            let what = format!("sparse indices of accessor {index} don't ascend within its count");
            return Err(self.fault(place, what, BROKEN));
        }
        Ok(positions)
    }

    /// Reads the selected elements (ascending indices) as floats; every number is finite.
    pub fn floats<const N: usize>(
        &self,
        index: usize,
        select: &[u32],
        integers: Integers,
        place: &str,
    ) -> Result<Vec<[f32; N]>> {
        let accessor = self.accessor(index, place)?;
        let kind = accessor.component_type;
        let size = match component_size(kind) {
            Some(size) if self.components(index, place)? == N && kind != 5125 => size * N,
            _ => {
                let what = format!(
                    "accessor {index} is {} of component type {kind}; {N} components of float or of 8 or 16 bits are needed",
                    accessor.shape
                );
                return Err(self.fault(place, what, BROKEN));
            }
        };
        if select.last().is_some_and(|&i| i as usize >= accessor.count) {
            let what = format!(
                "accessor {index} has {} elements, fewer than the primitive's vertices",
                accessor.count
            );
            return Err(self.fault(place, what, BROKEN));
        }
        let normalized = accessor.normalized || integers == Integers::Normalized;
        let mut out = match self.base(index, size, place)? {
            None => vec![[0.0; N]; select.len()],
            Some(elements) => read_floats(&elements, kind, normalized, select.iter().copied()),
        };
        if let Some(sparse) = &accessor.sparse {
            let positions = self.sparse_positions(index, place)?;
            let values = &sparse.values;
            let shape = (positions.len(), size);
            let elements =
                self.elements(values.buffer_view, values.byte_offset, None, shape, place)?;
            let all = 0..positions.len() as u32;
            let replaced: Vec<[f32; N]> = read_floats(&elements, kind, normalized, all);
            for (position, value) in positions.iter().zip(replaced) {
                if let Ok(slot) = select.binary_search(position) {
                    out[slot] = value;
                }
            }
        }
        if let Some(bad) = out.iter().position(|v| v.iter().any(|x| !x.is_finite())) {
            let i = select.get(bad).copied().unwrap_or_default();
            return Err(self.fault(
                format!("{place}, accessor {index}, index {i}"),
                format!("{:?} is not finite", out[bad]),
                "delete or repair this vertex in the modelling program and export again",
            ));
        }
        Ok(out)
    }

    /// Reads indices of 8, 16 or 32 bits.
    pub fn indices(&self, index: usize, place: &str) -> Result<Vec<u32>> {
        let accessor = self.accessor(index, place)?;
        let kind = accessor.component_type;
        let scalar = self.components(index, place)? == 1;
        let size = match kind {
            5121 | 5123 | 5125 if scalar => component_size(kind).unwrap_or(4),
            _ => {
                let what = format!(
                    "accessor {index} is {} of component type {kind}; indices are unsigned integers",
                    accessor.shape
                );
                return Err(self.fault(place, what, BROKEN));
            }
        };
        let mut out: Vec<u32> = match self.base(index, size, place)? {
            None => vec![0; accessor.count],
            Some(e) => (0..accessor.count)
                .map(|i| read_index(&e, kind, i))
                .collect(),
        };
        if let Some(sparse) = &accessor.sparse {
            let positions = self.sparse_positions(index, place)?;
            let values = &sparse.values;
            let shape = (positions.len(), size);
            let elements =
                self.elements(values.buffer_view, values.byte_offset, None, shape, place)?;
            for (i, &position) in positions.iter().enumerate() {
                out[position as usize] = read_index(&elements, kind, i);
            }
        }
        Ok(out)
    }

    /// How far neighbouring positions of an accessor lie apart where `values`, read from it, are coarsest: one unit of
    /// an integer (KHR_mesh_quantization), else one unit in the last place of the largest f32 along each axis.
    pub fn step(&self, index: usize, values: &[Vec3], place: &str) -> Result<DVec3> {
        let accessor = self.accessor(index, place)?;
        let most = match accessor.component_type {
            5120 => 127.0,
            5121 => 255.0,
            5122 => 32767.0,
            5123 => 65535.0,
            _ => {
                let largest = values.iter().fold(Vec3::ZERO, |most, v| most.max(v.abs()));
                let below = largest.to_array().map(f32::next_down);
                return Ok(largest.as_dvec3() - Vec3::from_array(below).as_dvec3());
            }
        };
        let unit = if accessor.normalized { 1.0 / most } else { 1.0 };
        Ok(DVec3::splat(unit))
    }
}

fn read_index(elements: &Elements, kind: u32, i: usize) -> u32 {
    match kind {
        5121 => elements.at::<1>(i, 0)[0].into(),
        5123 => u16::from_le_bytes(elements.at(i, 0)).into(),
        _ => u32::from_le_bytes(elements.at(i, 0)),
    }
}

/// Dequantisation as glTF 2.0 section 3.6.2.2 and KHR_mesh_quantization have it.
fn read_floats<const N: usize>(
    e: &Elements,
    kind: u32,
    normalized: bool,
    select: impl Iterator<Item = u32>,
) -> Vec<[f32; N]> {
    let scale = move |x: f32, most: f32| if normalized { (x / most).max(-1.0) } else { x };
    match kind {
        5120 => collect(e, select, |b| scale(i8::from_le_bytes(b).into(), 127.0)),
        5121 => collect(e, select, |b| scale(u8::from_le_bytes(b).into(), 255.0)),
        5122 => collect(e, select, |b| scale(i16::from_le_bytes(b).into(), 32767.0)),
        5123 => collect(e, select, |b| scale(u16::from_le_bytes(b).into(), 65535.0)),
        _ => collect(e, select, f32::from_le_bytes),
    }
}

fn collect<const N: usize, const B: usize>(
    e: &Elements,
    select: impl Iterator<Item = u32>,
    number: impl Fn([u8; B]) -> f32,
) -> Vec<[f32; N]> {
    select
        .map(|i| std::array::from_fn(|c| number(e.at(i as usize, c))))
        .collect()
}
