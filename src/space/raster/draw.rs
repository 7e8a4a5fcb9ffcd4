//! The nearest triangle of every sample.

use super::front::{EMPTY, Front};
use super::pane::Panes;
use super::{Camera, Sampling, Scene};

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
        for y in 0..pane.height() {
            let row = (pane.y[0] as usize + y) * size[0] as usize + pane.x[0] as usize;
            for x in 0..pane.width() {
                let (item, near) = front.at([x, y]);
                items.triangle[row + x] = ids.get(item as usize).copied().unwrap_or(EMPTY);
                items.near[row + x] = near;
            }
        }
    }
    items
}
