//! Matches a level's covered area to the original's, as an engine renders it.
//!
//! Alpha in a plain PNG has two free numbers. The threshold decides which texels are opaque, and
//! sets the area seen from near, where the base level is read. The contrast decides what box
//! filtered mips do with it from afar: a floor under the cutoff keeps sparse leaves from
//! dissolving, a ceiling over it keeps dense ones from closing up. For every contrast there is one
//! threshold that gives the right area near; the contrast is searched whose area at the level's
//! own distance and at twice it errs as little to one side as to the other.

use rayon::prelude::*;

use super::foliage::Foliage;
use super::surface::Surface;
use crate::space::raster::{
    Camera, Geometry, Material, Mips, Sampling, Scene, Scores, Texture, coverage,
    coverage_multisampled, critical,
};
use crate::space::root::Search;

/// What the level should cover.
#[derive(Clone, Debug)]
pub struct AreaGoal {
    /// Cameras that see the base level of the atlas.
    pub near: Vec<Camera>,
    /// The original's covered area in pixels, summed over the near cameras.
    pub near_area: f64,
    /// Cameras where the level starts.
    pub own: Vec<Camera>,
    /// The original's covered area in pixels, summed over them.
    pub own_area: f64,
    /// Cameras at twice that distance.
    pub far: Vec<Camera>,
    /// The original's covered area in pixels, summed over them.
    pub far_area: f64,
}

/// What was found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Matched {
    /// Score from which a texel is opaque.
    pub threshold: f32,
    /// Positive: alpha of the other texels; negative: what opaque texels lack of 255.
    pub contrast: i32,
    /// Covered area over the original's, supersampled from the base level.
    pub near_ratio: f64,
    /// Covered area over the original's where the level starts, as a client draws it.
    pub own_ratio: f64,
    /// The same at twice the distance.
    pub far_ratio: f64,
}

impl Matched {
    /// Alpha of opaque texels and of the others.
    pub fn alphas(&self) -> [u8; 2] {
        [
            (255 + self.contrast.min(0)) as u8,
            self.contrast.max(0) as u8,
        ]
    }
}

/// One sample a pixel of the base level: errors at edges cancel over a picture and many views.
const NEAR: Sampling = Sampling {
    side: 1,
    mips: Mips::Base,
};

/// Thresholds beyond these leave no texel out, or none in.
const THRESHOLDS: [f32; 2] = [-0.6, 1.6];

/// Areas from afar this close are the same.
const FAR_TOLERANCE: f64 = 4e-3;

/// The contrast at which to begin: leaves on cards are sparse more often than dense.
pub const CONTRAST_GUESS: i32 = 32;

/// Both alphas stay this far from the cutoff of 128: room for rounding in mips.
const HIGHEST_CONTRAST: f64 = 120.0;

/// Sets the alpha of `foliage` from `score` so that cards and `wood` together cover what the
/// original covers; the search begins at the contrast `guess`.
pub fn match_area(
    foliage: &mut Foliage,
    mut score: Vec<f32>,
    wood: &[Surface],
    goal: &AreaGoal,
    guess: i32,
) -> Matched {
    let mut found = Matched {
        threshold: 0.5,
        ..Matched::default()
    };
    if foliage.charts.is_empty() {
        return found;
    }
    let mut level = LevelScene::new(foliage, wood);
    for (score, _) in score.iter_mut().zip(&foliage.owned).filter(|(_, o)| !**o) {
        *score = f32::NEG_INFINITY;
    }
    let search = Search {
        range: [-HIGHEST_CONTRAST, HIGHEST_CONTRAST],
        guess: guess.into(),
        step: 16.0,
        grain: 2.0,
        tolerance: FAR_TOLERANCE,
    };
    search.falling(|contrast| {
        found.contrast = contrast.round() as i32;
        (found.threshold, found.near_ratio) = level.threshold(&score, found.alphas(), goal);
        apply(foliage, &score, found);
        found.own_ratio = level.client_area(foliage, &goal.own) / goal.own_area.max(1e-9);
        found.far_ratio = level.client_area(foliage, &goal.far) / goal.far_area.max(1e-9);
        1.0 - (found.own_ratio + found.far_ratio) / 2.0
    });
    found
}

fn apply(foliage: &mut Foliage, score: &[f32], found: Matched) {
    let [opaque, other] = found.alphas();
    let texels = foliage.alpha.par_iter_mut().zip(score);
    texels.for_each(|(alpha, &score)| {
        *alpha = if score >= found.threshold {
            opaque
        } else if score > f32::NEG_INFINITY {
            other
        } else {
            // Texels of no chart stay empty: they would only bleed into their neighbours' mips.
            0
        };
    });
}

/// The threshold at which as many pixels are covered as `wanted`, and how many are.
fn at_count(mut critical: Vec<f32>, wanted: f64) -> (f32, usize) {
    let [least, most] = THRESHOLDS;
    critical.par_sort_unstable_by(|a, b| b.total_cmp(a));
    let covered = |threshold: f32| critical.partition_point(|&c| c >= threshold);
    let index = (wanted.round() as usize).min(critical.len());
    let Some(&last) = critical.get(index.saturating_sub(1)) else {
        return (least, 0);
    };
    // Many texels may have the same score: with them or without, whichever is nearer.
    let tied = last.clamp(least, most);
    let next = critical[..covered(tied)].iter().rev().find(|&&c| c > tied);
    let above = next.map_or(most, |c| 0.5 * (tied + c)).clamp(least, most);
    let miss = |threshold: f32| (covered(threshold) as f64 - wanted).abs();
    let best = if miss(above) < miss(tied) {
        above
    } else {
        tied
    };
    (best, covered(best))
}

/// Cards and wood in one mesh for the raster; only alpha changes between renderings.
pub struct LevelScene {
    surface: Surface,
    materials: Vec<u32>,
    textures: [Texture; 1],
}

impl LevelScene {
    /// Cards first, then the wood.
    pub fn new(foliage: &Foliage, wood: &[Surface]) -> Self {
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

    /// The threshold at which the near area is the original's, and the area over it.
    fn threshold(&self, score: &[f32], alphas: [u8; 2], goal: &AreaGoal) -> (f32, f64) {
        let materials = materials();
        let scene = self.scene(&materials);
        let draw = |camera: &Camera| critical(&scene, camera, Scores { score, alphas });
        let pixels: Vec<Vec<f32>> = goal.near.par_iter().map(draw).collect();
        let (threshold, covered) = at_count(pixels.concat(), goal.near_area);
        (threshold, covered as f64 / goal.near_area.max(1e-9))
    }

    /// Covered pixels of each camera, from the base level.
    pub fn near_areas(&mut self, foliage: &Foliage, cameras: &[Camera]) -> Vec<f64> {
        self.areas(foliage, cameras, |scene, camera| {
            coverage(scene, camera, NEAR).area()
        })
    }

    /// Covered pixels of all cameras as a client draws them.
    fn client_area(&mut self, foliage: &Foliage, cameras: &[Camera]) -> f64 {
        let areas = self.areas(foliage, cameras, |scene, camera| {
            coverage_multisampled(scene, camera).area()
        });
        areas.iter().sum()
    }

    fn areas(
        &mut self,
        foliage: &Foliage,
        cameras: &[Camera],
        draw: impl Fn(&Scene, &Camera) -> f64 + Sync,
    ) -> Vec<f64> {
        self.textures[0].set_alpha(&foliage.alpha);
        let materials = materials();
        let scene = self.scene(&materials);
        cameras
            .par_iter()
            .map(|camera| draw(&scene, camera))
            .collect()
    }

    fn scene<'a>(&'a self, materials: &'a [Material]) -> Scene<'a> {
        Scene {
            geometry: Geometry {
                positions: &self.surface.positions,
                normals: &[],
                uvs: [&self.surface.uvs[0], &[]],
                colors: &[],
                triangles: &self.surface.triangles,
                triangle_material: &self.materials,
            },
            materials,
            textures: &self.textures,
        }
    }
}

/// Those of cards and of wood. Both have two sides, as they are written: thin twigs are ribbons of
/// one sheet.
fn materials() -> [Material; 2] {
    let wood = Material {
        double_sided: true,
        ..Material::default()
    };
    let cards = Material {
        texture: Some(0),
        cutoff: Some(0.5),
        ..wood
    };
    [cards, wood]
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::botany::model::Model;
    use crate::cloud::card::Card;
    use crate::export::atlas::Layout;
    use crate::export::foliage::{BakeOptions, CardGroup};
    use crate::export::original::camera;
    use crate::recipe::Packer;
    use crate::space::directions::direction;

    /// A card of 64 x 64 texels of which a share scores high, in clumps.
    fn card_with(opaque: impl Fn(u32, u32) -> bool) -> (Foliage, Vec<f32>, f64) {
        let card = Card::rectangle(Vec3::ZERO, Vec3::X, Vec3::Y, Vec2::splat(0.5));
        let group = CardGroup {
            card,
            triangles: Vec::new(),
        };
        let options = BakeOptions {
            layout: Layout {
                density: 64.0,
                pad: 1.0,
                packer: Packer::Rectangles,
            },
            samples: 1,
        };
        let foliage = Foliage::bake(&Model::default(), &[group], &[], options);
        let width = foliage.size[0];
        let mut wanted = 0;
        let score = (0..foliage.alpha.len() as u32)
            .map(|i| {
                let on = opaque(i % width, i / width) && foliage.owned[i as usize];
                wanted += u32::from(on);
                f32::from(u8::from(on)) + 0.001 * (i * 7919 % 97) as f32
            })
            .collect();
        let owned = foliage.owned.iter().filter(|&&o| o).count();
        // The gutter around the card is owned too: the card's own share is that of all.
        (foliage, score, f64::from(wanted) / owned as f64)
    }

    fn matched(opaque: impl Fn(u32, u32) -> bool) -> Matched {
        let (mut foliage, score, area) = card_with(opaque);
        let seen = |pixels: f32| {
            let camera = camera(&direction(0.0, 0.0), pixels);
            (vec![camera], area * f64::from(pixels * pixels))
        };
        // Sizes at which texels and pixels do not fall on each other, as they never do on a tree: a
        // mip of two opaque texels in four is the cutoff itself.
        let ((near, near_area), (own, own_area), (far, far_area)) =
            (seen(320.0), seen(61.0), seen(30.5));
        let goal = AreaGoal {
            near,
            near_area,
            own,
            own_area,
            far,
            far_area,
        };
        match_area(&mut foliage, score, &[], &goal, CONTRAST_GUESS)
    }

    /// 0 to 9, alike over 3 x 3 texels.
    fn clump(x: u32, y: u32) -> u32 {
        let cell = (x / 3).wrapping_mul(0x9e37_79b9) ^ (y / 3).wrapping_mul(0x85eb_ca6b);
        (cell ^ (cell >> 15)).wrapping_mul(0x2c1b_3c6d) / 65_536 % 10
    }

    #[test]
    fn sparse_leaves_get_a_floor_and_keep_their_area_from_afar() {
        let found = matched(|x, y| clump(x, y) < 3);
        assert!(found.contrast > 0, "{found:?}");
        assert!((found.near_ratio - 1.0).abs() < 0.05, "{found:?}");
        let mean = (found.own_ratio + found.far_ratio) / 2.0;
        assert!((mean - 1.0).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn dense_leaves_get_a_ceiling_and_do_not_close_up() {
        let found = matched(|x, y| clump(x, y) < 7);
        assert!(found.contrast < 0, "{found:?}");
        assert!((found.near_ratio - 1.0).abs() < 0.05, "{found:?}");
    }

    #[test]
    fn the_threshold_leaves_as_many_pixels_as_wanted() {
        let critical = vec![0.5, f32::INFINITY, 0.75, 0.25, 0.5, 0.5];
        assert_eq!(at_count(critical.clone(), 2.0), (0.75, 2));
        // Three are tied: five are nearer to four than two are.
        assert_eq!(at_count(critical.clone(), 4.0), (0.5, 5));
        assert_eq!(at_count(critical.clone(), 3.0), (0.625, 2));
        assert_eq!(at_count(critical.clone(), 9.0), (0.25, 6));
        assert_eq!(at_count(critical.clone(), 0.0), (THRESHOLDS[1], 1));
        assert_eq!(at_count(Vec::new(), 9.0), (THRESHOLDS[0], 0));
    }

    #[test]
    fn alphas_stay_on_their_sides_of_the_cutoff() {
        for contrast in [-120, -1, 0, 1, 120] {
            let found = Matched {
                contrast,
                ..Matched::default()
            };
            let [opaque, other] = found.alphas();
            assert!(
                opaque >= 135 && other <= 120,
                "{contrast}: {opaque} {other}"
            );
        }
    }
}
