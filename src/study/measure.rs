//! Counts the pixels that every leaf, or group of leaves, shows from directions over the sphere.

use glam::Vec3;
use rayon::prelude::*;

use super::leaves::Leaves;
use crate::report::Drawable;
use crate::runtime::{Measured, Measuring};
use crate::space::raster::{Camera, EMPTY, Mips, Sampling, draw};

/// Pixels of the bounding sphere's diameter in an item buffer.
const DIAMETER_PX: u32 = 1200;

/// A leaf that covers few pixels says little: so many pixels of its mean share are added.
const PRIOR_PX: f32 = 2.0;

/// Share of each item's own projected area that is seen, from `side * side` directions.
///
/// What an item shows is its projected area, which is known exactly at run time, times this share,
/// which varies slowly with the direction and bears interpolation.
pub fn measure(leaves: &Leaves, side: u32) -> Measured {
    let drawable = Drawable::silhouette(&leaves.tree.model);
    let owner = leaves.item_of_triangle();
    let mut measuring = Measuring::new(leaves.items.len(), side);
    let directions = measuring.directions();
    let sampling = Sampling {
        side: 1,
        mips: Mips::Base,
    };
    let pixels = DIAMETER_PX as f32 / 2.0;
    let seen: Vec<(Vec<f32>, Vec<f32>)> = directions
        .par_iter()
        .map(|&to_eye| {
            let up = if to_eye.y.abs() > 0.99 {
                Vec3::X
            } else {
                Vec3::Y
            };
            let side = DIAMETER_PX + 4;
            let camera = Camera::orthographic(-to_eye, up, Vec3::ZERO, pixels, side, side);
            let items = draw(&drawable.scene(), &camera, sampling);
            let mut counts = vec![0.0f32; leaves.items.len()];
            for &t in items.triangle.iter().filter(|&&t| t != EMPTY) {
                if let Some(count) = counts.get_mut(owner[t as usize] as usize) {
                    *count += 1.0;
                }
            }
            let area = |i| leaves.projected_area(i, to_eye) * pixels * pixels;
            (counts, (0..leaves.items.len()).map(area).collect())
        })
        .collect();
    let mean: Vec<f32> = (0..leaves.items.len())
        .map(|i| {
            let counts: f64 = seen.iter().map(|s| f64::from(s.0[i])).sum();
            let areas: f64 = seen.iter().map(|s| f64::from(s.1[i])).sum();
            (counts / areas.max(1e-9)) as f32
        })
        .collect();
    for (texel, (counts, areas)) in seen.iter().enumerate() {
        let shares: Vec<f32> = counts
            .iter()
            .zip(areas)
            .zip(&mean)
            .map(|((count, area), mean)| (count + PRIOR_PX * mean) / (area + PRIOR_PX))
            .collect();
        measuring.set(texel, &shares);
    }
    measuring.finish()
}

/// Priority of an item: the area that it is thought to show (ours).
pub fn by_measure(leaves: &Leaves, measured: &Measured, item: usize, eye: Vec3) -> f32 {
    let to_eye = eye - leaves.items[item].center;
    let distance = to_eye.length().max(1e-6);
    let direction = to_eye / distance;
    leaves.projected_area(item, direction) * measured.at(item, direction) / (distance * distance)
}
