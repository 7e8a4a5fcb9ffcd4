//! The search for the window through which a card shows the piece of a page that looks most like it.

use std::f32::consts::TAU;

use glam::Vec2;

use super::look::{Look, Page};
use super::window::Window;
use crate::space::random::Rng;

/// Random windows that are looked at for each card.
const TRIES: usize = 1500;

/// The best of them, which are moved to where they fit better.
const BEST: usize = 8;

/// Points of a card that a random window is judged by, and a better one.
const POINTS: [usize; 2] = [96, 400];

/// Times that the reach of a move shrinks, and moves at each of them.
const SHRINKS: u32 = 6;
const MOVES: u32 = 12;

impl Window {
    /// Whether the whole card is on the page.
    fn fits(&self, look: &Look, size: [u32; 2]) -> bool {
        // Room for rounding.
        let [w, h] = size.map(|side| side as f32 - 0.01);
        look.outline.iter().all(|&corner| {
            let p = self.place(corner);
            p.x >= 0.01 && p.y >= 0.01 && p.x <= w && p.y <= h
        })
    }

    /// The window with its difference over about `points` points of the card; `None` where it is
    /// not less than `most` or not on the page.
    fn judged(&self, look: &Look, page: &Page, points: usize, most: f32) -> Option<Self> {
        if !self.fits(look, page.size) {
            return None;
        }
        let step = look.points.len().div_ceil(points).max(1);
        let count = look.points.len().div_ceil(step) as f32;
        let mut sum = 0.0;
        for (q, wanted) in look.points.iter().step_by(step) {
            let p = self.place(*q);
            let x = (p.x as u32).min(page.size[0] - 1);
            let y = (p.y as u32).min(page.size[1] - 1);
            sum += wanted.difference(page.texels[(y * page.size[0] + x) as usize]);
            if sum >= most * count {
                return None;
            }
        }
        Some(Self {
            difference: sum / count,
            ..*self
        })
    }

    /// The best of windows that are known to show the same as the card; `None` where none is on the page.
    pub fn best(known: &[Self], look: &Look, page: &Page, stream: u64) -> Option<Self> {
        let judged = known
            .iter()
            .filter_map(|w| w.judged(look, page, POINTS[1], f32::MAX));
        let best = judged.min_by(|a, b| a.difference.total_cmp(&b.difference))?;
        best.moved(look, page, &mut Rng::new(0, stream))
    }

    /// The piece of the page that looks most like the card, among those that are likely to and random ones; `None`
    /// where none is found that holds it.
    pub fn find(likely: &[Self], look: &Look, page: &Page, stream: u64) -> Option<Self> {
        if page.owned.is_empty() {
            return None;
        }
        let mut rng = Rng::new(0, stream);
        let mut best: Vec<Self> = Vec::with_capacity(BEST + 1);
        let mut look_at = |tried: &Self| {
            let most = best.get(BEST - 1).map_or(f32::MAX, |last| last.difference);
            if let Some(found) = tried.judged(look, page, POINTS[0], most) {
                let rank = best.partition_point(|b| b.difference <= found.difference);
                best.insert(rank, found);
                best.truncate(BEST);
            }
        };
        likely.iter().for_each(&mut look_at);
        for _ in 0..TRIES {
            let at = page.owned[rng.below(page.owned.len())];
            let middle = Vec2::new((at % page.size[0]) as f32, (at / page.size[0]) as f32);
            look_at(&Self {
                middle: middle + Vec2::new(rng.unit(), rng.unit()),
                turn: Vec2::from_angle(TAU * rng.unit()),
                mirrored: rng.unit() < 0.5,
                scale: 1.0,
                difference: 0.0,
            });
        }
        best.into_iter()
            .filter_map(|w| w.moved(look, page, &mut rng))
            .min_by(|a, b| a.difference.total_cmp(&b.difference))
    }

    /// The best window nearby.
    fn moved(self, look: &Look, page: &Page, rng: &mut Rng) -> Option<Self> {
        let mut best = self.judged(look, page, POINTS[1], f32::MAX)?;
        let (mut reach, mut swing) = (4.0, 0.25);
        for _ in 0..SHRINKS {
            for _ in 0..MOVES {
                let tried = Self {
                    middle: best.middle + Vec2::new(rng.sway(), rng.sway()) * reach,
                    turn: Vec2::from_angle(rng.sway() * swing).rotate(best.turn),
                    ..best
                };
                best = tried
                    .judged(look, page, POINTS[1], best.difference)
                    .unwrap_or(best);
            }
            reach *= 0.7;
            swing *= 0.7;
        }
        Some(best)
    }
}

#[cfg(test)]
mod tests {
    use super::super::window::tests::{before, cut_out, page};
    use super::*;

    #[test]
    fn a_piece_is_found_where_it_was_cut_out_turned_or_mirrored() {
        let (page, chart, density) = (page(), before(), 9.0);
        for mirrored in [false, true] {
            let hidden = Window {
                middle: Vec2::new(37.0, 29.0),
                turn: Vec2::from_angle(2.1),
                mirrored,
                scale: 1.0,
                difference: 0.0,
            };
            let look = cut_out(&hidden, &page, &chart, density);
            let found = Window::find(&[], &look, &page, 5).unwrap();
            let usual: Vec<f32> = (0..40)
                .filter_map(|i| {
                    let angle = Vec2::from_angle(i as f32);
                    let other = Window {
                        middle: Vec2::splat(32.0) + angle * (i % 12) as f32,
                        turn: angle.perp(),
                        mirrored: i % 2 == 0,
                        scale: 1.0,
                        difference: 0.0,
                    };
                    other
                        .judged(&look, &page, 400, f32::MAX)
                        .map(|w| w.difference)
                })
                .collect();
            let usual = usual.iter().sum::<f32>() / usual.len() as f32;
            assert!(found.difference < 0.35 * usual, "{found:?} {usual}");
        }
    }

    #[test]
    fn no_window_is_smaller_than_its_card() {
        let (page, chart) = (page(), before());
        let hidden = Window {
            middle: Vec2::splat(32.0),
            turn: Vec2::X,
            mirrored: false,
            scale: 1.0,
            difference: 0.0,
        };
        let mut look = cut_out(&hidden, &page, &chart, 9.0);
        look.outline.iter_mut().for_each(|c| *c *= 9.0);
        assert_eq!(Window::find(&[], &look, &page, 1), None);
    }
}
