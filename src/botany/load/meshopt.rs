//! EXT_meshopt_compression: <https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Vendor/EXT_meshopt_compression>
//! (and KHR_meshopt_compression, which adds the COLOR filter).

use ::meshopt as codec;

use super::json::Compressed;

type Decoded = Result<Vec<u8>, String>;

/// The densest vertex stream: one control byte for 256 vertices of four bytes; twice that here.
const MOST_EXPANSION: usize = 2048;

/// Decompresses one buffer view; the result has `count * byteStride` bytes.
pub(super) fn decode(packed: &[u8], c: &Compressed) -> Decoded {
    // Counts are bounded by the compressed bytes before anything is allocated for them.
    let most = match c.mode.as_str() {
        "ATTRIBUTES" => packed.len().saturating_mul(MOST_EXPANSION) / c.byte_stride.max(1),
        "TRIANGLES" => packed.len().saturating_mul(3),
        "INDICES" => packed.len(),
        other => return Err(format!("unknown meshopt mode {other}")),
    };
    if c.count > most {
        return Err(format!(
            "{} elements can't be in {} compressed bytes",
            c.count,
            packed.len()
        ));
    }
    let filter = c.filter.as_deref().unwrap_or("NONE");
    match (c.mode.as_str(), c.byte_stride) {
        ("ATTRIBUTES", stride) => attributes(packed, stride, c.count, filter),
        ("TRIANGLES", _) if !c.count.is_multiple_of(3) => {
            Err(format!("{} indices are not whole triangles", c.count))
        }
        ("TRIANGLES", 2) => bytes16(codec::decode_index_buffer::<u16>(packed, c.count)),
        ("TRIANGLES", 4) => bytes32(codec::decode_index_buffer::<u32>(packed, c.count)),
        ("INDICES", 2) => bytes16(codec::decode_index_sequence::<u16>(packed, c.count)),
        ("INDICES", 4) => bytes32(codec::decode_index_sequence::<u32>(packed, c.count)),
        (mode, stride) => Err(format!("meshopt mode {mode} with byteStride {stride}")),
    }
}

/// The decoder is generic over the element; its size is all that matters, so every allowed
/// stride (a multiple of 4 up to 256) becomes an array of words.
fn attributes(packed: &[u8], stride: usize, count: usize, filter: &str) -> Decoded {
    macro_rules! by_words {
        ($($n:literal)*) => {
            match stride {
                $(s if s == $n * 4 => vertices::<Words<$n>>(packed, count),)*
                _ => Err(format!("byteStride {stride} of compressed attributes")),
            }
        };
    }
    let mut bytes = by_words!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25
        26 27 28 29 30 31 32 33 34 35 36 37 38 39 40 41 42 43 44 45 46 47 48 49 50 51 52 53 54 55
        56 57 58 59 60 61 62 63 64)?;
    unfilter(&mut bytes, stride, filter)?;
    Ok(bytes)
}

/// `N` words of four bytes.
#[derive(Clone, Copy)]
#[repr(C)]
struct Words<const N: usize>([[u8; 4]; N]);

impl<const N: usize> Default for Words<N> {
    fn default() -> Self {
        Self([[0; 4]; N])
    }
}

trait AsWords {
    fn words(&self) -> &[[u8; 4]];
}

impl<const N: usize> AsWords for Words<N> {
    fn words(&self) -> &[[u8; 4]] {
        &self.0
    }
}

fn vertices<T: Clone + Default + AsWords>(packed: &[u8], count: usize) -> Decoded {
    let decoded = codec::decode_vertex_buffer::<T>(packed, count).map_err(said)?;
    Ok(decoded
        .iter()
        .flat_map(|v| v.words().as_flattened().iter().copied())
        .collect())
}

fn unfilter(bytes: &mut [u8], stride: usize, filter: &str) -> Result<(), String> {
    match (filter, stride) {
        ("NONE", _) => {}
        ("OCTAHEDRAL", 4) => {
            let mut v: Vec<[i8; 4]> = bytes
                .as_chunks::<4>()
                .0
                .iter()
                .map(|c| c.map(|b| b as i8))
                .collect();
            codec::decode_filter_oct(&mut v);
            put(bytes, v.as_flattened().iter().map(|&b| [b as u8]));
        }
        ("OCTAHEDRAL", 8) => {
            let mut v = shorts(bytes);
            codec::decode_filter_oct(&mut v);
            put(bytes, v.as_flattened().iter().map(|s| s.to_le_bytes()));
        }
        ("QUATERNION", 8) => {
            let mut v = shorts(bytes);
            codec::decode_filter_quat(&mut v);
            put(bytes, v.as_flattened().iter().map(|s| s.to_le_bytes()));
        }
        ("EXPONENTIAL", s) if s.is_multiple_of(4) => {
            let mut v: Vec<[u32; 1]> = bytes
                .as_chunks::<4>()
                .0
                .iter()
                .map(|&c| [u32::from_le_bytes(c)])
                .collect();
            codec::decode_filter_exp(&mut v);
            put(bytes, v.iter().map(|w| w[0].to_le_bytes()));
        }
        ("COLOR", 4) => {
            let mut v = bytes.as_chunks::<4>().0.to_vec();
            codec::decode_filter_color(&mut v);
            put(bytes, v.as_flattened().iter().map(|&b| [b]));
        }
        ("COLOR", 8) => {
            let mut v: Vec<[u16; 4]> = shorts(bytes).iter().map(|q| q.map(|s| s as u16)).collect();
            codec::decode_filter_color(&mut v);
            put(bytes, v.as_flattened().iter().map(|s| s.to_le_bytes()));
        }
        _ => return Err(format!("meshopt filter {filter} with byteStride {stride}")),
    }
    Ok(())
}

fn shorts(bytes: &[u8]) -> Vec<[i16; 4]> {
    let short = |c: &[u8; 8], i: usize| i16::from_le_bytes([c[2 * i], c[2 * i + 1]]);
    let chunks = bytes.as_chunks::<8>().0.iter();
    chunks
        .map(|c| std::array::from_fn(|i| short(c, i)))
        .collect()
}

fn put<const N: usize>(bytes: &mut [u8], values: impl Iterator<Item = [u8; N]>) {
    for (to, from) in bytes.as_chunks_mut::<N>().0.iter_mut().zip(values) {
        *to = from;
    }
}

fn bytes16(decoded: codec::Result<Vec<u16>>) -> Decoded {
    Ok(decoded
        .map_err(said)?
        .iter()
        .flat_map(|i| i.to_le_bytes())
        .collect())
}

fn bytes32(decoded: codec::Result<Vec<u32>>) -> Decoded {
    Ok(decoded
        .map_err(said)?
        .iter()
        .flat_map(|i| i.to_le_bytes())
        .collect())
}

fn said(error: codec::Error) -> String {
    format!("the compressed data is broken: {error}")
}
