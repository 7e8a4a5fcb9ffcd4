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
mod owner;
mod plan;
mod rank;
mod search;
mod sheet;
mod window;

use glam::Vec2;
use rayon::prelude::*;

use super::chart::{Chart, Shape};
use super::foliage::{CardGroup, Foliage};
use super::project::{Texel, project};
use crate::space::hull;

pub use cards::Cards;
use cards::all_of;
use copies::{Copy, copies};
pub use fitted::Fitted;
pub use kin::{Kin, kin};
pub use lone::{Lone, lone};
pub use owner::owners;
pub use plan::Plan;
pub use sheet::sheet;

/// Where copies are too far off, those get tiles that are off by more than these shares of what is allowed, turn by turn:
/// a new tile moves all others, and what was nearly too far off may be so then.
const SHARES: [f64; 5] = [0.9, 0.7, 0.5, 0.3, 0.0];

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
    let copies = copies(&plan, trees)?;
    Some(drawn_on(&plan, copies, trees))
}

/// All cards as projected: tiles, and what copies add to them.
fn drawn_on(plan: &Plan, copies: Vec<Copy>, trees: &[Cards]) -> Shared {
    let farthest = copies.iter().map(|copy| copy.off).fold(0.0, f32::max);
    let kept = plan.order.iter().copied().zip(plan.kept.iter().cloned());
    let copies = copies.into_iter().map(|copy| (copy.card, copy.chart));
    let mut numbered: Vec<(u32, Chart)> = kept.chain(copies).collect();
    numbered.sort_by_key(|&(i, _)| i);
    let charts = numbered.into_iter().map(|(_, chart)| chart).collect();
    let mut foliage = Foliage::of(charts, plan.size);
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

/// Makes every texel the mean of all cards that show it: coverage of all, colours and normals of what
/// covers it. A texel where only copies have leaves would be black otherwise.
fn add_copies(foliage: &mut Foliage, trees: &[Cards]) {
    let all = foliage.charts.iter().zip(all_of(trees));
    let copies: Vec<_> = all.filter(|(c, _)| c.shape == Shape::Window).collect();
    let width = foliage.size[0];
    let mut drawn: Vec<(usize, Texel)> = copies
        .par_iter()
        .flat_map_iter(|&(chart, of)| {
            shown_by(chart, of.group(trees), &trees[of.tree as usize], width)
        })
        .collect();
    // Those of one texel stay in the order of their cards.
    drawn.par_sort_by_key(|&(at, _)| at);
    for shown in drawn.chunk_by(|a, b| a.0 == b.0) {
        let stored = &mut foliage.texels[shown[0].0];
        let mut mass = stored.coverage();
        let mut sums = [stored.color(), stored.normal(), stored.orm()].map(|v| v * mass);
        for (_, texel) in shown {
            let values = [texel.color, texel.normal, texel.orm];
            sums = std::array::from_fn(|k| sums[k] + values[k] * texel.coverage);
            mass += texel.coverage;
        }
        if mass > 0.0 {
            let [color, normal, orm] = sums.map(|sum| sum / mass);
            stored.set_color(color);
            stored.set_normal(normal);
            stored.set_orm(orm);
        }
        stored.set_coverage(mass / (shown.len() + 1) as f32);
    }
}

/// What a copy's own leaves show on the texels that it shows, by their index on the page.
fn shown_by(chart: &Chart, group: &CardGroup, cards: &Cards, width: u32) -> Vec<(usize, Texel)> {
    let triangles = group.triangles.iter().copied();
    let drawn = project(cards.model, triangles, chart, cards.samples);
    let outline: Vec<Vec2> = chart.corners.iter().map(|&c| chart.texel(c)).collect();
    let [w, h] = chart.size;
    let all = (0..w * h).map(|i| (i, Vec2::new((i % w) as f32 + 0.5, (i / w) as f32 + 0.5)));
    all.filter(|&(_, texel)| hull::holds(&outline, texel, 0.0))
        .map(|(i, _)| {
            let [ax, ay] = chart.in_atlas(i % w, i / w);
            ((ay * width + ax) as usize, drawn.texels[i as usize])
        })
        .collect()
}
