//! Windows: pieces of a page that a card shows instead of texels of its own.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::look::{Look, Page};
use crate::export::chart::{Chart, Shape};
use crate::space::random::Rng;

/// Where on a page a card lies, moved, turned and, seen from behind, mirrored; never scaled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// The card's middle, texels.
    pub middle: Vec2,
    /// Cosine and sine of the turn.
    pub turn: Vec2,
    /// Whether the card is turned over first.
    pub mirrored: bool,
    /// Mean squared difference from what the card should look like.
    pub difference: f32,
}

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
    /// Where a point of the card's plane, in texels from its middle, lies on the page.
    fn place(&self, mut q: Vec2) -> Vec2 {
        if self.mirrored {
            q.y = -q.y;
        }
        self.middle + self.turn.rotate(q)
    }

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
    fn judged(mut self, look: &Look, page: &Page, points: usize, most: f32) -> Option<Self> {
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
        self.difference = sum / count;
        Some(self)
    }

    /// The piece of the page that looks most like the card; `None` where none is found that holds it.
    pub fn find(look: &Look, page: &Page, stream: u64) -> Option<Self> {
        if page.owned.is_empty() {
            return None;
        }
        let mut rng = Rng::new(0, stream);
        let mut best: Vec<Self> = Vec::with_capacity(BEST + 1);
        for _ in 0..TRIES {
            let at = page.owned[rng.below(page.owned.len())];
            let middle = Vec2::new((at % page.size[0]) as f32, (at / page.size[0]) as f32);
            let tried = Self {
                middle: middle + Vec2::new(rng.unit(), rng.unit()),
                turn: Vec2::from_angle(TAU * rng.unit()),
                mirrored: rng.unit() < 0.5,
                difference: 0.0,
            };
            let most = match best.get(BEST - 1) {
                Some(last) => last.difference,
                None => f32::MAX,
            };
            if let Some(found) = tried.judged(look, page, POINTS[0], most) {
                let rank = best.partition_point(|b| b.difference <= found.difference);
                best.insert(rank, found);
                best.truncate(BEST);
            }
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

    /// The chart of a card that shows this window; `before` is its own.
    pub fn chart(&self, before: &Chart, look: &Look, density: f32) -> Chart {
        let mut corners = before.corners.clone();
        let [tangent, mut bitangent] = look.axes;
        let mut normal = before.normal;
        if self.mirrored {
            corners.reverse();
            (normal, bitangent) = (-normal, -bitangent);
        }
        let turn = self.turn * density;
        let to_x = tangent * turn.x - bitangent * turn.y;
        let to_y = tangent * turn.y + bitangent * turn.x;
        let place = |p: Vec3| {
            let d = p - look.center;
            self.middle + Vec2::new(d.dot(to_x), d.dot(to_y))
        };
        let low = corners.iter().fold(Vec2::MAX, |m, &c| m.min(place(c)));
        let high = corners.iter().fold(Vec2::MIN, |m, &c| m.max(place(c)));
        let low = low.floor().max(Vec2::ZERO);
        Chart {
            tangent: to_x.normalize_or(tangent),
            corners,
            normal,
            origin: look.center,
            to_x,
            to_y,
            base: self.middle - low,
            size: (high - low)
                .to_array()
                .map(|side| side.ceil().max(1.0) as u32),
            shape: Shape::Window,
            place: [low.x as u32, low.y as u32],
            turned: false,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::fitted::Seen;
    use super::*;

    const SIDE: u32 = 64;

    /// Blobs some texels wide, of which no two are alike.
    fn page() -> Page {
        let seen = |x: f32, y: f32| {
            let wave = (0.31 * x + 0.002 * x * y).sin() + (0.27 * y - 0.003 * x * x).cos();
            Seen {
                opacity: if wave > 0.2 { 1.0 } else { 0.0 },
                color: Vec3::new(x / SIDE as f32, 0.5, y / SIDE as f32) * 0.2,
            }
        };
        let texels = (0..SIDE * SIDE).map(|i| seen((i % SIDE) as f32, (i / SIDE) as f32));
        Page {
            size: [SIDE; 2],
            texels: texels.collect(),
            owned: (0..SIDE * SIDE).collect(),
        }
    }

    /// A triangle in a plane of its own.
    fn before() -> Chart {
        let normal = Vec3::new(0.36, 0.48, 0.8);
        let tangent = Vec3::new(0.8, -0.6, 0.0);
        let [a, b] = [tangent, normal.cross(tangent)];
        let corners = [(-1.0, -1.0), (1.2, -0.8), (0.1, 1.0)];
        Chart {
            corners: corners.map(|(x, y)| a * x + b * y).to_vec(),
            normal,
            tangent,
            origin: Vec3::ZERO,
            to_x: a,
            to_y: b,
            base: Vec2::ZERO,
            size: [1, 1],
            shape: Shape::Whole,
            place: [0, 0],
            turned: false,
        }
    }

    /// The look of a card that shows `window` of the page.
    fn cut_out(window: &Window, page: &Page, chart: &Chart, density: f32) -> Look {
        let axes = [chart.tangent, chart.normal.cross(chart.tangent)];
        let center = chart.corners.iter().sum::<Vec3>() / 3.0;
        let flat = |p: Vec3| Vec2::from(axes.map(|a| (p - center).dot(a))) * density;
        let outline: Vec<Vec2> = chart.corners.iter().map(|&c| flat(c)).collect();
        let grid = (-14..14).flat_map(|y| (-14..14).map(move |x| Vec2::new(x as f32, y as f32)));
        let inside = grid.filter(|&q| crate::space::hull::holds(&outline, q, 0.0));
        let points = inside.map(|q| {
            let p = window.place(q);
            (q, page.texels[(p.y as u32 * SIDE + p.x as u32) as usize])
        });
        Look {
            center,
            axes,
            points: points.collect(),
            outline,
        }
    }

    #[test]
    fn a_piece_is_found_where_it_was_cut_out_turned_or_mirrored() {
        let (page, chart, density) = (page(), before(), 9.0);
        for mirrored in [false, true] {
            let hidden = Window {
                middle: Vec2::new(37.0, 29.0),
                turn: Vec2::from_angle(2.1),
                mirrored,
                difference: 0.0,
            };
            let look = cut_out(&hidden, &page, &chart, density);
            let found = Window::find(&look, &page, 5).unwrap();
            let usual: Vec<f32> = (0..40)
                .filter_map(|i| {
                    let angle = Vec2::from_angle(i as f32);
                    let other = Window {
                        middle: Vec2::splat(32.0) + angle * (i % 12) as f32,
                        turn: angle.perp(),
                        mirrored: i % 2 == 0,
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
    fn a_window_keeps_the_cards_place_size_and_sides() {
        let (chart, density) = (before(), 9.0);
        for mirrored in [false, true] {
            let window = Window {
                middle: Vec2::new(30.0, 34.0),
                turn: Vec2::from_angle(0.7),
                mirrored,
                difference: 0.0,
            };
            let look = cut_out(&window, &page(), &chart, density);
            let copy = window.chart(&chart, &look, density);
            for &corner in &chart.corners {
                assert!(copy.corners.contains(&corner));
            }
            assert_eq!(
                copy.normal,
                if mirrored {
                    -chart.normal
                } else {
                    chart.normal
                }
            );
            // Corners go round the front as before, and the page's axes are the frame of normals.
            let [a, b, c] = [0, 1, 2].map(|i| copy.corners[i]);
            assert!((b - a).cross(c - b).dot(copy.normal) > 0.0);
            let at = |p: Vec3| copy.atlas_point(p);
            let right = at(a + copy.tangent) - at(a);
            let down = at(a + copy.normal.cross(copy.tangent)) - at(a);
            assert!((right - Vec2::X * density).length() < 1e-4, "{right}");
            assert!((down - Vec2::Y * density).length() < 1e-4, "{down}");
            assert!((at(look.center) - window.middle).length() < 1e-4);
            for &corner in &copy.corners {
                let local = copy.texel(corner);
                assert!(local.min_element() >= -1e-4);
                assert!(local.x <= copy.size[0] as f32 && local.y <= copy.size[1] as f32);
                assert!((copy.point(local) - corner).length() < 1e-5);
            }
        }
    }

    #[test]
    fn no_window_is_smaller_than_its_card() {
        let (page, chart) = (page(), before());
        let hidden = Window {
            middle: Vec2::splat(32.0),
            turn: Vec2::X,
            mirrored: false,
            difference: 0.0,
        };
        let mut look = cut_out(&hidden, &page, &chart, 9.0);
        look.outline.iter_mut().for_each(|c| *c *= 9.0);
        assert_eq!(Window::find(&look, &page, 1), None);
    }
}
