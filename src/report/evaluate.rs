//! All figures of a set of levels against their original.

use std::convert::Infallible;

use rayon::prelude::*;

use super::asked::Asked;
use super::cost::{draw_calls, texture_bytes};
use super::drawable::Drawable;
use super::measure::{actors, measure};
use super::schema::{Level, Report};
use crate::botany::Model;
use crate::space::raster::{Sampling, coverage_with_stats};
use crate::space::sector::Sector;
use crate::space::view::{DEFAULT_VIEWS, ELEVATIONS, Lens, View, views_of};

/// How levels are evaluated.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Heights of the tree on the screen, pixels.
    pub heights_px: Vec<u32>,
    /// For each level the height from which it is shown, pixels: it is measured there and at half
    /// of it (twice the distance) as well. May be shorter than the list of levels.
    pub own_heights_px: Vec<Option<u32>>,
    /// Number of views, the top included; more where every elevation would not have one (see [`views_of`]).
    pub views: usize,
    /// Azimuth of the first view, degrees.
    pub azimuth_offset_deg: f32,
    /// Elevations of the views, degrees above the horizon.
    pub elevations_deg: Vec<f32>,
    /// Where the tree is seen from: views outside move into it.
    pub sector: Sector,
    /// How lines of sight run.
    pub lens: Lens,
    /// Whether levels and original are also drawn as an engine draws them.
    pub client: bool,
    /// Whether colours, distances, normals and jumps are measured, too.
    pub appearance: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            heights_px: vec![256, 64],
            own_heights_px: Vec::new(),
            views: DEFAULT_VIEWS,
            azimuth_offset_deg: 0.0,
            elevations_deg: ELEVATIONS.to_vec(),
            sector: Sector::default(),
            lens: Lens::default(),
            client: false,
            appearance: false,
        }
    }
}

impl Settings {
    /// The heights at which a level (counted from 0, without the original) is measured, largest first.
    fn heights_of(&self, level: usize) -> Vec<u32> {
        let own = self.own_heights_px.get(level).copied().flatten();
        let mut heights = self.heights_px.clone();
        heights.extend(own.into_iter().flat_map(|px| [px, px / 2]));
        in_order(heights)
    }

    /// For each level the height from which it is shown, pixels; the first size stands for one that
    /// is not known. Empty where nothing is asked of that, or there is no size either.
    fn starts(&self, levels: usize) -> Vec<u32> {
        let first = self.heights_px.iter().copied().max();
        let own = |i: usize| self.own_heights_px.get(i).copied().flatten();
        let starts: Vec<u32> = (0..levels).filter_map(|i| own(i).or(first)).collect();
        match self.appearance && starts.len() == levels {
            true => starts,
            false => Vec::new(),
        }
    }

    /// The views that these settings ask for.
    pub fn view_set(&self) -> Vec<View> {
        let (elevations, count) = (&self.elevations_deg, self.views);
        views_of(&self.sector, elevations, count, self.azimuth_offset_deg)
    }
}

/// Measures `levels` (with their file names) against `original`.
pub fn evaluate(
    original: (&Model, &str),
    levels: &[(&Model, &str)],
    settings: &Settings,
) -> Report {
    let Ok(report) = evaluate_watched::<Infallible>(original, levels, settings, &|| Ok(()));
    report
}

/// As [`evaluate`]; `seen` is called after each view of [`Settings::view_set`], by any thread.
///
/// # Errors
/// Those of `seen`.
pub fn evaluate_watched<E: Send>(
    original: (&Model, &str),
    levels: &[(&Model, &str)],
    settings: &Settings,
    seen: &(dyn Fn() -> Result<(), E> + Sync),
) -> Result<Report, E> {
    let views = settings.view_set();
    let mut rows = rows(original, levels, settings);
    let models: Vec<&Model> = levels.iter().map(|(model, _)| *model).collect();
    let heights: Vec<Vec<u32>> = (0..levels.len())
        .map(|level| settings.heights_of(level))
        .collect();
    let all = in_order(
        heights
            .iter()
            .flatten()
            .chain(&settings.heights_px)
            .copied()
            .collect(),
    );
    let asked = Asked {
        original: original.0,
        levels: &models,
        views: &views,
        lens: settings.lens,
        heights_px: &heights,
        original_px: &all,
        starts_px: &settings.starts(levels.len()),
        looks: settings.appearance,
        client: settings.client,
        causes: settings.client,
    };
    let found = measure(&asked, &actors(&asked), &all, seen)?;
    for (row, found) in rows.iter_mut().zip(found) {
        row.sizes = found.sizes;
        row.jump_to_next = found.jump;
        row.orbit = found.orbit;
    }
    let levels = rows.split_off(1);
    Ok(Report {
        position_step_m: original.0.position_step,
        focal_px: settings.lens.focal_px(),
        original: rows.pop(),
        levels,
        ..Report::default()
    })
}

/// What the original and its levels cost, and from where they are shown.
pub(super) fn rows(
    original: (&Model, &str),
    levels: &[(&Model, &str)],
    settings: &Settings,
) -> Vec<Level> {
    let views = settings.view_set();
    let all = [original].into_iter().chain(levels.iter().copied());
    let costs = all.map(|(model, file)| Level {
        file: file.into(),
        triangles: model.triangles.len() as u64,
        draw_calls: draw_calls(model),
        texture_bytes: texture_bytes(model),
        file_bytes: model.file_bytes,
        overdraw: overdraw(model, original.0, &views, settings.lens),
        ..Level::default()
    });
    let mut rows: Vec<Level> = costs.collect();
    for (number, row) in rows.iter_mut().skip(1).enumerate() {
        row.level = number as u32 + 1;
        let own = settings.own_heights_px.get(number).copied().flatten();
        if let Some(height_px) = own.or(settings.heights_px.iter().copied().max()) {
            row.distance_m = distance_m(original.0, settings.lens, height_px);
        }
    }
    rows
}

/// Sorted from large to small, each once, none under a pixel.
fn in_order(mut heights: Vec<u32>) -> Vec<u32> {
    heights.retain(|&px| px > 0);
    heights.sort_unstable_by(|a, b| b.cmp(a));
    heights.dedup();
    heights
}

/// Distance at which the tree has a height on the screen, metres.
fn distance_m(original: &Model, lens: Lens, height_px: u32) -> f64 {
    let height_m = f64::from(original.height()) * original.frame.radius;
    let usual = Lens::SCREEN_LINES / (2.0 * (Lens::FIELD_OF_VIEW_DEG / 2.0).to_radians().tan());
    let focal_px = lens.focal_px().unwrap_or(usual);
    height_m * focal_px / f64::from(height_px)
}

/// Fragments a covered sample, mean over every third view; hardly depends on view or size.
fn overdraw(level: &Model, original: &Model, views: &[View], lens: Lens) -> f64 {
    let level = Drawable::silhouette(level);
    let (scene, place) = (level.scene(), level.placement_in(original.frame));
    let height = original.height();
    let in_view = |view: &View| {
        let camera = view.camera_through(lens, height, 256);
        let (_, stats) = coverage_with_stats(&scene, &camera.placed(place), Sampling::CLIENT);
        stats.fragments as f64 / stats.covered.max(1) as f64
    };
    let some: Vec<&View> = views.iter().step_by(3).collect();
    let each: Vec<f64> = some.into_par_iter().map(in_view).collect();
    each.iter().sum::<f64>() / each.len().max(1) as f64
}
