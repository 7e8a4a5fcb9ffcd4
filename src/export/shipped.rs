//! Images with all their mips as DDS files, for who does not leave mips to an engine.
//!
//! A box filter changes how many texels pass the alpha test: leaves dissolve or close up from afar. Here the alpha of
//! each mip is scaled so that as many pass as in the image itself (Castano 2010, "Computing Alpha Mipmaps"). Pages of
//! cards are filtered as they are: a level's covered area was matched with a box filter's mips.

use std::num::NonZeroU32;

use dds::header::{AlphaMode, Dx10Header, DxgiFormat, Header};
use dds::{ColorFormat, Encoder, Format, ImageView, Size};

use super::coarser::{halved, halved_normals};
use super::maps::first_of_page;
use super::mip::halve;
use super::surface::Scene;
use crate::botany::model::{AlphaMode as Tested, Image};
use crate::error::{Error, Result};
use crate::scene::TextureFormat;

/// What an image is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    /// Colours (sRGB), of which those texels are seen whose alpha is at least this; `None`: all are.
    Color(Option<f32>),
    /// Normals of the tangent space.
    Normal,
    /// Other numbers.
    Data,
}

/// What each image of a scene is for, by the materials that use it; the least cutoff of several counts, none that of
/// a page of cards.
pub fn roles(scene: &Scene) -> Vec<Role> {
    let page = first_of_page(&scene.images);
    let mut out = vec![Role::Data; scene.images.len()];
    for material in &scene.materials {
        if let Some(normal) = material.normal {
            out[normal.image as usize] = Role::Normal;
        }
        if let Some(emissive) = material.emissive {
            out[emissive.image as usize] = Role::Color(None);
        }
    }
    for material in &scene.materials {
        let Some(base) = material.base_color else {
            continue;
        };
        let is_kept = material.alpha_mode == Tested::Mask && page != Some(base.image as usize);
        let cutoff = is_kept.then_some(material.alpha_cutoff);
        let role = &mut out[base.image as usize];
        *role = match (*role, cutoff) {
            (Role::Color(Some(known)), Some(cutoff)) => Role::Color(Some(known.min(cutoff))),
            (Role::Color(known), cutoff) => Role::Color(known.or(cutoff)),
            (_, cutoff) => Role::Color(cutoff),
        };
    }
    out
}

/// An image and all its mips down to one texel, largest first.
pub fn chain(image: &Image, role: Role) -> Vec<Image> {
    let mut filtered = image.clone();
    let mut out = vec![image.clone()];
    let least = match role {
        Role::Color(Some(cutoff)) => Some((cutoff * 255.0).ceil().clamp(1.0, 255.0) as u8),
        _ => None,
    };
    let wanted = least.map(|least| share_from(image, least));
    while filtered.width > 1 || filtered.height > 1 {
        match role {
            Role::Color(_) => halve(&mut filtered, true),
            Role::Normal => filtered = halved_normals(&filtered),
            Role::Data => filtered = halved(&filtered),
        }
        let mut mip = filtered.clone();
        if let (Some(least), Some(wanted)) = (least, wanted) {
            keep_share(&mut mip, least, wanted);
        }
        out.push(mip);
    }
    out
}

/// Share of the texels whose alpha is at least this.
fn share_from(image: &Image, least: u8) -> f64 {
    let alphas = image.rgba.iter().skip(3).step_by(4);
    let count = alphas.clone().filter(|&&a| a >= least).count();
    count as f64 / alphas.len().max(1) as f64
}

/// Scales alpha so that the share of texels that pass is as near as can be to what is wanted.
fn keep_share(image: &mut Image, least: u8, wanted: f64) {
    let mut count = [0u64; 256];
    for texel in image.rgba.chunks_exact(4) {
        count[usize::from(texel[3])] += 1;
    }
    let all: u64 = count.iter().sum();
    let mut passed = 0;
    // Texels of one alpha pass together: the threshold whose share is nearest, and of several that which changes
    // least; at first none passes.
    let off = |passed: u64| (passed as f64 / all.max(1) as f64 - wanted).abs();
    let moved = |threshold: usize| threshold.abs_diff(usize::from(least));
    let mut best = (off(0), 256);
    for alpha in (1..=255usize).rev() {
        passed += count[alpha];
        let better = off(passed) < best.0 || off(passed) == best.0 && moved(alpha) < moved(best.1);
        if better {
            best = (off(passed), alpha);
        }
    }
    let threshold = best.1;
    let scale = f32::from(least) / threshold as f32;
    let mut rgba = image.rgba.to_vec();
    for texel in rgba.chunks_exact_mut(4) {
        let scaled = (f32::from(texel[3]) * scale).round().min(255.0) as u8;
        // Rounding takes nobody over the cutoff, or back.
        texel[3] = match usize::from(texel[3]) >= threshold {
            true => scaled.max(least),
            false => scaled.min(least - 1),
        };
    }
    image.rgba = std::sync::Arc::new(rgba);
}

/// An image with all its mips as a DDS file (DX10 header; sRGB where it holds colours).
///
/// # Errors
/// [`Error::Usage`] where the format can't be shipped.
pub fn to_dds(image: &Image, role: Role, format: TextureFormat) -> Result<Vec<u8>> {
    let (format, linear) = match format {
        TextureFormat::Rgba8 => (Format::R8G8B8A8_UNORM, DxgiFormat::R8G8B8A8_UNORM),
        TextureFormat::Bc3 => (Format::BC3_UNORM, DxgiFormat::BC3_UNORM),
        TextureFormat::Bc7 => (Format::BC7_UNORM, DxgiFormat::BC7_UNORM),
        TextureFormat::Astc4x4 | TextureFormat::Etc2 => return Err(not_shipped(format)),
    };
    let stored = match role {
        Role::Color(_) => linear.to_srgb(),
        Role::Normal | Role::Data => linear,
    };
    let mips = chain(image, role);
    let count = NonZeroU32::new(mips.len() as u32).unwrap_or(NonZeroU32::MIN);
    let header = Dx10Header::new_image(image.width, image.height, stored)
        .with_mipmap_count(count)
        .with_alpha_mode(AlphaMode::Straight);
    let fail = |what: String| Error::Internal {
        step: "encode DDS",
        what,
    };
    let mut out = Vec::new();
    let mut encoder = Encoder::new(&mut out, format, &Header::from(header))
        .map_err(|error| fail(error.to_string()))?;
    for mip in &mips {
        let size = Size::new(mip.width, mip.height);
        let view = ImageView::new(&mip.rgba, size, ColorFormat::RGBA_U8);
        let view = view.ok_or_else(|| fail(format!("{} has no pixels", mip.name)))?;
        encoder
            .write_surface(view)
            .map_err(|error| fail(error.to_string()))?;
    }
    encoder.finish().map_err(|error| fail(error.to_string()))?;
    Ok(out)
}

/// What is said where mips are to be shipped in a format that no file is written in.
pub fn not_shipped(format: TextureFormat) -> Error {
    Error::usage(
        format!("mips can't be shipped as {format:?}"),
        "set the scene's texture_format to Rgba8, Bc3 or Bc7, or its mips to Engine",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    /// A leaf texture: discs of alpha, soft at the rim, each in its cell of 16 x 16.
    fn discs() -> Image {
        let alpha = |x: i32, y: i32| {
            let cell = x / 16 + 4 * (y / 16);
            let [x, y] =
                [(x, 7), (y, 5)].map(|(v, k)| f64::from(v % 16) - 5.0 - f64::from(cell * k % 6));
            ((4.0 + f64::from(cell * 3 % 5) * 0.5 - x.hypot(y)) * 127.0 + 128.0).clamp(0.0, 255.0)
                as u8
        };
        let texels = (0..64).flat_map(|y| (0..64).map(move |x| [60, 120, 30, alpha(x, y)]));
        Image {
            name: "leaf".into(),
            width: 64,
            height: 64,
            rgba: Arc::new(texels.flatten().collect()),
        }
    }

    #[test]
    fn as_many_texels_pass_in_every_mip() {
        let image = discs();
        let wanted = share_from(&image, 128);
        assert!((0.25..0.35).contains(&wanted), "{wanted}");
        let mips = chain(&image, Role::Color(Some(0.5)));
        assert_eq!(mips.len(), 7);
        assert_eq!(mips[0], image);
        let boxed = chain(&image, Role::Color(None));
        for (mip, boxed) in mips.iter().zip(&boxed).take(5) {
            let (own, theirs) = (share_from(mip, 128), share_from(boxed, 128));
            assert!((own - wanted).abs() <= 0.03, "{} {own}", mip.width);
            assert!((own - wanted).abs() <= (theirs - wanted).abs());
        }
        // Discs fill a third of their cells: by a box filter nothing of them is left in four texels a cell's side.
        assert_eq!(share_from(&boxed[4], 128), 0.0);
    }

    #[test]
    fn nothing_that_is_solid_or_empty_changes() {
        for alpha in [0, 255] {
            let image = Image {
                rgba: Arc::new([9, 9, 9, alpha].repeat(64)),
                width: 8,
                height: 8,
                name: String::new(),
            };
            for mip in chain(&image, Role::Color(Some(0.5))) {
                assert!(mip.rgba.iter().skip(3).step_by(4).all(|&a| a == alpha));
            }
        }
    }

    #[test]
    fn other_software_reads_the_file_and_sees_the_mips() {
        let image = discs();
        for (format, bytes) in [
            (TextureFormat::Rgba8, 4 * 64 * 64),
            (TextureFormat::Bc3, 64 * 64),
            (TextureFormat::Bc7, 64 * 64),
        ] {
            let role = Role::Color(Some(0.5));
            let file = to_dds(&image, role, format).unwrap();
            let read = ddsfile::Dds::read(&file[..]).unwrap();
            assert_eq!((read.get_width(), read.get_height()), (64, 64));
            assert_eq!(read.get_num_mipmap_levels(), 7);
            assert_eq!(read.get_main_texture_size(), Some(bytes));
            let named = format!("{:?}", read.get_dxgi_format().unwrap());
            assert!(named.to_lowercase().ends_with("srgb"), "{named}");
            for (number, mip) in chain(&image, role).iter().enumerate() {
                let seen = image_dds::image_from_dds(&read, number as u32).unwrap();
                assert_eq!(seen.dimensions(), (mip.width, mip.height));
                let off = seen.iter().zip(mip.rgba.iter());
                let off = off.map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>();
                let mean = off / mip.rgba.len() as f64;
                let most = if format == TextureFormat::Rgba8 {
                    0.0
                } else {
                    4.0
                };
                assert!(mean <= most, "{format:?} mip {number}: {mean}");
            }
        }
        assert_eq!(
            to_dds(&image, Role::Data, TextureFormat::Etc2)
                .unwrap_err()
                .exit_code(),
            2
        );
    }
}
