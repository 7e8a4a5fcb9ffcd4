//! Cards that share texels (Deng, "Memory Strategy"; Kratt 2014, 3.2, for the idea of copies).
//!
//! A level's largest cards keep tiles of their own on a smaller page. Every other card is a copy: it
//! shows the piece of a tile that looks most like it (opacity and colour after the best of many
//! moves and turns found, seen from the front or from behind), and what a texel shows is then
//! fitted for all cards that show it. Small cards lose least: a page has many pieces of their size,
//! and their gutters were the larger part of them. Where most of a card is one sub-tree, it is laid over those of
//! others that are like it first, connector on connector. A copy that is farther off than the recipe allows
//! gets a tile of its own. Where cards show one leaf each, congruent leaves need
//! no search: a few tiles, finer than others, stand for all of them. Cards of several trees of a species
//! share one page the same way.

mod cards;
mod copies;
mod fitted;
mod kin;
mod lone;
mod look;
mod mean;
mod owner;
mod plan;
mod rank;
mod relatives;
mod search;
mod sheet;
mod window;

use super::chart::Chart;
use super::foliage::Foliage;
use super::maps::Maps;

pub use cards::Cards;
use copies::{Copy, copies};
pub use fitted::Fitted;
pub use kin::{Kin, kin};
pub use lone::{Lone, lone};
use mean::add_copies;
pub use owner::owners;
pub use plan::Plan;
pub use sheet::sheet;

/// Where copies are too far off, those get tiles that are off by more than these shares of what is allowed, turn by turn:
/// a new tile moves all others, and what was nearly too far off may be so then.
const SHARES: [f64; 6] = [0.9, 0.7, 0.5, 0.3, 0.0, 0.0];

/// Cards on a page that they share.
pub struct Shared {
    /// The cards of all trees, in their order, as projected.
    pub foliage: Foliage,
    /// Texels along a line over those that levels should have; 1 or less.
    pub finer: f32,
    /// Largest squared difference of a copy from what it should look like, over that of an empty card.
    pub farthest: f32,
}

/// Cards on a page of this size. Copies differ from what they should look like by no more than `tolerance` of what empty
/// cards would; `None` where the page has not room enough for all others.
pub fn share(trees: &[Cards], size: [u32; 2], tolerance: f64) -> Option<Shared> {
    let mut plan = Plan::new(trees, size)?;
    for share in SHARES {
        let copies = copies(&plan, trees)?;
        let farther = |most: f64| {
            let farther = copies.iter().filter(move |c| f64::from(c.off) > most);
            farther.map(|copy| copy.card)
        };
        if farther(tolerance).next().is_none() {
            return Some(drawn_on(&plan, copies, trees));
        }
        plan = plan.with(trees, farther(share * tolerance).collect())?;
    }
    None
}

/// All cards as projected: tiles, and what copies add to them.
fn drawn_on(plan: &Plan, copies: Vec<Copy>, trees: &[Cards]) -> Shared {
    let farthest = copies.iter().map(|copy| copy.off).fold(0.0, f32::max);
    let kept = plan.order.iter().copied().zip(plan.kept.iter().cloned());
    let copies = copies.into_iter().map(|copy| (copy.card, copy.chart));
    let mut numbered: Vec<(u32, Chart)> = kept.chain(copies).collect();
    numbered.sort_by_key(|&(i, _)| i);
    let charts = numbered.into_iter().map(|(_, chart)| chart).collect();
    let maps = trees.iter().map(|cards| Maps::of(cards.model));
    let maps = maps.reduce(Maps::with).unwrap_or_default();
    let mut foliage = Foliage::of(charts, plan.size, maps);
    let mut start = 0;
    for cards in trees {
        foliage.project(start, cards.model, cards.groups, cards.samples);
        start += cards.groups.len();
    }
    add_copies(&mut foliage, trees);
    foliage.threshold(0.5, 0);
    Shared {
        foliage,
        finer: plan.finer,
        farthest,
    }
}
