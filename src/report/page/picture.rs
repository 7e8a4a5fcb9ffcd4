//! The pictures of the page: original and level, where their silhouettes differ, and FLIP.

use crate::botany::Model;
use crate::report::shot::Shot;
use crate::report::stage::{Actor, Window, sampling};
use crate::space::view::{Lens, View};
use crate::{Error, Result};

/// A level beside its original from one view, as PNG files of one size.
pub struct Pair {
    /// The view's name.
    pub view: String,
    /// Width of all pictures, pixels.
    pub width: u32,
    /// Height of all pictures, pixels.
    pub height: u32,
    /// The original, lit.
    pub original: Vec<u8>,
    /// The level, lit.
    pub level: Vec<u8>,
    /// Where silhouettes agree and differ: [`AGREEMENT`].
    pub agreement: Vec<u8>,
    /// FLIP in the colours of [`flip_color`].
    pub flip: Vec<u8>,
    /// Pixels of both silhouettes, of the original alone, of the level alone.
    pub counts: [u64; 3],
}

/// Kratt, Fig. 3: ground, true positive, false negative, false positive.
pub const AGREEMENT: [[u8; 3]; 4] = [[255, 255, 255], [208, 208, 208], [128, 128, 128], [0, 0, 0]];

/// Draws a level and its original where the tree is `height_px` high.
///
/// # Errors
/// [`Error::Internal`] if a picture can't be encoded.
pub fn pair(
    original: &Model,
    level: &Model,
    view: &View,
    (lens, height_px): (Lens, u32),
) -> Result<Pair> {
    let actors = [original, level].map(|model| Actor::new(model, original, true));
    let lens = (lens, original.height());
    let (window, camera) = Window::of_view(&actors, view, lens, height_px);
    let drawn = |actor: Actor| {
        let order = actor.front_to_back(camera.forward);
        Shot::new(actor.layers(&camera, sampling(height_px), &order).1)
    };
    let [a, b] = actors.map(drawn);
    let agreement: Vec<u8> = a
        .layers
        .coverage
        .iter()
        .zip(&b.layers.coverage)
        .map(|(a, b)| match (*a >= 0.5, *b >= 0.5) {
            (false, false) => 0,
            (true, true) => 1,
            (true, false) => 2,
            (false, true) => 3,
        })
        .collect();
    let count = |kind: u8| agreement.iter().filter(|&&k| k == kind).count() as u64;
    let counts = [1, 2, 3].map(count);
    let flip: Vec<u8> = (0..agreement.len())
        .map(|i| (a.flip(&b, i).clamp(0.0, 1.0) * 255.0).round() as u8)
        .collect();
    let palette: Vec<[u8; 3]> = (0..=255).map(|i| flip_color(i as f32 / 255.0)).collect();
    let size = [window.width, window.height];
    Ok(Pair {
        view: view.name.clone(),
        width: window.width,
        height: window.height,
        original: rgb_png(size, &a.srgb)?,
        level: rgb_png(size, &b.srgb)?,
        agreement: palette_png(size, &AGREEMENT, &agreement)?,
        flip: palette_png(size, &palette, &flip)?,
        counts,
    })
}

/// Black over violet and orange to white, as light as the difference is large (after matplotlib's
/// "magma", straight between nine of its colours).
pub fn flip_color(value: f32) -> [u8; 3] {
    const STOPS: [[f32; 3]; 9] = [
        [0.0, 0.0, 4.0],
        [28.0, 16.0, 68.0],
        [79.0, 18.0, 123.0],
        [129.0, 37.0, 129.0],
        [181.0, 54.0, 122.0],
        [229.0, 80.0, 100.0],
        [251.0, 135.0, 97.0],
        [254.0, 194.0, 135.0],
        [252.0, 253.0, 191.0],
    ];
    let at = value.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let low = (at as usize).min(STOPS.len() - 2);
    let (a, b) = (STOPS[low], STOPS[low + 1]);
    std::array::from_fn(|i| (a[i] + (b[i] - a[i]) * (at - low as f32)).round() as u8)
}

/// Edge of the square that atlas pages are shown in, pixels.
const PAGE_PX: u32 = 256;

/// An image of a file, downscaled to [`PAGE_PX`], as PNG with its size.
///
/// # Errors
/// [`Error::Internal`] if it can't be encoded.
pub fn page(image: &crate::botany::model::Image) -> Result<Option<(Vec<u8>, u32, u32)>> {
    // Pixels may have been left behind to save memory.
    let texels = image.rgba.as_slice();
    let whole: Option<image::ImageBuffer<image::Rgba<u8>, _>> =
        image::ImageBuffer::from_raw(image.width, image.height, texels);
    let Some(whole) = whole else {
        return Ok(None);
    };
    let longest = image.width.max(image.height).max(1);
    let size = |px: u32| (px * PAGE_PX.min(longest)).div_ceil(longest).max(1);
    let (width, height) = (size(image.width), size(image.height));
    let small = image::imageops::thumbnail(&whole, width, height);
    let bytes = encode([width, height], png::ColorType::Rgba, &[], small.as_raw())?;
    Ok(Some((bytes, width, height)))
}

fn rgb_png(size: [u32; 2], srgb: &[[f32; 3]]) -> Result<Vec<u8>> {
    let bytes: Vec<u8> = srgb
        .as_flattened()
        .iter()
        .map(|c| (c * 255.0 + 0.5) as u8)
        .collect();
    encode(size, png::ColorType::Rgb, &[], &bytes)
}

fn palette_png(size: [u32; 2], colors: &[[u8; 3]], indices: &[u8]) -> Result<Vec<u8>> {
    encode(
        size,
        png::ColorType::Indexed,
        colors.as_flattened(),
        indices,
    )
}

fn encode(
    [width, height]: [u32; 2],
    color: png::ColorType,
    palette: &[u8],
    bytes: &[u8],
) -> Result<Vec<u8>> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Balanced);
    if !palette.is_empty() {
        encoder.set_palette(palette);
    }
    let written = encoder
        .write_header()
        .and_then(|mut writer| writer.write_image_data(bytes));
    match written {
        Ok(()) => Ok(out),
        Err(error) => Err(Error::Internal {
            step: "report.html",
            what: error.to_string(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flip_colors_begin_black_end_light_and_grow() {
        let light = |v: f32| flip_color(v).iter().map(|&c| u32::from(c)).sum::<u32>();
        assert_eq!(flip_color(0.0), [0, 0, 4]);
        assert_eq!(flip_color(1.0), [252, 253, 191]);
        assert!((0..16).all(|i| light(i as f32 / 16.0) < light((i + 1) as f32 / 16.0)));
    }
}
