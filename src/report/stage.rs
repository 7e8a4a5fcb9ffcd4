//! Draws models of different files into one window: the same pixels for all of them.

use glam::{Vec2, Vec3};

use super::drawable::Drawable;
use crate::botany::Model;
use crate::space::raster::{
    Camera, Geometry, Layers, Light, Placement, Relief, Sampling, Scene, draw,
};
use crate::space::view::View;

/// Heights of the tree in pixels above which a pixel gets 4 samples instead of 16.
const LARGE_PX: u32 = 256;

/// How trees of this height are drawn in colour: samples cost time by the square of the height, and
/// sizes under the first are made of its pixels, with four times as many samples at each step.
pub fn sampling(height_px: u32) -> Sampling {
    Sampling {
        side: if height_px > LARGE_PX {
            2
        } else {
            Sampling::REFERENCE.side
        },
        ..Sampling::REFERENCE
    }
}

/// A model with all that drawing it in colour needs.
pub struct Actor<'m> {
    drawable: Drawable<'m>,
    /// Into the original's normalised space.
    place: Placement,
    /// Corners in that space.
    points: Vec<Vec3>,
}

impl<'m> Actor<'m> {
    /// Makes a model ready; `original` states the space.
    pub fn new(model: &'m Model, original: &Model) -> Self {
        let drawable = Drawable::shaded(model);
        let place = drawable.placement_in(original.frame);
        let mut used = vec![false; model.positions.len()];
        for &corner in model.triangles.as_flattened() {
            used[corner as usize] = true;
        }
        let corners = model.positions.iter().zip(used).filter(|(_, used)| *used);
        Self {
            points: corners
                .map(|(&p, _)| p * place.scale + place.offset)
                .collect(),
            drawable,
            place,
        }
    }

    /// Lit, supersampled.
    pub fn layers(&self, camera: &Camera, sampling: Sampling) -> Layers {
        let scene = self.drawable.scene();
        let (triangles, triangle_material) = front_to_back(&scene.geometry, camera.forward);
        let scene = Scene {
            geometry: Geometry {
                triangles: &triangles,
                triangle_material: &triangle_material,
                ..scene.geometry
            },
            ..scene
        };
        let camera = camera.placed(self.place);
        let reliefs: Vec<Option<Relief>> = self.drawable.reliefs();
        draw(&scene, &camera, sampling).layers(&scene, &camera, sampling, Light::Outdoors, &reliefs)
    }
}

/// Triangles and their materials, nearest first: what is hidden then fails the cheap test of depth
/// before the dear one of alpha.
fn front_to_back(geometry: &Geometry, forward: Vec3) -> (Vec<[u32; 3]>, Vec<u32>) {
    let far = |corners: &[u32; 3]| {
        corners
            .iter()
            .map(|&i| geometry.positions[i as usize].dot(forward))
            .sum::<f32>()
    };
    let mut order: Vec<(f32, u32)> = geometry.triangles.iter().map(far).zip(0..).collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let material = |t: u32| geometry.triangle_material.get(t as usize).copied();
    order
        .iter()
        .map(|&(_, t)| (geometry.triangles[t as usize], material(t).unwrap_or(0)))
        .unzip()
}

/// A part of the picture plane in pixels, seen from its middle; y points down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    left: i32,
    top: i32,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
}

impl Window {
    /// The least window of multiples of `grain` pixels that shows all of the actors from all of
    /// the views, with at least a pixel of ground around them at the coarsest size; no more than
    /// [`View::camera`] shows. `height` is the tree's, `height_px` that in pixels.
    pub fn around(
        actors: &[Actor],
        views: &[&View],
        height: f32,
        height_px: u32,
        grain: u32,
    ) -> Self {
        let (mut low, mut high) = (Vec2::MAX, Vec2::MIN);
        let mut reach = 0.0f32;
        for view in views {
            let camera = view.camera(height, height_px);
            reach = reach.max(camera.width as f32 / 2.0);
            for p in actors.iter().flat_map(|a| &a.points) {
                let at = Vec2::new(p.dot(camera.right), -p.dot(camera.up)) * camera.pixels;
                (low, high) = (low.min(at), high.max(at));
            }
        }
        let grain = grain as i32;
        let ends = |low: f32, high: f32| {
            let (low, high) = if low <= high {
                (low.max(-reach), high.min(reach))
            } else {
                (0.0, 0.0)
            };
            let from = (low.floor() as i32 - 1).div_euclid(grain) * grain - grain;
            let to = (high.ceil() as i32 + 1 + grain - 1).div_euclid(grain) * grain + grain;
            (from, (to - from).max(2 * grain) as u32)
        };
        let (left, width) = ends(low.x, high.x);
        let (top, height) = ends(low.y, high.y);
        Self {
            left,
            top,
            width,
            height,
        }
    }

    /// The view's camera on this window.
    pub fn camera(self, view: &View, height: f32, height_px: u32) -> Camera {
        Camera {
            width: self.width,
            height: self.height,
            shift: Vec2::new(
                -self.left as f32 - self.width as f32 / 2.0,
                -self.top as f32 - self.height as f32 / 2.0,
            ),
            ..view.camera(height, height_px)
        }
    }
}
