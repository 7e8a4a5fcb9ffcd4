//! Windows for the cards that have no tiles of their own.

use std::collections::HashMap;

use rayon::prelude::*;

use super::cards::{Cards, Of, all_of};
use super::lone::Lone;
use super::look::{Look, Page};
use super::plan::Plan;
use super::relatives::Relatives;
use super::window::Window;
use crate::export::chart::Chart;

/// A card that shows another's texels.
pub struct Copy {
    /// The card, by its number in the order of [`all_of`].
    pub card: u32,
    /// Where it lies.
    pub chart: Chart,
    /// Squared difference from what it should look like, over that of an empty card.
    pub off: f32,
}

/// Windows for all cards that have no tile; `None` where one is larger than the page.
pub fn copies(plan: &Plan, trees: &[Cards]) -> Option<Vec<Copy>> {
    let all = all_of(trees);
    let (first, rest) = plan.order.split_at(plan.kept.len());
    let own: Vec<Of> = first.iter().map(|&i| all[i as usize]).collect();
    let page = Page::new(trees, &own, &plan.kept, plan.size);
    let standing = standing(&own[..plan.standing], &plan.kept, trees);
    let relatives = Relatives::new(own.iter().map(|of| of.kin(trees)).zip(&plan.kept));
    let copy = |&card: &u32| {
        let of = all[card as usize];
        let density = trees[of.tree as usize].density * plan.finer;
        let look = Look::new(of.fitted(trees), of.before(trees), density);
        let known = known(of, trees, &standing, &look, density);
        let window = Window::best(&known, &look, &page, card.into()).or_else(|| {
            let likely = of
                .kin(trees)
                .map(|kin| relatives.windows(kin, &look, density));
            Window::find(&likely.unwrap_or_default(), &look, &page, card.into())
        })?;
        Some(Copy {
            card,
            chart: window.chart(of.before(trees), &look, density),
            off: window.difference / look.of_empty(),
        })
    };
    rest.par_iter().map(copy).collect()
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

/// The tiles `kept` of cards that stand for families.
fn standing<'a>(own: &[Of], kept: &'a [Chart], trees: &'a [Cards<'a>]) -> Standing<'a> {
    let mut standing = Standing::new();
    for (of, tile) in own.iter().zip(kept) {
        if let Some((family, lone)) = of.lone(trees) {
            standing.entry(family).or_default().push((lone, tile));
        }
    }
    standing
}
