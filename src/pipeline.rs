//! The bake: every step in order, one line each. Read this first.

use std::path::PathBuf;

use glam::Vec2;

use crate::botany::model::Material;
use crate::botany::tree::Tree;
use crate::botany::{load, recognise};
use crate::cloud::Outline;
use crate::detail::element::{Element, elements};
use crate::detail::level::{LevelPlan, Planner};
use crate::detail::merge::{Hierarchy, merge};
use crate::detail::optimal_cut::Choice;
use crate::detail::reassign::Reassign;
use crate::error::{Error, Result};
use crate::export::foliage::{BakeOptions, Foliage};
use crate::export::gltf::{Scene, Surface, scene_of_model, write_glb};
use crate::export::matching::{AreaGoal, Matched, match_area};
use crate::export::original::{Original, camera};
use crate::export::refine::{Refine, refine};
use crate::recipe::Recipe;
use crate::space::raster;

/// How many triangles a level may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// At most this many.
    Count(u64),
    /// At most this share of the original's, 0 to 1.
    Share(f64),
}

impl Limit {
    /// The limit in triangles for an original of `all` triangles.
    pub fn triangles(self, all: u64) -> u64 {
        match self {
            Self::Count(n) => n,
            Self::Share(s) => (s * all as f64).floor() as u64,
        }
    }
}

/// What to bake.
#[derive(Clone, Debug)]
pub struct Request {
    /// The tree.
    pub input: PathBuf,
    /// The package's folder.
    pub output: PathBuf,
    /// One level for each limit, beside level 0.
    pub limits: Vec<Limit>,
    /// Knobs.
    pub recipe: Recipe,
}

/// Height of the original's masks in samples.
const MASK_HEIGHT: f32 = 1024.0;

/// Bakes a tree into a package.
pub fn bake(request: &Request) -> Result<()> {
    let model = load::load(&request.input)?;
    let tree = recognise::recognise(model, &Default::default())?;
    let elements = elements(&tree);
    let hierarchy = merge(&elements, request.recipe.locality);
    let original = Original::new(&tree.model, request.recipe.training_views, MASK_HEIGHT);
    std::fs::create_dir_all(&request.output)
        .map_err(|e| Error::io(&request.output, "create", e))?;
    let name = tree.model.name.clone();
    let all = tree.model.triangles.len() as u64;
    let mut files = Vec::new();
    for (index, limit) in request.limits.iter().enumerate() {
        let level = index + 1;
        let baker = Baker {
            tree: &tree,
            elements: &elements,
            hierarchy: &hierarchy,
            original: &original,
            recipe: &request.recipe,
        };
        let (scene, matched) = baker.level(limit.triangles(all));
        let file = request.output.join(format!("{name}_LOD{level}.glb"));
        let bytes = write_glb(
            &format!("{name}_LOD{level}"),
            &scene,
            &tree.model.frame,
            serde_json::Value::Null,
        )?;
        std::fs::write(&file, bytes).map_err(|e| Error::io(&file, "write", e))?;
        println!(
            "level {level}: {} triangles, {matched:?}, atlas {:?}",
            scene.triangles(),
            scene.images.first()
        );
        files.push(file);
    }
    let t = std::time::Instant::now();
    let levels = files
        .iter()
        .map(|f| load::load(f))
        .collect::<Result<Vec<_>>>()?;
    let named: Vec<_> = levels.iter().map(|m| (m, m.name.as_str())).collect();
    let settings = crate::report::Settings {
        azimuth_offset_deg: 11.0,
        heights_px: vec![256, 64],
        ..Default::default()
    };
    let report = crate::report::evaluate((&tree.model, &name), &named, &settings);
    for level in &report.levels {
        for size in &level.sizes {
            println!(
                "{:28} {:7} tri @{:3} F1 {:.3} worst {:.3} ({}) E {:.2} P {:.3} R {:.3} area {:.3} [{:.3}]",
                level.file,
                level.triangles,
                size.height_px,
                size.f1.mean,
                size.f1.worst,
                size.f1.worst_view,
                size.shift_ratio,
                size.precision.mean,
                size.recall.mean,
                size.area_ratio.mean,
                size.area_ratio.worst
            );
        }
    }
    eprintln!("evaluate {:.1}s", t.elapsed().as_secs_f64());
    Ok(())
}

struct Baker<'a> {
    tree: &'a Tree,
    elements: &'a [Element],
    hierarchy: &'a Hierarchy,
    original: &'a Original,
    recipe: &'a Recipe,
}

impl Baker<'_> {
    fn level(&self, budget: u64) -> (Scene, Matched) {
        let height_px = 256.0f32;
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
        let plan = planner.plan(budget);
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
        (scene, matched)
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
