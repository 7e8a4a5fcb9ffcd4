//! Triangles of materials whose textures are holes throughout: no client shows them.
//!
//! A level that leaves them out would be refused as thin, and one that draws them draws nothing.

use super::buffer::Asset;
use super::warning::Warnings;
use crate::Result;
use crate::botany::model::{Image, Material, Model};
use crate::space::texture::cutoff;

/// Drops the triangles that no alpha test lets pass, and says whose they were.
///
/// # Errors
/// [`crate::Error::Input`] where nothing is left.
pub(super) fn drop_unseen(asset: &Asset, model: &mut Model, warnings: &mut Warnings) -> Result<()> {
    let mut largest = vec![None; model.images.len()];
    let materials = model.materials.iter();
    let unseen: Vec<bool> = materials
        .map(|m| !is_seen(model, m, &mut largest))
        .collect();
    if !unseen.contains(&true) {
        return Ok(());
    }
    let material = |t: u32| model.objects[model.triangle_object[t as usize] as usize].material;
    let materials: Vec<u32> = (0..model.triangles.len() as u32).map(material).collect();
    let mut counts = vec![0u64; unseen.len()];
    for &m in materials.iter().filter(|&&m| unseen[m as usize]) {
        counts[m as usize] += 1;
    }
    for (m, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        let place = format!("material \"{}\"", model.materials[m].name);
        let what = "a triangle's texture has no alpha above the material's cutoff: it shows nothing and is left out";
        warnings.count(what, count, &place);
    }
    model.retain_triangles(|t| !unseen[materials[t as usize] as usize]);
    if model.triangles.is_empty() {
        return Err(asset.fault(
            "materials",
            "no triangle shows anything: all alpha is below the cutoff",
            "export the textures with their alpha channel, or lower alphaCutoff",
        ));
    }
    Ok(())
}

/// Whether any texel passes the alpha test; `largest` remembers the largest alpha of each image.
fn is_seen(model: &Model, material: &Material, largest: &mut [Option<u8>]) -> bool {
    let alpha = material.base_color.map_or(255, |texture| {
        let image = texture.image as usize;
        *largest[image].get_or_insert_with(|| largest_alpha(&model.images[image]))
    });
    f32::from(alpha) / 255.0 * material.base_color_factor[3] >= cutoff(material)
}

fn largest_alpha(image: &Image) -> u8 {
    let mut most = 0;
    for texel in image.rgba.chunks_exact(4) {
        most = most.max(texel[3]);
        if most == u8::MAX {
            break;
        }
    }
    most
}
