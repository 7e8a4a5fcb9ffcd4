//! What a model costs an engine.

use std::collections::BTreeSet;
use std::path::Path;

use super::schema::Level;
use super::start::json;
use crate::botany::Model;
use crate::botany::model::TextureRef;

/// Draw calls of an engine that does not batch: one for each primitive of each placed mesh, however
/// many instances its node has.
pub fn draw_calls(model: &Model) -> u64 {
    let drawn: BTreeSet<u32> = model.triangle_object.iter().copied().collect();
    let first = |&&object: &&u32| model.objects[object as usize].instance == 0;
    drawn.iter().filter(first).count() as u64
}

/// Sets what a level's file tells of its costs: its bytes and its draw calls, which may be fewer than those of the model that
/// was written to it.
pub fn as_written(level: &mut Level, file: &Path) {
    if let Ok(about) = file.metadata() {
        level.file_bytes = about.len();
    }
    if let Some(root) = json(file) {
        let nodes = root["nodes"].as_array().into_iter().flatten();
        let meshes = nodes.filter_map(|node| root["meshes"].get(node["mesh"].as_u64()? as usize));
        let primitives = meshes.filter_map(|mesh| mesh["primitives"].as_array());
        level.draw_calls = primitives.map(|list| list.len() as u64).sum();
    }
}

/// Bytes on the GPU of all textures in use, uncompressed RGBA with all mips.
///
/// An image that two materials share counts once.
pub fn texture_bytes(model: &Model) -> u64 {
    let used: BTreeSet<u32> = model
        .objects
        .iter()
        .map(|o| &model.materials[o.material as usize])
        .flat_map(|m| {
            [
                m.base_color,
                m.metallic_roughness,
                m.normal,
                m.occlusion,
                m.emissive,
            ]
        })
        .flatten()
        .map(|t: TextureRef| t.image)
        .collect();
    let bytes = |&image: &u32| {
        let image = &model.images[image as usize];
        chain_texels(image.width, image.height) * 4
    };
    used.iter().map(bytes).sum()
}

/// Texels of an image and all its mips.
fn chain_texels(mut width: u32, mut height: u32) -> u64 {
    let mut sum = width as u64 * height as u64;
    while width > 1 || height > 1 {
        (width, height) = ((width / 2).max(1), (height / 2).max(1));
        sum += width as u64 * height as u64;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::botany::model::{Image, Material, Object, Wrap};

    #[test]
    fn a_chain_is_all_levels_down_to_one_texel() {
        assert_eq!(chain_texels(4, 2), 8 + 2 + 1);
        assert_eq!(chain_texels(1, 1), 1);
    }

    #[test]
    fn shared_images_count_once_and_unused_ones_not_at_all() {
        let image = Image {
            width: 2,
            height: 2,
            rgba: vec![0; 16].into(),
            ..Image::default()
        };
        let base_color = Some(TextureRef {
            image: 0,
            uv_set: 0,
            wrap: [Wrap::Repeat; 2],
            linear: true,
        });
        let material = Material {
            base_color,
            ..Material::default()
        };
        let object = |material, instance| Object {
            material,
            instance,
            ..Object::default()
        };
        let model = Model {
            triangle_object: vec![0, 0, 2, 3],
            objects: vec![object(0, 0), object(1, 0), object(1, 0), object(1, 1)],
            materials: vec![material.clone(), material],
            images: vec![image.clone(), image],
            ..Model::default()
        };
        assert_eq!(texture_bytes(&model), 20);
        assert_eq!(
            draw_calls(&model),
            2,
            "object 1 has no triangles, 3 is a copy"
        );
    }
}
