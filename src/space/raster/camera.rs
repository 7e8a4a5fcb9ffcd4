//! Cameras: from model space to snapped sample coordinates.

use glam::{DVec3, Vec2, Vec3};
use wide::{f32x4, i32x4};

/// A similarity that puts a model into the space that the camera looks at: `offset + scale * p`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Uniform scale.
    pub scale: f32,
    /// Where the model's origin goes.
    pub offset: Vec3,
}

impl Placement {
    /// The model as it is.
    pub const IDENTITY: Self = Self {
        scale: 1.0,
        offset: Vec3::ZERO,
    };

    /// From one normalised space (`world = center + radius * p`) into another.
    pub fn between(center: DVec3, radius: f64, to_center: DVec3, to_radius: f64) -> Self {
        Self {
            scale: (radius / to_radius) as f32,
            offset: ((center - to_center) / to_radius).as_vec3(),
        }
    }
}

/// Where the eye is and how large a picture it takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Unit vector to the right of the picture.
    pub right: Vec3,
    /// Unit vector to the top of the picture.
    pub up: Vec3,
    /// Unit vector into the picture.
    pub forward: Vec3,
    /// Orthographic: the point in the middle of the picture. Perspective: the eye.
    pub origin: Vec3,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Orthographic: pixels for a unit of length. Perspective: focal length in pixels.
    pub pixels: f32,
    /// Whether lines of sight meet in `origin`.
    pub perspective: bool,
    /// Moves the picture's content by so many pixels, to the right and down.
    pub shift: Vec2,
    /// How the model is placed before it is looked at.
    pub placement: Placement,
}

impl Camera {
    /// An orthographic camera that looks along `forward` at `center`.
    ///
    /// `up` need not be perpendicular to `forward`, but must not be parallel to it.
    pub fn orthographic(
        forward: Vec3,
        up: Vec3,
        center: Vec3,
        pixels_per_unit: f32,
        width: u32,
        height: u32,
    ) -> Self {
        let forward = forward.normalize_or(Vec3::NEG_Z);
        let right = forward.cross(up).normalize_or(Vec3::X);
        Self {
            right,
            up: right.cross(forward),
            forward,
            origin: center,
            width,
            height,
            pixels: pixels_per_unit,
            perspective: false,
            shift: Vec2::ZERO,
            placement: Placement::IDENTITY,
        }
    }

    /// A perspective camera at `eye` that looks at `target`; `fov_y` is the full vertical angle in radians.
    pub fn perspective(
        eye: Vec3,
        target: Vec3,
        up: Vec3,
        fov_y: f32,
        width: u32,
        height: u32,
    ) -> Self {
        Self {
            origin: eye,
            pixels: 0.5 * height as f32 / (0.5 * fov_y).tan(),
            perspective: true,
            ..Self::orthographic(target - eye, up, eye, 1.0, width, height)
        }
    }

    /// The same camera on a model that lies elsewhere.
    pub fn placed(self, placement: Placement) -> Self {
        Self { placement, ..self }
    }

    /// The same camera, the picture's content moved to the right and down.
    pub fn shifted(self, right_px: f32, down_px: f32) -> Self {
        Self {
            shift: Vec2::new(right_px, down_px),
            ..self
        }
    }

    /// Where a point of the space that is looked at lies in the picture, in pixels to the right of
    /// and below what `origin` or the line of sight through it shows, before any shift; `None`
    /// behind the eye.
    pub fn on_picture(&self, point: Vec3) -> Option<Vec2> {
        let p = point - self.origin;
        let magnify = match self.perspective {
            true => self.pixels / Some(p.dot(self.forward)).filter(|&z| z >= NEAR)?,
            false => self.pixels,
        };
        Some(Vec2::new(p.dot(self.right), -p.dot(self.up)) * magnify)
    }

    /// Length along the line of sight through a place of the picture (pixels from the middle) for
    /// a unit of length along `forward`.
    pub(super) fn slant(&self, place: Vec2) -> f32 {
        if self.perspective {
            (1.0 + place.length_squared() / (self.pixels * self.pixels)).sqrt()
        } else {
            1.0
        }
    }

    /// Projects model-space points to a grid of `side` samples a pixel, four at a time.
    pub(super) fn project(&self, points: &[Vec3], side: u32) -> Vec<Corner> {
        let mut corners = Vec::with_capacity(points.len());
        let (fours, rest) = points.as_chunks::<4>();
        for four in fours {
            corners.extend(self.project_four(four, side));
        }
        if let Some(&last) = rest.last() {
            let four = std::array::from_fn(|i| *rest.get(i).unwrap_or(&last));
            corners.extend(&self.project_four(&four, side)[..rest.len()]);
        }
        corners
    }

    #[inline]
    fn project_four(&self, points: &[Vec3; 4], side: u32) -> [Corner; 4] {
        let splat = f32x4::splat;
        let scale = splat(side as f32 * SUBSAMPLES as f32);
        let middle = Vec2::new(self.width as f32, self.height as f32) * 0.5 + self.shift;
        // Placement and axes in one: coordinate = dot(axis, p) * scale + constant.
        let at = self.placement.offset - self.origin;
        let k = splat(self.placement.scale);
        let [a, b, c, d] = points;
        let x = f32x4::new([a.x, b.x, c.x, d.x]) * k + splat(at.x);
        let y = f32x4::new([a.y, b.y, c.y, d.y]) * k + splat(at.y);
        let z = f32x4::new([a.z, b.z, c.z, d.z]) * k + splat(at.z);
        let along = |axis: Vec3| x * splat(axis.x) + y * splat(axis.y) + z * splat(axis.z);
        let (x, y, z) = (along(self.right), -along(self.up), along(self.forward));
        let one = f32x4::ONE;
        let (magnify, q, near) = match self.perspective {
            true => (splat(self.pixels) / z, one / z, one / z),
            false => (splat(self.pixels), one, -z),
        };
        let x = (splat(middle.x) + x * magnify) * scale;
        let y = (splat(middle.y) + y * magnify) * scale;
        let limit = splat(LIMIT);
        let mut inside = x.abs().simd_lt(limit).to_bitmask() & y.abs().simd_lt(limit).to_bitmask();
        if self.perspective {
            inside &= z.simd_ge(splat(NEAR)).to_bitmask();
        }
        // Half up, as graphics processors do.
        let [xs, ys] = [x, y].map(|at| floor(at + f32x4::HALF).to_array());
        let [nears, qs] = [near, q].map(f32x4::to_array);
        let mut corners = [Corner::OUTSIDE; 4];
        for (i, corner) in corners.iter_mut().enumerate() {
            if inside >> i & 1 == 1 {
                *corner = Corner {
                    x: xs[i],
                    y: ys[i],
                    near: nears[i],
                    q: qs[i],
                };
            }
        }
        corners
    }
}

/// Rounds down; what lies beyond 32 bits has no answer.
#[inline]
pub(super) fn floor(value: f32x4) -> i32x4 {
    let whole = value.fast_trunc_int();
    let above = f32x4::from_i32x4(whole).simd_gt(value) & f32x4::ONE;
    whole - above.fast_trunc_int()
}

/// Corners are snapped to this part of a sample, as graphics processors do (8 bits).
pub(super) const SUBSAMPLES: i32 = 256;
/// Nearest distance of a perspective camera, in units of length; what reaches nearer is dropped.
const NEAR: f32 = 1e-4;
/// Corners farther out than this (in sub-samples) are dropped with their triangles, so that edge
/// functions stay far inside 64 bits.
const LIMIT: f32 = (1u32 << 29) as f32;

/// A projected corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// In sub-samples from the left.
    pub x: i32,
    /// In sub-samples from the top.
    pub y: i32,
    /// Grows towards the eye and is linear on the screen.
    pub near: f32,
    /// One over the distance along `forward` (perspective) or one.
    pub q: f32,
}

impl Corner {
    const OUTSIDE: Self = Self {
        x: i32::MIN,
        y: i32::MIN,
        near: 0.0,
        q: 0.0,
    };

    pub fn is_outside(&self) -> bool {
        self.x == i32::MIN
    }
}
