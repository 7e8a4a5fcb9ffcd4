//! Normal maps: which way a surface looks within a triangle.

use glam::{Vec2, Vec3};
use wide::f32x4;

use super::Scene;
use super::camera::Corner;
use super::fragment::divisors;
use super::level::Wrap;
use super::triangle::{Plane, Triangle};

/// A material's normal map (glTF: tangent space, x to the right and y to the top of the image).
#[derive(Clone, Copy, Debug)]
pub struct Relief<'a> {
    /// Straight RGBA, rows from the top.
    pub rgba: &'a [u8],
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// What happens outside 0..1 along u and v.
    pub wrap: [Wrap; 2],
    /// Which set of texture coordinates addresses it: 0 or 1.
    pub uv_set: u8,
    /// Scale of x and y.
    pub scale: f32,
}

/// The normal map on one triangle.
pub(super) struct Bumps<'a> {
    relief: &'a Relief<'a>,
    u: Plane,
    v: Plane,
    /// Where u grows, in model space.
    along: Vec3,
    /// Where v falls: the image's top.
    up: Vec3,
    /// Both on the surface, where its normal is one.
    axes: Option<[Vec3; 2]>,
}

impl<'a> Bumps<'a> {
    /// `None` where texture coordinates don't vary over the triangle; `normal` is its front's, where
    /// that does not vary.
    pub fn new(
        relief: &'a Relief<'a>,
        scene: &Scene,
        indices: &[u32; 3],
        corners: [Corner; 3],
        triangle: &Triangle,
        normal: Option<Vec3>,
    ) -> Option<Self> {
        let uvs = scene.geometry.uvs[relief.uv_set.min(1) as usize];
        if uvs.is_empty() {
            return None;
        }
        let [a, b, c] = indices.map(|i| i as usize);
        let (s, t) = (uvs[b] - uvs[a], uvs[c] - uvs[a]);
        let turn = s.perp_dot(t);
        if turn == 0.0 {
            return None;
        }
        let positions = scene.geometry.positions;
        let (p, r) = (positions[b] - positions[a], positions[c] - positions[a]);
        let q = divisors(&corners);
        let over = |axis: usize| {
            triangle.plane(std::array::from_fn(|i| {
                uvs[indices[i] as usize][axis] * q[i]
            }))
        };
        let mut bumps = Self {
            relief,
            u: over(0),
            v: over(1),
            along: (p * t.y - r * s.y) * turn.signum(),
            up: (p * t.x - r * s.x) * turn.signum(),
            axes: None,
        };
        bumps.axes = normal.map(|normal| bumps.axes_under(normal));
        Some(bumps)
    }

    /// The mapped normal at a place, where `normal` is the unit normal of the triangle's front and
    /// texture coordinates are divided by `q`.
    #[inline]
    pub fn at(&self, at: [f32; 2], q: f32, normal: Vec3) -> Vec3 {
        let uv = Vec2::new(self.u.at(at), self.v.at(at)) / q;
        let [r, g, b] = self.relief.texel(uv);
        let [tangent, bitangent] = self.axes.unwrap_or_else(|| self.axes_under(normal));
        let scale = self.relief.scale;
        (tangent * (r * scale) + bitangent * (g * scale) + normal * b).normalize_or(normal)
    }

    /// Where the image's right and top are on a surface with this normal.
    fn axes_under(&self, normal: Vec3) -> [Vec3; 2] {
        let tangent = (self.along - normal * normal.dot(self.along)).normalize_or_zero();
        let bitangent = normal.cross(tangent);
        match bitangent.dot(self.up) < 0.0 {
            true => [tangent, -bitangent],
            false => [tangent, bitangent],
        }
    }
}

impl Relief<'_> {
    /// The base level, bilinear; each channel from -1 to 1.
    fn texel(&self, uv: Vec2) -> [f32; 3] {
        let place = |coordinate: f32, size: u32, wrap: Wrap| {
            let at = (coordinate * size as f32 - 0.5).clamp(-1e9, 1e9);
            // `floor` is a call into the C library on plain x86-64.
            let whole = at as i32;
            let low = whole - i32::from(whole as f32 > at);
            let texels = match low >= 0 && low + 1 < size as i32 {
                true => [low as usize, low as usize + 1],
                false => [wrap.apply(low, size), wrap.apply(low + 1, size)],
            };
            (texels, f32x4::splat(at - low as f32))
        };
        let ([left, right], across) = place(uv.x, self.width, self.wrap[0]);
        let ([above, below], down) = place(uv.y, self.height, self.wrap[1]);
        let value = |row: usize, column: usize| {
            let at = (row * self.width as usize + column) * 4;
            let [r, g, b] = [self.rgba[at], self.rgba[at + 1], self.rgba[at + 2]];
            f32x4::new([f32::from(r), f32::from(g), f32::from(b), 0.0])
        };
        let row = |row: usize| {
            let (a, b) = (value(row, left), value(row, right));
            a + (b - a) * across
        };
        let (top, bottom) = (row(above), row(below));
        let mixed = (top + (bottom - top) * down) / f32x4::splat(127.5) - f32x4::ONE;
        let [r, g, b, _] = mixed.to_array();
        [r, g, b]
    }
}
