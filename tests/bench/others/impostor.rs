//! Impostors: pictures from many directions, of which a shader shows those nearest to the eye's.
//!
//! Minimal bakers of our own that bake and show what add-ons for three.js and Godot do, not those
//! add-ons. Two kinds: eight azimuths at the horizon on an upright quad that turns about the trunk, and
//! 16 x 16 directions of a hemisphere or of the whole sphere, by an octahedron (Engelhardt and
//! Dachsbacher, "Octahedron environment maps", 2008; Brucks, "Octahedral impostors", 2018): the line
//! of sight is cut with the plane of each picture. Lengths are normalised units.

use glam::{Vec2, Vec3};
use pleach::botany::Model;
use pleach::space::raster::Camera;
use rayon::prelude::*;

use crate::octahedron::{direction, nearest_three};
use crate::paint::{Painter, facing};

/// Directions along each side of the octahedron's square.
pub const GRID: u32 = 16;
/// Azimuths of the other kind.
const AZIMUTHS: u32 = 8;

/// From where pictures are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Eight azimuths at the horizon.
    Azimuths,
    /// 16 x 16 directions of the upper hemisphere.
    Hemisphere,
    /// 16 x 16 directions of the sphere.
    Sphere,
}

/// A baked impostor.
pub struct Impostor {
    /// Where its pictures were taken from.
    pub kind: Kind,
    /// Width and height of a picture, texels.
    pub size: [u32; 2],
    /// What a picture shows: half its width and height.
    half: Vec2,
    /// Height of its middle.
    middle: f32,
    /// Straight RGBA.
    pub frames: Vec<Vec<u8>>,
}

impl Kind {
    /// Pictures along the sides of the page.
    pub fn grid(self) -> [u32; 2] {
        match self {
            Self::Azimuths => [AZIMUTHS / 2, 2],
            Self::Hemisphere | Self::Sphere => [GRID; 2],
        }
    }

    /// Unit vector towards the eye of a picture.
    pub fn towards_eye(self, frame: u32) -> Vec3 {
        match self {
            Self::Azimuths => {
                let (sin, cos) = (frame as f32 * 45.0_f32.to_radians()).sin_cos();
                Vec3::new(sin, 0.0, cos)
            }
            Self::Hemisphere | Self::Sphere => direction(frame, GRID, self == Self::Sphere),
        }
    }

    /// Pictures that a shader shows from this direction, and their weights (sum one).
    fn shown(self, towards_eye: Vec3) -> [(u32, f32); 3] {
        match self {
            Self::Azimuths => {
                let turn = towards_eye.x.atan2(towards_eye.z) / 360.0_f32.to_radians();
                let at = turn.rem_euclid(1.0) * AZIMUTHS as f32;
                let (first, part) = (at as u32, at.fract());
                let frame = |i: u32| i % AZIMUTHS;
                [
                    (frame(first), 1.0 - part),
                    (frame(first + 1), part),
                    (0, 0.0),
                ]
            }
            Self::Hemisphere | Self::Sphere => {
                nearest_three(towards_eye, GRID, self == Self::Sphere)
            }
        }
    }
}

/// The middle, half width and half height of what pictures show.
fn extent(model: &Model, kind: Kind) -> (f32, Vec2) {
    if kind != Kind::Azimuths {
        return (0.0, Vec2::ONE);
    }
    let used = model.triangles.as_flattened().iter();
    let (mut low, mut high, mut wide) = (f32::MAX, f32::MIN, 0.0f32);
    for p in used.map(|&i| model.positions[i as usize]) {
        (low, high) = (low.min(p.y), high.max(p.y));
        wide = wide.max(Vec2::new(p.x, p.z).length());
    }
    (0.5 * (low + high), Vec2::new(wide, 0.5 * (high - low)))
}

/// Takes all pictures; together they have at most so many texels, and are as fine along both sides.
pub fn bake(model: &Model, kind: Kind, texels: u64) -> Impostor {
    bake_some(model, kind, texels, |_| true)
}

/// As [`bake`]; pictures that are not wanted are empty.
fn bake_some(
    model: &Model,
    kind: Kind,
    texels: u64,
    wanted: impl Fn(u32) -> bool + Sync,
) -> Impostor {
    let (middle, half) = extent(model, kind);
    let [columns, rows] = kind.grid();
    let each = texels as f32 / (columns * rows) as f32;
    let density = (each / (4.0 * half.x * half.y)).sqrt();
    let size = (half * 2.0 * density).to_array().map(|s| (s as u32).max(1));
    let painter = Painter::new(model);
    let frames = (0..columns * rows).into_par_iter().map(|frame| {
        if !wanted(frame) {
            return vec![0; size[0] as usize * size[1] as usize * 4];
        }
        let camera = eye(kind.towards_eye(frame), middle);
        let camera = facing(camera.origin, [camera.forward, camera.up], density, size);
        painter.paint(&camera, None)
    });
    Impostor {
        kind,
        size,
        half: Vec2::new(size[0] as f32, size[1] as f32) / (2.0 * density),
        middle,
        frames: frames.collect(),
    }
}

/// A camera of a picture: only its axes and middle matter.
fn eye(towards_eye: Vec3, middle: f32) -> Camera {
    let up = if towards_eye.y.abs() > 0.999 {
        Vec3::NEG_Z
    } else {
        Vec3::Y
    };
    facing(Vec3::Y * middle, [-towards_eye, up], 1.0, [1, 1])
}

/// A picture as a shader reads it from one direction.
pub struct Layer<'i> {
    impostor: &'i Impostor,
    alpha: &'i [u8],
    weight: f32,
    /// Axes and middle of the plane that the line of sight is cut with.
    plane: Camera,
}

impl Impostor {
    /// What the shader reads where the eye is in this direction: the nearest picture, or a blend.
    pub fn layers(&self, towards_eye: Vec3, blend: bool) -> Vec<Layer<'_>> {
        let mut shown = self.kind.shown(towards_eye).to_vec();
        // The first of the heaviest.
        shown.sort_by(|a, b| b.1.total_cmp(&a.1));
        if !blend {
            shown.truncate(1);
            shown[0].1 = 1.0;
        }
        shown.retain(|s| s.1 > 0.0);
        let layer = |(frame, weight): (u32, f32)| Layer {
            impostor: self,
            alpha: &self.frames[frame as usize],
            weight,
            plane: eye(self.facing(frame, towards_eye), self.middle),
        };
        shown.into_iter().map(layer).collect()
    }

    /// The normal of the plane on which a picture is shown: the quad that turns about the trunk, or the
    /// picture's own plane.
    fn facing(&self, frame: u32, towards_eye: Vec3) -> Vec3 {
        match self.kind {
            Kind::Azimuths => Vec3::new(towards_eye.x, 0.0, towards_eye.z).normalize_or(Vec3::Z),
            Kind::Hemisphere | Kind::Sphere => self.kind.towards_eye(frame),
        }
    }
}

impl Layer<'_> {
    /// Its part of the opacity that is seen along a line of sight, 0 to 1.
    pub fn opacity(&self, from: Vec3, along: Vec3) -> f32 {
        let (plane, impostor) = (&self.plane, self.impostor);
        let slope = along.dot(plane.forward);
        if slope.abs() < 1e-4 {
            return 0.0;
        }
        let from = from - plane.origin;
        let at = from - along * (from.dot(plane.forward) / slope);
        let (x, y) = (
            at.dot(plane.right) / impostor.half.x,
            at.dot(plane.up) / impostor.half.y,
        );
        if x.abs() >= 1.0 || y.abs() >= 1.0 {
            return 0.0;
        }
        let [width, height] = impostor.size;
        let at = Vec2::new(
            (0.5 + 0.5 * x) * width as f32,
            (0.5 - 0.5 * y) * height as f32,
        ) - 0.5;
        self.weight * self.bilinear(at)
    }

    fn bilinear(&self, at: Vec2) -> f32 {
        let [width, height] = self.impostor.size;
        let low = at.floor();
        let part = at - low;
        let texel = |x: f32, y: f32| {
            let x = (x.max(0.0) as u32).min(width - 1);
            let y = (y.max(0.0) as u32).min(height - 1);
            f32::from(self.alpha[(y * width + x) as usize * 4 + 3])
        };
        let row = |y: f32| texel(low.x, y) + (texel(low.x + 1.0, y) - texel(low.x, y)) * part.x;
        (row(low.y) + (row(low.y + 1.0) - row(low.y)) * part.y) / 255.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::shown;
    use crate::sample::palm;
    use pleach::report::{Drawable, Reference};
    use pleach::space::view::{Lens, View};

    /// F1 of an impostor from one direction, its pictures far finer than the view.
    fn f1(model: &Model, kind: Kind, towards_eye: Vec3) -> f64 {
        let view = View {
            name: "one".into(),
            azimuth_deg: towards_eye.x.atan2(towards_eye.z).to_degrees(),
            elevation_deg: towards_eye.y.asin().to_degrees(),
        };
        let shown_here = kind.shown(towards_eye);
        let wanted = |frame| shown_here.iter().any(|s| s.0 == frame);
        let texels = 512 * 512 * u64::from(kind.grid()[0] * kind.grid()[1]);
        let impostor = bake_some(model, kind, texels, wanted);
        // Along parallel lines, as it was baked.
        let drawable = Drawable::silhouette(model);
        let reference = Reference::of(&drawable, model, &[view], Lens::Parallel, 128);
        let compared = reference.compare_drawn(|camera| shown(&impostor, camera, true));
        compared.f1.mean
    }

    #[test]
    fn a_direction_that_was_baked_shows_the_original() {
        let model = palm();
        for (kind, frame) in [
            (Kind::Azimuths, 3),
            (Kind::Hemisphere, 17),
            (Kind::Hemisphere, 120),
            (Kind::Sphere, 200),
        ] {
            let found = f1(&model, kind, kind.towards_eye(frame));
            assert!(found > 0.98, "{kind:?} frame {frame}: {found}");
        }
    }

    #[test]
    fn between_directions_it_is_worse_but_still_the_tree() {
        let model = palm();
        for (kind, frame) in [
            (Kind::Azimuths, 1),
            (Kind::Hemisphere, 120),
            (Kind::Sphere, 120),
        ] {
            let between = (kind.towards_eye(frame) + kind.towards_eye(frame + 1)).normalize();
            let found = f1(&model, kind, between);
            assert!(found > 0.3 && found < 0.97, "{kind:?}: {found}");
        }
    }
}
