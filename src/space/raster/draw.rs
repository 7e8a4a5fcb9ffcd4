//! The nearest triangle of every sample.

use std::ops::Range;

use super::seen::seen;
use super::tiles::Tiles;
use super::triangle::CENTER;
use super::{Camera, Sampling, Scene};

/// The triangle of a sample that nothing hits.
pub const EMPTY: u32 = u32::MAX;

/// An item buffer: for every sample the triangle that is seen there.
#[derive(Clone, Debug)]
pub struct Items {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Samples along a pixel's edge.
    pub side: u32,
    /// Triangle a sample or [`EMPTY`], rows of `width * side` from the top.
    pub triangle: Vec<u32>,
    /// Nearness a sample: grows towards the eye; minus the distance along the line of sight
    /// (orthographic), one over it (perspective).
    pub near: Vec<f32>,
}

/// Draws the scene; of triangles equally near the first one stays.
pub fn draw(scene: &Scene, camera: &Camera, sampling: Sampling) -> Items {
    let corners = camera.project(scene.geometry.positions, sampling.side);
    let (width, height) = (
        (camera.width * sampling.side) as i32,
        (camera.height * sampling.side) as i32,
    );
    let count = width as usize * height as usize;
    let mut near = vec![f32::NEG_INFINITY; count];
    let mut items = vec![EMPTY; count];
    // For each sample of a row, whether it is hidden; then, whether it is seen.
    let (mut hidden, mut tested) = (Vec::<u8>::new(), Vec::<u8>::new());
    let mut tiles = Tiles::new(width, height);
    for shown in seen(scene, &corners, CENTER) {
        let nearest = shown
            .corners
            .iter()
            .map(|c| c.near)
            .fold(f32::MIN, f32::max);
        let least = |samples: Range<usize>| near[samples].iter().copied().fold(f32::MAX, f32::min);
        if tiles.hide(&shown.corners, nearest, least) {
            continue;
        }
        let mut fragment = None;
        let mut depth = None;
        let id = shown.id as u32;
        shown.triangle.scan(width, height, |y, from, to| {
            let depth = depth.get_or_insert_with(|| shown.triangle.near_plane(shown.corners));
            let depth = depth.row(y);
            let row = y as usize * width as usize;
            let row = row + from as usize..row + to as usize;
            let (near, items) = (&mut near[row.clone()], &mut items[row]);
            tested.clear();
            let is_hidden = |(near, x): (&f32, i32)| u8::from(depth.value(x) <= *near);
            tested.extend(near.iter().zip(from..).map(is_hidden));
            if shown.material.cutoff.is_none() {
                tested.iter_mut().for_each(|t| *t ^= 1);
            } else if tested.contains(&0) {
                hidden.clone_from(&tested);
                let fragment = fragment.get_or_insert_with(|| shown.fragment(scene, sampling));
                fragment.test_row(y, from, &mut tested);
                tested.iter_mut().zip(&hidden).for_each(|(t, h)| *t ^= h);
            } else {
                return;
            }
            // Eight at a time are passed over where none is seen.
            for (first, eight) in (0..).step_by(8).zip(tested.chunks(8)) {
                if eight.contains(&1) {
                    for (i, _) in (first..).zip(eight).filter(|(_, seen)| **seen == 1) {
                        (near[i], items[i]) = (depth.value(from + i as i32), id);
                    }
                }
            }
        });
    }
    Items {
        width: camera.width,
        height: camera.height,
        side: sampling.side,
        triangle: items,
        near,
    }
}
