//! Measures the levels of a package, each at the sizes that it is for.

use super::drawable::Drawable;
use super::evaluate::{Settings, evaluate};
use super::reference::Reference;
use super::schema::Report;
use crate::botany::Model;
use crate::error::Result;
use crate::space::raster::Sampling;

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

/// Figures of every level at its own sizes, supersampled and as an engine draws it; the original
/// as an engine draws it, at all of them. `step` is called after each of [`heights`].
///
/// # Errors
/// Those of `step`.
pub fn judge(
    original: (&Model, &str),
    levels: &[Judged],
    settings: &Settings,
    mut step: impl FnMut() -> Result<()>,
) -> Result<Report> {
    let costs_only = Settings {
        heights_px: Vec::new(),
        ..settings.clone()
    };
    let named: Vec<(&Model, &str)> = levels.iter().map(|l| (&l.model, l.file.as_str())).collect();
    let mut report = evaluate(original, &named, &costs_only);
    for (row, level) in report.levels.iter_mut().zip(levels) {
        row.distance_m = level.distance_m;
    }
    let own = Drawable::silhouette(original.0);
    let drawables: Vec<Drawable> = levels
        .iter()
        .map(|l| Drawable::silhouette(&l.model))
        .collect();
    let views = settings.view_set();
    let heights_px = heights(levels);
    for reference in Reference::each(&own, original.0, &views, &heights_px) {
        let height_px = reference.height_px();
        if let Some(row) = &mut report.original {
            row.sizes.push(reference.compare_client(&own));
        }
        for ((row, level), drawable) in report.levels.iter_mut().zip(levels).zip(&drawables) {
            if !level.heights_px.contains(&height_px) {
                continue;
            }
            let mut figures = reference.compare_drawable(drawable, Sampling::REFERENCE);
            let client = reference.compare_client(drawable);
            figures.client = Some(Box::new(client));
            row.sizes.push(figures);
        }
        step()?;
    }
    Ok(report)
}
