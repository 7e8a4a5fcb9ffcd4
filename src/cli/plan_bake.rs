//! `pleach plan --bake`: just what the plan needs, baked and measured.

use std::path::Path;

use super::out::say;
use super::progress::Bars;
use super::species::made;
use crate::batch::{Batch, Done, bake_all};
use crate::error::{Error, Result};
use crate::pipeline::{Request, Wanted};
use crate::plan::{Answer, Spec, SpeciesAnswer};
use crate::recipe::Recipe;
use crate::report::schema::Report;
use crate::report::species::SpeciesReport;
use crate::scene::Scene;
use crate::species::Species;

/// How a plan is baked.
pub struct Baking<'a> {
    /// What was planned.
    pub spec: &'a Spec,
    /// Knobs.
    pub recipe: Recipe,
    /// Folder of the packages.
    pub output: &'a Path,
    /// Whether levels that left their band are kept.
    pub accept: bool,
    /// Threads; 0: one for each core.
    pub threads: usize,
    /// Whether to say nothing.
    pub quiet: bool,
}

impl Baking<'_> {
    /// Bakes each species with a scene of its own, those that share an atlas together, and puts what was measured into
    /// the answer.
    pub fn bake(&self, answer: &mut Answer) -> Result<()> {
        self.check_names(answer)?;
        let mut disk = 0;
        let mut shared: Vec<String> = Vec::new();
        for index in 0..answer.species.len() {
            let species = &answer.species[index];
            let atlas = species.atlas.clone();
            disk += match (species.nearest_m, atlas.as_str()) {
                (None, _) => 0,
                (_, "") => self.alone(&mut answer.species[index])?,
                _ if shared.contains(&atlas) => 0,
                _ => {
                    shared.push(atlas.clone());
                    self.together(&mut answer.species, &atlas)?
                }
            };
        }
        (answer.texture_bytes_estimated, answer.disk_bytes_estimated) = (false, false);
        answer.disk_bytes = disk;
        answer.add_up();
        Ok(())
    }

    /// Packages are named after trees and atlases.
    fn check_names(&self, answer: &Answer) -> Result<()> {
        let named = |atlas: &str| {
            let mut species = answer.species.iter();
            species.any(|s| s.name.to_lowercase() == atlas.to_lowercase())
        };
        for species in &answer.species {
            let atlas = species.atlas.as_str();
            let is_folder = !atlas.contains(['/', '\\']) && atlas != "." && atlas != "..";
            if !is_folder || named(atlas) {
                return Err(Error::usage(
                    format!(
                        "the atlas of {} can't be named {atlas:?}: its package is a folder of that name, beside those of trees",
                        species.name
                    ),
                    "give it a name of its own, without slashes",
                ));
            }
        }
        Ok(())
    }

    fn request(&self, scene: &Scene) -> Request {
        Request {
            wanted: Wanted::Levels(self.spec.levels.into()),
            max_error_px: Some(self.spec.max_error_px).filter(|&pixels| pixels > 0.0),
            recipe: self.recipe.clone(),
            scene: scene.clone(),
            accept: self.accept,
            ..Request::default()
        }
    }

    /// Bakes one into a package of its own; returns its bytes.
    fn alone(&self, species: &mut SpeciesAnswer) -> Result<u64> {
        let batch = Batch {
            inputs: vec![species.input.clone()],
            output: self.output.into(),
            request: self.request(&species.scene),
            rebake: false,
            threads: self.threads,
        };
        let bars = Bars::new(self.quiet);
        let outcomes = bake_all(&batch, &bars);
        bars.finish();
        let mut disk = 0;
        for outcome in outcomes? {
            let report = match outcome.done {
                Done::Baked(baked) => {
                    for warning in baked.warnings.iter().filter(|_| !self.quiet) {
                        say(format_args!("warning: {}: {warning}", species.name));
                    }
                    baked.report
                }
                Done::Unchanged => report(&outcome.output)?,
                Done::Failed(error) => return Err(error),
            };
            self.measured(species, &report);
            disk += size(&outcome.output)?;
        }
        Ok(disk)
    }

    /// Bakes all that are seen and share an atlas into a package named after it; returns its bytes.
    fn together(&self, all: &mut [SpeciesAnswer], atlas: &str) -> Result<u64> {
        let ours = |s: &&mut SpeciesAnswer| s.atlas == atlas && s.nearest_m.is_some();
        let mut sharing: Vec<&mut SpeciesAnswer> = all.iter_mut().filter(ours).collect();
        let output = self.output.join(atlas);
        let species = Species {
            inputs: sharing.iter().map(|s| s.input.clone()).collect(),
            request: Request {
                output: output.clone(),
                ..self.request(&self.spec.scene)
            },
            scenes: sharing.iter().map(|s| s.scene.clone()).collect(),
        };
        let report = made(&species, false, self.threads, self.quiet)?.report;
        for (species, tree) in sharing.iter_mut().zip(&report.trees) {
            self.measured(species, &tree.report);
            for (height_px, bytes) in self.of_others(&report, &tree.name) {
                let mut levels = species.levels.iter_mut();
                if let Some(level) = levels.find(|l| same_height(l.height_px, height_px)) {
                    level.texture_bytes = level.texture_bytes.saturating_sub(bytes);
                }
            }
        }
        size(&output)
    }

    /// Bytes of pages that a tree shares and another one carries, by the height where levels start.
    fn of_others(&self, report: &SpeciesReport, tree: &str) -> Vec<(f64, u64)> {
        let pages = report.pages.iter().filter(|page| page.shared);
        let carried = pages.filter(|page| {
            let mut trees = page.trees.iter().map(|t| t.name.as_str());
            trees.next() != Some(tree) && trees.any(|name| name == tree)
        });
        carried
            .map(|p| (p.height_px, self.on_gpu(p.bytes_with)))
            .collect()
    }

    /// Textures and triangles of the levels that were baked.
    fn measured(&self, species: &mut SpeciesAnswer, report: &Report) {
        for level in &report.levels {
            let Some(height) = level.sizes.first().map(|s| f64::from(s.height_px)) else {
                continue;
            };
            let mut levels = species.levels.iter_mut();
            if let Some(found) = levels.find(|l| same_height(l.height_px, height)) {
                found.triangles = level.triangles;
                found.texture_bytes = self.on_gpu(level.texture_bytes);
            }
        }
    }

    /// Bytes in the scene's texture format of what takes so many uncompressed.
    fn on_gpu(&self, bytes: u64) -> u64 {
        (bytes as f64 / 4.0 * self.spec.scene.texture_format.texel_bytes()) as u64
    }
}

/// Whether a level starts where the tree is so high, pixels.
fn same_height(level: Option<f64>, height_px: f64) -> bool {
    level.is_some_and(|px| (px.round() - height_px.round()).abs() < 1.0)
}

fn report(package: &Path) -> Result<Report> {
    let file = package.join("report.json");
    let text = std::fs::read_to_string(&file).map_err(|e| Error::io(&file, "read", e))?;
    serde_json::from_str(&text)
        .map_err(|e| Error::input(&file, "the report", e.to_string(), "bake the tree again"))
}

/// Bytes of all files of a folder.
fn size(folder: &Path) -> Result<u64> {
    let fail = |e| Error::io(folder, "list", e);
    let mut sum = 0;
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        sum += entry.and_then(|e| e.metadata()).map_err(fail)?.len();
    }
    Ok(sum)
}
