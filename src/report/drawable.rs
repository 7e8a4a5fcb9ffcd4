//! A loaded model made ready for the raster: textures with mips, materials without the file's detours.

use crate::botany::Model;
use crate::botany::model::{self, AlphaMode, Frame, TextureRef};
use crate::space::raster::{Geometry, Light, Material, Placement, Relief, Scene, Texture, Wrap};

/// Alpha from which a blended sample counts as covered.
const BLEND_CUTOFF: f32 = 0.5;

/// A model with the textures that drawing it needs; made once, drawn many times.
#[derive(Debug)]
pub struct Drawable<'m> {
    model: &'m Model,
    materials: Vec<Material>,
    textures: Vec<Texture>,
    triangle_material: Vec<u32>,
}

impl<'m> Drawable<'m> {
    /// For silhouettes: alpha alone, and only of textures whose alpha is tested.
    pub fn silhouette(model: &'m Model) -> Self {
        Self::new(model, false)
    }

    /// For colour too.
    pub fn shaded(model: &'m Model) -> Self {
        Self::new(model, true)
    }

    fn new(model: &'m Model, colors: bool) -> Self {
        let mut textures = Vec::new();
        // Thousands of materials may share one image: it is mipped once.
        let mut made = vec![None; model.images.len()];
        let materials = model
            .materials
            .iter()
            .map(|source| {
                let mut material = plain(source);
                if never_cut(model, source) {
                    material.cutoff = None;
                }
                let wanted = colors || material.cutoff.is_some();
                if let Some(base) = source.base_color.filter(|_| wanted) {
                    let index = *made[base.image as usize].get_or_insert_with(|| {
                        textures.push(texture(&model.images[base.image as usize], colors));
                        textures.len() as u32 - 1
                    });
                    address(&mut material, index, &base);
                }
                material
            })
            .collect();
        let of_object = |&object: &u32| model.objects[object as usize].material;
        Self {
            model,
            materials,
            textures,
            triangle_material: model.triangle_object.iter().map(of_object).collect(),
        }
    }

    /// What the raster draws.
    pub fn scene(&self) -> Scene<'_> {
        Scene {
            geometry: Geometry {
                positions: &self.model.positions,
                normals: &self.model.normals,
                uvs: [&self.model.uvs[0], &self.model.uvs[1]],
                colors: &self.model.colors,
                triangles: &self.model.triangles,
                triangle_material: &self.triangle_material,
            },
            materials: &self.materials,
            textures: &self.textures,
        }
    }

    /// How it is lit where light falls on trees.
    pub fn light(&self) -> Light {
        match self.model.is_unlit() {
            true => Light::Unlit,
            false => Light::Outdoors,
        }
    }

    /// The materials' normal maps, where their pixels are kept.
    pub fn reliefs(&self) -> Vec<Option<Relief<'_>>> {
        let relief = |source: &'m model::Material| {
            let map = source.normal?;
            let image = &self.model.images[map.image as usize];
            (!image.rgba.is_empty()).then_some(Relief {
                rgba: &image.rgba,
                width: image.width,
                height: image.height,
                wrap: map.wrap.map(wrap),
                uv_set: map.uv_set,
                scale: source.normal_scale,
            })
        };
        self.model.materials.iter().map(relief).collect()
    }

    /// Puts this file's normalised space into another file's.
    pub fn placement_in(&self, frame: Frame) -> Placement {
        let own = self.model.frame;
        Placement::between(own.center, own.radius, frame.center, frame.radius)
    }
}

fn plain(source: &model::Material) -> Material {
    Material {
        factor: source.base_color_factor,
        cutoff: match source.alpha_mode {
            AlphaMode::Opaque => None,
            AlphaMode::Mask => Some(source.alpha_cutoff),
            AlphaMode::Blend => Some(BLEND_CUTOFF),
        },
        double_sided: source.double_sided,
        ..Material::default()
    }
}

/// Whether alpha is tested in vain: a texture without holes, and no vertex colours to make any.
fn never_cut(model: &Model, source: &model::Material) -> bool {
    let cutoff = match source.alpha_mode {
        AlphaMode::Opaque => return true,
        AlphaMode::Mask => source.alpha_cutoff,
        AlphaMode::Blend => BLEND_CUTOFF,
    };
    let solid = |texture: TextureRef| {
        let image = &model.images[texture.image as usize];
        image.rgba.iter().skip(3).step_by(4).all(|&a| a == 255)
    };
    model.colors.is_empty()
        && source.base_color_factor[3] >= cutoff
        && source.base_color.is_none_or(solid)
}

fn address(material: &mut Material, texture: u32, reference: &TextureRef) {
    material.texture = Some(texture);
    material.uv_set = reference.uv_set;
    material.linear = reference.linear;
    material.wrap = reference.wrap.map(wrap);
}

fn wrap(wrap: model::Wrap) -> Wrap {
    match wrap {
        model::Wrap::Repeat => Wrap::Repeat,
        model::Wrap::Mirror => Wrap::Mirror,
        model::Wrap::Clamp => Wrap::Clamp,
    }
}

fn texture(image: &model::Image, colors: bool) -> Texture {
    if colors {
        return Texture::from_rgba(image.width, image.height, &image.rgba);
    }
    let alpha = image.rgba.iter().skip(3).step_by(4).copied().collect();
    Texture::from_alpha(image.width, image.height, alpha)
}
