//! One level of a package: which wood and cards draw it, their texels, and its covered area.

use glam::Vec2;

use crate::botany::tree::Tree;
use crate::cloud::Outline;
use crate::detail::element::{Element, mean_radius};
use crate::detail::level::{LevelPlan, Planner};
use crate::detail::merge::Hierarchy;
use crate::detail::optimal_cut::{Choice, Pruning};
use crate::detail::reassign::Reassign;
use crate::detail::whole_tree::whole_tree;
use crate::detail::wood::{Wood, WoodOption};
use crate::export::chart::Chart;
use crate::export::foliage::{BakeOptions, Foliage};
use crate::export::matching::{AreaGoal, Matched, match_area};
use crate::export::mip::shrink;
use crate::export::original::{Original, camera};
use crate::export::refine::{Refine, refine};
use crate::export::surface::{Scene, Surface, scene_of_wood};
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
    /// The branches' tubes.
    pub wood: &'a Wood<'a>,
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

/// Levels of at most so many triangles are whole-tree billboards.
const WHOLE_TREE_TRIANGLES: u64 = 24;

/// Times that the wood's radius is tried.
const WOOD_TRIES: u32 = 4;

/// Excess of the covered area that is left alone.
const WOOD_TOLERANCE: f64 = 0.005;

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
        let whole = request.triangles <= WHOLE_TREE_TRIANGLES;
        let cut = if whole {
            None
        } else {
            planner.plan(request.triangles)
        };
        let plan = cut.unwrap_or_else(|| {
            whole_tree(
                &self.tree.model,
                self.elements,
                &self.radii(),
                request.triangles,
            )
        });
        // Levels are looked at from nearer than they are made for: never fewer texels than this.
        let texels_px = if whole {
            height_px.max(128.0)
        } else {
            height_px.max(256.0)
        };
        let pixels = texels_px / self.original.height;
        let projected = Foliage::bake(
            &self.tree.model,
            &plan.cards,
            BakeOptions {
                density: pixels * self.recipe.texel_density,
                pad: self.recipe.gutter_texels,
                samples: self.recipe.samples,
            },
        );
        let views = self.original.directions.iter().step_by(3);
        // Supersampled area hardly depends on the size: the near end is judged no larger than this.
        let near_pixels = pixels.min(256.0 / self.original.height);
        let near: Vec<_> = views.clone().map(|d| camera(d, near_pixels)).collect();
        let far: Vec<_> = views.map(|d| camera(d, pixels / 2.0)).collect();
        let area: f64 = self.original.areas().iter().step_by(3).sum();
        let goal = AreaGoal {
            near,
            near_area: area * f64::from(near_pixels * near_pixels),
            far,
            far_area: area * f64::from(pixels * pixels) / 4.0,
        };
        // Where the wood alone covers more than the original, no alpha can make up for it (bare
        // trees): then the tubes become thinner, and the cards are fitted again.
        let mut radius_scale = 1.0f32;
        let mut tries = 0;
        let (mut scene, mut foliage, matched) = loop {
            let scene = self.wood(&plan, height_px, radius_scale);
            let mut foliage = projected.clone();
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
            let matched = match_area(&mut foliage, &score, &scene.surfaces, &goal);
            tries += 1;
            let over = matched.near_ratio;
            if tries == WOOD_TRIES || plan.tubes.is_empty() || over <= 1.0 + WOOD_TOLERANCE {
                break (scene, foliage, matched);
            }
            radius_scale /= over.min(1.25) as f32;
        };
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

    /// Fewest triangles whose error is at most `pixels` where the tree is `height_px` high.
    pub fn triangles_within(&self, pixels: f64, height_px: f64) -> u64 {
        let area: f64 = self.elements.iter().map(|e| f64::from(e.area)).sum();
        let length = pixels / height_px * f64::from(self.original.height);
        let choices = self.choices();
        let pruning = Pruning {
            hierarchy: self.hierarchy,
            card_error: &self.hierarchy.error,
            card_triangles: if self.recipe.triangular_cards { 1 } else { 2 },
            choices: &choices,
        };
        pruning.cut_within(area * length * length).triangles
    }

    fn choices(&self) -> Vec<Vec<Choice>> {
        let choice = |o: &WoodOption, solid: bool| Choice {
            triangles: o.triangles,
            // A thick branch that is a ribbon or left out vanishes from some views: never chosen.
            error: if solid && !o.is_round() {
                f64::INFINITY
            } else {
                o.error
            },
        };
        let of_chain = |chain: u32, solid: bool| {
            let options = &self.wood.tube_options(chain).options;
            let solid = solid && options.iter().any(WoodOption::is_round);
            options.iter().map(|o| choice(o, solid)).collect()
        };
        self.elements
            .iter()
            .map(|e| e.chain.map_or(Vec::new(), |chain| of_chain(chain, e.solid)))
            .collect()
    }

    /// Mean radius of each element that is wood; 0 for leaves.
    fn radii(&self) -> Vec<f32> {
        let mean = |chain| mean_radius(self.tree, chain);
        self.elements
            .iter()
            .map(|e| e.chain.map_or(0.0, mean))
            .collect()
    }

    /// The wood that the plan draws as geometry, its textures no finer than the level needs.
    fn wood(&self, plan: &LevelPlan, height_px: f32, radius_scale: f32) -> Scene {
        let mut chosen = vec![None; self.wood.len()];
        for &(element, choice) in &plan.tubes {
            if let Some(chain) = self.elements[element as usize].chain {
                chosen[chain as usize] = Some(choice as usize);
            }
        }
        let mesh = self.wood.build(&chosen, radius_scale);
        let mut scene = scene_of_wood(&self.tree.model, &mesh);
        let most = (height_px as u32).next_power_of_two().clamp(64, 2048);
        let colored = scene.colored_images();
        for (image, colored) in scene.images.iter_mut().zip(colored) {
            shrink(image, most, colored);
        }
        scene
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
