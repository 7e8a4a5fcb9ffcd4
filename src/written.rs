//! What levels become on their way to the package's files.

use std::sync::Arc;

use rayon::prelude::*;
use serde_json::Value;

use crate::botany::model::Image;
use crate::botany::tree::Tree;
use crate::error::{Error, Result};
use crate::export::combined::{Packed, write_combined};
use crate::export::gltf::glb;
use crate::export::manifest::SUFFIX;
use crate::export::package::Package;
use crate::export::png::encode_png;
use crate::export::shipped::{Role, roles, to_dds};
use crate::report::schema::SharedLevel;
use crate::scene::{Mips, Scene, TextureFormat};
use crate::watch::{Watch, step};

/// What a level shares, and the contact sheet of it.
pub type Share = (SharedLevel, Option<Vec<u8>>);

/// Turns a level's images into PNG and drops their pixels: all levels wait for the last one.
pub fn encode_images_of(level: &mut Packed) -> Result<()> {
    if !level.shown {
        return Ok(());
    }
    let encode = |image: &mut Image| {
        let png = encode_png(image);
        image.rgba = Arc::default();
        png
    };
    let images = level.scene.images.par_iter_mut();
    level.pngs = images.map(encode).collect::<Result<_>>()?;
    Ok(())
}

/// Writes every level that is shown alone and all in one; returns the names of the package's files.
pub fn write(
    package: &Package,
    tree: &Tree,
    packed: &[Packed],
    scene: &Scene,
    watch: &dyn Watch,
) -> Result<Vec<String>> {
    let frame = &tree.model.frame;
    let mut files = Vec::with_capacity(packed.len() + 3);
    for level in packed.iter().filter(|level| level.shown) {
        let file = format!("{}.glb", level.name);
        let extras: Value = level.extras.clone();
        let glb = glb(&level.name, &level.scene, &level.pngs, frame, extras)?;
        package.write_pieces(&file, glb.pieces())?;
        files.push(file);
        if scene.mips == Mips::Shipped {
            ship(package, level, scene.texture_format, &mut files)?;
        }
        step(watch)?;
    }
    let all = format!("{}.glb", tree.model.name);
    package.write_pieces(&all, write_combined(packed, frame)?.pieces())?;
    files.extend([all, "report.json".into(), tree.model.name.clone() + SUFFIX]);
    step(watch)?;
    Ok(files)
}

/// Writes each image of a level with its mips.
fn ship(
    package: &Package,
    level: &Packed,
    format: TextureFormat,
    files: &mut Vec<String>,
) -> Result<()> {
    let (images, pngs) = (&level.scene.images, &level.pngs);
    let encode = |((image, png), role): ((&Image, &Vec<u8>), Role)| {
        // The level's pixels are gone by now.
        let decoded = image::load_from_memory(png).map_err(|e| Error::Internal {
            step: "read PNG back",
            what: e.to_string(),
        })?;
        let decoded = Image {
            rgba: Arc::new(decoded.into_rgba8().into_raw()),
            ..image.clone()
        };
        to_dds(&decoded, role, format)
    };
    let all = images.par_iter().zip(pngs).zip(roles(&level.scene));
    let encoded: Vec<Vec<u8>> = all.map(encode).collect::<Result<_>>()?;
    for (number, (image, bytes)) in images.iter().zip(encoded).enumerate() {
        let file = format!("{}_image{number}{}.dds", level.name, suffix(&image.name));
        package.write(&file, &bytes)?;
        files.push(file);
    }
    Ok(())
}

/// What of an image's name goes into a file's.
fn suffix(name: &str) -> String {
    let plain = name
        .chars()
        .filter(|c| c.is_ascii_alphanumeric() || *c == '_');
    let plain: String = plain.take(40).collect();
    match plain.is_empty() {
        true => plain,
        false => format!("_{plain}"),
    }
}

/// Follows a level's name in that of its contact sheet.
pub const SHEET: &str = "_sharing.png";

/// Writes the contact sheets of what levels share.
pub fn sheets(
    package: &Package,
    packed: &[Packed],
    shares: Vec<Share>,
    files: &mut Vec<String>,
) -> Result<Vec<SharedLevel>> {
    let mut out = Vec::with_capacity(shares.len());
    for ((told, sheet), level) in shares.into_iter().zip(packed) {
        if let Some(sheet) = sheet {
            let file = format!("{}{SHEET}", level.name);
            package.write(&file, &sheet)?;
            // The manifest stays last: who finds it finds all the others.
            files.insert(files.len() - 1, file);
        }
        out.push(told);
    }
    Ok(out)
}
