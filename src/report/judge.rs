//! Measures the levels of a package, each at the sizes that it is for.

use std::convert::Infallible;

use super::asked::Asked;
use super::evaluate::{Settings, rows};
use super::measure::{actors, measure};
use super::schema::Report;
use crate::botany::Model;
use crate::error::Result;

/// A level of a package, read back from its file.
#[derive(Clone, Debug)]
pub struct Judged {
    /// What the file holds.
    pub model: Model,
    /// The file's name.
    pub file: String,
    /// Distance from which it is shown, metres.
    pub distance_m: f64,
    /// Heights of the tree in pixels at which it is measured; the first is where it starts.
    pub heights_px: Vec<u32>,
}

/// Distinct heights of all levels, largest first.
pub fn heights(levels: &[Judged]) -> Vec<u32> {
    let mut heights: Vec<u32> = levels.iter().flat_map(|l| l.heights_px.clone()).collect();
    heights.sort_unstable_by(|a, b| b.cmp(a));
    heights.dedup();
    heights
}

/// Figures of every level at its own sizes, supersampled and as an engine draws it. Of the original only what
/// it costs is told: it has no error beside itself, and what an engine makes of it takes a tenth of a bake to draw
/// (`pleach evaluate --client` does). `step` is called after each of [`heights`].
///
/// # Errors
/// Those of `step`.
pub fn judge(
    original: (&Model, &str),
    levels: &[Judged],
    settings: &Settings,
    mut step: impl FnMut() -> Result<()>,
) -> Result<Report> {
    let named: Vec<(&Model, &str)> = levels.iter().map(|l| (&l.model, l.file.as_str())).collect();
    let mut rows = rows(original, &named, settings);
    for (row, level) in rows.iter_mut().skip(1).zip(levels) {
        row.distance_m = level.distance_m;
    }
    let all = heights(levels);
    let models: Vec<&Model> = levels.iter().map(|l| &l.model).collect();
    let own: Vec<Vec<u32>> = levels.iter().map(|l| l.heights_px.clone()).collect();
    let asked = Asked {
        original: original.0,
        levels: &models,
        views: &settings.view_set(),
        lens: settings.lens,
        heights_px: &own,
        original_px: &[],
        starts_px: &[],
        looks: false,
        client: true,
        causes: false,
    };
    let actors = actors(&asked);
    for &height_px in &all {
        let Ok(found) = measure::<Infallible>(&asked, &actors, &[height_px], &|| Ok(()));
        for (row, found) in rows.iter_mut().zip(found) {
            row.sizes.extend(found.sizes);
        }
        step()?;
    }
    let measured = rows.split_off(1);
    Ok(Report {
        position_step_m: original.0.position_step,
        focal_px: settings.lens.focal_px(),
        original: rows.pop(),
        levels: measured,
        ..Report::default()
    })
}
