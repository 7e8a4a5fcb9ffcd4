//! Sharing of texels, accepted by the measure that the report uses.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;

use crate::botany::load::{Limits, base_colors_of};
use crate::botany::model::Model;
use crate::error::Result;
use crate::export::chart::Shape;
use crate::export::gltf::write_glb;
use crate::export::png::{encode_images, encode_png};
use crate::export::share::{owners, sheet};
use crate::level::Level;
use crate::report::schema::{self, Figure, Report, SharedLevel, Sharing};
use crate::report::{Drawable, Reference, Settings, texture_bytes};

/// The worst view may lose so many times as much as the mean.
const WORST: f64 = 2.0;

/// A level, and what sharing did to it.
#[derive(Debug)]
pub struct Chosen {
    /// The one that is written.
    pub level: Level,
    /// What it was before.
    pub told: SharedLevel,
    /// Tiles and their copies as a PNG; `None` where nothing is shared.
    pub sheet: Option<Vec<u8>>,
}

/// The original where levels start, drawn once: the ruler of the report.
pub struct Ruler<'a> {
    original: &'a Model,
    references: Vec<Reference>,
}

impl<'a> Ruler<'a> {
    /// For levels that start at these heights, pixels.
    pub fn new(original: &'a Model, heights_px: &[u32], settings: &Settings) -> Self {
        let mut heights = heights_px.to_vec();
        heights.sort_unstable();
        heights.dedup();
        let own = Drawable::silhouette(original);
        let views = settings.view_set();
        let of = |&px: &u32| Reference::of(&own, original, &views, settings.lens, px);
        Self {
            references: heights.iter().map(of).collect(),
            original,
        }
    }

    /// Writes a level, reads it back and measures it where it starts: F1, and bytes of textures.
    ///
    /// # Errors
    /// Those of writing and reading levels.
    pub fn measure(&self, level: &Level, height_px: u32) -> Result<(Figure, u64)> {
        let pngs = encode_images(&level.scene)?;
        let frame = &self.original.frame;
        let bytes = write_glb("level", &level.scene, &pngs, frame, Value::Null)?;
        let model = base_colors_of(&bytes, Path::new("level.glb"), &Limits::default())?;
        let texture_bytes = texture_bytes(&model);
        let mut known = self.references.iter();
        let reference = known.find(|r| r.height_px() == height_px);
        let figures = reference.map(|r| r.compare(&model));
        Ok((figures.unwrap_or_default().f1, texture_bytes))
    }

    /// The level with the fewest texels that loses no more than `most` of F1 where it starts,
    /// supersampled, over the views of the report.
    ///
    /// # Errors
    /// Those of writing and reading levels.
    pub fn choose(
        &self,
        mut level: Level,
        number: usize,
        (height_px, most): (u32, f64),
    ) -> Result<Chosen> {
        let shared = std::mem::take(&mut level.shared);
        let mut told = alone(&level, number);
        if shared.is_empty() {
            return Ok(Chosen {
                level,
                told,
                sheet: None,
            });
        }
        let (without, bytes) = self.measure(&level, height_px)?;
        (told.f1_without, told.texture_bytes_without) = (without.mean, bytes);
        let (density, atlas) = (level.density, level.atlas);
        for candidate in shared {
            let (f1, _) = self.measure(&candidate, height_px)?;
            if within(&f1, &without, most) {
                level = candidate;
                break;
            }
        }
        let copies = level.charts.iter().filter(|c| c.shape == Shape::Window);
        told.copies = copies.count() as u64;
        let owners = owners(&level.charts, level.atlas);
        told.classes = classes(&owners);
        told.farthest_copy = level.farthest_copy.into();
        told.smaller_page = level.atlas != atlas;
        told.tiles -= told.copies;
        told.density = f64::from(level.density / density);
        let page = level.page().filter(|_| told.copies > 0);
        let sheet = page.map(|page| encode_png(&sheet(&level.charts, &owners, page)));
        Ok(Chosen {
            sheet: sheet.transpose()?,
            level,
            told,
        })
    }
}

/// How many tiles others show pieces of.
fn classes(owners: &[Option<u32>]) -> u64 {
    let owners: BTreeSet<&u32> = owners.iter().flatten().collect();
    owners.len() as u64
}

/// Whether a level that shares texels loses no more than `most` of F1.
pub fn within(f1: &Figure, without: &Figure, most: f64) -> bool {
    f1.mean >= without.mean - most && f1.worst >= without.worst - WORST * most
}

/// A level whose cards share nothing.
pub fn alone(level: &Level, number: usize) -> SharedLevel {
    SharedLevel {
        level: number as u32,
        tiles: level.charts.len() as u64,
        density: 1.0,
        ..SharedLevel::default()
    }
}

/// What sharing saved and cost, by the figures of the written files; `chosen` are in the order of
/// the report's levels.
pub fn told(report: &Report, chosen: Vec<SharedLevel>) -> Sharing {
    let with_figures = |(mut level, row): (SharedLevel, &schema::Level)| {
        level.texture_bytes_with = row.texture_bytes;
        level.f1_with = row.sizes.first().map_or(0.0, |s| s.f1.mean);
        if level.texture_bytes_without == 0 {
            level.texture_bytes_without = level.texture_bytes_with;
            level.f1_without = level.f1_with;
        }
        level
    };
    let levels = chosen.into_iter().zip(&report.levels).map(with_figures);
    let levels: Vec<SharedLevel> = levels.collect();
    let count = levels.len().max(1) as f64;
    Sharing {
        texture_bytes_with: levels.iter().map(|l| l.texture_bytes_with).sum(),
        texture_bytes_without: levels.iter().map(|l| l.texture_bytes_without).sum(),
        f1_with: levels.iter().map(|l| l.f1_with).sum::<f64>() / count,
        f1_without: levels.iter().map(|l| l.f1_without).sum::<f64>() / count,
        levels,
    }
}

/// What to say where sharing was asked for and levels found nothing to share.
pub fn kept(sharing: &Sharing, most: f64) -> Option<String> {
    let kept: Vec<String> = sharing
        .levels
        .iter()
        .filter(|l| l.tiles > 0 && l.copies == 0 && l.density == 1.0 && !l.smaller_page)
        .map(|l| l.level.to_string())
        .collect();
    (!kept.is_empty()).then(|| {
        format!(
            "level {} keeps its page: none of half the size was found on which it loses at most {most} of F1",
            kept.join(", ")
        )
    })
}
