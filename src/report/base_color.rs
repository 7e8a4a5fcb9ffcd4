//! The mean base colour of what an engine draws: no light, so that any renderer can be held to it.

use rayon::prelude::*;

use super::drawable::Drawable;
use crate::botany::model::Frame;
use crate::space::raster::{Light, Sampling, draw};
use crate::space::view::View;

/// Mean linear RGB of all covered pixels of all views, drawn with mips and one sample a pixel;
/// `None` where nothing is covered. `height` is the original's, `frame` its normalised space.
pub fn base_color(
    level: &Drawable,
    frame: Frame,
    height: f32,
    views: &[View],
    height_px: u32,
) -> Option<[f64; 3]> {
    let place = level.placement_in(frame);
    let in_view = |view: &View| -> [f64; 4] {
        let scene = level.scene();
        let camera = view.camera(height, height_px).placed(place);
        let items = draw(&scene, &camera, Sampling::CLIENT);
        let layers = items.layers(&scene, &camera, Sampling::CLIENT, Light::Unlit, &[]);
        let sum = |c: usize| layers.color.iter().map(|p| f64::from(p[c])).sum();
        let covered = layers.coverage.iter().map(|&c| f64::from(c)).sum();
        [sum(0), sum(1), sum(2), covered]
    };
    let sums: Vec<[f64; 4]> = views.par_iter().map(in_view).collect();
    let total = |i: usize| sums.iter().map(|s| s[i]).sum::<f64>();
    let covered = total(3);
    (covered > 0.0).then(|| [0, 1, 2].map(|c| total(c) / covered))
}
