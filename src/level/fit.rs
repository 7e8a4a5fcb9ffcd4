//! The texels of a level: projected, fitted to the original's silhouettes, matched in area.

use std::ops::Range;

use glam::Vec2;

use super::{Baker, Level, LevelRequest};
use crate::botany::model::{Image, Material};
use crate::detail::level::LevelPlan;
use crate::error::Result;
use crate::export::atlas::Layout;
use crate::export::enough::enough;
use crate::export::foliage::{BakeOptions, Foliage};
use crate::export::level_scene::{AreaGoal, LevelScene, Sight};
use crate::export::matching::{Matched, Matching, Standing};
use crate::export::original::{Original, camera};
use crate::export::refine::{Refine, Target, refine};
use crate::export::surface::{Scene, Surface, scene_of_wood};
use crate::space::raster::{self, Camera};
use crate::watch::{Watch, part};

/// Height of the original's masks in samples.
pub const MASK_HEIGHT: f32 = 1024.0;

/// Height of the tree in pixels where the supersampled area is matched: it hardly depends on it,
/// so that five pixels a texel are enough, and so is this.
fn near_height_px(request: LevelRequest) -> f32 {
    (5.0 * request.height_texels).min(320.0)
}

/// Of the training directions every third one is matched in area; every sixth one where the
/// level is largest on the screen.
const MATCHED: usize = 3;

/// Times that the wood's radius is tried.
const WOOD_TRIES: u32 = 4;

/// Excess of the covered area that is left alone.
const WOOD_TOLERANCE: f64 = 0.005;

/// Distance of the two sides of a card that has a texture for each, pixels where the level starts: less than an eye sees,
/// more than a depth buffer of 24 bits resolves there.
const GAP_PX: f32 = 0.25;

/// A plan with its wood and texels.
#[derive(Clone)]
pub struct Fitted {
    pub(super) request: LevelRequest,
    pub(super) plan: LevelPlan,
    pub(super) wood: Scene,
    pub(super) foliage: Foliage,
    pub(super) matched: Matched,
    /// Texels a normalised unit.
    pub(super) density: f32,
    /// What the fit wants of each texel; kept only for sharing.
    pub(super) score: Vec<f32>,
}

impl Baker<'_> {
    /// Gives a plan its wood and texels.
    pub(super) fn fit(
        &self,
        mut plan: LevelPlan,
        request: LevelRequest,
        watch: &dyn Watch,
    ) -> Result<Fitted> {
        self.face_the_eye(&mut plan);
        let request = request.no_nearer_than(self.rms_error(&plan), self.original.height);
        part(watch, "project")?;
        let mut foliage = Foliage::bake(
            &self.tree.model,
            &plan.cards,
            &plan.sided,
            BakeOptions {
                layout: Layout {
                    density: self.density(request),
                    pad: self.recipe.gutter_texels,
                    packer: self.recipe.packer,
                },
                samples: self.recipe.samples,
            },
        );
        foliage.one_sided = plan.one_sided;
        let goal = self.goal(request);
        let pool = self.pool(request);
        // Where the wood alone covers more than the original, no alpha can make up for it (bare
        // trees): then the tubes become thinner, and the cards are fitted again.
        let mut radius_scale = 1.0f32;
        let mut tries = 0;
        loop {
            part(watch, "wood")?;
            let wood = self.wood(&plan, request, radius_scale);
            let taken = merge_wood(&wood);
            let charts = 0..foliage.charts.len();
            let taken = wood_scene(&taken);
            let targets = self.original.targets(pool, Some(&taken), charts.clone());
            let seen: Vec<&Target> = targets.iter().collect();
            part(watch, "fit texels")?;
            let score = refine(&foliage, &seen, self.refining());
            drop(targets);
            part(watch, "match area")?;
            let kept = match self.recipe.sharing > 0.0 {
                true => score.clone(),
                false => Vec::new(),
            };
            let again = (!foliage.backs.is_empty()).then(|| score.clone());
            let standing = Standing {
                charts,
                wood: &wood.surfaces,
                goal: &goal,
            };
            let smaller;
            let mut matching = Matching::new(&foliage, score, std::slice::from_ref(&standing));
            let mut matched = matching.near(&mut foliage);
            if let Some(score) = again {
                let gap = gap(self.original, request);
                smaller = goal.over(grown(&foliage, &wood.surfaces, &goal, gap));
                let standing = Standing {
                    goal: &smaller,
                    ..standing
                };
                matching = Matching::new(&foliage, score, &[standing]);
                matched = matching.near(&mut foliage);
            }
            tries += 1;
            let over = matched.near_ratio;
            if tries == WOOD_TRIES || plan.tubes.is_empty() || over <= 1.0 + WOOD_TOLERANCE {
                matching.client(&mut foliage, &mut matched);
                return Ok(Fitted {
                    request,
                    plan,
                    wood,
                    foliage,
                    matched,
                    density: self.density(request),
                    score: kept,
                });
            }
            radius_scale /= over.min(1.25) as f32;
        }
    }

    /// The original's views for a fitted level, some of whose page's charts are the tree's.
    pub(super) fn targets(&self, fitted: &Fitted, charts: Range<usize>) -> Vec<Target> {
        let taken = merge_wood(&fitted.wood);
        let pool = self.pool(fitted.request);
        let taken = wood_scene(&taken);
        self.original.targets(pool, Some(&taken), charts)
    }

    /// Texels a normalised unit.
    pub(super) fn density(&self, request: LevelRequest) -> f32 {
        request.height_texels / self.original.height * self.recipe.texel_density
    }

    /// Samples a cell of the targets: cells about as large as texels; finer ones cost as their
    /// square, and no texel can follow.
    pub(super) fn pool(&self, request: LevelRequest) -> u32 {
        let samples = self.original.height_samples() / request.height_texels;
        samples.round().clamp(2.0, 4.0) as u32
    }

    pub(super) fn refining(&self) -> Refine {
        Refine {
            rounds: self.recipe.refine_rounds,
            weight: 1.0,
        }
    }

    /// What the level should cover from near, where it starts and at twice that distance.
    pub(super) fn goal(&self, request: LevelRequest) -> AreaGoal {
        let areas = self.original.areas();
        let seen = |pixels: f32, every: usize| {
            let unit = pixels / self.original.height;
            let directions = self.original.directions.iter().step_by(every);
            let area: f64 = areas.iter().step_by(every).sum();
            Sight {
                cameras: directions.map(|d| camera(d, unit)).collect(),
                area: area * f64::from(unit * unit),
            }
        };
        AreaGoal {
            near: seen(near_height_px(request), MATCHED),
            client: vec![
                seen(request.height_px, 2 * MATCHED),
                seen(request.height_px / 2.0, MATCHED),
            ],
        }
    }

    /// The wood that the plan draws as geometry, its textures no finer than the level needs.
    fn wood(&self, plan: &LevelPlan, request: LevelRequest, radius_scale: f32) -> Scene {
        let mut chosen = vec![None; self.wood.len()];
        for &(element, choice) in &plan.tubes {
            if let Some(chain) = self.elements[element as usize].chain {
                chosen[chain as usize] = Some(choice as usize);
            }
        }
        let mesh = self.wood.build(&chosen, radius_scale);
        let mut scene = scene_of_wood(&self.tree.model, &mesh);
        let most = (request.height_px as u32)
            .next_power_of_two()
            .clamp(64, 2048);
        enough(
            &mut scene,
            request.height_texels / self.original.height,
            most,
        );
        scene
    }
}

/// Distance of the two sides of a card that has a texture for each, normalised units.
fn gap(original: &Original, request: LevelRequest) -> f32 {
    GAP_PX * original.height / request.height_px
}

/// What a level covers with its second sides over what it covers without: they stand `gap` off the first ones, and
/// from aside each card is as much wider.
fn grown(foliage: &Foliage, wood: &[Surface], goal: &AreaGoal, gap: f32) -> f64 {
    let area = |foliage: &Foliage| {
        let level = LevelScene::new(foliage, 0..foliage.charts.len(), wood);
        level.near_areas(&goal.near.cameras).iter().sum::<f64>()
    };
    let mut both = foliage.without_texels();
    both.add_backs(gap);
    area(&both) / area(foliage).max(1.0)
}

impl Fitted {
    /// What was found for its alpha.
    pub fn matched(&self) -> &Matched {
        &self.matched
    }

    /// The least covered area of all training views, over the original's.
    pub(super) fn least_view(&self, original: &Original) -> f64 {
        let unit = near_height_px(self.request) / original.height;
        let charts = 0..self.foliage.charts.len();
        let level = LevelScene::new(&self.foliage, charts, &self.wood.surfaces);
        let cameras: Vec<Camera> = original
            .directions
            .iter()
            .map(|d| camera(d, unit))
            .collect();
        let covered = level.near_areas(&cameras);
        let wanted = original.areas();
        let wanted = wanted.iter().map(|area| area * f64::from(unit * unit));
        covered
            .iter()
            .zip(wanted)
            .map(|(covered, wanted)| covered / wanted.max(1e-9))
            .fold(f64::MAX, f64::min)
    }

    /// Bleeds the texels and joins wood and cards. Of the cards' images only the base colours are there yet: the others are
    /// still the page's texels.
    pub(super) fn level(mut self, original: &Original) -> (Level, Foliage) {
        self.foliage.add_backs(gap(original, self.request));
        self.foliage.bleed();
        let surface = self.foliage.surface(0..self.foliage.charts.len());
        let (maps, double_sided) = (self.foliage.maps, !self.plan.one_sided);
        let material = |first: u32| maps.material(first, double_sided);
        let page = vec![self.foliage.take_page()];
        let level = Level {
            scene: on_page(self.wood, surface, page, material),
            request: self.request,
            plan: self.plan,
            matched: self.matched,
            charts: std::mem::take(&mut self.foliage.charts),
            atlas: self.foliage.size,
            density: self.density,
            farthest_copy: 0.0,
            shared: Vec::new(),
        };
        (level, self.foliage)
    }

    /// What the fit wants of each texel, 0 transparent and 1 opaque; where the level was fitted for sharing.
    pub(super) fn opacity(&self) -> Vec<f32> {
        let opaque = |score: &f32| (score - self.matched.threshold + 0.5).clamp(0.0, 1.0);
        self.score.iter().map(opaque).collect()
    }
}

/// Wood with cards, whose images come last: of a `material` that knows the first one's number.
pub(super) fn on_page(
    wood: Scene,
    mut cards: Surface,
    images: Vec<Image>,
    material: impl Fn(u32) -> Material,
) -> Scene {
    let mut scene = wood;
    let material = material(scene.images.len() as u32);
    if material.unlit {
        // They are for normal maps.
        cards.tangents.clear();
    }
    cards.material = scene.materials.len() as u32;
    scene.materials.push(material);
    scene.images.extend(images);
    scene.surfaces.push(cards);
    scene
}

fn merge_wood(scene: &Scene) -> Surface {
    let mut out = Surface::default();
    for s in &scene.surfaces {
        let base = out.positions.len() as u32;
        out.positions.extend(&s.positions);
        out.uvs[0].resize(out.positions.len(), Vec2::ZERO);
        out.triangles
            .extend(s.triangles.iter().map(|t| t.map(|i| i + base)));
    }
    out
}

fn wood_scene(surface: &Surface) -> raster::Scene<'_> {
    const OPAQUE: [raster::Material; 1] = [raster::Material {
        texture: None,
        uv_set: 0,
        wrap: [raster::Wrap::Repeat; 2],
        linear: true,
        factor: [1.0; 4],
        cutoff: None,
        double_sided: true,
    }];
    raster::Scene {
        geometry: raster::Geometry {
            positions: &surface.positions,
            normals: &[],
            uvs: [&surface.uvs[0], &[]],
            colors: &[],
            triangles: &surface.triangles,
            triangle_material: &[],
        },
        materials: &OPAQUE,
        textures: &[],
    }
}
