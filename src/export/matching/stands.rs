//! The trees of a page as the matching draws them, with one alpha after another.

use std::ops::Range;

use super::mips::{fill, means};
use super::pixels::{Pixels, THRESHOLDS};
use super::rule::{REACH, Rule};
use crate::export::foliage::Foliage;
use crate::export::level_scene::{AreaGoal, LevelScene, Sight, WoodSeen};
use crate::export::surface::Surface;
use crate::space::raster::{Critical, ScorePage, Scores, Texture};

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
    page: Scored,
    /// The same for its mips, the finest first, once they are made.
    mips: Vec<Scored>,
}

/// Scores, and what they cover.
struct Scored {
    page: ScorePage,
    /// What all trees' near cameras see of it; thresholds are looked for many times, and it is drawn once or twice.
    pixels: Option<Pixels>,
}

impl Scored {
    fn new(page: ScorePage) -> Self {
        Self { page, pixels: None }
    }
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
            page: Scored::new(ScorePage::new(width, height, score)),
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
        let mips = means(&self.page.page, threshold).into_iter();
        self.mips = mips.map(Scored::new).collect();
        self.mips.len()
    }

    /// Sets alpha by a rule.
    pub fn fill(&mut self, foliage: &mut Foliage, rule: &Rule) {
        let mips: Vec<&ScorePage> = self.mips.iter().map(|mip| &mip.page).collect();
        fill(&mut foliage.alpha, &self.page.page, &mips, rule);
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
    pub fn threshold(&mut self, range: [f32; 2], part: f64) -> (f32, f64) {
        threshold_of(&self.all, &mut self.page, None, range, part)
    }

    /// The same where one of the mips is seen alone.
    pub fn mip_threshold(&mut self, mip: usize, range: [f32; 2], part: f64) -> f32 {
        let scored = &mut self.mips[mip];
        let size = scored.page.size();
        threshold_of(&self.all, scored, Some(size), range, part).0
    }
}

/// Of a page, or of a mip of this size.
fn threshold_of(
    all: &[Stand],
    scored: &mut Scored,
    mip: Option<[usize; 2]>,
    range: [f32; 2],
    part: f64,
) -> (f32, f64) {
    let wanted = part * all.iter().map(|s| s.goal.near.area).sum::<f64>();
    let drawn = |range: [f32; 2]| {
        let scores = Scores {
            page: &scored.page,
            reach: REACH,
            range,
        };
        let texture = mip.map(|[width, height]| {
            Texture::from_alpha(width as u32, height as u32, vec![0; width * height])
        });
        let mut pixels = Critical::default();
        for Stand { level, goal, seen } in all {
            let own = level.critical(&goal.near.cameras, &seen.near, scores, texture.as_ref());
            pixels.above += own.above;
            pixels.within.extend(own.within);
        }
        Pixels::new(pixels, range)
    };
    let mut pixels = scored.pixels.take().unwrap_or_else(|| drawn(range));
    let mut found = pixels.at_count(wanted);
    if found.is_none() {
        pixels = drawn([f32::NEG_INFINITY, f32::INFINITY]);
        found = pixels.at_count(wanted);
    }
    scored.pixels = Some(pixels);
    let (threshold, covered) = found.unwrap_or((THRESHOLDS[0], 0));
    (threshold, covered as f64 / wanted.max(1e-9))
}
