//! Lets every mip that is seen cover what the original covers, and all of them together as a client mixes them.
//!
//! Each mip has a threshold of its own, at which it alone covers as much as it should. Where they can't all
//! have their way (of a block without an opaque texel no mean passes), or where a client mixes two of them,
//! areas are still off; so every mip is asked for more or less, and everything is drawn again, a few times.
//!
//! Mips that are seen only from farther than twice the distance where a level starts are left to what becomes of them:
//! what they are made to show costs finer ones more than it brings. Where mips were told as far as 8 pixels of height, F1 of
//! five trees' last levels fell from .777 to .746 at 32 pixels and from .765 to .719 at 16, and rose from .577 to .670 at 8.

use std::ops::Range;

use super::found::Matched;
use super::rule::{MIPS, Rule};
use super::stands::Stands;
use crate::export::foliage::Foliage;

/// Times that everything is drawn, least and most.
const ROUNDS: [usize; 2] = [6, 10];

/// Texels that all rounds together go through: the larger the page, the fewer rounds.
const TEXELS: usize = 5 << 20;

/// Thresholds are looked for so far around the last ones first.
const RANGE: f32 = 0.15;

/// Mips ask for no less and no more than these shares of their area.
const PARTS: [f64; 2] = [0.2, 3.0];

/// Least and most part of the way that the base level's area follows its threshold's: blocks that pass in mips
/// lift their texels next to the cutoff, and outlines swell.
const FOLLOWS: [f64; 2] = [0.2, 2.0];

/// What it is taken for before it is known.
const FIRST_FOLLOWS: f64 = 0.3;

/// How much less is asked of the base level at first, for the logarithm of what is missing at twice the distance: about what
/// outlines will swell by. At most so much.
const SWELLS: f64 = 0.65;
const MOST_SWELLS: f64 = 0.5;

/// Most change of the logarithm of what the base level's threshold is asked for.
const MOST_STEP: f64 = 0.25;

/// The part of the way that mips are asked to go at a time: all of them move the same areas. The whole way at a time, third levels of
/// six trees get nearer to their area where they start (.047 off instead of .076), and lose .008 more of F1.
const DAMPED: f64 = 0.6;

/// A loss that is not worth another round.
const ENOUGH: f64 = 0.1;

/// Rounds in a row that find nothing better, once one has, before it is left at that.
const IDLE: usize = 2;

/// Cards that are seen from aside show coarser mips than those that are seen face on, by so many halvings in the mean.
const ASIDE: f32 = 0.7;

/// A mip that a client reaches but for so many halvings is one that is seen: where a level starts with a texel a pixel, what is
/// rounded must not decide.
const NEARLY: f32 = 0.1;

/// How dear squares of errors are: a hundredth of the area from near is as dear as two and a half of what a client covers.
const DEAR_NEAR: f64 = 400.0;
const DEAR_CLIENT: f64 = 60.0;

/// Areas may err by so much; what they err by beyond is dear whatever its square is.
const BAND: f64 = 0.04;
const OUTSIDE: f64 = 20.0;

/// Alpha as it was tried.
struct Tried {
    rule: Rule,
    found: Matched,
    loss: f64,
}

/// Matches the mips that are seen, from a threshold at which the base level covers what it should.
pub fn match_mips(stands: &mut Stands, foliage: &mut Foliage, found: &mut Matched) {
    let halvings = stands.halvings(texels_a_unit(foliage));
    found.ratios = stands.client_ratios();
    // Where leaves are dense and large, mips are right as they come.
    let mut best = Tried {
        rule: Rule::of(found.threshold),
        found: found.clone(),
        loss: loss(found),
    };
    if best.loss < ENOUGH {
        return;
    }
    let seen = seen(&halvings, stands.make_mips(found.threshold));
    let mut asked = Asked::new(found);
    let [least, most] = ROUNDS;
    let mut idle = 0;
    for round in 0..(TEXELS / foliage.alpha.len().max(1)).clamp(least, most) {
        if round > 0 {
            asked.change(found, &halvings);
        }
        let range = [found.threshold - RANGE, found.threshold + RANGE];
        (found.threshold, _) = stands.threshold(range, asked.near.exp());
        let rule = asked.rule(stands, found.threshold, seen.clone());
        stands.fill(foliage, &rule);
        found.near_ratio = stands.near_ratio();
        found.ratios = stands.client_ratios();
        let loss = loss(found);
        if loss < best.loss {
            let found = found.clone();
            best = Tried { rule, found, loss };
            idle = 0;
        } else if best.rule.passes != [None; MIPS] {
            idle += 1;
        }
        if loss < ENOUGH || idle == IDLE {
            break;
        }
    }
    stands.fill(foliage, &best.rule);
    *found = best.found;
}

/// Texels for a unit of length, in the mean of all cards.
fn texels_a_unit(foliage: &Foliage) -> f32 {
    let texels = foliage.charts.iter().map(|chart| chart.to_x.length());
    texels.sum::<f32>() / foliage.charts.len().max(1) as f32
}

/// Which of so many mips are seen: the finer one of the two that a client mixes from where the level starts to the
/// coarser one from twice that distance.
fn seen(halvings: &[f32], mips: usize) -> Range<usize> {
    let [nearest, farthest] =
        [f32::min, f32::max].map(|of| halvings.iter().copied().reduce(of).unwrap_or(0.0));
    // The base level is none of them.
    let first = (nearest as usize).saturating_sub(1);
    first.min(mips)..((farthest + NEARLY).max(0.0) as usize + 1).min(mips)
}

/// What thresholds are asked for.
struct Asked {
    /// Logarithm of the base level's area over what it should be.
    near: f64,
    /// Area of each mip alone over what it should be.
    parts: [f64; MIPS],
    /// Threshold of each mip.
    thresholds: [f32; MIPS],
    /// The part of the way that the base level's area follows, and the last way with the logarithm of that area.
    follows: f64,
    before: Option<[f64; 2]>,
}

impl Asked {
    /// Of what is found where no mip asks for anything.
    fn new(found: &Matched) -> Self {
        let missing = found
            .ratios
            .last()
            .map_or(0.0, |ratio| ratio.clamp(0.1, 10.0).ln());
        Self {
            near: (SWELLS * missing).clamp(-MOST_SWELLS, 0.0),
            parts: [1.0; MIPS],
            thresholds: [found.threshold; MIPS],
            follows: FIRST_FOLLOWS,
            before: None,
        }
    }

    /// What these thresholds lead to for the mips that are seen.
    fn rule(&mut self, stands: &mut Stands, threshold: f32, seen: Range<usize>) -> Rule {
        let mut rule = Rule::of(threshold);
        for mip in seen {
            let last = self.thresholds[mip];
            let range = [last - RANGE, last + RANGE];
            self.thresholds[mip] = stands.mip_threshold(mip, range, self.parts[mip]);
            rule.passes[mip] = Some(self.thresholds[mip]);
        }
        rule
    }

    /// Asks for more where there is too little.
    fn change(&mut self, found: &Matched, halvings: &[f32]) {
        let near = found.near_ratio.max(1e-3).ln();
        if let Some([way, area]) = self.before
            && (self.near - way).abs() > 0.01
        {
            let follows = (near - area) / (self.near - way);
            self.follows = follows.clamp(FOLLOWS[0], FOLLOWS[1]);
        }
        self.before = Some([self.near, near]);
        self.near -= (near / self.follows).clamp(-MOST_STEP, MOST_STEP);
        for (mip, part) in self.parts.iter_mut().enumerate() {
            let error = error_of(mip, found, halvings);
            *part = (*part * (-DAMPED * error).exp()).clamp(PARTS[0], PARTS[1]);
        }
    }
}

/// Logarithm of the area over what it should be, in the mean of the distances from which a mip is seen.
fn error_of(mip: usize, found: &Matched, halvings: &[f32]) -> f64 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for (ratio, halvings) in found.ratios.iter().zip(halvings) {
        let off = halvings + ASIDE - (mip + 1) as f32;
        let weight = f64::from((1.0 - off.abs()).max(0.0));
        sum += weight * ratio.clamp(0.5, 2.0).ln();
        weights += weight;
    }
    sum / f64::max(weights, 1e-9)
}

/// How far areas are from the original's.
fn loss(found: &Matched) -> f64 {
    let loss = |ratio: f64, dear: f64| {
        let error = ratio.max(1e-3).ln().abs();
        dear * error * error + OUTSIDE * (error - BAND).max(0.0)
    };
    let of_client = found.ratios.iter().map(|&ratio| loss(ratio, DEAR_CLIENT));
    loss(found.near_ratio, DEAR_NEAR) + of_client.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mips_are_seen_from_where_a_level_starts_to_twice_that_distance() {
        // A texel a pixel: the base level, the first and the second mip.
        assert_eq!(seen(&[0.0, 1.0], 5), 0..2);
        assert_eq!(seen(&[-1e-6, 1.0 - 1e-6], 5), 0..2);
        assert_eq!(seen(&[-0.3, 0.7], 5), 0..1);
        // Two: the first to the third. Four and a half: the second to the fourth.
        assert_eq!(seen(&[1.1, 2.1], 5), 0..3);
        assert_eq!(seen(&[2.2, 3.2], 5), 1..4);
        // As far as there are any.
        assert_eq!(seen(&[6.0, 7.0], 5), 5..5);
        assert_eq!(seen(&[0.0, 1.0], 1), 0..1);
    }

    #[test]
    fn the_base_level_is_asked_for_less_where_much_is_missing_from_afar() {
        let asked = |farthest: f64| {
            let found = Matched {
                threshold: 0.3,
                ratios: vec![2.0, farthest],
                ..Matched::default()
            };
            let asked = Asked::new(&found);
            assert_eq!(asked.parts, [1.0; MIPS]);
            assert_eq!(asked.thresholds, [0.3; MIPS]);
            asked.near
        };
        assert!((asked(0.8) - 0.65 * 0.8f64.ln()).abs() < 1e-12);
        // Too much is no reason to ask for more, and there is a least.
        assert_eq!((asked(1.5), asked(0.1)), (0.0, -0.5));
    }

    #[test]
    fn a_mip_is_asked_for_more_where_too_little_is_seen_of_it() {
        let found = Matched {
            ratios: vec![1.0, 0.9],
            ..Matched::default()
        };
        // Halved .7 times where the level starts, since cards are seen from aside, and 1.7 times at twice the distance.
        let error = |mip| error_of(mip, &found, &[0.0, 1.0]);
        let too_little = 0.9f64.ln();
        assert!((error(0) - 0.3 * too_little).abs() < 1e-6);
        assert!((error(1) - too_little).abs() < 1e-6);
        assert_eq!(error(4), 0.0);
    }

    #[test]
    fn errors_cost_more_beyond_the_band_and_from_near() {
        let of = |near: f64, own: f64| {
            loss(&Matched {
                near_ratio: near,
                ratios: vec![own],
                ..Matched::default()
            })
        };
        assert_eq!(of(1.0, 1.0), 0.0);
        let e = 1.03f64.ln();
        assert!((of(1.0, 1.03) - 60.0 * e * e).abs() < 1e-12);
        assert!((of(1.03, 1.0) - 400.0 * e * e).abs() < 1e-12);
        let e = 1.1f64.ln();
        assert!((of(1.0, 1.1) - (60.0 * e * e + 20.0 * (e - 0.04))).abs() < 1e-12);
    }
}
