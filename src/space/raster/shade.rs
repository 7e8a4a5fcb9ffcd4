//! From an item buffer to pixels: base colour, light, normals and depth.

use glam::Vec3;

use super::draw::Items;
use super::fragment::{Fragment, divisors};
use super::front::EMPTY;
use super::image::Picture;
use super::triangle::{Plane, Triangle};
use super::{Camera, Sampling, Scene};

/// How surfaces are lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// Base colour alone.
    Unlit,
    /// A sky from above, a darker ground from below, and a sun from the upper right front.
    Outdoors,
}

impl Light {
    /// Light that reaches a surface with this normal, as a factor on its base colour.
    pub(super) fn on(self, normal: Vec3) -> f32 {
        match self {
            Self::Unlit => 1.0,
            Self::Outdoors => {
                let sky = 0.5 + 0.5 * normal.y;
                let sun = normal.dot(Vec3::new(0.45, 0.78, 0.43)).max(0.0);
                0.22 + 0.28 * sky + 0.6 * sun
            }
        }
    }
}

/// A triangle whose values are read at several samples.
pub(super) struct Surface<'a> {
    fragment: Fragment<'a>,
    normal: Normal,
    color: Option<[Plane; 3]>,
    q: Plane,
    /// Minus one where the back is seen: its normal points the other way.
    pub side: f32,
}

impl Items {
    /// Share of each pixel's samples that are hit.
    pub fn mask(&self) -> super::Mask {
        super::Mask {
            width: self.width,
            height: self.height,
            side: self.side,
            samples: self.triangle.iter().map(|&t| (t != EMPTY) as u8).collect(),
        }
    }

    /// Shades every sample and averages the hit ones of each pixel.
    ///
    /// `scene`, `camera` and `sampling` must be those that the items were drawn with.
    pub fn shade(
        &self,
        scene: &Scene,
        camera: &Camera,
        sampling: Sampling,
        light: Light,
    ) -> Picture {
        let corners = camera.project(scene.geometry.positions, sampling.side);
        let pixels = (self.width * self.height) as usize;
        let mut picture = Picture {
            width: self.width,
            height: self.height,
            coverage: vec![0.0; pixels],
            color: vec![[0.0; 3]; pixels],
            normal: vec![Vec3::ZERO; pixels],
            near: vec![f32::NEG_INFINITY; pixels],
        };
        let mut cached: Option<(u32, Surface)> = None;
        let row = (self.width * self.side) as usize;
        for (sample, &id) in self.triangle.iter().enumerate() {
            if id == EMPTY {
                continue;
            }
            let (x, y) = (sample % row, sample / row);
            let pixel = y / self.side as usize * self.width as usize + x / self.side as usize;
            if cached.as_ref().is_none_or(|(cached, _)| *cached != id) {
                cached = Surface::new(scene, &corners, id, sampling).map(|s| (id, s));
            }
            let Some((_, surface)) = &cached else {
                continue;
            };
            let (albedo, normal, _) = surface.at([x as f32, y as f32]);
            let lit = light.on(normal);
            for (sum, value) in picture.color[pixel].iter_mut().zip(albedo) {
                *sum += value * lit;
            }
            picture.normal[pixel] += normal;
            picture.near[pixel] = picture.near[pixel].max(self.near[sample]);
            picture.coverage[pixel] += 1.0;
        }
        let per_pixel = (self.side * self.side) as f32;
        for pixel in 0..pixels {
            let hits = picture.coverage[pixel];
            if hits > 0.0 {
                picture.color[pixel] = picture.color[pixel].map(|c| c / hits);
                picture.normal[pixel] = picture.normal[pixel].normalize_or_zero();
                picture.coverage[pixel] = hits / per_pixel;
            }
        }
        picture
    }
}

impl<'a> Surface<'a> {
    pub fn new(
        scene: &Scene<'a>,
        corners: &[super::camera::Corner],
        id: u32,
        sampling: Sampling,
    ) -> Option<Self> {
        let material = match scene.geometry.triangle_material.get(id as usize) {
            Some(&material) => &scene.materials[material as usize],
            None => &scene.materials[0],
        };
        let indices = &scene.geometry.triangles[id as usize];
        let at = indices.map(|i| corners[i as usize]);
        let triangle = Triangle::new(at, material.double_sided)?;
        let q = divisors(&at);
        let over = |values: [Vec3; 3]| {
            let axis =
                |axis: usize| triangle.plane(std::array::from_fn(|i| values[i][axis] * q[i]));
            [axis(0), axis(1), axis(2)]
        };
        let (normals, colors) = (scene.geometry.normals, scene.geometry.colors);
        let side = if triangle.front { 1.0 } else { -1.0 };
        let normal = match indices.map(|i| normals.get(i as usize)) {
            [Some(a), Some(b), Some(c)] if a != b || b != c => Normal::Varies(over([*a, *b, *c])),
            [Some(a), ..] => Normal::Same(a.normalize_or(Vec3::Y) * side),
            _ => Normal::Same(Vec3::Y),
        };
        Some(Self {
            fragment: Fragment::new(scene, material, indices, &at, &triangle, sampling),
            normal,
            color: (!colors.is_empty()).then(|| {
                over(indices.map(|i| {
                    let [r, g, b, _] = colors[i as usize];
                    Vec3::new(r, g, b)
                }))
            }),
            q: triangle.plane(q),
            side,
        })
    }

    /// Linear base colour and unit normal at a place, and what its values were divided by.
    #[inline]
    pub fn at(&self, at: [f32; 2]) -> ([f32; 3], Vec3, f32) {
        let q = self.q.at(at);
        let value = |planes: &[Plane; 3]| Vec3::from_array(planes.each_ref().map(|p| p.at(at)));
        let normal = match &self.normal {
            Normal::Same(normal) => *normal,
            // Its length does not matter, nor does what it is divided by.
            Normal::Varies(planes) => value(planes).normalize_or(Vec3::Y) * self.side,
        };
        let mut albedo = self.fragment.albedo(at, q);
        if let Some(planes) = &self.color {
            let tint = value(planes) / q;
            albedo = [albedo[0] * tint.x, albedo[1] * tint.y, albedo[2] * tint.z];
        }
        (albedo, normal, q)
    }

    /// The normal of all of the triangle, where it is one.
    pub fn normal(&self) -> Option<Vec3> {
        match self.normal {
            Normal::Same(normal) => Some(normal),
            Normal::Varies(_) => None,
        }
    }
}

/// Unit normals of a triangle, on the side that is seen.
enum Normal {
    Same(Vec3),
    /// Towards its front.
    Varies([Plane; 3]),
}
