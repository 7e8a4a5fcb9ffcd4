//! Images: which of a texture's sources can be read, and their decoded texels.

use std::borrow::Cow;
use std::io::Cursor;
use std::path::Path;

use ::image::{ImageFormat, ImageReader};
use rayon::prelude::*;

use super::buffer::{Asset, BROKEN};
use super::json::{Texture, TextureSource};
use super::material::Materials;
use super::uri;
use crate::botany::model::Image;
use crate::{Error, Result};

/// What a texture has to offer.
pub(super) enum Support {
    /// The file's image of this index.
    Read(usize),
    /// Only formats that are not read; the text names them.
    Unreadable(String),
}

/// Picks the image of a texture: WebP if there is one, else the plain source.
pub(super) fn choose(asset: &Asset, texture: &Texture, place: &str) -> Result<Support> {
    let e = &texture.extensions;
    let of = |source: &Option<TextureSource>| source.as_ref().and_then(|s| s.source);
    if let Some(image) = of(&e.webp).or(texture.source) {
        return judge(asset, image, place);
    }
    let foreign = [
        (&e.basisu, "KTX2 (Basis)"),
        (&e.avif, "AVIF"),
        (&e.dds, "DDS"),
    ];
    let found = foreign.iter().find(|(source, _)| source.is_some());
    Ok(Support::Unreadable(match found {
        Some((_, format)) => format!("the image is {format}, which pleach does not read"),
        None => "the texture has no image".into(),
    }))
}

/// Looks at the type that the file gives; the bytes are looked at when they are decoded.
fn judge(asset: &Asset, index: usize, place: &str) -> Result<Support> {
    let Some(image) = asset.json.images.get(index) else {
        return Err(asset.fault(place, format!("there is no image {index}"), BROKEN));
    };
    let name = image.uri.as_deref().filter(|u| !u.starts_with("data:"));
    let ending = name
        .and_then(|u| u.rsplit_once('.'))
        .map(|(_, e)| e.to_ascii_lowercase());
    let foreign = match (image.mime_type.as_deref(), ending.as_deref()) {
        (Some("image/ktx2"), _) | (_, Some("ktx2" | "ktx" | "basis")) => Some("KTX2 (Basis)"),
        (Some("image/avif"), _) | (_, Some("avif")) => Some("AVIF"),
        (Some("image/vnd-ms.dds"), _) | (_, Some("dds")) => Some("DDS"),
        _ => None,
    };
    Ok(match foreign {
        Some(format) => {
            Support::Unreadable(format!("the image is {format}, which pleach does not read"))
        }
        None => Support::Read(index),
    })
}

/// Of which images texels are read; of the others only sizes are.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Texels {
    /// All that materials use.
    All,
    /// Those that are a material's base colour.
    OfBaseColors,
}

/// Decodes the images of some materials, in their order; adds external bytes to `file_bytes`.
pub(super) fn decode_all(
    asset: &Asset,
    materials: &Materials,
    texels: Texels,
    file_bytes: &mut u64,
) -> Result<Vec<Image>> {
    let indices = &materials.images;
    let mut wanted = vec![texels == Texels::All; indices.len()];
    for texture in materials.list.iter().filter_map(|m| m.base_color) {
        wanted[texture.image as usize] = true;
    }
    // 1. Bytes and dimensions, in order, so that the limit is judged before anything is decoded.
    let mut pixels_left = asset.limits.pixels;
    let mut jobs = Vec::with_capacity(indices.len());
    for &index in indices {
        let place = place(asset, index);
        let (bytes, external) = encoded(asset, index, &place)?;
        *file_bytes += external;
        let (format, width, height) = probe(&bytes).map_err(|what| broken(asset, &place, what))?;
        let pixels = u64::from(width) * u64::from(height);
        if pixels == 0 || pixels > pixels_left {
            let what = format!(
                "{width} x {height} texels are too many: all images together may have {}",
                asset.limits.pixels
            );
            return Err(asset.fault(
                place,
                what,
                "scale the textures down; or raise pixels in the recipe's limits",
            ));
        }
        pixels_left -= pixels;
        jobs.push((index, place, bytes, format, [width, height]));
    }
    // 2. Texels, on all threads; the collected order is that of the list.
    jobs.par_iter()
        .zip(wanted)
        .map(|((index, place, bytes, format, [width, height]), wanted)| {
            let pixels = u64::from(*width) * u64::from(*height);
            let mut image = match wanted {
                true => {
                    decode(bytes, *format, pixels).map_err(|what| broken(asset, place, what))?
                }
                false => Image {
                    width: *width,
                    height: *height,
                    ..Image::default()
                },
            };
            image.name = name(asset, *index);
            Ok(image)
        })
        .collect()
}

fn broken(asset: &Asset, place: &str, what: String) -> Error {
    asset.fault(
        place,
        what,
        "open the image in an image editor, save it as PNG and try again",
    )
}

fn place(asset: &Asset, index: usize) -> String {
    match asset.json.images[index].name.as_deref() {
        Some(name) => format!("image {index} ({name})"),
        None => format!("image {index}"),
    }
}

/// The name in the file, or that of the image file.
fn name(asset: &Asset, index: usize) -> String {
    let image = &asset.json.images[index];
    let file = image.uri.as_deref().filter(|uri| !uri.starts_with("data:"));
    let file = file.and_then(|uri| Path::new(uri).file_stem()?.to_str());
    image
        .name
        .as_deref()
        .or(file)
        .unwrap_or_default()
        .to_owned()
}

fn encoded<'a>(asset: &'a Asset, index: usize, place: &str) -> Result<(Cow<'a, [u8]>, u64)> {
    let image = &asset.json.images[index];
    match (image.buffer_view, &image.uri) {
        (Some(view), _) => Ok((Cow::Borrowed(asset.view(view, place)?), 0)),
        (None, Some(uri)) => {
            let (bytes, external) = uri::fetch(asset.path, uri, place, asset.limits)?;
            Ok((Cow::Owned(bytes), external))
        }
        (None, None) => Err(asset.fault(place, "it has neither bufferView nor uri", BROKEN)),
    }
}

#[derive(Clone, Copy)]
enum Format {
    Png,
    Jpeg,
    WebP,
}

/// Format by the first bytes (the file's mimeType is often wrong), and the dimensions.
fn probe(bytes: &[u8]) -> std::result::Result<(Format, u32, u32), String> {
    let format = match bytes {
        [0x89, b'P', b'N', b'G', ..] => Format::Png,
        [0xff, 0xd8, 0xff, ..] => Format::Jpeg,
        [
            b'R',
            b'I',
            b'F',
            b'F',
            _,
            _,
            _,
            _,
            b'W',
            b'E',
            b'B',
            b'P',
            ..,
        ] => Format::WebP,
        [0xab, b'K', b'T', b'X', ..] => return Err("it is KTX, which pleach does not read".into()),
        [_, _, _, _, b'f', b't', b'y', b'p', ..] => {
            return Err("it is AVIF or HEIF, which pleach does not read".into());
        }
        _ => return Err("it is neither PNG nor JPEG nor WebP".into()),
    };
    let (width, height) = match format {
        Format::WebP => web_decoder(bytes)?.dimensions(),
        _ => reader(bytes, format).into_dimensions().map_err(said)?,
    };
    Ok((format, width, height))
}

fn reader(bytes: &[u8], format: Format) -> ImageReader<Cursor<&[u8]>> {
    let kind = match format {
        Format::Jpeg => ImageFormat::Jpeg,
        _ => ImageFormat::Png,
    };
    ImageReader::with_format(Cursor::new(bytes), kind)
}

fn web_decoder(
    bytes: &[u8],
) -> std::result::Result<image_webp::WebPDecoder<Cursor<&[u8]>>, String> {
    image_webp::WebPDecoder::new(Cursor::new(bytes)).map_err(said)
}

fn decode(bytes: &[u8], format: Format, pixels: u64) -> std::result::Result<Image, String> {
    if let Format::WebP = format {
        return decode_webp(bytes, pixels);
    }
    let mut reader = reader(bytes, format);
    let mut limits = ::image::Limits::default();
    limits.max_alloc = Some(working_memory(pixels));
    reader.limits(limits);
    let rgba = reader.decode().map_err(said)?.into_rgba8();
    Ok(Image {
        name: String::new(),
        width: rgba.width(),
        height: rgba.height(),
        rgba: rgba.into_raw().into(),
    })
}

/// Bytes that decoding may take: 16-bit RGBA twice, and room for tables and profiles. Hidden
/// chunks that inflate to more are refused.
fn working_memory(pixels: u64) -> u64 {
    pixels * 16 + (64 << 20)
}

fn decode_webp(bytes: &[u8], pixels: u64) -> std::result::Result<Image, String> {
    let mut decoder = web_decoder(bytes)?;
    decoder.set_memory_limit(working_memory(pixels) as usize);
    let (width, height) = decoder.dimensions();
    let size = decoder.output_buffer_size().ok_or("its size overflows")?;
    let mut texels = vec![0; size];
    decoder.read_image(&mut texels).map_err(said)?;
    if !decoder.has_alpha() {
        let rgb = texels.as_chunks::<3>().0.iter();
        texels = rgb.flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
    }
    Ok(Image {
        name: String::new(),
        width,
        height,
        rgba: texels.into(),
    })
}

fn said(error: impl std::fmt::Display) -> String {
    format!("it can't be decoded: {error}")
}
