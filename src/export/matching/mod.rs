//! Matches a level's covered area to the original's, as an engine renders it.
//!
//! Alpha in a plain PNG has two free numbers. The threshold decides which texels are opaque, and
//! sets the area seen from near, where the base level is read. The contrast decides what box
//! filtered mips do with it from afar: a floor under the cutoff keeps sparse leaves from
//! dissolving, a ceiling over it keeps dense ones from closing up. For every contrast there is one
//! threshold that gives the right area near; the contrast is searched whose area at the level's
//! own distance and at twice it errs as little to one side as to the other. Levels that are seen from
//! farther need more numbers than two (`far`).

mod block;
mod far;
mod found;
mod mips;
mod rule;
mod stands;

use self::found::HIGHEST_CONTRAST;
pub use self::found::Matched;
pub use self::stands::Standing;
use self::stands::Stands;
use super::foliage::Foliage;
use crate::space::root::Search;

/// Least whole alpha that passes the alpha test of one half.
const LEAST_PASSING: f64 = 128.0;

/// Areas from afar this close are the same.
const FAR_TOLERANCE: f64 = 4e-3;

/// The contrast at which to begin where nothing is known: those of 48 pages of eleven trees are 32 to 112.
pub const CONTRAST_GUESS: i32 = 70;

/// A threshold is looked for so far around one half first: those of an oak's levels are .35 to .65.
const FIRST_RANGE: f32 = 0.25;

/// Later it is looked for so far around the last one, and so much farther for each step that the
/// contrast has made: on an oak's levels a step moves it by .0026. Beyond that all are looked at again.
const RANGE: [f32; 2] = [0.02, 0.005];

/// How steeply areas from afar fall as [`share_that_passes`] rises: on levels of an oak and of an airy birch by .3 to 2.5.
const AREA_A_SHARE: f64 = 0.4;

/// Most change of that share before it is known on which side the answer lies.
const MOST_STEP: f64 = 0.2;

/// How well the share is to be known: two to four steps of the contrast.
const GRAIN: f64 = 0.01;

/// The share of opaque texels from which on a texel of a mip passes the alpha test: areas from afar are nearly straight
/// over it, and over the contrast they are not.
fn share_that_passes(contrast: f64) -> f64 {
    match contrast > 0.0 {
        true => (LEAST_PASSING - contrast) / (255.0 - contrast),
        false => LEAST_PASSING / (255.0 + contrast),
    }
}

/// The contrast at which it is such a share.
fn contrast_of(share: f64) -> f64 {
    match share < LEAST_PASSING / 255.0 {
        true => (LEAST_PASSING - 255.0 * share) / (1.0 - share),
        false => LEAST_PASSING / share - 255.0,
    }
}

/// The search for the alpha of a page, of which trees have cards.
pub struct Matching<'a> {
    /// `None` where there are no cards.
    stands: Option<Stands<'a>>,
}

impl<'a> Matching<'a> {
    /// Alpha is to come from `score`, one a texel.
    pub fn new(foliage: &Foliage, score: Vec<f32>, trees: &[Standing<'a>]) -> Self {
        let cards = !foliage.charts.is_empty();
        Self {
            stands: cards.then(|| Stands::new(foliage, score, trees)),
        }
    }

    /// Sets alpha so that cards and wood of all trees together cover what their originals cover, to twice
    /// the distance where the level starts; the search begins at the contrast `guess`.
    pub fn area(&mut self, foliage: &mut Foliage, guess: i32) -> Matched {
        let mut found = Matched {
            threshold: 0.5,
            ..Matched::default()
        };
        let Some(stands) = &mut self.stands else {
            return found;
        };
        let search = Search {
            range: [
                share_that_passes(HIGHEST_CONTRAST),
                share_that_passes(-HIGHEST_CONTRAST),
            ],
            guess: share_that_passes(guess.into()),
            slope: AREA_A_SHARE,
            step: MOST_STEP,
            grain: GRAIN,
            tolerance: FAR_TOLERANCE,
        };
        let mut before = None;
        let mut best: Option<Matched> = None;
        search.falling(|share| {
            found.contrast = contrast_of(share).round() as i32;
            let range = match before.replace(found.contrast) {
                None => FIRST_RANGE,
                Some(before) => RANGE[0] + RANGE[1] * found.contrast.abs_diff(before) as f32,
            };
            let range = [found.threshold - range, found.threshold + range];
            (found.threshold, found.near_ratio) = stands.threshold(found.alphas(), range, 1.0);
            stands.fill(foliage, &found.rule());
            found.ratios = [0, 1].map(|sight| stands.client_ratio(sight)).to_vec();
            let off = 1.0 - found.balance();
            if best
                .as_ref()
                .is_none_or(|best| off.abs() < (1.0 - best.balance()).abs())
            {
                best = Some(found.clone());
            }
            -off
        });
        // A search ends beside the nearest as often as on it.
        match best {
            Some(best) if best != found => {
                stands.fill(foliage, &best.rule());
                best
            }
            _ => found,
        }
    }

    /// The same from as far as anybody looks, once the area is matched.
    pub fn from_afar(self, foliage: &mut Foliage, found: &mut Matched) {
        if let Some(mut stands) = self.stands {
            far::keep(&mut stands, foliage, found);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::botany::model::Model;
    use crate::cloud::card::Card;
    use crate::export::atlas::Layout;
    use crate::export::foliage::{BakeOptions, CardGroup};
    use crate::export::level_scene::{AreaGoal, Sight};
    use crate::export::original::camera;
    use crate::recipe::Packer;
    use crate::space::directions::direction;

    /// A card of 64 x 64 texels of which a share scores high, in clumps; scores are as fine as those of a tree.
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
                f32::from(u8::from(on)) + 0.008 * (i * 7919 % 97) as f32
            })
            .collect();
        let owned = foliage.owned.count_ones(..);
        // The gutter around the card is owned too: the card's own share is that of all.
        (foliage, score, f64::from(wanted) / owned as f64)
    }

    /// What a card whose leaves have this area covers: at 320 pixels, and as a client draws it at these.
    fn goal(area: f64, client: &[f32]) -> AreaGoal {
        let seen = |pixels: f32| {
            let camera = camera(&direction(0.0, 0.0), pixels);
            Sight {
                cameras: vec![camera],
                area: area * f64::from(pixels * pixels),
            }
        };
        AreaGoal {
            near: seen(320.0),
            client: client.iter().map(|&pixels| seen(pixels)).collect(),
        }
    }

    /// A card matched at these sizes, and what it covers at all [`SIZES`].
    fn matched_at(opaque: impl Fn(u32, u32) -> bool, client: &[f32]) -> (Matched, Vec<f64>) {
        let (mut foliage, score, area) = card_with(opaque);
        let goal = |sizes| goal(area, sizes);
        let (asked, all) = (goal(client), goal(&SIZES));
        let standing = |goal| Standing {
            charts: 0..1,
            wood: &[],
            goal,
        };
        let (asked, all) = (standing(&asked), standing(&all));
        let mut matching = Matching::new(&foliage, score.clone(), &[asked]);
        let mut found = matching.area(&mut foliage, CONTRAST_GUESS);
        matching.from_afar(&mut foliage, &mut found);
        let mut stands = Stands::new(&foliage, score, &[all]);
        stands.set_alpha(&foliage.alpha);
        let seen = stands.client_ratios();
        assert_eq!(found.ratios, seen[..client.len()]);
        (found, seen)
    }

    /// Sizes at which texels and pixels do not fall on each other, as they never do on a tree: a mip of
    /// two opaque texels in four is the cutoff itself.
    const SIZES: [f32; 4] = [61.0, 30.5, 15.3, 7.7];

    fn matched(opaque: impl Fn(u32, u32) -> bool) -> Matched {
        matched_at(opaque, &SIZES[..2]).0
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
        let mean = found.balance();
        assert!((mean - 1.0).abs() < 0.1, "{found:?}");
    }

    #[test]
    fn a_level_that_never_ends_is_seen_from_afar() {
        // Two texels in ten, more of them to the left.
        let leaves = |x: u32, y: u32| clump(x, y) < if x < 32 { 3 } else { 1 };
        let (_, dissolved) = matched_at(leaves, &SIZES[..2]);
        let (found, kept) = matched_at(leaves, &SIZES);
        assert!((found.balance() - 1.0).abs() < 0.1, "{found:?}");
        // At four and eight times the distance.
        let errors = |ratios: &[f64]| ratios[2..].iter().map(|r| (r - 1.0).abs()).sum::<f64>();
        let (before, after) = (errors(&dissolved), errors(&kept));
        assert!(
            before > 0.5 && after < 0.85 * before,
            "{dissolved:?} {kept:?}"
        );
    }

    #[test]
    fn dense_leaves_get_a_ceiling_and_do_not_close_up() {
        let found = matched(|x, y| clump(x, y) < 7);
        assert!(found.contrast < 0, "{found:?}");
        assert!((found.near_ratio - 1.0).abs() < 0.05, "{found:?}");
    }

    #[test]
    fn wherever_the_search_begins_it_ends_where_areas_are_alike() {
        for most in [3, 7] {
            let (mut foliage, score, area) = card_with(|x, y| clump(x, y) < most);
            let goal = goal(area, &SIZES[..2]);
            let mut balance = |guess| {
                let standing = Standing {
                    charts: 0..1,
                    wood: &[],
                    goal: &goal,
                };
                let mut matching = Matching::new(&foliage, score.clone(), &[standing]);
                matching.area(&mut foliage, guess).balance()
            };
            let found = [-112, -40, CONTRAST_GUESS, 112].map(&mut balance);
            for balance in found {
                assert!((balance - found[2]).abs() < 0.05, "{most}: {found:?}");
            }
        }
    }

    #[test]
    fn a_floor_lets_mips_pass_with_fewer_opaque_texels_and_a_ceiling_with_more() {
        // Of 255 and 120 eight parts in 135 make the cutoff of 128; of 135 and nothing all but seven.
        for (contrast, share) in [
            (120.0, 8.0 / 135.0),
            (0.0, 128.0 / 255.0),
            (-120.0, 128.0 / 135.0),
        ] {
            assert!(
                (share_that_passes(contrast) - share).abs() < 1e-12,
                "{contrast}"
            );
        }
        for contrast in -120..=120 {
            let again = contrast_of(share_that_passes(contrast.into()));
            assert_eq!(again.round() as i32, contrast);
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
