//! Draws models of different files into one window: the same pixels for all of them.

use glam::{Vec2, Vec3};

use super::drawable::Drawable;
use crate::botany::Model;
use crate::space::raster::{
    Camera, Coverage, Geometry, Layers, Mask, Placement, Relief, Sampling, Scene, Tone, coverage,
    coverage_multisampled, layers, tone,
};
use crate::space::view::{Lens, View};

/// Lines of samples that a tree is drawn with at least: in fewer, where a silhouette is half of a
/// pixel depends on where the samples happen to lie (level 1 of an airy birch at 32 pixels: F1 .91
/// with 16 samples a pixel, .97 with 1,024).
const LEAST_SAMPLES: u32 = 512;

/// Slices that triangles are sorted into from near to far. Of 444,633 triangles 4,096 slices take a quarter longer to
/// draw at 128 pixels and a twentieth at 512.
const SLICES: usize = 64;

/// The samples of a picture in which the tree is so high, pixels: 4 x 4 a pixel, more in small ones.
pub fn sampling(height_px: u32) -> Sampling {
    let side = LEAST_SAMPLES.div_ceil(height_px.max(1)).next_power_of_two();
    Sampling {
        side: side.clamp(Sampling::REFERENCE.side, 64),
        ..Sampling::REFERENCE
    }
}

/// A model with all that drawing it needs.
pub struct Actor<'m> {
    drawable: Drawable<'m>,
    /// Into the original's normalised space.
    place: Placement,
    /// Corners in that space.
    points: Vec<Vec3>,
}

/// Triangles and their materials, as a view draws them.
pub struct Order {
    triangles: Vec<[u32; 3]>,
    materials: Vec<u32>,
}

impl<'m> Actor<'m> {
    /// Makes a model ready, also for `colors`; `original` states the space.
    pub fn new(model: &'m Model, original: &Model, colors: bool) -> Self {
        let drawable = match colors {
            true => Drawable::shaded(model),
            false => Drawable::silhouette(model),
        };
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

    /// Nearest triangles first, as seen along `forward`: what is hidden then fails the cheap test of
    /// depth before the dear one of alpha. Sorted into slices, which is enough for that; within one they stay in
    /// the file's order, where neighbours share what is in the caches.
    pub fn front_to_back(&self, forward: Vec3) -> Order {
        let geometry = self.drawable.scene().geometry;
        let depths: Vec<f32> = geometry
            .triangles
            .iter()
            .map(|t| {
                let corner = |&i: &u32| geometry.positions[i as usize].dot(forward);
                t.iter().map(corner).sum()
            })
            .collect();
        let ends = |ends: (f32, f32), &d: &f32| (ends.0.min(d), ends.1.max(d));
        let (near, far) = depths.iter().fold((f32::MAX, f32::MIN), ends);
        let per_depth = (SLICES - 1) as f32 / (far - near).max(f32::MIN_POSITIVE);
        let slice = |depth: f32| (((depth - near) * per_depth) as usize).min(SLICES - 1);
        let mut next = vec![0u32; SLICES + 1];
        for &depth in &depths {
            next[slice(depth) + 1] += 1;
        }
        for i in 0..SLICES {
            next[i + 1] += next[i];
        }
        let mut order = Order {
            triangles: vec![[0; 3]; depths.len()],
            materials: vec![0; depths.len()],
        };
        for (t, &depth) in depths.iter().enumerate() {
            let at = &mut next[slice(depth)];
            order.triangles[*at as usize] = geometry.triangles[t];
            order.materials[*at as usize] = geometry.triangle_material[t];
            *at += 1;
        }
        order
    }

    /// Lit, supersampled: which samples are hit, and what each pixel shows.
    pub fn layers(&self, camera: &Camera, sampling: Sampling, order: &Order) -> (Mask, Layers) {
        let scene = self.drawable.scene();
        let scene = Scene {
            geometry: Geometry {
                triangles: &order.triangles,
                triangle_material: &order.materials,
                ..scene.geometry
            },
            ..scene
        };
        let camera = camera.placed(self.place);
        let reliefs: Vec<Option<Relief>> = self.drawable.reliefs();
        layers(&scene, &camera, sampling, self.drawable.light(), &reliefs)
    }

    /// Where it is, supersampled.
    pub fn mask(&self, camera: &Camera, sampling: Sampling) -> Mask {
        let camera = camera.placed(self.place);
        coverage(&self.drawable.scene(), &camera, sampling)
    }

    /// Where it is, as an engine draws it.
    pub fn client(&self, camera: &Camera) -> Coverage {
        coverage_multisampled(&self.drawable.scene(), &camera.placed(self.place))
    }

    /// The base colour, without light, as an engine draws it: one sample a pixel, mips.
    pub fn base_color(&self, camera: &Camera) -> Tone {
        let camera = camera.placed(self.place);
        tone(&self.drawable.scene(), &camera, Sampling::CLIENT)
    }
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
    /// The least window that shows all of the actors from all of the `cameras`, with at least a
    /// pixel of ground around them; no more than these show themselves.
    pub fn around(actors: &[Actor], cameras: &[Camera]) -> Self {
        let (mut low, mut high) = (Vec2::MAX, Vec2::MIN);
        let mut reach = 0.0f32;
        for camera in cameras {
            reach = reach.max(camera.width as f32 / 2.0);
            for &p in actors.iter().flat_map(|a| &a.points) {
                if let Some(at) = camera.on_picture(p) {
                    (low, high) = (low.min(at), high.max(at));
                }
            }
        }
        let ends = |low: f32, high: f32| {
            let (low, high) = if low <= high {
                (low.max(-reach), high.min(reach))
            } else {
                (0.0, 0.0)
            };
            let (from, to) = (low.floor() as i32 - 2, high.ceil() as i32 + 2);
            (from, (to - from).max(2) as u32)
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

    /// A camera on this window.
    pub fn on(self, camera: Camera) -> Camera {
        Camera {
            width: self.width,
            height: self.height,
            shift: Vec2::new(
                -self.left as f32 - self.width as f32 / 2.0,
                -self.top as f32 - self.height as f32 / 2.0,
            ),
            ..camera
        }
    }

    /// Where one view through a lens shows the actors.
    pub fn of_view(
        actors: &[Actor],
        view: &View,
        (lens, height): (Lens, f32),
        height_px: u32,
    ) -> (Self, Camera) {
        let camera = view.camera_through(lens, height, height_px);
        let window = Self::around(actors, &[camera]);
        (window, window.on(camera))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::botany::grow::{Options, Species, grow};
    use crate::botany::load::load_slice;

    fn palm() -> Model {
        let options = Options {
            leaves: Some(100),
            ..Options::default()
        };
        let grown = grow(&Species::named("palm").unwrap(), &options).unwrap();
        load_slice(&grown.glb, "palm.glb".as_ref(), &Default::default()).unwrap()
    }

    #[test]
    fn every_triangle_is_drawn_once_and_nearer_slices_come_first() {
        let model = palm();
        let actor = Actor::new(&model, &model, true);
        let forward = Vec3::new(0.6, 0.0, -0.8);
        let order = actor.front_to_back(forward);
        let mut drawn = order.triangles.clone();
        let mut all = model.triangles.clone();
        drawn.sort_unstable();
        all.sort_unstable();
        assert_eq!(drawn, all);
        let depth = |t: &[u32; 3]| {
            let corner = |&i: &u32| model.positions[i as usize].dot(forward);
            t.iter().map(corner).sum::<f32>()
        };
        let mut before = order.triangles.iter().map(depth);
        let after = order.triangles[1..].iter().map(depth);
        // A slice is a part of at most six radii.
        let slice = 6.0 / (SLICES - 1) as f32;
        assert!(after.zip(&mut before).all(|(b, a)| a <= b + slice));
    }

    #[test]
    fn a_window_shows_what_the_whole_picture_shows_with_sixteen_samples_a_pixel() {
        let model = palm();
        let actors = [Actor::new(&model, &model, true)];
        let view = &crate::space::view::views(16, 11.0)[7];
        assert_eq!(
            [512, 300, 128, 64, 32].map(|px| sampling(px).side),
            [4, 4, 4, 8, 16]
        );
        for lens in [Lens::default(), Lens::Parallel] {
            let whole = view.camera_through(lens, model.height(), 300);
            let (window, camera) = Window::of_view(&actors, view, (lens, model.height()), 300);
            assert!(window.width < whole.width || window.height < whole.height);
            let area = actors[0].mask(&whole, sampling(300)).area();
            assert_eq!(actors[0].mask(&camera, sampling(300)).area(), area);
            let order = actors[0].front_to_back(camera.forward);
            let (mask, layers) = actors[0].layers(&camera, sampling(300), &order);
            assert_eq!(mask.coverage().fraction, layers.coverage);
            // Parts of sixteen, and not of four alone.
            let parts: Vec<f32> = layers.coverage.iter().map(|c| c * 16.0).collect();
            assert!(parts.iter().all(|p| p.fract() == 0.0));
            assert!(parts.iter().any(|p| p % 4.0 != 0.0));
            let sum: f64 = layers.coverage.iter().map(|&c| f64::from(c)).sum();
            assert!((sum - area).abs() < 1e-3 * area, "{sum} against {area}");
        }
    }
}
