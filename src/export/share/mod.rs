//! Cards that share texels (Deng, "Memory Strategy"; Kratt 2014, 3.2, for the idea of copies).
//!
//! A level's largest cards keep tiles of their own on a smaller page. Every other card is a copy: it
//! shows the piece of a tile that looks most like it (opacity and colour after the best of many
//! moves and turns found, seen from the front or from behind), and what a texel shows is then
//! fitted for all cards that show it. Small cards lose least: a page has many pieces of their size,
//! and their gutters were the larger part of them.

mod look;
mod owner;
mod sheet;
mod window;

use glam::Vec2;
use rayon::prelude::*;

use super::atlas::place;
use super::chart::{Chart, Shape};
use super::foliage::{CardGroup, Foliage};
use super::project::project;
use crate::botany::model::Model;
use crate::space::hull;

pub use look::Fitted;
use look::{Look, Page, upright};
pub use owner::owners;
pub use sheet::sheet;
use window::Window;

/// The cards of a level and how they are drawn.
#[derive(Clone, Copy)]
pub struct Cards<'a> {
    /// The tree.
    pub model: &'a Model,
    /// Its cards.
    pub groups: &'a [CardGroup],
    /// Sub-samples a texel along each axis.
    pub samples: u32,
    /// Gutter on each side of a chart, texels.
    pub pad: f32,
}

/// A page that is smaller than the cards need together.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Width and height in texels.
    pub size: [u32; 2],
    /// Texels a normalised unit.
    pub density: f32,
    /// All cards, the largest first.
    order: Vec<u32>,
    /// Charts of the first ones, placed.
    kept: Vec<Chart>,
}

/// Densities that are tried, over that of the level: each is `2^(-1/4)` of the one before.
const DENSITIES: i32 = 9;

/// Share of all cards' area that has tiles of its own where a density is taken: large copies lose more
/// than coarser texels do, small ones less. On a quarter of its page an oak of 1,306 cards loses .008
/// of F1 where all are kept, .006 with this, .010 with .6; a palm of 1,991 more than .010, .006, .005.
const KEPT: f64 = 0.75;

impl Plan {
    /// The finest texels with which most of the cards' area has tiles of its own on a page of this
    /// size; `None` where even the coarsest are too many.
    pub fn new(cards: Cards, density: f32, size: [u32; 2]) -> Option<Self> {
        let area = |i: u32| f64::from(cards.groups[i as usize].card.area());
        let mut order: Vec<u32> = (0..cards.groups.len() as u32).collect();
        order.sort_by(|&a, &b| area(b).total_cmp(&area(a)).then(a.cmp(&b)));
        let all: f64 = order.iter().map(|&i| area(i)).sum();
        (0..DENSITIES).find_map(|step| {
            let density = density * (-0.25 * step as f32).exp2();
            let kept = keep(cards, &order, density, size);
            let held: f64 = order[..kept.len()].iter().map(|&i| area(i)).sum();
            (held >= KEPT * all).then(|| Self {
                size,
                density,
                order: order.clone(),
                kept,
            })
        })
    }

    /// The cards on this page, as projected; `None` where a card is larger than the page.
    pub fn share(&self, cards: Cards, fitted: Fitted) -> Option<Foliage> {
        let before = |i: u32| &fitted.foliage.charts[i as usize];
        let (first, rest) = self.order.split_at(self.kept.len());
        let own: Vec<&Chart> = first.iter().map(|&i| before(i)).collect();
        let page = Page::new(fitted, &own, &self.kept, self.size);
        let copies: Option<Vec<Chart>> = rest
            .par_iter()
            .map(|&i| {
                let look = Look::new(fitted, before(i), self.density);
                let window = Window::find(&look, &page, i.into())?;
                Some(window.chart(before(i), &look, self.density))
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
        foliage.project(cards.model, cards.groups, cards.samples);
        add_copies(&mut foliage, cards);
        foliage.threshold(0.5, 0);
        Some(foliage)
    }
}

/// Charts of as many of the largest cards as have room on the page.
fn keep(cards: Cards, order: &[u32], density: f32, size: [u32; 2]) -> Vec<Chart> {
    let chart = |&i: &u32| {
        let card = &cards.groups[i as usize].card;
        upright(Chart::new(card, density, cards.pad))
    };
    let all: Vec<Chart> = order.par_iter().map(chart).collect();
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

/// Makes every texel's coverage the mean over all cards that show it.
fn add_copies(foliage: &mut Foliage, cards: Cards) {
    let all = foliage.charts.iter().zip(cards.groups);
    let copies: Vec<_> = all.filter(|(c, _)| c.shape == Shape::Window).collect();
    let drawn: Vec<Vec<(usize, f32)>> = copies
        .par_iter()
        .map(|(chart, group)| coverage(chart, group, cards, foliage.size[0]))
        .collect();
    let mut sums: Vec<(f32, u32)> = foliage.texels.iter().map(|t| (t.coverage(), 1)).collect();
    for (at, coverage) in drawn.into_iter().flatten() {
        sums[at].0 += coverage;
        sums[at].1 += 1;
    }
    for (texel, (sum, count)) in foliage.texels.iter_mut().zip(sums) {
        if count > 1 {
            texel.set_coverage(sum / count as f32);
        }
    }
}

/// What a copy's own leaves cover of the texels that it shows, by their index on the page.
fn coverage(chart: &Chart, group: &CardGroup, cards: Cards, width: u32) -> Vec<(usize, f32)> {
    let drawn = project(
        cards.model,
        group.triangles.iter().copied(),
        chart,
        cards.samples,
    );
    let outline: Vec<Vec2> = chart.corners.iter().map(|&c| chart.texel(c)).collect();
    let [w, h] = chart.size;
    let all = (0..w * h).map(|i| (i, Vec2::new((i % w) as f32 + 0.5, (i / w) as f32 + 0.5)));
    all.filter(|&(_, texel)| hull::holds(&outline, texel, 0.0))
        .map(|(i, _)| {
            let [ax, ay] = chart.in_atlas(i % w, i / w);
            (
                (ay * width + ax) as usize,
                drawn.texels[i as usize].coverage,
            )
        })
        .collect()
}
