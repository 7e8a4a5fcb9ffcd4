//! A sheet of pictures to look at: original, level, and where their silhouettes differ.

use rayon::prelude::*;

use super::drawable::Drawable;
use crate::botany::Model;
use crate::space::raster::{Camera, Light, Picture, Sampling, draw};
use crate::space::view::{Lens, View};

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
    (lens, height_px): (Lens, u32),
    sampling: Sampling,
) -> (u32, u32, Vec<u8>) {
    let height = original.height();
    let cameras: Vec<Camera> = views
        .iter()
        .map(|v| v.camera_through(lens, height, height_px))
        .collect();
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
    let levels: Vec<_> = levels.iter().map(|level| shaded(level, sampling)).collect();
    // Every view is cut to what anything covers in it, so that trees are large on the sheet.
    let crops: Vec<Crop> = (0..views.len())
        .map(|i| {
            Crop::around(
                [&originals[i]]
                    .into_iter()
                    .chain(levels.iter().map(|l| &l[i])),
            )
        })
        .collect();
    let row_height = crops.iter().map(|c| c.height).max().unwrap_or(1);
    let width = crops.iter().map(|c| 3 * c.width).sum::<usize>().max(1);
    let total = row_height * levels.len();
    let mut sheet = Sheet {
        width,
        rgba: vec![255; width * total * 4],
    };
    for (row, level) in levels.iter().enumerate() {
        let (mut x, y) = (0, row * row_height);
        for ((a, b), crop) in originals.iter().zip(level).zip(&crops) {
            let map = difference(&a.coverage, &b.coverage);
            for rgba in [a.over(BACKGROUND), b.over(BACKGROUND), map] {
                sheet.put(x, y, &rgba, a.width as usize, crop);
                x += crop.width;
            }
        }
    }
    (width as u32, total as u32, sheet.rgba)
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
    width: usize,
    rgba: Vec<u8>,
}

/// A part of a picture, in pixels.
struct Crop {
    x: usize,
    y: usize,
    width: usize,
    height: usize,
}

/// White around each cell, pixels.
const MARGIN: usize = 4;

impl Crop {
    fn around<'a>(pictures: impl Iterator<Item = &'a Picture>) -> Self {
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        let mut size = [0; 2];
        for picture in pictures {
            size = [picture.width as usize, picture.height as usize];
            let covered = picture
                .coverage
                .iter()
                .enumerate()
                .filter(|(_, c)| **c > 0.0);
            for (i, _) in covered {
                let at = [i % size[0], i / size[0]];
                for axis in 0..2 {
                    low[axis] = low[axis].min(at[axis]);
                    high[axis] = high[axis].max(at[axis] + 1);
                }
            }
        }
        let [(x, width), (y, height)] = [0, 1].map(|axis| {
            let from = low[axis].min(high[axis]).saturating_sub(MARGIN);
            (from, (high[axis] + MARGIN).min(size[axis]) - from)
        });
        Self {
            x,
            y,
            width,
            height,
        }
    }
}

impl Sheet {
    fn put(&mut self, x: usize, y: usize, rgba: &[u8], row: usize, crop: &Crop) {
        for line in 0..crop.height {
            let from = ((crop.y + line) * row + crop.x) * 4;
            let to = ((y + line) * self.width + x) * 4;
            self.rgba[to..to + crop.width * 4].copy_from_slice(&rgba[from..from + crop.width * 4]);
        }
    }
}
