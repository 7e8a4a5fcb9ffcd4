//! PNG, the format that every client reads.

use std::io::Write;

use rayon::prelude::*;

use super::surface::Scene;
use crate::botany::model::Image;
use crate::error::{Error, Result};

/// Compressed bytes in one piece of a file.
const CHUNK_BYTES: usize = 1 << 20;

/// All images of a scene as PNG, in order.
pub fn encode_images(scene: &Scene) -> Result<Vec<Vec<u8>>> {
    scene.images.par_iter().map(encode_png).collect()
}

/// PNG without an alpha channel where every texel is opaque.
pub fn encode_png(image: &Image) -> Result<Vec<u8>> {
    let fail = |error: png::EncodingError| Error::Internal {
        step: "encode PNG",
        what: error.to_string(),
    };
    let opaque = image.rgba.chunks_exact(4).all(|t| t[3] == 255);
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, image.width, image.height);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_color(if opaque {
        png::ColorType::Rgb
    } else {
        png::ColorType::Rgba
    });
    encoder.set_compression(png::Compression::Balanced);
    let mut writer = encoder.write_header().map_err(fail)?;
    // Row by row: neither the pixels nor what comes of them is in memory twice.
    let mut rows = writer.stream_writer_with_size(CHUNK_BYTES).map_err(fail)?;
    let mut written = Vec::new();
    for row in image.rgba.chunks_exact(4 * image.width.max(1) as usize) {
        written.clear();
        match opaque {
            true => written.extend(row.chunks_exact(4).flat_map(|t| [t[0], t[1], t[2]])),
            false => written.extend_from_slice(row),
        }
        rows.write_all(&written).map_err(|e| fail(e.into()))?;
    }
    rows.finish().map_err(fail)?;
    writer.finish().map_err(fail)?;
    Ok(out)
}
