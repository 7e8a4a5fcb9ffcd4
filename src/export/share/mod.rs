//! Cards that share texels (Deng, "Memory Strategy"; Kratt 2014, 3.2, for the idea of copies).
//!
//! A level's largest cards keep tiles of their own on a smaller page. Every other card is a copy: it
//! shows the piece of a tile that looks most like it (opacity and colour after the best of many
//! moves and turns found, seen from the front or from behind), and what a texel shows is then
//! fitted for all cards that show it. Small cards lose least: a page has many pieces of their size,
//! and their gutters were the larger part of them. Where cards show one leaf each, congruent leaves need
//! no search: a few tiles, finer than others, stand for all of them. Cards of several trees of a species
//! share one page the same way.

mod cards;
mod fitted;
mod lone;
mod look;
mod owner;
mod rank;
mod search;
mod sheet;
mod window;

use std::collections::HashMap;

use glam::Vec2;
use rayon::prelude::*;

use super::atlas::place;
use super::chart::{Chart, Shape};
use super::foliage::{CardGroup, Foliage};
use super::project::{Texel, project};
use crate::space::hull;

pub use cards::Cards;
use cards::{Of, all_of};
pub use fitted::Fitted;
pub use lone::{Lone, lone};
use look::{Look, Page, upright};
pub use owner::owners;
use rank::Ranking;
pub use sheet::sheet;
use window::Window;

/// A page that may be smaller than the cards need together.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Width and height in texels.
    pub size: [u32; 2],
    /// Texels along a line over those that levels should have; 1 or less.
    pub finer: f32,
    /// All cards as they are ranked, by their number in the order of [`all_of`].
    order: Vec<u32>,
    /// So many of the first stand for families of lone leaves.
    standing: usize,
    /// Charts of the first ones, placed.
    kept: Vec<Chart>,
}

/// Densities that are tried, over that of the level: each is `2^(-1/4)` of the one before.
const DENSITIES: i32 = 9;

/// Share of all cards' area that has tiles of its own where a density is taken: large copies lose more
/// than coarser texels do, small ones less. On a quarter of its page an oak of 1,306 cards loses .008
/// of F1 where all are kept, .006 with this, .010 with .6; a palm of 1,991 more than .010, .006, .005 (measured
/// with gutters as wide as those of pages that share nothing).
const KEPT: f64 = 0.75;

/// Texels along a line, over others', of tiles that stand for a family: its leaves lie on it at any angle.
const FOR_ALL: f32 = 2.0;

impl Plan {
    /// The finest texels with which most of the cards' area has tiles of its own on a page of this
    /// size; `None` where even the coarsest are too many.
    pub fn new(trees: &[Cards], size: [u32; 2]) -> Option<Self> {
        let all = all_of(trees);
        let ranking = Ranking::new(trees);
        let area = |count: usize| ranking.areas[..count].iter().sum::<f64>();
        let ranked: Vec<Of> = ranking.order.iter().map(|&i| all[i as usize]).collect();
        (0..DENSITIES).find_map(|step| {
            let finer = (-0.25 * step as f32).exp2();
            let kept = keep(trees, &ranked, ranking.standing, finer, size);
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

    /// Whether every card has a tile of its own, as fine as it should be.
    pub fn is_complete(&self) -> bool {
        self.finer == 1.0 && self.kept.len() == self.order.len()
    }

    /// The cards of all trees, in their order, on this page, as projected; `None` where a card is larger
    /// than the page.
    pub fn share(&self, trees: &[Cards]) -> Option<Foliage> {
        let all = all_of(trees);
        let (first, rest) = self.order.split_at(self.kept.len());
        let own: Vec<Of> = first.iter().map(|&i| all[i as usize]).collect();
        let page = Page::new(trees, &own, &self.kept, self.size);
        let mut standing = Standing::new();
        for (of, tile) in own[..self.standing].iter().zip(&self.kept) {
            if let Some((family, lone)) = of.lone(trees) {
                standing.entry(family).or_default().push((lone, tile));
            }
        }
        let copies: Option<Vec<Chart>> = rest
            .par_iter()
            .map(|&i| {
                let of = all[i as usize];
                let density = trees[of.tree as usize].density * self.finer;
                let look = Look::new(of.fitted(trees), of.before(trees), density);
                let known = known(of, trees, &standing, &look, density);
                let window = Window::best(&known, &look, &page, i.into())
                    .or_else(|| Window::find(&look, &page, i.into()))?;
                Some(window.chart(of.before(trees), &look, density))
            })
            .collect();
        let mut numbered: Vec<(u32, Chart)> = self
            .order
            .iter()
            .copied()
            .zip(self.kept.iter().cloned().chain(copies?))
            .collect();
        numbered.sort_by_key(|&(i, _)| i);
        let charts = numbered.into_iter().map(|(_, chart)| chart).collect();
        let mut foliage = Foliage::of(charts, self.size);
        let mut start = 0;
        for cards in trees {
            foliage.project(start, cards.model, cards.groups, cards.samples);
            start += cards.groups.len();
        }
        add_copies(&mut foliage, trees);
        foliage.threshold(0.5, 0);
        Some(foliage)
    }
}

/// Leaves and tiles that stand for a family.
type Standing<'a> = HashMap<(u32, u32), Vec<(&'a Lone, &'a Chart)>>;

/// The windows through which a card shows tiles that stand for its family.
fn known(of: Of, trees: &[Cards], standing: &Standing, look: &Look, density: f32) -> Vec<Window> {
    let found = of.lone(trees).and_then(|(family, lone)| {
        let tiles = standing.get(&family)?.iter();
        let window = |&(other, tile): &(&Lone, &Chart)| {
            Window::onto(look, density, tile, |p| lone.onto(other, p))
        };
        Some(tiles.filter_map(window).collect())
    });
    found.unwrap_or_default()
}

/// Charts of as many of the first cards as have room on the page; those that stand for families have finer texels.
fn keep(trees: &[Cards], order: &[Of], standing: usize, finer: f32, size: [u32; 2]) -> Vec<Chart> {
    let chart = |(rank, of): (usize, &Of)| {
        let cards = &trees[of.tree as usize];
        let card = &of.group(trees).card;
        let finer = if rank < standing {
            finer * FOR_ALL
        } else {
            finer
        };
        upright(Chart::new(card, cards.density * finer, cards.pad))
    };
    let all: Vec<Chart> = order.par_iter().enumerate().map(chart).collect();
    let fit = |count: usize| {
        let mut charts = all[..count].to_vec();
        place(&mut charts, size).then_some(charts)
    };
    let (mut best, mut too_many) = (Vec::new(), order.len() + 1);
    while best.len() + 1 < too_many {
        let middle = usize::midpoint(best.len(), too_many);
        match fit(middle) {
            Some(charts) => best = charts,
            None => too_many = middle,
        }
    }
    for chart in best.iter_mut().filter(|c| c.turned) {
        chart.tangent = -chart.tangent;
    }
    best
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
            drawn(chart, of.group(trees), &trees[of.tree as usize], width)
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
fn drawn(chart: &Chart, group: &CardGroup, cards: &Cards, width: u32) -> Vec<(usize, Texel)> {
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
