//! One level of a package: which wood and cards draw it, their texels, and its covered area.

use glam::Vec2;

use crate::botany::model::Material;
use crate::botany::tree::Tree;
use crate::cloud::Outline;
use crate::detail::element::Element;
use crate::detail::level::{LevelPlan, Planner};
use crate::detail::merge::Hierarchy;
use crate::detail::optimal_cut::Choice;
use crate::detail::reassign::Reassign;
use crate::export::chart::Chart;
use crate::export::foliage::{BakeOptions, Foliage};
use crate::export::gltf::{Scene, Surface, scene_of_model};
use crate::export::matching::{AreaGoal, Matched, match_area};
use crate::export::original::{Original, camera};
use crate::export::refine::{Refine, refine};
use crate::recipe::Recipe;
use crate::space::raster;

/// What every level of a tree is baked from.
pub struct Baker<'a> {
    /// The tree.
    pub tree: &'a Tree,
    /// Its smallest pieces.
    pub elements: &'a [Element],
    /// How they merge.
    pub hierarchy: &'a Hierarchy,
    /// The original's masks.
    pub original: &'a Original,
    /// Knobs.
    pub recipe: &'a Recipe,
}

/// What one level is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelRequest {
    /// Most triangles, wood included.
    pub triangles: u64,
    /// Height of the tree in pixels where the level starts.
    pub height_px: f32,
    /// Height in pixels where it ends and the next one starts.
    pub end_px: f32,
}

/// A level, not yet written.
#[derive(Clone, Debug)]
pub struct Level {
    /// What to draw.
    pub scene: Scene,
    /// Cards and wood of the cut.
    pub plan: LevelPlan,
    /// Threshold and floor of the alpha, and what they gave.
    pub matched: Matched,
    /// Where each card lies in the atlas.
    pub charts: Vec<Chart>,
    /// Size of the atlas in texels.
    pub atlas: [u32; 2],
}

impl Baker<'_> {
    /// Makes one level.
    pub fn level(&self, request: LevelRequest) -> Level {
        let height_px = request.height_px;
        let choices = self.choices();
        let outline = if self.recipe.triangular_cards {
            Outline::Triangle
        } else {
            Outline::Quad
        };
        let planner = Planner {
            model: &self.tree.model,
            elements: self.elements,
            hierarchy: self.hierarchy,
            choices: &choices,
            outline,
            reassign: Reassign {
                rounds: self.recipe.reassign_rounds,
                locality: self.recipe.locality,
                neighbours: 12,
            },
        };
        let plan = planner.plan(request.triangles);
        let mut scene = self.wood(&plan);
        let pixels = height_px / self.original.height;
        let mut foliage = Foliage::bake(
            &self.tree.model,
            &plan.cards,
            BakeOptions {
                density: pixels * self.recipe.texel_density,
                pad: self.recipe.gutter_texels,
                samples: self.recipe.samples,
            },
        );
        let targets = self
            .original
            .targets(2, Some(&wood_scene(&merge_wood(&scene))));
        let score = refine(
            &foliage,
            &targets,
            Refine {
                rounds: self.recipe.refine_rounds,
                weight: 1.0,
            },
        );
        let views = self.original.directions.iter().step_by(3);
        let near: Vec<_> = views.clone().map(|d| camera(d, pixels)).collect();
        let far: Vec<_> = views.map(|d| camera(d, pixels / 2.0)).collect();
        let area: f64 = self.original.areas().iter().step_by(3).sum();
        let goal = AreaGoal {
            near,
            near_area: area * f64::from(pixels * pixels),
            far,
            far_area: area * f64::from(pixels * pixels) / 4.0,
        };
        let matched = match_area(&mut foliage, &score, &scene.surfaces, &goal);
        foliage.bleed();
        let mut surface = foliage.surface();
        surface.material = scene.materials.len() as u32;
        scene
            .materials
            .push(foliage.material(scene.images.len() as u32));
        scene.images.extend(foliage.images());
        scene.surfaces.push(surface);
        Level {
            scene,
            plan,
            matched,
            charts: foliage.charts,
            atlas: foliage.size,
        }
    }

    fn choices(&self) -> Vec<Vec<Choice>> {
        self.elements
            .iter()
            .map(|e| match e.chain {
                Some(_) => vec![Choice {
                    triangles: e.triangles.len() as u32,
                    error: 0.0,
                }],
                None => Vec::new(),
            })
            .collect()
    }

    fn wood(&self, plan: &LevelPlan) -> Scene {
        let triangles = plan
            .tubes
            .iter()
            .flat_map(|&(e, _)| self.elements[e as usize].triangles.iter().copied());
        scene_of_model(&self.tree.model, triangles)
    }
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
    let _ = Material::default();
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
