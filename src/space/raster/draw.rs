//! The nearest triangle of every sample.

use super::seen::seen;
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
    for shown in seen(scene, &corners, CENTER) {
        let mut fragment = None;
        let mut depth = None;
        shown.triangle.scan(width, height, |y, from, to| {
            let depth = depth.get_or_insert_with(|| shown.triangle.near_plane(shown.corners));
            let row = y as usize * width as usize;
            for x in from..to {
                let sample = row + x as usize;
                let here = depth.value(x, y);
                if here <= near[sample] {
                    continue;
                }
                let seen = shown.material.cutoff.is_none()
                    || fragment
                        .get_or_insert_with(|| shown.fragment(scene, sampling))
                        .passes(x, y);
                if seen {
                    near[sample] = here;
                    items[sample] = shown.id as u32;
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
