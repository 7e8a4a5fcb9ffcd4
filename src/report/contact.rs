//! A sheet of pictures to look at: original, level, and where their silhouettes differ.

use rayon::prelude::*;

use super::drawable::Drawable;
use crate::botany::Model;
use crate::space::raster::{Camera, Light, Picture, Sampling, draw};
use crate::space::view::View;

const BACKGROUND: [u8; 3] = [255, 255, 255];
/// Pixels of both silhouettes.
const BOTH: [u8; 3] = [205, 205, 205];
/// Pixels that the level lacks.
const MISSING: [u8; 3] = [215, 35, 35];
/// Pixels that the level has and the original has not.
const EXTRA: [u8; 3] = [40, 70, 220];

/// One row for each level, and in it for each view: original, level, difference (grey: both, red:
/// missing, blue: extra). Returns width, height and RGBA.
///
/// The original is always supersampled; `sampling` is how the levels are drawn.
pub fn contact_sheet(
    original: &Model,
    levels: &[&Model],
    views: &[View],
    height_px: u32,
    sampling: Sampling,
) -> (u32, u32, Vec<u8>) {
    let height = original.height();
    let cameras: Vec<Camera> = views.iter().map(|v| v.camera(height, height_px)).collect();
    let cell = cameras.first().map_or(1, |c| c.width);
    let (width, rows) = (cell * 3 * views.len() as u32, levels.len() as u32);
    let mut sheet = Sheet {
        width,
        rgba: vec![255; (width * cell * rows) as usize * 4],
    };
    let shaded = |model: &Model, sampling| -> Vec<Picture> {
        let drawable = Drawable::shaded(model);
        let (scene, place) = (drawable.scene(), drawable.placement_in(original.frame));
        let shade = |camera: &Camera| {
            let camera = camera.placed(place);
            draw(&scene, &camera, sampling).shade(&scene, &camera, sampling, Light::Outdoors)
        };
        cameras.par_iter().map(shade).collect()
    };
    let originals = shaded(original, Sampling::REFERENCE);
    for (row, level) in levels.iter().enumerate() {
        let y = row as u32 * cell;
        for (column, (a, b)) in originals.iter().zip(shaded(level, sampling)).enumerate() {
            let x = column as u32 * cell * 3;
            sheet.put(x, y, cell, &a.over(BACKGROUND));
            sheet.put(x + cell, y, cell, &b.over(BACKGROUND));
            sheet.put(x + 2 * cell, y, cell, &difference(&a.coverage, &b.coverage));
        }
    }
    (width, cell * rows, sheet.rgba)
}

/// RGBA map of where two silhouettes agree.
fn difference(original: &[f32], level: &[f32]) -> Vec<u8> {
    let color = |(&a, &b): (&f32, &f32)| {
        let [r, g, b] = match (a >= 0.5, b >= 0.5) {
            (true, true) => BOTH,
            (true, false) => MISSING,
            (false, true) => EXTRA,
            (false, false) => BACKGROUND,
        };
        [r, g, b, 255]
    };
    original.iter().zip(level).flat_map(color).collect()
}

struct Sheet {
    width: u32,
    rgba: Vec<u8>,
}

impl Sheet {
    fn put(&mut self, x: u32, y: u32, size: u32, rgba: &[u8]) {
        for (row, line) in rgba.chunks_exact(size as usize * 4).enumerate() {
            let at = ((y as usize + row) * self.width as usize + x as usize) * 4;
            self.rgba[at..at + line.len()].copy_from_slice(line);
        }
    }
}
