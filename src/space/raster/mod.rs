//! A z-buffer raster for triangles with alpha-tested, mip-mapped textures.
//!
//! It draws as a graphics processor does (snapped corners, top-left rule, mips by derivative,
//! bilinear filter, alpha test), because that is where levels of detail live, and on request far
//! better than one does: 4 x 4 samples a pixel from the base level, the picture that levels are
//! compared with. [`Sampling`] is the only difference between the two.
//!
//! ```text
//! Scene = Geometry + Material + Texture   borrowed: geometry stays while alpha is tried out
//! coverage(scene, camera, sampling)       which samples are hit; no depth, no colour: fast
//! coverage_multisampled(scene, camera)    the same as a page with four samples a pixel shows it
//! critical(scene, camera, scores)         the alpha threshold at which each pixel is lost
//! draw(scene, camera, sampling)           nearest triangle of every sample
//! layers(scene, camera, sampling, ..)     what every pixel shows: coverage, light, normal, distance
//! ```
//!
//! One call works on one thread and gives the same bits everywhere; callers spread views.

mod bits;
mod blocks;
mod camera;
mod coverage;
mod critical;
mod draw;
mod edges;
mod fragment;
mod front;
mod image;
mod layers;
mod level;
mod mips;
mod msaa;
mod pane;
mod patch;
mod relief;
mod seen;
mod shade;
mod shader;
mod srgb;
mod texture;
mod tone;
mod triangle;

pub use camera::{Camera, Placement};
pub use coverage::{Coverage, Mask, Stats, coverage, coverage_with_stats};
pub use critical::{Critical, ScorePage, Scores, critical};
pub use draw::{Items, draw};
pub use front::EMPTY;
pub use image::Picture;
pub use layers::{Layers, layers};
pub use level::Wrap;
pub use msaa::{Multisampled, coverage_multisampled};
pub use relief::Relief;
pub use shade::Light;
pub use srgb::{linear_from_srgb, srgb_from_linear};
pub use texture::Texture;
pub use tone::{Tone, each_tone, tone};

use glam::{Vec2, Vec3};

/// Triangles in model space; every slice is borrowed, so one model serves many scenes.
#[derive(Clone, Copy, Debug)]
pub struct Geometry<'a> {
    /// Corner positions.
    pub positions: &'a [Vec3],
    /// Unit normals, as many as positions; may be empty where nothing is lit.
    pub normals: &'a [Vec3],
    /// Two sets of texture coordinates, v pointing down; each empty or as many as positions.
    pub uvs: [&'a [Vec2]; 2],
    /// Linear RGBA factors a vertex; empty (white) or as many as positions.
    pub colors: &'a [[f32; 4]],
    /// Triangles, counter-clockwise seen from the front; all indices in range.
    pub triangles: &'a [[u32; 3]],
    /// For each triangle an index into [`Scene::materials`]; empty: all use material 0.
    pub triangle_material: &'a [u32],
}

/// How triangles look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Index into [`Scene::textures`].
    pub texture: Option<u32>,
    /// Which set of texture coordinates addresses it: 0 or 1.
    pub uv_set: u8,
    /// What happens outside 0..1 along u and v.
    pub wrap: [Wrap; 2],
    /// False: the base level is not interpolated (NEAREST).
    pub linear: bool,
    /// Linear RGBA factor.
    pub factor: [f32; 4],
    /// A sample is kept where alpha is at least this; `None`: alpha is ignored.
    pub cutoff: Option<f32>,
    /// Whether back faces are drawn.
    pub double_sided: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            texture: None,
            uv_set: 0,
            wrap: [Wrap::Repeat; 2],
            linear: true,
            factor: [1.0; 4],
            cutoff: None,
            double_sided: false,
        }
    }
}

/// What is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Scene<'a> {
    /// The triangles.
    pub geometry: Geometry<'a>,
    /// Their materials; never empty.
    pub materials: &'a [Material],
    /// The materials' textures.
    pub textures: &'a [Texture],
}

/// Which mip levels a sample reads; the derivative is taken between neighbouring samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mips {
    /// Always the base level: no filtering in advance, so many samples converge to the truth.
    Base,
    /// The nearest level (LINEAR_MIPMAP_NEAREST).
    Nearest,
    /// Between the two nearest levels (LINEAR_MIPMAP_LINEAR, what engines do by default).
    Linear,
}

/// How often a pixel is sampled, and from which mips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// Samples along a pixel's edge; a pixel has `side * side`.
    pub side: u32,
    /// Which mip levels are read.
    pub mips: Mips,
}

impl Sampling {
    /// The picture that everything is compared with: 4 x 4 samples of the base level.
    pub const REFERENCE: Self = Self {
        side: 4,
        mips: Mips::Base,
    };
    /// As an engine draws by default: one sample a pixel, trilinear mips by derivative.
    pub const CLIENT: Self = Self {
        side: 1,
        mips: Mips::Linear,
    };
}

impl Scene<'_> {
    fn material(&self, triangle: usize) -> &Material {
        match self.geometry.triangle_material.get(triangle) {
            Some(&material) => &self.materials[material as usize],
            None => &self.materials[0],
        }
    }
}
