//! PNG, the format that every client reads.

use rayon::prelude::*;

use super::surface::Scene;
use crate::botany::model::Image;
use crate::error::{Error, Result};

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
    if opaque {
        let rgb: Vec<u8> = image
            .rgba
            .chunks_exact(4)
            .flat_map(|t| [t[0], t[1], t[2]])
            .collect();
        writer.write_image_data(&rgb).map_err(fail)?;
    } else {
        writer.write_image_data(&image.rgba).map_err(fail)?;
    }
    writer.finish().map_err(fail)?;
    Ok(out)
}
