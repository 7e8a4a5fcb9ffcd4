//! Incorrect pixels under leaf budgets (Lee and others, Table I), for the paper's three priorities
//! and our measured one.
//!
//! A pixel is incorrect where the picture with few leaves differs at all from the one with all
//! (8 bits a channel, one sample a pixel, as the paper draws); the share is that of the pixels which
//! the whole tree covers. Wood is always drawn. Views are perspective ones from around the tree and
//! from the top, none of them a direction that was measured.

use std::path::Path;

use glam::Vec3;
use rayon::prelude::*;
use serde_json::{Value, json};

use super::leaves::{Leaves, draw_some};
use super::measure::{by_measure, measure};
use super::picture::Sheet;
use crate::botany::tree::Tree;
use crate::error::Result;
use crate::report::{Agreement, Drawable, agreement};
use crate::runtime::{Chosen, Measured, Spender, by_distance, by_normal};
use crate::space::raster::{Camera, Coverage, Light, Sampling};
use crate::space::view::{View, views};

/// Shares of the leaves that are drawn.
pub const BUDGETS: [f64; 4] = [0.8, 0.5, 0.3, 0.1];

/// Names of the priorities, in the order of all figures.
pub const PRIORITIES: [&str; 4] = ["distance", "normal", "layer_normal", "measured"];

/// How the study is done.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Height of the tree in pixels.
    pub height_px: u32,
    /// Number of views.
    pub views: usize,
    /// Layers of the third priority (the paper doesn't say how many).
    pub layers: u32,
    /// Leaves that are drawn or left out together.
    pub group: usize,
    /// Directions are the texels of a map with this side.
    pub map_side: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            height_px: 512,
            views: 16,
            layers: 10,
            group: 1,
            map_side: 10,
        }
    }
}

/// Figures of one priority at one budget.
#[derive(Clone, Copy, Debug, Default)]
pub struct Figures {
    /// Share of covered pixels that differ at all, mean over views.
    pub incorrect: f64,
    /// Share of covered pixels that differ by more than 32/255 in a channel.
    pub far_off: f64,
    /// F1 of the silhouette, mean over views.
    pub f1: f64,
    /// The worst view's.
    pub worst_f1: f64,
}

/// The whole study.
pub struct Study {
    /// Number of leaves.
    pub leaves: u32,
    /// Bytes of the measured visibility.
    pub measured_bytes: usize,
    /// For each budget the figures of each priority.
    pub figures: Vec<[Figures; 4]>,
    sheet: Sheet,
}

/// The eye's distance from the tree's middle, in radii of its bounding sphere.
const EYE_DISTANCE: f32 = 4.0;
/// First azimuth of the views, degrees.
const OFFSET_DEG: f32 = 11.0;
/// Pixels that differ by more than this differ clearly.
const FAR_OFF: u8 = 32;

/// Runs the study.
pub fn study(tree: &Tree, settings: &Settings) -> Study {
    let leaves = Leaves::new(tree, settings.group);
    let measured = measure(&leaves, settings.map_side);
    let drawable = Drawable::shaded(&tree.model);
    let views = views(settings.views, OFFSET_DEG);
    let seen: Vec<Vec<[Seen; 4]>> = views
        .par_iter()
        .map(|view| look(&leaves, &measured, &drawable, view, settings))
        .collect();
    let figures = (0..BUDGETS.len())
        .map(|b| std::array::from_fn(|p| mean(seen.iter().map(|view| &view[b][p]))))
        .collect();
    let size = camera(tree, &views[0], settings).width;
    let mut sheet = Sheet::new(1 + PRIORITIES.len(), BUDGETS.len(), size, size);
    let whole: Vec<u32> = (0..tree.model.triangles.len() as u32).collect();
    let whole = picture(&drawable, &whole, &camera(tree, &views[0], settings)).0;
    for (row, budget) in seen[0].iter().enumerate() {
        sheet.put(0, row, &whole);
        for (column, seen) in budget.iter().enumerate() {
            sheet.put(column + 1, row, &seen.rgba);
        }
    }
    Study {
        leaves: leaves.count(),
        measured_bytes: measured.bytes().len(),
        figures,
        sheet,
    }
}

/// What one view shows at one budget and priority.
struct Seen {
    incorrect: f64,
    far_off: f64,
    silhouette: Agreement,
    rgba: Vec<u8>,
}

fn look(
    leaves: &Leaves,
    measured: &Measured,
    drawable: &Drawable,
    view: &View,
    settings: &Settings,
) -> Vec<[Seen; 4]> {
    let camera = camera(leaves.tree, view, settings);
    let all: Vec<u32> = (0..leaves.tree.model.triangles.len() as u32).collect();
    let (whole, coverage) = picture(drawable, &all, &camera);
    let covered = coverage
        .fraction
        .iter()
        .filter(|&&c| c > 0.0)
        .count()
        .max(1) as f64;
    let mut spender = Spender::default();
    let mut at = |budget: f64, priority: usize| {
        let budget = (f64::from(leaves.count()) * budget).round() as u32;
        let chosen = choose(
            &mut spender,
            leaves,
            measured,
            &camera,
            budget,
            priority,
            settings.layers,
        );
        let (rgba, some) = picture(drawable, &leaves.triangles(&chosen), &camera);
        let differ = |by: u8| {
            let pixels = whole.chunks_exact(4).zip(rgba.chunks_exact(4));
            let wrong = pixels.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > by));
            wrong.count() as f64 / covered
        };
        Seen {
            incorrect: differ(0),
            far_off: differ(FAR_OFF),
            silhouette: agreement(&coverage, &some),
            rgba,
        }
    };
    BUDGETS
        .iter()
        .map(|&budget| std::array::from_fn(|priority| at(budget, priority)))
        .collect()
}

fn choose(
    spender: &mut Spender,
    leaves: &Leaves,
    measured: &Measured,
    camera: &Camera,
    budget: u32,
    priority: usize,
    layers: u32,
) -> Vec<Chosen> {
    let (items, eye) = (&leaves.items, camera.origin);
    let normal = |i: usize| by_normal(&items[i], eye);
    match priority {
        0 => spender.spend(items, budget, |i| by_distance(&items[i], eye)),
        1 => spender.spend(items, budget, normal),
        2 => spender.spend_layers(items, budget, (eye, camera.forward), layers, normal),
        _ => spender.spend(items, budget, |i| by_measure(leaves, measured, i, eye)),
    }
    .to_vec()
}

/// A perspective camera in a view's direction; the tree's height takes `height_px` pixels.
fn camera(tree: &Tree, view: &View, settings: &Settings) -> Camera {
    let flat = view.camera(tree.model.height(), settings.height_px);
    let eye = view.towards_eye() * EYE_DISTANCE;
    // The sphere is seen under a wider angle than its middle section.
    let half = flat.width as f32 / 2.0 / flat.pixels;
    let fov = 2.0 * (half * 1.04 / EYE_DISTANCE).atan();
    Camera::perspective(eye, Vec3::ZERO, flat.up, fov, flat.width, flat.height)
}

/// Shaded bytes on white, and what is covered.
fn picture(drawable: &Drawable, triangles: &[u32], camera: &Camera) -> (Vec<u8>, Coverage) {
    let drawn = draw_some(drawable, triangles, camera, Sampling::CLIENT);
    let whole = drawable.scene();
    let shaded = drawn.items.shade(
        &drawn.scene(&whole),
        camera,
        Sampling::CLIENT,
        Light::Outdoors,
    );
    (shaded.over([255; 3]), drawn.items.mask().coverage())
}

fn mean<'a>(seen: impl Iterator<Item = &'a Seen>) -> Figures {
    let mut out = Figures {
        worst_f1: 1.0,
        ..Figures::default()
    };
    let mut n = 0.0;
    for seen in seen {
        n += 1.0;
        out.incorrect += seen.incorrect;
        out.far_off += seen.far_off;
        out.f1 += seen.silhouette.f1();
        out.worst_f1 = out.worst_f1.min(seen.silhouette.f1());
    }
    for sum in [&mut out.incorrect, &mut out.far_off, &mut out.f1] {
        *sum /= f64::max(n, 1.0);
    }
    out
}

impl Study {
    /// Shares of incorrect pixels, one object a budget.
    pub fn to_json(&self) -> Value {
        let row = |(budget, figures): (&f64, &[Figures; 4])| {
            let mut row = json!({ "budget": budget });
            for (name, f) in PRIORITIES.iter().zip(figures) {
                row[*name] = json!(f.incorrect);
            }
            row
        };
        json!({ "budgets": BUDGETS.iter().zip(&self.figures).map(row).collect::<Vec<_>>() })
    }

    /// The figures for people.
    pub fn table(&self) -> String {
        let mut out = format!(
            "{} leaves; measured visibility takes {} bytes\n\n{:<44}",
            self.leaves, self.measured_bytes, ""
        );
        for name in PRIORITIES {
            out += &format!("{name:>14}");
        }
        type Line = (&'static str, fn(&Figures) -> String);
        let lines: [Line; 4] = [
            ("incorrect pixels", |f| {
                format!("{:.2} %", 100.0 * f.incorrect)
            }),
            ("differ by more than 32/255", |f| {
                format!("{:.2} %", 100.0 * f.far_off)
            }),
            ("silhouette, mean F1", |f| format!("{:.3}", f.f1)),
            ("silhouette, worst view's F1", |f| {
                format!("{:.3}", f.worst_f1)
            }),
        ];
        for (what, figure) in lines {
            for (budget, figures) in BUDGETS.iter().zip(&self.figures) {
                out += &format!("\n{:<30}{:>10.0} %  ", what, 100.0 * budget);
                for f in figures {
                    out += &format!("{:>14}", figure(f));
                }
            }
            out += "\n";
        }
        out
    }

    /// Writes lee.png: a row for each budget; all leaves, then the priorities.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn write(&self, folder: &Path) -> Result<()> {
        self.sheet.write(&folder.join("lee.png"))
    }
}
