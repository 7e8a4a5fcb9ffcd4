//! What an impostor's shader would draw, compared as every level is.

use glam::Vec3;
use pleach::botany::Model;
use pleach::report::schema::SizeFigures;
use pleach::report::{Drawable, Reference, Settings};
use pleach::space::raster::{Camera, Coverage, Sampling};

use crate::impostor::{Impostor, Layer};

/// Alpha from which a blend counts as covered.
const CUTOFF: f32 = 0.5;

/// The original's pictures, from the views of `pleach bake`'s own report.
pub fn reference(model: &Model, height_px: u32) -> Reference {
    let settings = Settings {
        azimuth_offset_deg: pleach::pipeline::REPORT_OFFSET_DEG,
        ..Settings::default()
    };
    let drawable = Drawable::silhouette(model);
    Reference::of(
        &drawable,
        model,
        &settings.view_set(),
        settings.lens,
        height_px,
    )
}

/// Figures of an impostor, its pictures blended or the nearest alone.
pub fn figures(reference: &Reference, impostor: &Impostor, blend: bool) -> SizeFigures {
    reference.compare_drawn(|camera| shown(impostor, camera, blend))
}

/// The pixels of one view, with as many samples as the original's.
pub fn shown(impostor: &Impostor, camera: &Camera, blend: bool) -> Coverage {
    let towards_eye = match camera.perspective {
        true => camera.origin.normalize_or(-camera.forward),
        false => -camera.forward,
    };
    let layers = impostor.layers(towards_eye, blend);
    let side = Sampling::REFERENCE.side;
    let pixel = |x: u32, y: u32| {
        let mut hits = 0;
        for sample in 0..side * side {
            let place =
                |pixel: u32, sample: u32| pixel as f32 + (sample as f32 + 0.5) / side as f32;
            let (from, along) = sight(camera, place(x, sample % side), place(y, sample / side));
            hits += u32::from(opacity(&layers, from, along) >= CUTOFF);
        }
        hits as f32 / (side * side) as f32
    };
    let rows = 0..camera.height;
    Coverage {
        width: camera.width,
        height: camera.height,
        fraction: rows
            .flat_map(|y| (0..camera.width).map(move |x| (x, y)))
            .map(|(x, y)| pixel(x, y))
            .collect(),
    }
}

fn opacity(layers: &[Layer], from: Vec3, along: Vec3) -> f32 {
    layers.iter().map(|layer| layer.opacity(from, along)).sum()
}

/// A line of sight through a place in the picture (pixels from its left upper corner): a point on
/// it, and a vector along it.
fn sight(camera: &Camera, x: f32, y: f32) -> (Vec3, Vec3) {
    let x = (x - 0.5 * camera.width as f32 - camera.shift.x) / camera.pixels;
    let y = (y - 0.5 * camera.height as f32 - camera.shift.y) / camera.pixels;
    let aside = camera.right * x - camera.up * y;
    match camera.perspective {
        true => (camera.origin, camera.forward + aside),
        false => (camera.origin + aside, camera.forward),
    }
}
