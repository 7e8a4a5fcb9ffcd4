//! What the material of one triangle gives at its samples: alpha test and base colour.

use super::camera::{Corner, SUBSAMPLES};
use super::edges::TILE;
use super::level::{Address, UNIT};
use super::patch::Patch;
use super::texture::Texture;
use super::triangle::{Plane, Triangle};
use super::{Material, Mips, Sampling, Scene};

/// What the texture of one triangle gives at its samples.
pub(super) struct Fragment<'a> {
    texture: Option<&'a Texture>,
    material: &'a Material,
    u: Plane,
    v: Plane,
    q: Plane,
    /// The level of the whole triangle, where lines of sight are parallel or as good as that.
    lod: Option<f32>,
    mips: Mips,
    /// Vertex alpha, where vertices have colours.
    alpha: Option<Plane>,
}

/// Largest displacement of a texture, in samples. Corners are snapped to 1/256 of one.
const MOST_OFF: f32 = 1.0 / 32.0;

/// Whether a triangle is so small against its distance that one level of its texture is right for
/// all of it, within .02 levels: such a triangle's corners are `1 / q` away.
fn is_far(q: [f32; 3]) -> bool {
    let (low, high) = (q[0].min(q[1]).min(q[2]), q[0].max(q[1]).max(q[2]));
    high - low < low / 64.0
}

/// What texture coordinates are multiplied and divided by: one over the corners' distances, or ones
/// where the middle of the triangle moves by less than [`MOST_OFF`] samples without.
pub(super) fn divisors(corners: &[Corner; 3]) -> [f32; 3] {
    let [a, b, c] = corners;
    let q = corners.map(|c| c.q);
    let extent = |of: fn(&Corner) -> i32| {
        let [a, b, c] = [of(a), of(b), of(c)];
        a.max(b).max(c) as f32 - a.min(b).min(c) as f32
    };
    let samples = extent(|c| c.x).max(extent(|c| c.y)) / SUBSAMPLES as f32;
    let (low, high) = (q[0].min(q[1]).min(q[2]), q[0].max(q[1]).max(q[2]));
    // A straight line over n samples in which the divisor changes by the factor r is off by at most
    // about n |r - 1| / 4 of them.
    match samples * (high - low) <= 4.0 * MOST_OFF * low {
        true => [1.0; 3],
        false => q,
    }
}

impl<'a> Fragment<'a> {
    pub fn new(
        scene: &Scene<'a>,
        material: &'a Material,
        indices: &[u32; 3],
        corners: &[Corner; 3],
        triangle: &Triangle,
        sampling: Sampling,
    ) -> Self {
        let uvs = scene.geometry.uvs[material.uv_set.min(1) as usize];
        let texture = material
            .texture
            .filter(|_| !uvs.is_empty())
            .map(|i| &scene.textures[i as usize]);
        let q = divisors(corners);
        let flat = q == [1.0; 3];
        let mut fragment = Self {
            texture,
            material,
            u: Plane::default(),
            v: Plane::default(),
            q: triangle.plane(q),
            lod: None,
            mips: sampling.mips,
            alpha: None,
        };
        if texture.is_some() {
            let uv = indices.map(|i| uvs[i as usize]);
            fragment.u = triangle.plane(std::array::from_fn(|i| uv[i].x * q[i]));
            fragment.v = triangle.plane(std::array::from_fn(|i| uv[i].y * q[i]));
            if flat || sampling.mips == Mips::Base {
                fragment.lod = Some(fragment.level(0.0, 0.0, 1.0));
            } else if is_far(q) {
                let middle = |values: [f32; 3]| values.iter().sum::<f32>() / 3.0;
                let q = middle(q);
                let [u, v] = [uv.map(|uv| uv.x), uv.map(|uv| uv.y)].map(middle);
                fragment.lod = Some(fragment.level(u, v, q));
            }
        }
        let colors = scene.geometry.colors;
        if !colors.is_empty() {
            let alpha = std::array::from_fn(|i| colors[indices[i] as usize][3] * q[i]);
            fragment.alpha = Some(triangle.plane(alpha));
        }
        fragment
    }

    /// OpenGL's level of detail: the longer of a sample's two edges in texels, as a power of two.
    fn level(&self, u: f32, v: f32, q: f32) -> f32 {
        let (Some(texture), false) = (self.texture, self.mips == Mips::Base) else {
            return 0.0;
        };
        let (width, height) = texture.size();
        // Quotient rule: u = U/q, so du = (dU - u dq) / q.
        let edge = |du: f32, dv: f32, dq: f32| {
            let (s, t) = (
                (du - u * dq) / q * width as f32,
                (dv - v * dq) / q * height as f32,
            );
            s * s + t * t
        };
        let across = edge(self.u.dx, self.v.dx, self.q.dx);
        let down = edge(self.u.dy, self.v.dy, self.q.dy);
        let level = 0.5 * across.max(down).log2();
        match self.mips {
            Mips::Nearest => level.max(0.0).round(),
            _ => level.max(0.0),
        }
    }

    /// Whether nothing varies over the triangle but texture coordinates, and those linearly.
    fn is_flat(&self) -> bool {
        self.q.dx == 0.0 && self.q.dy == 0.0
    }

    /// Texture coordinates and level at a sample.
    fn at(&self, x: i32, y: i32) -> ([f32; 2], f32) {
        let (u, v) = (self.u.value(x, y), self.v.value(x, y));
        let (u, v, q) = if self.is_flat() {
            (u, v, 1.0)
        } else {
            let q = self.q.value(x, y);
            (u / q, v / q, q)
        };
        ([u, v], self.lod.unwrap_or_else(|| self.level(u, v, q)))
    }

    fn address(&self) -> Address {
        Address {
            wrap: self.material.wrap,
            linear: self.material.linear,
        }
    }

    /// Alpha test of one sample.
    pub fn passes(&self, x: i32, y: i32) -> bool {
        let mut alpha = self.material.factor[3];
        if let Some(texture) = self.texture {
            let (uv, lod) = self.at(x, y);
            alpha *= texture.mip(lod).alpha(uv, self.address());
        }
        if let Some(plane) = &self.alpha {
            alpha *= plane.value(x, y) / self.q.value(x, y);
        }
        self.material.cutoff.is_none_or(|cutoff| alpha >= cutoff)
    }

    /// Alpha test of the `open` samples of the tile that begins at a sample: bit `8 y + x`.
    pub fn test_tile(&self, first: [i32; 2], open: u64) -> u64 {
        let Some(cutoff) = self.material.cutoff else {
            return open;
        };
        match self.patch(first) {
            Some(patch) => {
                let factor = self.material.factor[3];
                patch.test(open, |alpha| factor * (alpha * UNIT) >= cutoff)
            }
            None => {
                let (mut left, mut passed) = (open, 0);
                while left != 0 {
                    let sample = left.trailing_zeros() as i32;
                    left &= left - 1;
                    let passes = self.passes(first[0] + sample % TILE, first[1] + sample / TILE);
                    passed |= u64::from(passes) << sample;
                }
                passed
            }
        }
    }

    /// Where the tile that begins at a sample reads its texture, where that is one level and nothing
    /// else tells alpha.
    #[inline]
    pub fn patch(&self, first: [i32; 2]) -> Option<Patch<'a>> {
        let mip = self.texture?.mip(self.lod?);
        (self.alpha.is_none() && mip.is_single()).then(|| Patch {
            level: mip.level(),
            address: self.address(),
            uv: [self.u, self.v],
            divisor: (!self.is_flat()).then_some(self.q),
            first,
        })
    }

    /// Linear base colour without vertex colours at a place where the divisor has this value.
    pub fn albedo(&self, at: [f32; 2], q: f32) -> [f32; 3] {
        let [r, g, b, _] = self.material.factor;
        let Some(texture) = self.texture else {
            return [r, g, b];
        };
        let uv = [self.u.at(at) / q, self.v.at(at) / q];
        let lod = self.lod.unwrap_or_else(|| self.level(uv[0], uv[1], q));
        let [tr, tg, tb] = texture.mip(lod).rgb(uv, self.address());
        [r * tr, g * tg, b * tb]
    }
}
