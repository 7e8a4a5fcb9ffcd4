//! Texels as a page keeps them: a third of the size of the numbers that they are made from.

use std::sync::LazyLock;

use glam::Vec3;

use super::project::Texel;
use crate::space::texture::srgb;

/// A texel in 14 bytes. Colours have 16 bits, because 8 linear ones band in shadows; the rest has
/// the 8 bits that are written.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stored {
    color: [u16; 3],
    normal: [i8; 3],
    orm: [u8; 3],
    coverage: u8,
}

impl From<Texel> for Stored {
    fn from(t: Texel) -> Self {
        let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
        let mut out = Self {
            coverage: byte(t.coverage),
            ..Self::default()
        };
        out.set_color(t.color);
        out.set_normal(t.normal);
        out.set_orm(t.orm);
        out
    }
}

impl Stored {
    /// Covered share, 0 to 1.
    pub fn coverage(&self) -> f32 {
        f32::from(self.coverage) / 255.0
    }

    /// Sets [`Stored::coverage`].
    pub fn set_coverage(&mut self, share: f32) {
        self.coverage = (share.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    }

    /// Mean linear colour of the covered part.
    pub fn color(&self) -> Vec3 {
        Vec3::from(self.color.map(|c| f32::from(c) / 65_535.0))
    }

    /// The colour as it is written.
    pub fn srgb(&self) -> [u8; 3] {
        static TABLE: LazyLock<Vec<u8>> = LazyLock::new(|| {
            let light = |c: u16| f32::from(c) / 65_535.0;
            (0..=u16::MAX).map(|c| srgb(light(c))).collect()
        });
        let table = &*TABLE;
        self.color.map(|c| table[usize::from(c)])
    }

    /// Sets [`Stored::color`].
    pub fn set_color(&mut self, color: Vec3) {
        self.color = color
            .to_array()
            .map(|c| (c.clamp(0.0, 1.0) * 65_535.0 + 0.5) as u16);
    }

    /// Normal in the card's frame, not of unit length.
    pub fn normal(&self) -> Vec3 {
        Vec3::from(self.normal.map(|n| f32::from(n) / 127.0))
    }

    /// Sets [`Stored::normal`].
    pub fn set_normal(&mut self, normal: Vec3) {
        self.normal = normal
            .to_array()
            .map(|n| (n.clamp(-1.0, 1.0) * 127.0).round() as i8);
    }

    /// Occlusion, roughness, metalness.
    pub fn orm(&self) -> Vec3 {
        Vec3::from(self.orm.map(|v| f32::from(v) / 255.0))
    }

    /// Sets [`Stored::orm`].
    pub fn set_orm(&mut self, orm: Vec3) {
        self.orm = orm
            .to_array()
            .map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stored_is_within_half_a_step() {
        let texel = Texel {
            coverage: 0.4375,
            color: Vec3::new(0.0, 0.001_23, 1.0),
            normal: Vec3::new(-0.6, 0.0, 0.8),
            orm: Vec3::new(1.0, 0.7, 0.0),
        };
        let stored = Stored::from(texel);
        assert!((stored.coverage() - texel.coverage).abs() <= 0.5 / 255.0);
        assert!((stored.color() - texel.color).abs().max_element() <= 0.51 / 65_535.0);
        assert!((stored.normal() - texel.normal).abs().max_element() <= 0.51 / 127.0);
        assert!((stored.orm() - texel.orm).abs().max_element() <= 0.51 / 255.0);
        assert_eq!(stored.srgb(), [0, srgb(0.001_23), 255]);
        assert_eq!(std::mem::size_of::<Stored>(), 14);
    }
}
