//! Matches a level's covered area to the original's, as an engine renders it.
//!
//! Alpha in a plain PNG has two free numbers. The threshold decides which texels are opaque, and
//! sets the area seen from near, where the base level is read. The contrast decides what box
//! filtered mips do with it from afar: a floor under the cutoff keeps sparse leaves from
//! dissolving, a ceiling over it keeps dense ones from closing up. For every contrast there is one
//! threshold that gives the right area near; the contrast is searched whose area at the level's
//! own distance and at twice it errs as little to one side as to the other.

use std::ops::Range;

use rayon::prelude::*;

use super::foliage::Foliage;
use super::level_scene::{AreaGoal, LevelScene, WoodSeen};
use super::surface::Surface;
use crate::space::raster::{Critical, ScorePage, Scores};
use crate::space::root::Search;

/// What was found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Matched {
    /// Score from which a texel is opaque.
    pub threshold: f32,
    /// Positive: alpha of the other texels; negative: what opaque texels lack of 255.
    pub contrast: i32,
    /// Covered area over the original's, supersampled from the base level.
    pub near_ratio: f64,
    /// Covered area over the original's where the level starts, as a client draws it.
    pub own_ratio: f64,
    /// The same at twice the distance.
    pub far_ratio: f64,
}

impl Matched {
    /// Alpha of opaque texels and of the others.
    pub fn alphas(&self) -> [u8; 2] {
        [
            (255 + self.contrast.min(0)) as u8,
            self.contrast.max(0) as u8,
        ]
    }
}

/// Thresholds beyond these leave no texel out, or none in.
const THRESHOLDS: [f32; 2] = [-0.6, 1.6];

/// Areas from afar this close are the same.
const FAR_TOLERANCE: f64 = 4e-3;

/// The contrast at which to begin: leaves on cards are sparse more often than dense.
pub const CONTRAST_GUESS: i32 = 32;

/// Both alphas stay this far from the cutoff of 128: room for rounding in mips.
const HIGHEST_CONTRAST: f64 = 120.0;

/// A threshold is looked for so far around one half first: those of an oak's levels are .35 to .65.
const FIRST_RANGE: f32 = 0.25;

/// Later it is looked for so far around the last one, and so much farther for each step that the
/// contrast has made: on an oak's levels a step moves it by .0026. Beyond that all are looked at again.
const RANGE: [f32; 2] = [0.02, 0.005];

/// What areas from afar grow by with a step of contrast: on an oak's levels it is .0005 to .0007.
const AREA_A_STEP: f64 = 5e-4;

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

/// The trees of a page, ready to be drawn with other alphas.
struct Stand<'a> {
    goal: &'a AreaGoal,
    level: LevelScene,
    seen: WoodSeen,
}

/// A sum over all trees.
fn sum<T>(all: &[T], of: impl Fn(&T) -> f64) -> f64 {
    all.iter().map(of).sum()
}

/// Sets the alpha of `foliage` from `score` so that cards and wood of all its trees together cover what
/// their originals cover; the search begins at the contrast `guess`.
pub fn match_area(
    foliage: &mut Foliage,
    mut score: Vec<f32>,
    trees: &[Standing],
    guess: i32,
) -> Matched {
    let mut found = Matched {
        threshold: 0.5,
        ..Matched::default()
    };
    if foliage.charts.is_empty() {
        return found;
    }
    for (score, _) in score.iter_mut().zip(&foliage.owned).filter(|(_, o)| !**o) {
        *score = f32::NEG_INFINITY;
    }
    let [width, height] = foliage.size;
    let page = ScorePage::new(width, height, score);
    let stand = |tree: &Standing<'_>| {
        let level = LevelScene::new(foliage, tree.charts.clone(), tree.wood);
        (WoodSeen::new(&level, tree.goal), level)
    };
    let mut stands: Vec<Stand> = Vec::with_capacity(trees.len());
    for tree in trees {
        let (seen, level) = stand(tree);
        let goal = tree.goal;
        stands.push(Stand { goal, level, seen });
    }
    let [own_area, far_area] = [
        sum(&stands, |s| s.goal.own_area),
        sum(&stands, |s| s.goal.far_area),
    ];
    let search = Search {
        range: [-HIGHEST_CONTRAST, HIGHEST_CONTRAST],
        guess: guess.into(),
        slope: AREA_A_STEP,
        step: 48.0,
        grain: 2.0,
        tolerance: FAR_TOLERANCE,
    };
    let mut before = None;
    search.falling(|contrast| {
        found.contrast = contrast.round() as i32;
        let range = match before.replace(found.contrast) {
            None => FIRST_RANGE,
            Some(before) => RANGE[0] + RANGE[1] * found.contrast.abs_diff(before) as f32,
        };
        let scores = Scores {
            page: &page,
            alphas: found.alphas(),
            range: [found.threshold - range, found.threshold + range],
        };
        (found.threshold, found.near_ratio) = threshold(&stands, scores);
        apply(foliage, &page, found);
        for stand in &mut stands {
            stand.level.set_alpha(&foliage.alpha);
        }
        let own = sum(&stands, |s| s.level.client_area(&s.goal.own, &s.seen.own));
        let far = sum(&stands, |s| s.level.client_area(&s.goal.far, &s.seen.far));
        found.own_ratio = own / own_area.max(1e-9);
        found.far_ratio = far / far_area.max(1e-9);
        1.0 - (found.own_ratio + found.far_ratio) / 2.0
    });
    found
}

fn apply(foliage: &mut Foliage, page: &ScorePage, found: Matched) {
    let [opaque, other] = found.alphas();
    let texels = foliage.alpha.par_iter_mut().zip(page.scores());
    texels.for_each(|(alpha, &score)| {
        *alpha = if score >= found.threshold {
            opaque
        } else if score > f32::NEG_INFINITY {
            other
        } else {
            // Texels of no chart stay empty: they would only bleed into their neighbours' mips.
            0
        };
    });
}

/// The threshold at which the area near is the original's, and the area over it; looked for in the
/// scores' range first.
fn threshold(stands: &[Stand], scores: Scores) -> (f32, f64) {
    let wanted = sum(stands, |s| s.goal.near_area);
    let within = |range: [f32; 2]| {
        let scores = Scores { range, ..scores };
        let mut pixels = Critical::default();
        for Stand { level, goal, seen } in stands {
            let own = level.critical(&goal.near, &seen.near, scores);
            pixels.above += own.above;
            pixels.within.extend(own.within);
        }
        at_count(&mut pixels, range, wanted)
    };
    let all = [f32::NEG_INFINITY, f32::INFINITY];
    let found = within(scores.range).or_else(|| within(all));
    let (threshold, covered) = found.unwrap_or((THRESHOLDS[0], 0));
    (threshold, covered as f64 / wanted.max(1e-9))
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
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::botany::model::Model;
    use crate::cloud::card::Card;
    use crate::export::atlas::Layout;
    use crate::export::foliage::{BakeOptions, CardGroup};
    use crate::export::original::camera;
    use crate::recipe::Packer;
    use crate::space::directions::direction;

    /// A card of 64 x 64 texels of which a share scores high, in clumps.
    fn card_with(opaque: impl Fn(u32, u32) -> bool) -> (Foliage, Vec<f32>, f64) {
        let card = Card::rectangle(Vec3::ZERO, Vec3::X, Vec3::Y, Vec2::splat(0.5));
        let group = CardGroup {
            card,
            triangles: Vec::new(),
        };
        let options = BakeOptions {
            layout: Layout {
                density: 64.0,
                pad: 1.0,
                packer: Packer::Rectangles,
            },
            samples: 1,
        };
        let foliage = Foliage::bake(&Model::default(), &[group], &[], options);
        let width = foliage.size[0];
        let mut wanted = 0;
        let score = (0..foliage.alpha.len() as u32)
            .map(|i| {
                let on = opaque(i % width, i / width) && foliage.owned[i as usize];
                wanted += u32::from(on);
                f32::from(u8::from(on)) + 0.001 * (i * 7919 % 97) as f32
            })
            .collect();
        let owned = foliage.owned.iter().filter(|&&o| o).count();
        // The gutter around the card is owned too: the card's own share is that of all.
        (foliage, score, f64::from(wanted) / owned as f64)
    }

    fn matched(opaque: impl Fn(u32, u32) -> bool) -> Matched {
        let (mut foliage, score, area) = card_with(opaque);
        let seen = |pixels: f32| {
            let camera = camera(&direction(0.0, 0.0), pixels);
            (vec![camera], area * f64::from(pixels * pixels))
        };
        // Sizes at which texels and pixels do not fall on each other, as they never do on a tree: a
        // mip of two opaque texels in four is the cutoff itself.
        let ((near, near_area), (own, own_area), (far, far_area)) =
            (seen(320.0), seen(61.0), seen(30.5));
        let goal = AreaGoal {
            near,
            near_area,
            own,
            own_area,
            far,
            far_area,
        };
        let tree = Standing {
            charts: 0..foliage.charts.len(),
            wood: &[],
            goal: &goal,
        };
        match_area(&mut foliage, score, &[tree], CONTRAST_GUESS)
    }

    /// 0 to 9, alike over 3 x 3 texels.
    fn clump(x: u32, y: u32) -> u32 {
        let cell = (x / 3).wrapping_mul(0x9e37_79b9) ^ (y / 3).wrapping_mul(0x85eb_ca6b);
        (cell ^ (cell >> 15)).wrapping_mul(0x2c1b_3c6d) / 65_536 % 10
    }

    #[test]
    fn sparse_leaves_get_a_floor_and_keep_their_area_from_afar() {
        let found = matched(|x, y| clump(x, y) < 3);
        assert!(found.contrast > 0, "{found:?}");
        assert!((found.near_ratio - 1.0).abs() < 0.05, "{found:?}");
        let mean = (found.own_ratio + found.far_ratio) / 2.0;
        assert!((mean - 1.0).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn dense_leaves_get_a_ceiling_and_do_not_close_up() {
        let found = matched(|x, y| clump(x, y) < 7);
        assert!(found.contrast < 0, "{found:?}");
        assert!((found.near_ratio - 1.0).abs() < 0.05, "{found:?}");
    }

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

    #[test]
    fn alphas_stay_on_their_sides_of_the_cutoff() {
        for contrast in [-120, -1, 0, 1, 120] {
            let found = Matched {
                contrast,
                ..Matched::default()
            };
            let [opaque, other] = found.alphas();
            assert!(
                opaque >= 135 && other <= 120,
                "{contrast}: {opaque} {other}"
            );
        }
    }
}
