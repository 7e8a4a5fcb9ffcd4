//! Which cards have tiles of their own on a page, and how fine these are.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::cards::{Cards, Of, all_of};
use super::look::upright;
use super::rank::Ranking;
use crate::export::atlas::place;
use crate::export::chart::Chart;

/// A page that may be smaller than the cards need together.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Width and height in texels.
    pub size: [u32; 2],
    /// Texels along a line over those that levels should have; 1 or less.
    pub finer: f32,
    /// All cards as they are ranked, by their number in the order of [`all_of`].
    pub(super) order: Vec<u32>,
    /// So many of the first stand for families of lone leaves.
    pub(super) standing: usize,
    /// Charts of the first ones, placed.
    pub(super) kept: Vec<Chart>,
}

/// Densities that are tried, over that of the level: each is `2^(-1/4)` of the one before.
const DENSITIES: i32 = 9;

/// The least density where more cards are given tiles.
const COARSEST: f32 = 0.2;

/// Share of all cards' area that has tiles of its own where a density is taken: large copies lose more
/// than coarser texels do, small ones less. On a quarter of its page an oak of 1,306 cards loses .008
/// of F1 where all are kept, .006 with this, .010 with .6; a palm of 1,991 more than .010, .006, .005 (measured
/// with gutters as wide as those of pages that share nothing).
const KEPT: f64 = 0.75;

/// Texels along a line, over others', of tiles that stand for a family: its leaves lie on it at any angle.
const FOR_ALL: f32 = 2.0;

impl Plan {
    /// The finest texels with which most of the cards' area has tiles of their own on a page of this
    /// size; `None` where even the coarsest are too many.
    pub fn new(trees: &[Cards], size: [u32; 2]) -> Option<Self> {
        let ranking = Ranking::new(trees);
        let area = |count: usize| ranking.areas[..count].iter().sum::<f64>();
        let all = Charts::new(trees, &ranking.order, ranking.standing);
        (0..DENSITIES).find_map(|step| {
            let finer = (-0.25 * step as f32).exp2();
            let kept = all.as_many_as_fit(finer, size);
            // Those that known tiles stand for are no loss.
            let held = area(kept.len().min(ranking.first));
            let enough = kept.len() >= ranking.standing && held >= KEPT * area(ranking.first);
            enough.then(|| Self {
                size,
                finer,
                standing: ranking.standing,
                order: ranking.order.clone(),
                kept,
            })
        })
    }

    /// The same where these cards have tiles of their own, too; texels are coarser where there is no room for them.
    pub fn with(&self, trees: &[Cards], own: BTreeSet<u32>) -> Option<Self> {
        let (first, rest) = self.order.split_at(self.kept.len());
        let rest = rest.iter().filter(|card| !own.contains(card));
        let order: Vec<u32> = first.iter().chain(&own).chain(rest).copied().collect();
        let all = Charts::new(trees, &order, self.standing);
        let densities = (0..).map(|step| self.finer * (-0.0625 * step as f32).exp2());
        let mut densities = densities.take_while(|&finer| finer >= COARSEST);
        let (finer, kept) = densities.find_map(|finer| {
            let kept = all.first(first.len() + own.len(), finer, self.size)?;
            Some((finer, kept))
        })?;
        Some(Self {
            size: self.size,
            finer,
            standing: self.standing,
            order,
            kept,
        })
    }

    /// Whether every card has a tile of its own, as fine as it should be.
    pub fn is_complete(&self) -> bool {
        self.finer == 1.0 && self.kept.len() == self.order.len()
    }
}

/// Cards in their order, whose charts are placed on a page.
struct Charts<'a> {
    trees: &'a [Cards<'a>],
    order: Vec<Of>,
    /// So many of the first have finer texels.
    standing: usize,
}

impl<'a> Charts<'a> {
    fn new(trees: &'a [Cards<'a>], order: &[u32], standing: usize) -> Self {
        let all = all_of(trees);
        Self {
            trees,
            order: order.iter().map(|&i| all[i as usize]).collect(),
            standing,
        }
    }

    /// The first so many, not yet placed.
    fn of_first(&self, count: usize, finer: f32) -> Vec<Chart> {
        let chart = |(rank, of): (usize, &Of)| {
            let cards = &self.trees[of.tree as usize];
            let card = &of.group(self.trees).card;
            let finer = if rank < self.standing {
                finer * FOR_ALL
            } else {
                finer
            };
            upright(Chart::new(card, cards.density * finer, cards.pad))
        };
        let order = self.order[..count].par_iter();
        order.enumerate().map(chart).collect()
    }

    /// The first so many; `None` where the page has not room enough.
    fn first(&self, count: usize, finer: f32, size: [u32; 2]) -> Option<Vec<Chart>> {
        let mut charts = self.of_first(count, finer);
        place(&mut charts, size).then(|| turned_back(charts))
    }

    /// As many of the first as have room.
    fn as_many_as_fit(&self, finer: f32, size: [u32; 2]) -> Vec<Chart> {
        let all = self.of_first(self.order.len(), finer);
        let fit = |count: usize| {
            let mut charts = all[..count].to_vec();
            place(&mut charts, size).then_some(charts)
        };
        let (mut best, mut too_many) = (Vec::new(), all.len() + 1);
        while best.len() + 1 < too_many {
            let middle = usize::midpoint(best.len(), too_many);
            match fit(middle) {
                Some(charts) => best = charts,
                None => too_many = middle,
            }
        }
        turned_back(best)
    }
}

/// Tangents of those that were turned on the page.
fn turned_back(mut charts: Vec<Chart>) -> Vec<Chart> {
    for chart in charts.iter_mut().filter(|c| c.turned) {
        chart.tangent = -chart.tangent;
    }
    charts
}

#[cfg(test)]
mod tests {
    use super::super::rank::tests::{cards, group};
    use super::*;
    use crate::botany::model::Model;
    use crate::export::foliage::{CardGroup, Foliage};

    #[test]
    fn a_copy_that_was_too_far_off_gets_a_tile_beside_those_that_are_there() {
        // The larger ones have nearly all of the area: their tiles fit, not all of the small ones.
        let sides = [8.0f32; 9].into_iter().chain([1.0; 40]);
        let groups: Vec<CardGroup> = sides.map(group).collect();
        let (model, foliage) = (Model::default(), Foliage::default());
        let trees = [cards(&model, &foliage, &groups, &[])];
        let plan = Plan::new(&trees, [48, 48]).unwrap();
        let tiles = plan.kept.len();
        assert!((9..49).contains(&tiles), "{tiles}");
        let far = plan.order[48];
        let with = plan.with(&trees, BTreeSet::from([far])).unwrap();
        assert_eq!(with.kept.len(), tiles + 1);
        assert_eq!(with.order[..tiles], plan.order[..tiles]);
        assert_eq!(with.order[tiles], far);
        let sorted = |plan: &Plan| plan.order.iter().copied().collect::<BTreeSet<u32>>();
        assert_eq!(sorted(&with), sorted(&plan));
        assert!(with.finer <= plan.finer && with.finer >= COARSEST);
        // Nor is there a page on which all cards have tiles, however coarse, where it is tiny.
        let all = plan.order[tiles..].iter().copied().collect();
        assert!(
            Plan {
                size: [8, 8],
                ..plan
            }
            .with(&trees, all)
            .is_none()
        );
    }
}
