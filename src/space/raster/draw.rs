//! The nearest triangle of every sample.

use super::camera::Corner;
use super::triangle::{Plane, Triangle};
use super::{Camera, Material, Mips, Sampling, Scene, Texture};

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
    for (id, indices) in scene.geometry.triangles.iter().enumerate() {
        let material = scene.material(id);
        let at: [Corner; 3] = indices.map(|i| corners[i as usize]);
        let Some(triangle) = Triangle::new(at, material.double_sided) else {
            continue;
        };
        let mut fragment = None;
        let mut depth = None;
        triangle.scan(width, height, |y, from, to| {
            let depth = depth.get_or_insert_with(|| triangle.near_plane(at));
            let row = y as usize * width as usize;
            for x in from..to {
                let sample = row + x as usize;
                let here = depth.value(x, y);
                if here <= near[sample] {
                    continue;
                }
                let seen = material.cutoff.is_none()
                    || fragment
                        .get_or_insert_with(|| {
                            Fragment::new(scene, material, indices, &at, &triangle, sampling)
                        })
                        .passes(x, y);
                if seen {
                    near[sample] = here;
                    items[sample] = id as u32;
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

/// What the texture of one triangle gives at its samples.
pub(super) struct Fragment<'a> {
    texture: Option<&'a Texture>,
    material: &'a Material,
    u: Plane,
    v: Plane,
    q: Plane,
    /// The level of the whole triangle, where lines of sight are parallel.
    lod: Option<f32>,
    mips: Mips,
    /// Vertex alpha, where vertices have colours.
    alpha: Option<Plane>,
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
        let q = corners.map(|c| c.q);
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

    /// Texture coordinates, level and one over q at a sample.
    fn at(&self, x: i32, y: i32) -> ([f32; 2], f32) {
        let (u, v) = (self.u.value(x, y), self.v.value(x, y));
        match self.lod {
            Some(lod) if self.q.dx == 0.0 && self.q.dy == 0.0 => {
                let q = self.q.value(x, y);
                ([u / q, v / q], lod)
            }
            lod => {
                let q = self.q.value(x, y);
                let (u, v) = (u / q, v / q);
                ([u, v], lod.unwrap_or_else(|| self.level(u, v, q)))
            }
        }
    }

    /// Alpha test.
    pub fn passes(&self, x: i32, y: i32) -> bool {
        let mut alpha = self.material.factor[3];
        if let Some(texture) = self.texture {
            let (uv, lod) = self.at(x, y);
            alpha *= texture.alpha(uv, lod, self.material.wrap, self.material.linear);
        }
        if let Some(plane) = &self.alpha {
            alpha *= plane.value(x, y) / self.q.value(x, y);
        }
        self.material.cutoff.is_none_or(|cutoff| alpha >= cutoff)
    }

    /// Linear base colour without vertex colours.
    pub fn albedo(&self, x: i32, y: i32) -> [f32; 3] {
        let [r, g, b, _] = self.material.factor;
        match self.texture {
            None => [r, g, b],
            Some(texture) => {
                let (uv, lod) = self.at(x, y);
                let [tr, tg, tb] = texture.rgb(uv, lod, self.material.wrap, self.material.linear);
                [r * tr, g * tg, b * tb]
            }
        }
    }
}
