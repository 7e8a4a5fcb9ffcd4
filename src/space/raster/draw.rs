//! The nearest triangle of every sample.

use super::camera::Corner;
use super::pane::{Pane, Panes};
use super::seen::{Seen, seen};
use super::tiles::Tiles;
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
    let side = sampling.side as i32;
    let size = [camera.width as i32 * side, camera.height as i32 * side];
    let count = size[0] as usize * size[1] as usize;
    let mut items = Items {
        width: camera.width,
        height: camera.height,
        side: sampling.side,
        triangle: vec![EMPTY; count],
        near: vec![f32::NEG_INFINITY; count],
    };
    let mut front = Front::default();
    for (pane, ids) in Panes::new(scene, &corners, size, side).each() {
        front.draw(scene, &corners, sampling, &pane, ids);
        for y in pane.y[0]..pane.y[1] {
            let from = pane.row(y)..pane.row(y) + pane.width();
            let to = y as usize * size[0] as usize + pane.x[0] as usize;
            items.near[to..to + pane.width()].copy_from_slice(&front.near[from.clone()]);
            let found = items.triangle[to..].iter_mut().zip(&front.items[from]);
            found.for_each(|(to, &item)| *to = ids.get(item as usize).copied().unwrap_or(EMPTY));
        }
    }
    items
}

/// What is nearest in one pane.
#[derive(Default)]
pub(super) struct Front {
    /// For each sample of the pane the place of its triangle in the pane's list, or [`EMPTY`].
    pub items: Vec<u32>,
    /// As [`Items::near`].
    pub near: Vec<f32>,
    tiles: Tiles,
    /// For each sample of a row, whether it is hidden; then, whether it is seen.
    hidden: Vec<u8>,
    tested: Vec<u8>,
}

impl Front {
    /// Draws those of the scene's triangles that have the numbers `ids`.
    pub fn draw(
        &mut self,
        scene: &Scene,
        corners: &[Corner],
        sampling: Sampling,
        pane: &Pane,
        ids: &[u32],
    ) {
        let count = pane.width() * pane.height();
        self.items.clear();
        self.items.resize(count, EMPTY);
        self.near.clear();
        self.near.resize(count, f32::NEG_INFINITY);
        self.tiles.clear(pane);
        for (place, &id) in (0..).zip(ids) {
            if let Some(shown) = seen(scene, corners, id) {
                self.add(&shown, scene, sampling, pane, place);
            }
        }
    }

    fn add(&mut self, shown: &Seen, scene: &Scene, sampling: Sampling, pane: &Pane, place: u32) {
        let Self {
            items,
            near,
            tiles,
            hidden,
            tested,
        } = self;
        let nearest = shown
            .corners
            .iter()
            .map(|c| c.near)
            .fold(f32::MIN, f32::max);
        let least = |near: &[f32]| near.iter().copied().fold(f32::MAX, f32::min);
        let plane = || shown.triangle.near_plane(shown.corners);
        let mut fragment = None;
        let mut depth = None;
        let draw = |part: &Pane, near: &mut [f32]| {
            shown.triangle.scan(part, |y, from, to| {
                let depth = depth.get_or_insert_with(plane);
                let depth = depth.row(y);
                let row = pane.row(y);
                let row = row + (from - pane.x[0]) as usize..row + (to - pane.x[0]) as usize;
                let (near, items) = (&mut near[row.clone()], &mut items[row]);
                tested.clear();
                let is_hidden = |(near, x): (&f32, i32)| u8::from(depth.value(x) <= *near);
                tested.extend(near.iter().zip(from..).map(is_hidden));
                if shown.material.cutoff.is_none() {
                    tested.iter_mut().for_each(|t| *t ^= 1);
                } else if tested.contains(&0) {
                    hidden.clone_from(tested);
                    let fragment = fragment.get_or_insert_with(|| shown.fragment(scene, sampling));
                    fragment.test_row(y, from, tested);
                    tested
                        .iter_mut()
                        .zip(hidden.iter())
                        .for_each(|(t, h)| *t ^= h);
                } else {
                    return;
                }
                // Eight at a time are passed over where none is seen.
                for (first, eight) in (0..).step_by(8).zip(tested.chunks(8)) {
                    if eight.contains(&1) {
                        for (i, _) in (first..).zip(eight).filter(|(_, seen)| **seen == 1) {
                            (near[i], items[i]) = (depth.value(from + i as i32), place);
                        }
                    }
                }
            });
        };
        tiles.visible(&shown.triangle, pane, (nearest, plane), near, least, draw);
    }
}
