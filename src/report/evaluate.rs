//! All figures of a set of levels against their original.

use rayon::prelude::*;

use super::appearance::{Asked, appearance};
use super::base_color::base_color;
use super::cost::{draw_calls, texture_bytes};
use super::drawable::Drawable;
use super::reference::Reference;
use super::schema::{Level, Report};
use crate::botany::Model;
use crate::space::raster::{Sampling, coverage_with_stats};
use crate::space::view::{DEFAULT_VIEWS, ELEVATIONS, View, views_at};

/// How levels are evaluated.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Heights of the tree on the screen, pixels.
    pub heights_px: Vec<u32>,
    /// For each level the height from which it is shown, pixels: it is measured there and at half
    /// of it (twice the distance) as well. May be shorter than the list of levels.
    pub own_heights_px: Vec<Option<u32>>,
    /// Number of views, the top included (at least; see [`views_at`]).
    pub views: usize,
    /// Azimuth of the first view, degrees.
    pub azimuth_offset_deg: f32,
    /// Elevations of the views, degrees above the horizon.
    pub elevations_deg: Vec<f32>,
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

    /// The views that these settings ask for.
    pub fn view_set(&self) -> Vec<View> {
        views_at(&self.elevations_deg, self.views, self.azimuth_offset_deg)
    }
}

/// Lines of the screen that distances are stated for.
const SCREEN_LINES: f64 = 1080.0;
/// Vertical field of view that distances are stated for, degrees.
const FIELD_OF_VIEW_DEG: f64 = 60.0;

/// Measures `levels` (with their file names) against `original`.
pub fn evaluate(
    original: (&Model, &str),
    levels: &[(&Model, &str)],
    settings: &Settings,
) -> Report {
    let views = settings.view_set();
    let all: Vec<(&Model, &str)> = [original]
        .into_iter()
        .chain(levels.iter().copied())
        .collect();
    let drawables: Vec<Drawable> = all.iter().map(|(m, _)| Drawable::silhouette(m)).collect();
    let mut rows: Vec<Level> = all
        .iter()
        .zip(&drawables)
        .map(|(&(model, file), drawable)| Level {
            file: file.into(),
            triangles: model.triangles.len() as u64,
            draw_calls: draw_calls(model),
            texture_bytes: texture_bytes(model),
            file_bytes: model.file_bytes,
            overdraw: overdraw(drawable, original.0, &views),
            ..Level::default()
        })
        .collect();
    for (number, row) in rows.iter_mut().skip(1).enumerate() {
        row.level = number as u32 + 1;
        let own = settings.own_heights_px.get(number).copied().flatten();
        if let Some(height_px) = own.or(settings.heights_px.iter().copied().max()) {
            row.distance_m = distance_m(original.0, height_px);
        }
    }
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
    for chain in Reference::chains(&drawables[0], original.0, &views, &all) {
        for (index, (row, drawable)) in rows.iter_mut().zip(&drawables).enumerate() {
            let level = index.checked_sub(1);
            let asked = |px: u32| level.is_none_or(|level| heights[level].contains(&px));
            if !chain.iter().any(|r| asked(r.height_px())) {
                continue;
            }
            let figures = match level {
                None => chain.iter().map(Reference::compare_itself).collect(),
                Some(_) => Reference::compare_chain(&chain, drawable),
            };
            for (reference, mut figures) in chain.iter().zip(figures) {
                if asked(reference.height_px()) {
                    let client = || Box::new(reference.compare_client(drawable));
                    figures.client = settings.client.then(client);
                    row.sizes.push(figures);
                }
            }
        }
    }
    for row in &mut rows {
        row.sizes.sort_by_key(|s| std::cmp::Reverse(s.height_px));
    }
    if settings.client {
        add_base_colors(original.0, levels, &views, &mut rows);
    }
    let mut measured = rows.split_off(1);
    if settings.appearance {
        add_appearance(original.0, levels, &heights, settings, &mut measured);
    }
    let levels = measured;
    Report {
        position_step_m: original.0.position_step,
        original: rows.pop(),
        levels,
        ..Report::default()
    }
}

/// What engines show without light, for `rows` of the original and its levels.
fn add_base_colors(
    original: &Model,
    levels: &[(&Model, &str)],
    views: &[View],
    rows: &mut [Level],
) {
    let models = [original].into_iter().chain(levels.iter().map(|(m, _)| *m));
    for (row, model) in rows.iter_mut().zip(models) {
        let drawable = Drawable::shaded(model);
        for size in &mut row.sizes {
            let (height, px) = (original.height(), size.height_px);
            if let Some(client) = &mut size.client {
                client.base_color_linear = base_color(&drawable, original.frame, height, views, px);
            }
        }
    }
}

fn add_appearance(
    original: &Model,
    levels: &[(&Model, &str)],
    heights_px: &[Vec<u32>],
    settings: &Settings,
    rows: &mut [Level],
) {
    // Where it is not known from where a level is shown, the first size stands for it.
    let first = settings.heights_px.iter().copied().max();
    let own = |i: usize| settings.own_heights_px.get(i).copied().flatten();
    let starts: Vec<u32> = (0..levels.len()).filter_map(|i| own(i).or(first)).collect();
    if starts.len() < levels.len() {
        return;
    }
    let models: Vec<&Model> = levels.iter().map(|(model, _)| *model).collect();
    let found = appearance(&Asked {
        original,
        levels: &models,
        views: &settings.view_set(),
        heights_px,
        starts_px: &starts,
    });
    for (row, found) in rows.iter_mut().zip(found) {
        for (height_px, figures) in found.sizes {
            let size = row.sizes.iter_mut().find(|s| s.height_px == height_px);
            if let Some(size) = size {
                size.appearance = Some(Box::new(figures));
            }
        }
        row.jump_to_next = found.jump;
        row.orbit = found.orbit;
    }
}

/// Sorted from large to small, each once, none under a pixel.
fn in_order(mut heights: Vec<u32>) -> Vec<u32> {
    heights.retain(|&px| px > 0);
    heights.sort_unstable_by(|a, b| b.cmp(a));
    heights.dedup();
    heights
}

/// Distance at which the tree has a height on the screen, metres.
fn distance_m(original: &Model, height_px: u32) -> f64 {
    let height_m = original.height() as f64 * original.frame.radius;
    let half_angle = (FIELD_OF_VIEW_DEG / 2.0).to_radians();
    height_m * SCREEN_LINES / (2.0 * height_px as f64 * half_angle.tan())
}

/// Fragments a covered sample, mean over every third view; hardly depends on view or size.
fn overdraw(level: &Drawable, original: &Model, views: &[View]) -> f64 {
    let place = level.placement_in(original.frame);
    let in_view = |view: &View| {
        let camera = view.camera(original.height(), 256).placed(place);
        let (_, stats) = coverage_with_stats(&level.scene(), &camera, Sampling::CLIENT);
        stats.fragments as f64 / stats.covered.max(1) as f64
    };
    let some: Vec<&View> = views.iter().step_by(3).collect();
    let each: Vec<f64> = some.into_par_iter().map(in_view).collect();
    each.iter().sum::<f64>() / each.len().max(1) as f64
}
