//! The bake: every step in order, one line each. Read this first.

use std::path::PathBuf;

use crate::botany::{load, recognise};
use crate::detail::element::elements;
use crate::detail::merge::merge;
use crate::detail::wood::Wood;
use crate::error::{Error, Result};
use crate::export::gltf::write_glb;
use crate::export::original::Original;
use crate::level::{Baker, LevelRequest};
use crate::recipe::Recipe;

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
    let wood = Wood::new(&tree, false);
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
            wood: &wood,
            original: &original,
            recipe: &request.recipe,
        };
        let made = baker.level(LevelRequest {
            triangles: limit.triangles(all),
            height_px: if limit.triangles(all) <= 24 {
                64.0
            } else {
                256.0
            },
            end_px: 128.0,
        });
        let (scene, matched) = (made.scene, made.matched);
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
