//! The images of a page of cards: no more than what differs from texel to texel.

use crate::botany::model::{AlphaMode, Image, Material, Model, TextureRef, Wrap};

/// Names of all images that a page may have, in order.
const IMAGES: [&str; 3] = ["foliage_base_color", "foliage_normal", "foliage_orm"];

/// What a page has images of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Maps {
    /// Base colours with alpha alone: no light falls on the tree.
    Unlit,
    /// These and tangent-space normals: all materials are alike otherwise, and nothing occludes.
    Even {
        /// glTF's roughnessFactor.
        roughness: f32,
        /// glTF's metallicFactor.
        metalness: f32,
    },
    /// These and an image in which roughness alone differs: materials have no image of the rest.
    Rough {
        /// glTF's metallicFactor.
        metalness: f32,
    },
    /// These and occlusion, roughness and metalness.
    #[default]
    All,
}

impl Maps {
    /// What cards of a tree need.
    pub fn of(model: &Model) -> Self {
        if model.is_unlit() {
            return Self::Unlit;
        }
        // Of all objects, so that parts of a tree need what the whole does.
        let materials = model.objects.iter().map(|object| object.material as usize);
        let each = materials.map(|number| needed_by(&model.materials[number]));
        each.reduce(Self::with).unwrap_or_default()
    }

    /// What cards of two kinds need on one page.
    pub fn with(self, other: Self) -> Self {
        match (self.metalness(), other.metalness()) {
            _ if self == other => self,
            (Some(metalness), Some(others)) if metalness == others => Self::Rough { metalness },
            _ => Self::All,
        }
    }

    /// Metalness, where it is the same everywhere and nothing occludes.
    fn metalness(self) -> Option<f32> {
        match self {
            Self::Even { metalness, .. } | Self::Rough { metalness } => Some(metalness),
            Self::Unlit | Self::All => None,
        }
    }

    /// Names of the images.
    pub fn names(self) -> &'static [&'static str] {
        &IMAGES[..self.count()]
    }

    /// How many images there are.
    pub fn count(self) -> usize {
        match self {
            Self::Unlit => 1,
            Self::Even { .. } => 2,
            Self::Rough { .. } | Self::All => 3,
        }
    }

    /// The material of the cards; its images are numbered from `first_image`.
    pub fn material(self, first_image: u32, double_sided: bool) -> Material {
        let texture = |k: u32| {
            (k < self.count() as u32).then_some(TextureRef {
                image: first_image + k,
                uv_set: 0,
                wrap: [Wrap::Clamp; 2],
                linear: true,
            })
        };
        let (roughness_factor, metallic_factor) = match self {
            Self::Even {
                roughness,
                metalness,
            } => (roughness, metalness),
            _ => (1.0, 1.0),
        };
        Material {
            name: "foliage".into(),
            base_color: texture(0),
            normal: texture(1),
            metallic_roughness: texture(2),
            occlusion: texture(2),
            roughness_factor,
            metallic_factor,
            unlit: self == Self::Unlit,
            alpha_mode: AlphaMode::Mask,
            alpha_cutoff: 0.5,
            double_sided,
            ..Material::default()
        }
    }
}

/// What a material alone needs.
fn needed_by(material: &Material) -> Maps {
    match (material.metallic_roughness, material.occlusion) {
        (None, None) => Maps::Even {
            roughness: material.roughness_factor,
            metalness: material.metallic_factor,
        },
        _ => Maps::All,
    }
}

/// Where the images of the page of a level with cards begin: they are its last.
pub fn first_of_page(images: &[Image]) -> Option<usize> {
    images.iter().rposition(|image| image.name == IMAGES[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::botany::model::Object;

    /// An object of each material.
    fn model(materials: Vec<Material>) -> Model {
        let object = |material| Object {
            material,
            ..Object::default()
        };
        Model {
            objects: (0..materials.len() as u32).map(object).collect(),
            materials,
            ..Model::default()
        }
    }

    fn plain(roughness_factor: f32) -> Material {
        Material {
            roughness_factor,
            metallic_factor: 0.0,
            ..Material::default()
        }
    }

    #[test]
    fn what_is_the_same_everywhere_is_a_factor_and_no_image() {
        let mut tree = model(vec![plain(0.85), plain(0.85)]);
        let maps = Maps::of(&tree);
        assert_eq!(maps.names(), ["foliage_base_color", "foliage_normal"]);
        let material = maps.material(4, true);
        assert_eq!(
            [material.roughness_factor, material.metallic_factor],
            [0.85, 0.0]
        );
        assert!(material.metallic_roughness.is_none() && material.occlusion.is_none());
        assert_eq!(material.normal.map(|t| t.image), Some(5));
        // A rougher leaf, where some object shows it, or an image of roughness.
        tree.materials.push(plain(0.5));
        assert_eq!(Maps::of(&tree), maps);
        tree.objects[1].material = 2;
        assert_eq!(Maps::of(&tree), Maps::Rough { metalness: 0.0 });
        assert_eq!(Maps::of(&tree).names()[2], "foliage_orm");
        tree.objects[1].material = 1;
        tree.materials[0].occlusion = material.normal;
        assert_eq!(Maps::of(&tree), Maps::All);
        assert_eq!(
            Maps::All.material(0, true).occlusion.map(|t| t.image),
            Some(2)
        );
    }

    #[test]
    fn trees_on_one_page_need_what_differs_between_them() {
        let [rough, smooth] = [0.9, 0.5].map(|r| Maps::of(&model(vec![plain(r)])));
        assert_eq!(rough.with(rough), rough);
        let both = rough.with(smooth);
        assert_eq!(both, Maps::Rough { metalness: 0.0 });
        assert_eq!([both.with(rough), smooth.with(both)], [both; 2]);
        let metal = Maps::Rough { metalness: 1.0 };
        assert_eq!([both.with(metal), rough.with(metal)], [Maps::All; 2]);
        let unlit = Material {
            unlit: true,
            ..plain(0.9)
        };
        let unlit = Maps::of(&model(vec![unlit]));
        assert_eq!(unlit.with(unlit).names(), ["foliage_base_color"]);
        assert_eq!(unlit.with(rough), Maps::All);
        assert!(unlit.material(0, false).unlit && !rough.material(0, false).unlit);
    }
}
