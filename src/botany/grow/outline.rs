//! Outlines of leaves and how leaves sit on a sprig; the painter and the polygon mesher share them.
//!
//! A leaf lies in its own plane from its stalk at (0, 0) to its tip at (0, 1).

use glam::Vec2;

use super::rng::{Rng, pow, sin_cos};
use super::species::Outline;

/// Half the width of a leaf at `t` from stalk (0) to tip (1), in lengths of the leaf.
pub(super) fn half_width(outline: Outline, t: f32) -> f32 {
    let bow = |power: f32| pow((sin_cos(180.0 * pow(t, power)).0).max(0.0), 0.85);
    match outline {
        Outline::Lobed => {
            let wave = sin_cos(180.0 * (4.5 * t + 0.12)).0.abs();
            0.31 * bow(1.25) * (0.42 + 0.58 * pow(wave, 0.7))
        }
        Outline::Ovate => 0.36 * bow(0.72),
        Outline::Lance => 0.1 * bow(0.8),
        Outline::Needle => 0.028 * bow(1.0),
        Outline::Blade => 0.05 * bow(0.6),
    }
}

/// Right and left edge at `t`: lobes point forwards.
pub(super) fn edges(outline: Outline, t: f32) -> [Vec2; 2] {
    let w = half_width(outline, t);
    let forward = if outline == Outline::Lobed {
        0.35 * w
    } else {
        0.0
    };
    [Vec2::new(w, t + forward), Vec2::new(-w, t + forward)]
}

/// One leaf on a sprig.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    /// Where its stalk begins.
    pub base: Vec2,
    /// From base to tip.
    pub axis: Vec2,
    /// Share of the colour variation, -1 to 1.
    pub tint: f32,
}

impl Placed {
    /// From the leaf's own plane to the sprig's.
    pub fn map(&self, p: Vec2) -> Vec2 {
        self.base + self.axis * p.y + self.axis.perp() * -p.x
    }
}

/// A sprig: a stalk with leaves, lower ones first, in a plane where the card is the rectangle
/// from `low` to `high` and the twig is at the origin. The card's length is one.
#[derive(Clone, Debug)]
pub(super) struct Sprig {
    pub outline: Outline,
    pub leaves: Vec<Placed>,
    pub low: Vec2,
    pub high: Vec2,
    /// Where the stalk ends (0: there is none).
    pub stalk: f32,
}

/// Arranges `count` leaves.
pub(super) fn sprig(outline: Outline, count: u32) -> Sprig {
    let mut rng = Rng::new(7, u64::from(count));
    let mut leaves = Vec::new();
    let pairs = count.saturating_sub(1);
    let needle = outline == Outline::Needle;
    let stalk = match count {
        1 => 0.0,
        _ if needle => 0.82,
        _ => 0.6,
    };
    for i in 0..pairs {
        let t = (i as f32 + 0.3) / pairs as f32;
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        let lean = if needle {
            52.0 - 22.0 * t
        } else {
            68.0 - 34.0 * t
        } + 6.0 * rng.sway();
        let size = if needle { 0.26 } else { 0.56 - 0.16 * t } * (1.0 + 0.12 * rng.sway());
        let (sin, cos) = sin_cos(side * lean);
        leaves.push(Placed {
            base: Vec2::new(0.0, stalk * if needle { t } else { 0.12 + 0.86 * t }),
            axis: Vec2::new(sin, cos) * size,
            tint: rng.sway(),
        });
    }
    let terminal = if count > 1 { 1.0 - stalk } else { 1.0 };
    leaves.push(Placed {
        base: Vec2::new(0.0, stalk),
        axis: Vec2::new(0.0, terminal),
        tint: rng.sway(),
    });
    bounded(Sprig {
        outline,
        leaves,
        low: Vec2::ZERO,
        high: Vec2::ZERO,
        stalk,
    })
}

/// Scales a sprig to length one and finds its card, a little wider than the leaves.
fn bounded(mut sprig: Sprig) -> Sprig {
    let points: Vec<Vec2> = sprig
        .leaves
        .iter()
        .flat_map(|leaf| {
            (0..=40).flat_map(|i| edges(sprig.outline, i as f32 / 40.0).map(|p| leaf.map(p)))
        })
        .chain([Vec2::ZERO])
        .collect();
    let top = points.iter().fold(0.0f32, |a, p| a.max(p.y));
    let scale = 1.0 / (1.02 * top);
    for leaf in &mut sprig.leaves {
        leaf.base *= scale;
        leaf.axis *= scale;
    }
    sprig.stalk *= scale;
    let low = points.iter().fold(Vec2::MAX, |a, &p| a.min(p)) * scale;
    let high = points.iter().fold(Vec2::MIN, |a, &p| a.max(p)) * scale;
    // The twig stays in the middle of the card: half of all cards are mirrored.
    let half = 1.02 * high.x.max(-low.x) + 0.008;
    sprig.low = Vec2::new(-half, low.y.min(0.0));
    sprig.high = Vec2::new(half, 1.0);
    sprig
}
