//! What the cards of a fitted level show.

use glam::Vec3;

use crate::export::chart::Chart;
use crate::export::foliage::Foliage;

/// Opacity, and a colour whose differences are about as large as they look, each 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// 0 transparent, 1 opaque.
    pub opacity: f32,
    /// Square root of the linear colour.
    pub color: Vec3,
}

/// How much a difference of colour counts beside one of opacity, where both are opaque.
const COLOR_WEIGHT: f32 = 8.0;

impl Seen {
    /// Squared difference.
    pub fn difference(self, other: Self) -> f32 {
        let opacity = self.opacity - other.opacity;
        let both = self.opacity.min(other.opacity);
        opacity * opacity + COLOR_WEIGHT * both * (self.color - other.color).length_squared()
    }
}

/// A fitted level whose cards are looked at.
#[derive(Clone, Copy)]
pub struct Fitted<'a> {
    /// Cards with texels of their own.
    pub foliage: &'a Foliage,
    /// What the fit wants of each texel: 0 transparent, 1 opaque.
    pub opacity: &'a [f32],
}

impl Fitted<'_> {
    /// What a card shows at a point of its plane; nothing beyond its texels.
    pub(super) fn at(&self, chart: &Chart, point: Vec3) -> Seen {
        let texel = chart.atlas_point(point);
        let [w, h] = self.foliage.size;
        let (x, y) = (texel.x.floor(), texel.y.floor());
        if x < 0.0 || y < 0.0 || x >= w as f32 || y >= h as f32 {
            return Seen::default();
        }
        let at = (y as u32 * w + x as u32) as usize;
        if !self.foliage.owned[at] {
            return Seen::default();
        }
        Seen {
            opacity: self.opacity[at],
            color: self.foliage.texels.color(at).map(|c| c.max(0.0).sqrt()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_count_where_both_are_opaque() {
        let seen = |opacity: f32, red: f32| Seen {
            opacity,
            color: Vec3::X * red,
        };
        assert_eq!(
            seen(1.0, 0.5).difference(seen(1.0, 0.0)),
            COLOR_WEIGHT * 0.25
        );
        assert_eq!(seen(1.0, 0.5).difference(seen(0.0, 0.0)), 1.0);
        assert_eq!(seen(0.5, 0.5).difference(seen(0.5, 0.5)), 0.0);
    }
}
