//! From so far that the mips of a page dissolve, as a client draws it.
//!
//! A floor under the cutoff holds leaves together where a level starts and at twice that distance. A
//! level that is seen from farther still, most of all the last one, needs more: there the blocks of
//! texels that pass the alpha test are chosen mip by mip ([`super::mips`]). What the mip that is seen from
//! a distance shows too little of, more of its blocks pass; what that costs from near is taken back by
//! the threshold, and from where the level starts by the contrast.

use super::found::{AREA_A_STEP, HIGHEST_CONTRAST, Matched};
use super::mips::Survey;
use super::rule::{MIPS, Rule};
use super::stands::Stands;
use crate::export::foliage::Foliage;

/// Times that everything is drawn, least and most.
const ROUNDS: [usize; 2] = [4, 12];

/// Texels that all rounds together go through: the larger the page, the fewer rounds.
const TEXELS: usize = 3 << 20;

/// The last quarter of the rounds only settles the threshold.
const SETTLING: usize = 4;

/// A threshold is looked for so far around the last one first.
const RANGE: f32 = 0.15;

/// Shares of a mip's blocks that pass, over that of opaque texels: these are where asking begins to
/// help, and where it stops.
const SHARES: [f32; 2] = [0.1, 3.0];

/// Opaque texels lack no more of 255 than this, or mips have nothing to be made of.
const LOWEST_CONTRAST: f64 = -40.0;

/// Most that the area where a level starts grows by with a step of contrast: a floor next to the cutoff lifts all mips.
const STEEPEST: f64 = 0.03;

/// The part of the way that contrast goes at a time: shares change, too.
const DAMPED: f64 = 0.7;

/// A loss that is not worth another round.
const ENOUGH: f64 = 0.1;

/// Most change of the contrast in a round.
const MOST_STEP: f64 = 48.0;

/// How dear the squares of errors from near, and from where a level starts and twice that distance, are
/// beside errors from beyond: a hundredth of the area from near is as dear as four of these.
const DEAR: [f64; 3] = [400.0, 60.0, 60.0];

/// Where the level starts and at twice that distance areas may err by so much; what they err by beyond is `OUTSIDE` times
/// as dear as errors from farther: a crown that swells is seen sooner than one that thins from afar.
const BAND: f64 = 0.04;
const OUTSIDE: f64 = 20.0;

/// How dear it is, beside errors from beyond, that leaves swell or shrink where blocks are lifted or lowered: the
/// threshold keeps the area, but what is opaque from near is less what the fit wants. With 8 an aspen's trunk of one
/// texel was torn.
const BLURRED: f64 = 16.0;

/// Alpha as it was tried.
struct Tried {
    rule: Rule,
    found: Matched,
    loss: f64,
}

/// Keeps the area from where the two alphas of `found` no longer do, if anybody looks from there.
pub fn keep(stands: &mut Stands, foliage: &mut Foliage, found: &mut Matched) {
    let mips = asked(stands, foliage);
    if mips.is_empty() {
        return;
    }
    found.ratios = stands.client_ratios();
    let mut rule = found.rule();
    let mut best = Tried {
        loss: loss(found, found.near_ratio),
        found: found.clone(),
        rule,
    };
    if best.loss < ENOUGH {
        return;
    }
    let mut tuning = Tuning::new(found, Survey::new(stands.scores(), foliage.size, &rule));
    let mut swell = 1.0;
    let [least, most] = ROUNDS;
    let rounds = (TEXELS / stands.scores().len().max(1)).clamp(least, most);
    for round in 0..rounds {
        let range = [found.threshold - RANGE, found.threshold + RANGE];
        rule.alphas = found.alphas();
        let part;
        (found.threshold, part) = stands.threshold(rule.alphas, range, 1.0 / swell);
        rule.threshold = found.threshold;
        let survey = Survey::new(stands.scores(), foliage.size, &rule);
        for &(_, mip) in &mips {
            rule.passes[mip] = Some(survey.least(mip, tuning.shares[mip]));
        }
        stands.fill(foliage, &rule);
        let near = stands.near_ratio();
        swell *= near / part.max(1e-9);
        found.ratios = stands.client_ratios();
        let loss = loss(found, near) + BLURRED * swell.max(1e-3).ln().abs();
        if loss < best.loss {
            let found = found.clone();
            best = Tried { rule, found, loss };
        }
        if best.loss < ENOUGH {
            break;
        }
        if round + rounds / SETTLING < rounds {
            tuning.change(found, &mips);
        }
    }
    stands.fill(foliage, &best.rule);
    *found = best.found;
}

/// What alpha is made of, beside its threshold.
struct Tuning {
    /// Of each mip the share of the page that passes, over that of texels which are opaque.
    shares: [f32; MIPS],
    lowest: f64,
    /// What the area where the level starts and at twice that distance grows by with a step of contrast.
    slope: f64,
    /// The last contrast, and that area.
    before: Option<(i32, f64)>,
}

impl Tuning {
    fn new(found: &Matched, survey: Survey) -> Self {
        Self {
            shares: survey.shares().map(|share| share.max(SHARES[0])),
            lowest: LOWEST_CONTRAST.min(found.contrast.into()),
            slope: AREA_A_STEP,
            before: None,
        }
    }

    /// Changes it so that areas come nearer to the original's.
    fn change(&mut self, found: &mut Matched, mips: &[(usize, usize)]) {
        let over = found.balance();
        if let Some((contrast, area)) = self.before.replace((found.contrast, over))
            && contrast != found.contrast
        {
            let rise = (over - area) / f64::from(found.contrast - contrast);
            let least = AREA_A_STEP.max(0.5 * self.slope);
            self.slope = rise.clamp(least, STEEPEST);
        }
        let step = (DAMPED * (1.0 - over) / self.slope).clamp(-MOST_STEP, MOST_STEP);
        let contrast = f64::from(found.contrast) + step;
        found.contrast = contrast.clamp(self.lowest, HIGHEST_CONTRAST).round() as i32;
        // Rather too little from far than too much from near.
        let less = over.max(1.0).powi(3);
        for &(sight, mip) in mips {
            let asked = (found.ratios[sight] * less).clamp(0.5, 2.0) as f32;
            self.shares[mip] = (self.shares[mip] / asked).clamp(SHARES[0], SHARES[1]);
        }
    }
}

/// How far areas are from the original's.
fn loss(found: &Matched, near: f64) -> f64 {
    let errors = [near].into_iter().chain(found.ratios.iter().copied());
    let errors = errors.map(|ratio| ratio.max(1e-3).ln().abs());
    let each = errors.enumerate().map(|(i, error)| match DEAR.get(i) {
        Some(dear) => dear * error * error + OUTSIDE * (error - BAND).max(0.0),
        None => error,
    });
    each.sum()
}

/// For each distance beyond twice that where the level starts the coarser of the two mips that a client
/// mixes there, 0 being half as large as the page; where it can be told what to show.
fn asked(stands: &Stands, foliage: &Foliage) -> Vec<(usize, usize)> {
    let texels = foliage.charts.iter().map(|chart| chart.to_x.length());
    let texels = texels.sum::<f32>() / foliage.charts.len() as f32;
    let mip = |sight: usize| (texels / stands.pixels(sight)).log2().floor();
    (2..stands.sights())
        .map(|sight| (sight, mip(sight)))
        .filter(|(_, mip)| (0.0..MIPS as f32).contains(mip))
        .map(|(sight, mip)| (sight, mip as usize))
        .collect()
}
