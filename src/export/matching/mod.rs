//! Matches a level's covered area to the original's, as an engine renders it.
//!
//! Alpha in a plain PNG decides what is seen from near, where the base level is read, and from afar, where
//! box filtered mips are. Which texels are opaque is one threshold of their scores: it sets the area from near.
//! By how much their alpha differs from the cutoff is free, and so it is chosen mip by mip which blocks of texels
//! pass (`mips`), such that a client covers what the original does (`rounds`).

mod block;
mod found;
mod mips;
mod pixels;
mod rounds;
mod rule;
mod stands;

pub use self::found::Matched;
use self::rule::Rule;
pub use self::stands::Standing;
use self::stands::Stands;
use super::foliage::Foliage;

/// A threshold is looked for between these first: those of an oak's levels are .35 to .65.
const FIRST_RANGE: [f32; 2] = [0.25, 0.75];

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

    /// Sets alpha so that cards and wood of all trees together cover what their originals cover from near.
    pub fn near(&mut self, foliage: &mut Foliage) -> Matched {
        let mut found = Matched::default();
        if let Some(stands) = &mut self.stands {
            (found.threshold, found.near_ratio) = stands.threshold(FIRST_RANGE, 1.0);
            stands.fill(foliage, &Rule::of(found.threshold));
        }
        found
    }

    /// The same as a client draws it, once it is so from [`near`](Self::near).
    pub fn client(mut self, foliage: &mut Foliage, found: &mut Matched) {
        if let Some(stands) = &mut self.stands {
            rounds::match_mips(stands, foliage, found);
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

    /// Where the level starts and at twice that distance: at these sizes texels and pixels do not fall on each other,
    /// as they never do on a tree.
    const SIZES: [f32; 2] = [61.0, 30.5];

    /// What a card whose leaves have this area covers: at 320 pixels, and as a client draws it.
    fn goal(area: f64) -> AreaGoal {
        let seen = |pixels: f32| {
            let camera = camera(&direction(0.0, 0.0), pixels);
            Sight {
                cameras: vec![camera],
                area: area * f64::from(pixels * pixels),
            }
        };
        AreaGoal {
            near: seen(320.0),
            client: SIZES.map(seen).to_vec(),
        }
    }

    /// What is covered by a card matched from near alone, and as a client draws it.
    fn matched(opaque: impl Fn(u32, u32) -> bool) -> [Matched; 2] {
        let (mut foliage, score, area) = card_with(opaque);
        let goal = goal(area);
        let standing = Standing {
            charts: 0..1,
            wood: &[],
            goal: &goal,
        };
        let measured = |foliage: &Foliage| {
            let mut stands = Stands::new(foliage, score.clone(), std::slice::from_ref(&standing));
            stands.set_alpha(&foliage.alpha);
            stands.client_ratios()
        };
        let mut matching = Matching::new(&foliage, score.clone(), std::slice::from_ref(&standing));
        let mut near = matching.near(&mut foliage);
        near.ratios = measured(&foliage);
        let mut found = near.clone();
        matching.client(&mut foliage, &mut found);
        assert_eq!(found.ratios, measured(&foliage));
        [near, found]
    }

    fn off(ratios: &[f64]) -> f64 {
        ratios
            .iter()
            .map(|ratio| (ratio - 1.0).abs())
            .fold(0.0, f64::max)
    }

    /// 0 to 9, alike over 3 x 3 texels.
    fn clump(x: u32, y: u32) -> u32 {
        let cell = (x / 3).wrapping_mul(0x9e37_79b9) ^ (y / 3).wrapping_mul(0x85eb_ca6b);
        (cell ^ (cell >> 15)).wrapping_mul(0x2c1b_3c6d) / 65_536 % 10
    }

    #[test]
    fn sparse_leaves_do_not_dissolve_in_mips() {
        let [near, found] = matched(|x, y| clump(x, y) < 2);
        assert!((near.near_ratio - 1.0).abs() < 0.01, "{near:?}");
        assert!(near.ratios[1] < 0.9, "{near:?} {found:?}");
        assert!((found.near_ratio - 1.0).abs() < 0.05, "{found:?}");
        assert!(off(&found.ratios) < 0.06, "{near:?} {found:?}");
    }

    #[test]
    fn dense_leaves_do_not_close_up_in_mips() {
        // Holes of single texels.
        let [near, found] = matched(|x, y| clump(3 * x, 3 * y) < 8);
        assert!((near.near_ratio - 1.0).abs() < 0.01, "{near:?}");
        assert!(near.ratios[1] > 1.08, "{near:?} {found:?}");
        assert!((found.near_ratio - 1.0).abs() < 0.05, "{found:?}");
        assert!(off(&found.ratios) < 0.06, "{near:?} {found:?}");
    }

    #[test]
    fn a_page_without_cards_is_left_alone() {
        let mut foliage = Foliage::default();
        let mut matching = Matching::new(&foliage, Vec::new(), &[]);
        let mut found = matching.near(&mut foliage);
        matching.client(&mut foliage, &mut found);
        assert_eq!(found, Matched::default());
    }
}
