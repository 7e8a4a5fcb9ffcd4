//! A level as the raster draws it, to try many alphas: the wood is drawn once, cards over it.

use std::ops::Range;

use rayon::prelude::*;

use super::foliage::Foliage;
use super::surface::Surface;
use crate::space::raster::{
    Camera, Critical, Geometry, Mask, Material, Mips, Multisampled, Sampling, Scene, Scores,
    Texture, coverage, critical,
};

/// What the level should cover.
#[derive(Clone, Debug)]
pub struct AreaGoal {
    /// From where the base level of the atlas is seen.
    pub near: Sight,
    /// As a client draws it: where the level starts, and at twice the distance of the one before each.
    pub client: Vec<Sight>,
}

/// Cameras, and what they should see.
#[derive(Clone, Debug)]
pub struct Sight {
    /// All at one distance.
    pub cameras: Vec<Camera>,
    /// The original's covered area in pixels, summed over them.
    pub area: f64,
}

impl AreaGoal {
    /// The same from all cameras, of areas so many times smaller.
    pub fn over(&self, factor: f64) -> Self {
        let mut out = self.clone();
        for sight in [&mut out.near].into_iter().chain(&mut out.client) {
            sight.area /= factor;
        }
        out
    }
}

/// One sample a pixel of the base level: errors at edges cancel over a picture and many views.
const NEAR: Sampling = Sampling {
    side: 1,
    mips: Mips::Base,
};

/// Cards and wood as meshes for the raster; only the alpha of cards changes between renderings.
pub struct LevelScene {
    cards: Part,
    wood: Part,
}

/// What is drawn with one material.
struct Part {
    surface: Surface,
    materials: [Material; 1],
    /// The cards' alpha; none for wood.
    textures: Vec<Texture>,
}

impl Part {
    fn scene(&self) -> Scene<'_> {
        self.scene_with(&self.textures)
    }

    /// The same with other textures.
    fn scene_with<'s>(&'s self, textures: &'s [Texture]) -> Scene<'s> {
        Scene {
            geometry: Geometry {
                positions: &self.surface.positions,
                normals: &[],
                uvs: [&self.surface.uvs[0], &[]],
                colors: &[],
                triangles: &self.surface.triangles,
                triangle_material: &[],
            },
            materials: &self.materials,
            textures,
        }
    }
}

/// What the wood covers, drawn once for all alphas that are tried.
pub struct WoodSeen {
    /// From the near cameras, one sample a pixel.
    pub near: Vec<Mask>,
    /// For each of a client's sights what its cameras see.
    pub client: Vec<Vec<Multisampled>>,
}

impl WoodSeen {
    /// Draws the wood for all cameras of a goal.
    pub fn new(level: &LevelScene, goal: &AreaGoal) -> Self {
        let wood = level.wood.scene();
        let draw = |camera: &Camera| {
            let mut pixels = Multisampled::empty(camera);
            pixels.draw(&wood, camera);
            pixels
        };
        let client = goal.client.iter();
        let near = goal.near.cameras.par_iter();
        Self {
            near: near.map(|camera| coverage(&wood, camera, NEAR)).collect(),
            client: client
                .map(|sight| sight.cameras.par_iter().map(draw).collect())
                .collect(),
        }
    }
}

impl LevelScene {
    /// Those cards of `foliage` that are the tree's, with the page's alpha, and the wood.
    pub fn new(foliage: &Foliage, charts: Range<usize>, wood: &[Surface]) -> Self {
        let mut tubes = Surface::default();
        for part in wood {
            let base = tubes.positions.len() as u32;
            tubes.positions.extend(&part.positions);
            tubes
                .triangles
                .extend(part.triangles.iter().map(|t| t.map(|i| i + base)));
        }
        let [w, h] = foliage.size;
        // As they are written: thin twigs are ribbons of one sheet.
        let opaque = Material {
            double_sided: true,
            ..Material::default()
        };
        let cut = Material {
            texture: Some(0),
            cutoff: Some(0.5),
            double_sided: !foliage.one_sided,
            ..opaque
        };
        Self {
            cards: Part {
                surface: foliage.surface(charts),
                materials: [cut],
                textures: vec![Texture::from_alpha(w, h, foliage.alpha.clone())],
            },
            wood: Part {
                surface: tubes,
                materials: [opaque],
                textures: Vec::new(),
            },
        }
    }

    /// Replaces the cards' alpha.
    pub fn set_alpha(&mut self, alpha: &[u8]) {
        let textures = &mut self.cards.textures;
        textures.iter_mut().for_each(|t| t.set_alpha(alpha));
    }

    /// Thresholds of the pixels near, beside the wood there. For scores of a mip `texture` is one as large.
    pub fn critical(
        &self,
        cameras: &[Camera],
        wood: &[Mask],
        scores: Scores,
        texture: Option<&Texture>,
    ) -> Critical {
        let textures = texture.map_or(&self.cards.textures[..], std::slice::from_ref);
        let scene = self.cards.scene_with(textures);
        let draw = |(camera, wood)| critical(&scene, camera, wood, scores);
        let views: Vec<Critical> = cameras.par_iter().zip(wood).map(draw).collect();
        Critical {
            above: views.iter().map(|view| view.above).sum(),
            within: views.into_iter().flat_map(|view| view.within).collect(),
        }
    }

    /// Covered pixels of all cameras, from the base level, over the wood that each sees.
    pub fn near_area(&self, cameras: &[Camera], wood: &[Mask]) -> f64 {
        let both = cameras.par_iter().zip(wood);
        let areas: Vec<f64> = both.map(|(c, wood)| self.over(wood.clone(), c)).collect();
        areas.iter().sum()
    }

    /// Covered pixels of each camera, from the base level.
    pub fn near_areas(&self, cameras: &[Camera]) -> Vec<f64> {
        let wood = self.wood.scene();
        let area = |camera: &Camera| self.over(coverage(&wood, camera, NEAR), camera);
        cameras.par_iter().map(area).collect()
    }

    /// Pixels that the cards cover from near together with what is covered.
    fn over(&self, mut covered: Mask, camera: &Camera) -> f64 {
        covered.draw(&self.cards.scene(), camera, Mips::Base);
        covered.area()
    }

    /// Covered pixels of all cameras as a client draws them, over the wood that each sees.
    pub fn client_area(&self, cameras: &[Camera], wood: &[Multisampled]) -> f64 {
        let cards = self.cards.scene();
        let draw = |(camera, wood): (&Camera, &Multisampled)| {
            let mut pixels = wood.clone();
            pixels.draw(&cards, camera);
            pixels.area()
        };
        let areas: Vec<f64> = cameras.par_iter().zip(wood).map(draw).collect();
        areas.iter().sum()
    }
}
