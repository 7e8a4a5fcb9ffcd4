//! Texels as a page keeps them: less than a third of the size of the numbers that they are made from.

use std::sync::LazyLock;

use glam::Vec3;
use rayon::prelude::*;

use super::edge::{bleed, nearest};
use super::maps::Maps;
use super::orm::Orms;
use super::project::Texel;
use crate::space::texture::{linear, srgb};

/// A texel: the 8 bits of everything that are written. Colours are sRGB, because 8 linear
/// bits band in shadows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stored {
    color: [u8; 3],
    normal: [i8; 3],
    orm: [u8; 3],
    coverage: u8,
}

impl From<Texel> for Stored {
    fn from(t: Texel) -> Self {
        Self {
            color: color_bytes(t.color),
            normal: normal_bytes(t.normal),
            orm: bytes(t.orm),
            coverage: byte(t.coverage),
        }
    }
}

impl Stored {
    /// Covered share, 0 to 1.
    pub fn coverage(&self) -> f32 {
        f32::from(self.coverage) / 255.0
    }

    /// Mean linear colour of the covered part.
    pub fn color(&self) -> Vec3 {
        color_of(self.color)
    }

    /// Normal in the card's frame, not of unit length.
    pub fn normal(&self) -> Vec3 {
        normal_of(self.normal)
    }

    /// Occlusion, roughness, metalness.
    pub fn orm(&self) -> Vec3 {
        orm_of(self.orm)
    }
}

/// The texels of a page, a plane for each of the images that come of them: what is stored becomes pixels in place,
/// so that a page and its images are never in memory side by side. What comes into no image is forgotten.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Texels {
    /// sRGB and coverage.
    color: Vec<[u8; 4]>,
    /// Each in 127ths, of both signs.
    normal: Vec<[u8; 4]>,
    /// Occlusion, roughness, metalness.
    orm: Orms,
}

impl Texels {
    /// So many of nothing.
    pub fn empty(count: usize, maps: Maps) -> Self {
        let plane = |number: usize| match number < maps.count() {
            true => vec![[0; 4]; count],
            false => Vec::new(),
        };
        Self {
            color: plane(0),
            normal: plane(1),
            orm: Orms::empty(count, maps),
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.color.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.color.is_empty()
    }

    /// One of them.
    pub fn at(&self, at: usize) -> Stored {
        let [r, g, b, coverage] = self.color[at];
        Stored {
            color: [r, g, b],
            normal: self.normal.get(at).map_or([0; 3], |&n| normal_bytes_in(n)),
            orm: self.orm.at(at),
            coverage,
        }
    }

    /// Replaces one.
    pub fn set(&mut self, at: usize, texel: Stored) {
        let [r, g, b] = texel.color;
        self.color[at] = [r, g, b, texel.coverage];
        if let Some(normal) = self.normal.get_mut(at) {
            put(normal, texel.normal.map(i8::cast_unsigned));
        }
        self.orm.set(at, texel.orm);
    }

    /// Covered share of one, 0 to 1.
    pub fn coverage(&self, at: usize) -> f32 {
        share_of(self.color[at])
    }

    /// As [`Stored::color`].
    pub fn color(&self, at: usize) -> Vec3 {
        color_of(first_three(self.color[at]))
    }

    /// Covered shares of all, 0 to 1.
    pub fn coverages(&self) -> impl IndexedParallelIterator<Item = f32> {
        self.color.par_iter().copied().map(share_of)
    }

    /// Fills everything but coverage from the neighbourhood where nothing is covered.
    pub fn bleed(&mut self, size: [u32; 2]) {
        let colors = &self.color;
        let normal = |at: usize, &texel: &[u8; 4]| {
            let normal = normal_of(normal_bytes_in(texel));
            (normal, share_of(colors[at]))
        };
        if !self.normal.is_empty() {
            bleed(&mut self.normal, size, normal, |texel, normal| {
                put(texel, normal_bytes(normal).map(i8::cast_unsigned));
            });
        }
        self.orm.bleed(size, |at| share_of(colors[at]));
        let color = |_, &texel: &[u8; 4]| (color_of(first_three(texel)), share_of(texel));
        bleed(&mut self.color, size, color, |texel, color| {
            put(texel, color_bytes(color));
        });
    }

    /// RGBA of the base colours, with this alpha; colours and coverage are no more.
    pub fn take_colors(&mut self, alpha: &[u8]) -> Vec<u8> {
        let mut colors = std::mem::take(&mut self.color);
        let both = colors.par_iter_mut().zip(alpha);
        both.for_each(|(pixel, &alpha)| pixel[3] = alpha);
        colors.into_flattened()
    }

    /// RGBA of the normals, as tangent space has them; they are no more.
    pub fn take_normals(&mut self) -> Vec<u8> {
        let mut normals = std::mem::take(&mut self.normal);
        normals.par_iter_mut().for_each(|pixel| {
            let normal = normal_of(normal_bytes_in(*pixel));
            let unit = normal.normalize_or(Vec3::Z) * 0.5 + 0.5;
            *pixel = opaque(bytes(unit));
        });
        normals.into_flattened()
    }

    /// RGBA of occlusion, roughness and metalness; they are no more.
    pub fn take_orms(&mut self) -> Vec<u8> {
        self.orm.take()
    }
}

fn share_of([_, _, _, coverage]: [u8; 4]) -> f32 {
    f32::from(coverage) / 255.0
}

fn first_three([a, b, c, _]: [u8; 4]) -> [u8; 3] {
    [a, b, c]
}

fn normal_bytes_in(texel: [u8; 4]) -> [i8; 3] {
    first_three(texel).map(u8::cast_signed)
}

/// Replaces the first three bytes.
fn put(texel: &mut [u8; 4], [a, b, c]: [u8; 3]) {
    *texel = [a, b, c, texel[3]];
}

fn opaque([a, b, c]: [u8; 3]) -> [u8; 4] {
    [a, b, c, 255]
}

pub(super) fn byte(share: f32) -> u8 {
    (share.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

fn bytes(shares: Vec3) -> [u8; 3] {
    shares.to_array().map(byte)
}

fn orm_of(orm: [u8; 3]) -> Vec3 {
    Vec3::from(orm.map(|v| f32::from(v) / 255.0))
}

fn normal_bytes(normal: Vec3) -> [i8; 3] {
    let byte = |n: f32| nearest(n.clamp(-1.0, 1.0) * 127.0) as i8;
    normal.to_array().map(byte)
}

fn normal_of(normal: [i8; 3]) -> Vec3 {
    Vec3::from(normal.map(|n| f32::from(n) / 127.0))
}

fn color_of(color: [u8; 3]) -> Vec3 {
    Vec3::from(color.map(linear))
}

/// The nearest sRGB, looked up by 16 linear bits: millions are made, each by a power.
fn color_bytes(color: Vec3) -> [u8; 3] {
    static TABLE: LazyLock<Vec<u8>> = LazyLock::new(|| {
        let light = |c: u16| f32::from(c) / 65_535.0;
        (0..=u16::MAX).map(|c| srgb(light(c))).collect()
    });
    let table = &*TABLE;
    let light = |c: f32| (c.clamp(0.0, 1.0) * 65_535.0 + 0.5) as u16;
    color.to_array().map(|c| table[usize::from(light(c))])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texel() -> Texel {
        Texel {
            coverage: 0.4375,
            color: Vec3::new(0.0, 0.001_23, 1.0),
            normal: Vec3::new(-0.6, 0.0, 0.8),
            orm: Vec3::new(1.0, 0.7, 0.0),
        }
    }

    #[test]
    fn what_is_stored_is_within_half_a_step() {
        let (texel, mut all) = (texel(), Texels::empty(3, Maps::All));
        all.set(1, texel.into());
        let stored = all.at(1);
        assert!((stored.coverage() - texel.coverage).abs() <= 0.5 / 255.0);
        assert_eq!(all.coverage(1), stored.coverage());
        // In dark colours a step of sRGB is 1 / (12.92 * 255) of light.
        let off = (stored.color() - texel.color).abs().max_element();
        assert!(off <= 0.51 / (12.92 * 255.0), "{off}");
        assert!((stored.normal() - texel.normal).abs().max_element() <= 0.51 / 127.0);
        assert!((stored.orm() - texel.orm).abs().max_element() <= 0.51 / 255.0);
        assert_eq!((all.at(0), all.at(2)), Default::default());
    }

    #[test]
    fn every_srgb_colour_comes_back_as_it_is() {
        for byte in 0..=255u8 {
            assert_eq!(color_bytes(color_of([byte; 3])), [byte; 3]);
        }
    }

    #[test]
    fn images_hold_what_was_stored_and_each_takes_its_plane_along() {
        let mut all = Texels::empty(2, Maps::All);
        all.set(1, texel().into());
        let green = srgb(0.001_23);
        assert_eq!(all.take_colors(&[7, 9]), [0, 0, 0, 7, 0, green, 255, 9]);
        // No normal: towards the viewer. -.6, 0, .8 is of unit length.
        let normals = [128, 128, 255, 255, 51, 128, 230, 255];
        assert_eq!(all.take_normals(), normals);
        assert_eq!(all.take_orms(), [0, 0, 0, 255, 255, 179, 0, 255]);
        assert_eq!(all, Texels::default());
    }

    #[test]
    fn what_comes_into_no_image_is_forgotten() {
        let mut all = Texels::empty(4, Maps::Unlit);
        all.set(2, texel().into());
        all.bleed([2, 2]);
        let own = all.at(2);
        assert_eq!((own.normal, own.orm), ([0; 3], [0; 3]));
        assert_eq!(own.color, Stored::from(texel()).color);
        assert!(all.take_normals().is_empty() && all.take_orms().is_empty());
        assert_eq!(all.take_colors(&[255; 4]).len(), 16);
    }

    #[test]
    fn empty_texels_take_what_is_beside_them() {
        let mut all = Texels::empty(4, Maps::All);
        all.set(2, texel().into());
        all.bleed([2, 2]);
        let (own, taken) = (all.at(2), all.at(1));
        assert_eq!((taken.color, taken.normal), (own.color, own.normal));
        assert_eq!((taken.orm, taken.coverage), (own.orm, 0));
    }
}
