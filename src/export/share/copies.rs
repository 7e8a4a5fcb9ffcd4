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

/// A card's difference from an empty one, at least, over the mean of all copies'. Without it a copy that shows nothing of a
/// card of a few faint texels counts as one that shows nothing of what it should: eleven such cards, of 833 of three small
/// oaks, that lack .0001 to .007 of their texels kept a page from being shared. With .1 an airy birch, few of whose texels
/// are opaque, gets fewer tiles, and its third level finds no page.
const FAINT: f32 = 0.05;

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
        let copy = Copy {
            card,
            chart: window.chart(of.before(trees), &look, density),
            // Not yet over anything: what is faint is told by all copies.
            off: window.difference,
        };
        Some((copy, look.of_empty()))
    };
    let found: Option<Vec<(Copy, f32)>> = rest.par_iter().map(copy).collect();
    Some(over_empty(found?))
}

/// Copies with their differences over those of empty cards, which are beside them; the faintest count as [`FAINT`].
fn over_empty(found: Vec<(Copy, f32)>) -> Vec<Copy> {
    let mean = found.iter().map(|(_, empty)| empty).sum::<f32>() / found.len().max(1) as f32;
    let over = |(copy, empty): (Copy, f32)| Copy {
        off: copy.off / empty.max(FAINT * mean),
        ..copy
    };
    found.into_iter().map(over).collect()
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

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::cloud::card::Card;

    #[test]
    fn copies_are_as_far_off_as_empty_cards_would_be_unless_these_lack_next_to_nothing() {
        let rectangle = Card::rectangle(Vec3::ZERO, Vec3::X, Vec3::Y, Vec2::ONE);
        let found = |card: u32, off: f32, empty: f32| {
            let chart = Chart::new(&rectangle, 8.0, 1.0);
            (Copy { card, chart, off }, empty)
        };
        // A half of what it should show, nine tenths, and nothing of nearly nothing.
        let copies = over_empty(vec![
            found(0, 0.25, 0.5),
            found(1, 0.36, 0.4),
            found(2, 0.003, 0.003),
        ]);
        let faintest = FAINT * (0.5 + 0.4 + 0.003) / 3.0;
        let wanted = [0.5, 0.9, 0.003 / faintest];
        for (copy, wanted) in copies.iter().zip(wanted) {
            assert!((copy.off - wanted).abs() < 1e-6, "{}", copy.off);
        }
        assert!(copies[2].off < 0.25 && copies.len() == 3);
        assert!(over_empty(Vec::new()).is_empty());
    }
}
