//! The trees of a page as the matching draws them, with one alpha after another.

use std::ops::Range;

use rayon::prelude::*;

use super::mips::{fill, means};
use super::rule::{REACH, Rule};
use crate::export::foliage::Foliage;
use crate::export::level_scene::{AreaGoal, LevelScene, Sight, WoodSeen};
use crate::export::surface::Surface;
use crate::space::raster::{Critical, ScorePage, Scores, Texture};

/// Thresholds beyond these leave no texel out, or none in.
const THRESHOLDS: [f32; 2] = [-0.6, 1.6];

/// A tree that has cards on the page.
#[derive(Clone, Debug)]
pub struct Standing<'a> {
    /// Its charts.
    pub charts: Range<usize>,
    /// Its wood.
    pub wood: &'a [Surface],
    /// What it should cover.
    pub goal: &'a AreaGoal,
}

/// A tree, ready to be drawn with other alphas.
struct Stand<'a> {
    goal: &'a AreaGoal,
    level: LevelScene,
    seen: WoodSeen,
}

/// The trees of a page, and its scores.
pub(super) struct Stands<'a> {
    all: Vec<Stand<'a>>,
    /// What decides which texels are opaque.
    page: ScorePage,
    /// The same for its mips, the finest first, once they are made.
    mips: Vec<ScorePage>,
}

impl<'a> Stands<'a> {
    /// Draws the wood; texels of no chart score nothing.
    pub fn new(foliage: &Foliage, mut score: Vec<f32>, trees: &[Standing<'a>]) -> Self {
        for nobodys in foliage.owned.zeroes() {
            score[nobodys] = f32::NEG_INFINITY;
        }
        let [width, height] = foliage.size;
        let stand = |tree: &Standing<'a>| {
            let level = LevelScene::new(foliage, tree.charts.clone(), tree.wood);
            let (goal, seen) = (tree.goal, WoodSeen::new(&level, tree.goal));
            Stand { goal, level, seen }
        };
        Self {
            page: ScorePage::new(width, height, score),
            all: trees.iter().map(stand).collect(),
            mips: Vec::new(),
        }
    }

    /// How many distances all trees are matched at.
    pub fn sights(&self) -> usize {
        let of_each = self.all.iter().map(|s| s.goal.client.len());
        of_each.min().unwrap_or(0)
    }

    /// What a client makes of a page of so many texels a unit of length at each distance: how often it is halved,
    /// where a card is seen face on.
    pub fn halvings(&self, texels: f32) -> Vec<f32> {
        let Some(first) = self.all.first() else {
            return Vec::new();
        };
        let pixels = |sight: &Sight| sight.cameras.first().map_or(1.0, |camera| camera.pixels);
        let sights = &first.goal.client[..self.sights()];
        sights.iter().map(|s| (texels / pixels(s)).log2()).collect()
    }

    /// Takes over alpha.
    pub fn set_alpha(&mut self, alpha: &[u8]) {
        self.all.iter_mut().for_each(|s| s.level.set_alpha(alpha));
    }

    /// Covered area over the originals', from the base level.
    pub fn near_ratio(&self) -> f64 {
        let area = |s: &Stand| s.level.near_area(&s.goal.near.cameras, &s.seen.near);
        self.ratio(area, |goal| &goal.near)
    }

    /// Gives mips scores: how opaque texels are from this threshold on, in the mean. Returns how many mips there are.
    pub fn make_mips(&mut self, threshold: f32) -> usize {
        self.mips = means(&self.page, threshold);
        self.mips.len()
    }

    /// Sets alpha by a rule.
    pub fn fill(&mut self, foliage: &mut Foliage, rule: &Rule) {
        fill(&mut foliage.alpha, &self.page, &self.mips, rule);
        self.set_alpha(&foliage.alpha);
    }

    /// [`Stands::client_ratio`] at all distances.
    pub fn client_ratios(&self) -> Vec<f64> {
        (0..self.sights()).map(|s| self.client_ratio(s)).collect()
    }

    /// The same as a client draws it at such a distance.
    pub fn client_ratio(&self, sight: usize) -> f64 {
        let area = |s: &Stand| {
            let cameras = &s.goal.client[sight].cameras;
            s.level.client_area(cameras, &s.seen.client[sight])
        };
        self.ratio(area, |goal| &goal.client[sight])
    }

    fn ratio(&self, area: impl Fn(&Stand) -> f64, of: impl Fn(&AreaGoal) -> &Sight) -> f64 {
        let wanted: f64 = self.all.iter().map(|s| of(s.goal).area).sum();
        self.all.iter().map(area).sum::<f64>() / wanted.max(1e-9)
    }

    /// The threshold at which the area near is the originals' times `part`, and the area over that;
    /// looked for in a `range` first.
    pub fn threshold(&self, range: [f32; 2], part: f64) -> (f32, f64) {
        self.threshold_of(&self.page, None, range, part)
    }

    /// The same where one of the mips is seen alone.
    pub fn mip_threshold(&self, mip: usize, range: [f32; 2], part: f64) -> f32 {
        let page = &self.mips[mip];
        let [width, height] = page.size().map(|s| s as u32);
        let texture = Texture::from_alpha(width, height, vec![0; page.scores().len()]);
        self.threshold_of(page, Some(&texture), range, part).0
    }

    fn threshold_of(
        &self,
        page: &ScorePage,
        texture: Option<&Texture>,
        range: [f32; 2],
        part: f64,
    ) -> (f32, f64) {
        let wanted = part * self.all.iter().map(|s| s.goal.near.area).sum::<f64>();
        let within = |range: [f32; 2]| {
            let scores = Scores {
                page,
                reach: REACH,
                range,
            };
            let mut pixels = Critical::default();
            for Stand { level, goal, seen } in &self.all {
                let own = level.critical(&goal.near.cameras, &seen.near, scores, texture);
                pixels.above += own.above;
                pixels.within.extend(own.within);
            }
            at_count(&mut pixels, range, wanted)
        };
        let all = [f32::NEG_INFINITY, f32::INFINITY];
        let found = within(range).or_else(|| within(all));
        let (threshold, covered) = found.unwrap_or((THRESHOLDS[0], 0));
        (threshold, covered as f64 / wanted.max(1e-9))
    }
}

/// The threshold at which as many pixels are covered as `wanted`, and how many are; `None` where it
/// lies beyond `range`, between whose ends `critical` tells thresholds apart.
fn at_count(critical: &mut Critical, range: [f32; 2], wanted: f64) -> Option<(f32, usize)> {
    let [least, most] = THRESHOLDS;
    let known = range[0] > least || range[1] < most;
    let Critical { above, within } = critical;
    within.par_sort_unstable_by(|a, b| b.total_cmp(a));
    let covered = |threshold: f32| *above + within.partition_point(|&c| c >= threshold);
    let index = (wanted.round() as usize).min(*above + within.len());
    let Some(&last) = index.checked_sub(*above + 1).and_then(|i| within.get(i)) else {
        // None are asked for, or all of those above.
        let none = if *above + within.len() == 0 {
            least
        } else {
            most
        };
        return (!known).then_some((none, covered(none)));
    };
    if known && index == *above + within.len() {
        return None;
    }
    // Many texels may have the same score: with them or without, whichever is nearer.
    let tied = last.clamp(least, most);
    let next = within[..covered(tied) - *above]
        .iter()
        .rev()
        .find(|&&c| c > tied);
    if known && next.is_none() {
        return None;
    }
    let above = next.map_or(most, |c| 0.5 * (tied + c)).clamp(least, most);
    let miss = |threshold: f32| (covered(threshold) as f64 - wanted).abs();
    let best = if miss(above) < miss(tied) {
        above
    } else {
        tied
    };
    Some((best, covered(best)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

    fn counted(above: usize, within: &[f32]) -> Critical {
        Critical {
            above,
            within: within.to_vec(),
        }
    }

    #[test]
    fn the_threshold_leaves_as_many_pixels_as_wanted() {
        // One pixel is opaque whatever the threshold.
        let count = |wanted| {
            let mut critical = counted(1, &[0.5, 0.75, 0.25, 0.5, 0.5]);
            at_count(&mut critical, ALL, wanted)
        };
        assert_eq!(count(2.0), Some((0.75, 2)));
        // Three are tied: five are nearer to four than two are.
        assert_eq!(count(4.0), Some((0.5, 5)));
        assert_eq!(count(3.0), Some((0.625, 2)));
        assert_eq!(count(9.0), Some((0.25, 6)));
        assert_eq!(count(0.0), Some((THRESHOLDS[1], 1)));
        let nothing = at_count(&mut counted(0, &[]), ALL, 9.0);
        assert_eq!(nothing, Some((THRESHOLDS[0], 0)));
    }

    #[test]
    fn a_threshold_within_a_range_is_that_of_all_or_not_known() {
        let all = [0.9f32, 0.8, 0.62, 0.6, 0.58, 0.56, 0.3, 0.2];
        let range = [0.5, 0.7];
        for wanted in 0..9 {
            let full = at_count(&mut counted(0, &all), ALL, f64::from(wanted));
            let above = all.iter().filter(|&&c| c >= range[1]).count();
            let within = all.iter().filter(|&&c| c > range[0] && c < range[1]);
            let within: Vec<f32> = within.copied().collect();
            let some = at_count(&mut counted(above, &within), range, f64::from(wanted));
            assert_eq!(some.is_some(), (4..6).contains(&wanted), "{wanted}");
            assert!(some.is_none() || some == full, "{some:?} for {full:?}");
        }
    }
}
