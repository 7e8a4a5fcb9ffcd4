//! Matches a level's covered area to the original's, as an engine renders it.
//!
//! Alpha in a plain PNG has two free numbers: the threshold that decides which texels are opaque,
//! and the alpha of the others, a floor below the cutoff. The threshold sets the area from near,
//! where the base level is read; the floor sets it from far, where box-filtered mips mix both and
//! leaves would otherwise dissolve. Both are found by rendering the level with the packed atlas.

use rayon::prelude::*;

use super::foliage::Foliage;
use super::surface::Surface;
use crate::space::raster::{Camera, Geometry, Material, Mips, Sampling, Scene, Texture, coverage};

/// What the level should cover.
#[derive(Clone, Debug)]
pub struct AreaGoal {
    /// Cameras at the near end of the level's range.
    pub near: Vec<Camera>,
    /// The original's covered area in pixels, summed over the near cameras.
    pub near_area: f64,
    /// Cameras at the far end of the level's range.
    pub far: Vec<Camera>,
    /// The original's covered area in pixels, summed over the far cameras.
    pub far_area: f64,
}

/// What was found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Matched {
    /// Score from which a texel is opaque.
    pub threshold: f32,
    /// Alpha of the other texels, 0 to 127.
    pub floor: u8,
    /// Covered area over the original's at the near end, supersampled.
    pub near_ratio: f64,
    /// Covered area over the original's at the far end, one sample a pixel.
    pub far_ratio: f64,
}

/// Near areas are compared at 2 x 2 samples: over many views their error is below one per mille.
const NEAR: Sampling = Sampling {
    side: 2,
    mips: Mips::Base,
};

/// Times that threshold and floor are found in turn.
const ROUNDS: u32 = 4;

/// Highest floor: under the cutoff of 128 with room for rounding in mips.
const HIGHEST_FLOOR: u8 = 120;

/// Sets the alpha of `foliage` from `score` so that cards and `wood` together cover what the
/// original covers.
pub fn match_area(
    foliage: &mut Foliage,
    score: &[f32],
    wood: &[Surface],
    goal: &AreaGoal,
) -> Matched {
    let mut level = LevelScene::new(foliage, wood);
    let mut found = Matched {
        threshold: 0.5,
        ..Matched::default()
    };
    if foliage.charts.is_empty() {
        return found;
    }
    // Each number moves the other's area a little; the threshold has the last word, because what
    // is near is seen best.
    let mut aim = goal.far_area;
    for round in 0..ROUNDS {
        if round > 0 {
            // The threshold that follows takes some of the far area away again: aim above it.
            let far = level.far(foliage, score, found, goal);
            aim *= (goal.far_area / far.max(1e-9)).clamp(0.8, 1.25);
            found.floor = level.floor(foliage, score, found, goal, aim);
        }
        found.threshold = level.threshold(foliage, score, found, goal);
    }
    apply(foliage, score, found);
    found.near_ratio = level.area(foliage, &goal.near, NEAR) / goal.near_area.max(1e-9);
    let far = level.area(foliage, &goal.far, Sampling::CLIENT);
    found.far_ratio = far / goal.far_area.max(1e-9);
    found
}

fn apply(foliage: &mut Foliage, score: &[f32], found: Matched) {
    for (alpha, &s) in foliage.alpha.iter_mut().zip(score) {
        *alpha = if s >= found.threshold {
            255
        } else {
            found.floor
        };
    }
    // Texels of no chart stay empty: they would only bleed into the mips of their neighbours.
    for (alpha, &owned) in foliage.alpha.iter_mut().zip(&foliage.owned) {
        if !owned {
            *alpha = 0;
        }
    }
}

/// Cards and wood in one mesh for the raster; only alpha changes between renderings.
struct LevelScene {
    surface: Surface,
    materials: Vec<u32>,
    textures: [Texture; 1],
}

impl LevelScene {
    fn new(foliage: &Foliage, wood: &[Surface]) -> Self {
        let mut surface = foliage.surface();
        let mut materials = vec![0; surface.triangles.len()];
        for part in wood {
            let base = surface.positions.len() as u32;
            surface.positions.extend(&part.positions);
            surface.uvs[0].resize(surface.positions.len(), glam::Vec2::ZERO);
            surface
                .triangles
                .extend(part.triangles.iter().map(|t| t.map(|i| i + base)));
            materials.resize(surface.triangles.len(), 1);
        }
        let [w, h] = foliage.size;
        Self {
            surface,
            materials,
            textures: [Texture::from_alpha(w, h, foliage.alpha.clone())],
        }
    }

    /// The threshold at which the near area is the original's, by bisection.
    fn threshold(
        &mut self,
        foliage: &mut Foliage,
        score: &[f32],
        mut found: Matched,
        goal: &AreaGoal,
    ) -> f32 {
        let (mut low, mut high) = (-0.6f32, 1.6f32);
        for _ in 0..9 {
            found.threshold = (low + high) / 2.0;
            apply(foliage, score, found);
            if self.area(foliage, &goal.near, NEAR) > goal.near_area {
                low = found.threshold;
            } else {
                high = found.threshold;
            }
        }
        (low + high) / 2.0
    }

    /// The covered area at the far end.
    fn far(
        &mut self,
        foliage: &mut Foliage,
        score: &[f32],
        found: Matched,
        goal: &AreaGoal,
    ) -> f64 {
        apply(foliage, score, found);
        self.area(foliage, &goal.far, Sampling::CLIENT)
    }

    /// The least floor at which the far area reaches `aim`, by bisection.
    fn floor(
        &mut self,
        foliage: &mut Foliage,
        score: &[f32],
        mut found: Matched,
        goal: &AreaGoal,
        aim: f64,
    ) -> u8 {
        let (mut low, mut high) = (0u8, HIGHEST_FLOOR);
        while low < high {
            found.floor = low + (high - low) / 2;
            apply(foliage, score, found);
            if self.area(foliage, &goal.far, Sampling::CLIENT) < aim {
                low = found.floor + 1;
            } else {
                high = found.floor;
            }
        }
        low
    }

    fn area(&mut self, foliage: &Foliage, cameras: &[Camera], sampling: Sampling) -> f64 {
        self.textures[0].set_alpha(&foliage.alpha);
        let cards = Material {
            texture: Some(0),
            cutoff: Some(0.5),
            double_sided: true,
            ..Material::default()
        };
        // As it is written: thin twigs are ribbons of one sheet that both sides show.
        let bark = Material {
            double_sided: true,
            ..Material::default()
        };
        let scene = Scene {
            geometry: Geometry {
                positions: &self.surface.positions,
                normals: &[],
                uvs: [&self.surface.uvs[0], &[]],
                colors: &[],
                triangles: &self.surface.triangles,
                triangle_material: &self.materials,
            },
            materials: &[cards, bark],
            textures: &self.textures,
        };
        let areas: Vec<f64> = cameras
            .par_iter()
            .map(|camera| coverage(&scene, camera, sampling).area())
            .collect();
        areas.iter().sum()
    }
}
