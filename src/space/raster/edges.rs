//! Which samples of a square of them a triangle holds, 64 in one word.
//!
//! A crown is hundreds of thousands of triangles of a few samples each: rows that are solved one by
//! one cost more than all their samples. Edge functions step over a whole tile instead, four lanes
//! in a register, and a tile is full when its word has no zero.

use wide::i32x4;

use super::camera::{Corner, SUBSAMPLES};
use super::triangle::Triangle;

/// Edge of a tile in samples.
pub(super) const TILE: i32 = 8;
/// Edge of a tile of pixels with four samples each.
pub(super) const PIXELS: i32 = 4;
/// Changes over a tile of steps below this, and twice that, fit 32 bits.
const SMALL: i64 = 1 << 26;

/// A tile that a triangle may reach.
pub(super) struct Reached {
    /// Its column and row.
    pub tile: [i32; 2],
    /// The columns of it that are reached, counted from its first; end excluded.
    pub xs: [i32; 2],
    /// The rows of it that are reached.
    pub ys: [i32; 2],
}

/// The tile that holds all that is reached, if one does.
#[inline]
pub(super) fn only_tile([xs, ys]: [[i32; 2]; 2], side: i32) -> Option<[i32; 2]> {
    let tiles = [xs, ys].map(|ends| ends.map(|at| at / side));
    let [[x, last_x], [y, last_y]] = tiles;
    (x == last_x && y == last_y).then_some([x, y])
}

/// Calls `each` for the tiles with `side` samples along an edge that hold the columns and rows from
/// the first to the last of those reached, counted from where tiles begin.
#[inline]
pub(super) fn each_tile([xs, ys]: [[i32; 2]; 2], side: i32, mut each: impl FnMut(Reached)) {
    let within = |[first, last]: [i32; 2], tile: i32| {
        [first, last + 1].map(|at| (at - tile * side).clamp(0, side))
    };
    for y in ys[0] / side..=ys[1] / side {
        for x in xs[0] / side..=xs[1] / side {
            each(Reached {
                tile: [x, y],
                xs: within(xs, x),
                ys: within(ys, y),
            });
        }
    }
}

/// An edge function at one or several samples of a pixel: not negative on the inner side.
///
/// In 256ths of what [`Triangle`] counts in: its steps from pixel to pixel are whole then, and the
/// sign of a sum of whole steps and a value rounded down is the sign of the exact one.
#[derive(Clone, Copy)]
struct Edge<const N: usize> {
    /// At each place of pixel 0, 0.
    at: [i64; N],
    right: i64,
    down: i64,
}

impl<const N: usize> Edge<N> {
    #[inline(always)]
    fn new(from: &Corner, to: &Corner, places: [[i32; 2]; N]) -> Self {
        let (dx, dy) = (i64::from(to.x - from.x), i64::from(to.y - from.y));
        // A sample on the edge itself belongs to the triangle whose top or left edge it is.
        let owns = dy < 0 || (dy == 0 && dx > 0);
        let mut at = [0; N];
        for (at, [x, y]) in at.iter_mut().zip(places) {
            let (px, py) = (i64::from(x - from.x), i64::from(y - from.y));
            *at = (dx * py - dy * px - i64::from(!owns)).div_euclid(SUBSAMPLES.into());
        }
        Self {
            at,
            right: -dy,
            down: dx,
        }
    }
}

/// The three edges of a triangle at `N` places of every pixel.
pub(super) struct Edges<const N: usize>([Edge<N>; 3]);

impl<const N: usize> Edges<N> {
    /// Of a triangle, at places in sub-samples from a pixel's left upper corner.
    #[inline]
    pub fn new(triangle: &Triangle, places: [[i32; 2]; N]) -> Self {
        let [a, b, c] = triangle.sides();
        let edge = |(from, to)| Edge::new(from, to, places);
        Self([edge(a), edge(b), edge(c)])
    }

    /// The edges that some sample of a tile may lie outside of, at its first pixel; `None` where no
    /// sample is inside. Those that all lie inside of are zero.
    #[inline]
    fn crossing(&self, [x, y]: [i32; 2], tile: i32) -> Option<[Edge<N>; 3]> {
        let last = i64::from(tile - 1);
        let mut crossing = self.0;
        for edge in &mut crossing {
            let first = i64::from(x) * edge.right + i64::from(y) * edge.down;
            let (mut low, mut high) = (i64::MAX, i64::MIN);
            for at in &mut edge.at {
                *at += first;
                (low, high) = (low.min(*at), high.max(*at));
            }
            if high + last * (edge.right.max(0) + edge.down.max(0)) < 0 {
                return None;
            }
            if low + last * (edge.right.min(0) + edge.down.min(0)) >= 0 {
                *edge = Edge {
                    at: [0; N],
                    right: 0,
                    down: 0,
                };
            }
        }
        Some(crossing)
    }
}

/// Whether edges that cross a tile can be followed in 32 bits.
fn is_small<const N: usize>(edges: &[Edge<N>; 3]) -> bool {
    let step = |e: &Edge<N>| e.right.abs() < SMALL && e.down.abs() < SMALL;
    edges.iter().all(step)
}

/// The value of an edge at a pixel of the tile.
fn value<const N: usize>(edge: &Edge<N>, place: usize, [x, y]: [i32; 2]) -> i64 {
    edge.at[place] + i64::from(x) * edge.right + i64::from(y) * edge.down
}

impl Edges<1> {
    /// The samples inside of the tile that begins at a sample: bit `8 y + x`. Those of other rows than
    /// `rows`, counted from the tile's first, may be left out.
    #[inline]
    pub fn samples(&self, first: [i32; 2], rows: [i32; 2]) -> u64 {
        let Some(edges) = self.crossing(first, TILE) else {
            return 0;
        };
        if !is_small(&edges) {
            return each::<TILE, 1>(&edges);
        }
        let lanes = |e: &Edge<1>, from: i32| {
            let r = e.right as i32;
            let first = (e.at[0] + i64::from(rows[0]) * e.down) as i32 + from * r;
            i32x4::new([first, first + r, first + 2 * r, first + 3 * r])
        };
        let [a, b, c] = &edges;
        let mut left = [lanes(a, 0), lanes(b, 0), lanes(c, 0)];
        let mut right = [lanes(a, 4), lanes(b, 4), lanes(c, 4)];
        let down = [a, b, c].map(|e| i32x4::splat(e.down as i32));
        let mut inside = 0;
        for y in rows[0]..rows[1] {
            let outside = |v: &[i32x4; 3]| (v[0] | v[1] | v[2]).to_bitmask();
            let row = outside(&left) | outside(&right) << 4;
            inside |= u64::from(!row & 0xff) << (TILE * y);
            for edge in 0..3 {
                left[edge] += down[edge];
                right[edge] += down[edge];
            }
        }
        inside
    }
}

impl Edges<4> {
    /// The samples inside of the tile of 4 x 4 pixels that begins at a pixel: bit `16 y + 4 x + place`.
    /// Those of other pixels than the columns `xs` and rows `ys`, counted from the tile's first, may
    /// be left out.
    #[inline]
    pub fn pixels(&self, first: [i32; 2], xs: [i32; 2], ys: [i32; 2]) -> u64 {
        let Some(edges) = self.crossing(first, PIXELS) else {
            return 0;
        };
        if !is_small(&edges) {
            return each::<PIXELS, 4>(&edges);
        }
        let steps = |step: i64| i32x4::splat(step as i32);
        let (right, down) = (edges.map(|e| steps(e.right)), edges.map(|e| steps(e.down)));
        let mut row = edges.map(|e| {
            let first = i64::from(xs[0]) * e.right + i64::from(ys[0]) * e.down;
            i32x4::new(e.at.map(|at| (at + first) as i32))
        });
        let mut inside = 0;
        for y in ys[0]..ys[1] {
            let mut at = row;
            for x in xs[0]..xs[1] {
                let outside = (at[0] | at[1] | at[2]).to_bitmask();
                inside |= u64::from(!outside & 0xf) << (4 * (PIXELS * y + x));
                (0..3).for_each(|edge| at[edge] += right[edge]);
            }
            (0..3).for_each(|edge| row[edge] += down[edge]);
        }
        inside
    }
}

/// As the others, sample by sample: for triangles that reach absurdly far.
fn each<const SIDE: i32, const N: usize>(edges: &[Edge<N>; 3]) -> u64 {
    let mut inside = 0;
    for sample in 0..64 {
        let (place, pixel) = (sample % N, (sample / N) as i32);
        let at = [pixel % SIDE, pixel / SIDE];
        let is_inside = edges.iter().all(|edge| value(edge, place, at) >= 0);
        inside |= u64::from(is_inside) << sample;
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::raster::pane::Pane;
    use crate::space::raster::pane::reach;
    use crate::space::raster::triangle::CENTER;

    /// Places as four samples of a pixel have them.
    const FOUR: [[i32; 2]; 4] = [[96, 32], [224, 96], [32, 160], [160, 224]];

    /// Pineda's edge functions at one place, exactly.
    fn is_inside(triangle: &Triangle, [x, y]: [i64; 2]) -> bool {
        triangle.sides().into_iter().all(|(from, to)| {
            let (dx, dy) = (i64::from(to.x - from.x), i64::from(to.y - from.y));
            let value = dx * (y - i64::from(from.y)) - dy * (x - i64::from(from.x));
            value > 0 || (value == 0 && (dy < 0 || (dy == 0 && dx > 0)))
        })
    }

    /// Triangles of all sizes, some with corners on samples and edges along rows.
    fn triangles() -> impl Iterator<Item = Triangle> {
        let random = |i: u32| {
            let mixed = (i ^ (i >> 15)).wrapping_mul(0x2c1b_3c6d);
            let mixed = (mixed ^ (mixed >> 12)).wrapping_mul(0x297a_2d39);
            (mixed ^ (mixed >> 15)) as f32 / u32::MAX as f32
        };
        (0..600u32).filter_map(move |case| {
            let size = [2.0, 12.0, 90.0, 2e6][case as usize % 4];
            let middle = if size > 1e6 { 0.0 } else { 32.0 };
            let corner = |k: u32| {
                let at = |axis: u32| {
                    let off = (random(case * 16 + 2 * k + axis) - 0.5) * size + middle;
                    let grain = if case % 3 == 0 { 128.0 } else { 1.0 };
                    ((off * 256.0 / grain).round() * grain) as i32
                };
                Corner {
                    x: at(0),
                    y: at(1),
                    near: 1.0,
                    q: 1.0,
                }
            };
            Triangle::new([corner(0), corner(1), corner(2)], true)
        })
    }

    /// All samples of 64 x 64 pixels, by tiles and by the exact edge functions.
    fn compare<const N: usize>(
        places: [[i32; 2]; N],
        side: i32,
        inside: impl Fn(&Edges<N>, Reached) -> u64,
    ) -> usize {
        let pane = Pane::of([64, 64]);
        let mut hits = 0;
        for (case, triangle) in triangles().enumerate() {
            let edges = Edges::new(&triangle, places);
            let mut found = vec![0u64; (64 / side * 64 / side) as usize];
            let corners = triangle.sides().map(|(from, _)| *from);
            if let Some(reached) = reach(&corners, &pane, places) {
                each_tile(reached, side, |reached| {
                    let [x, y] = reached.tile;
                    found[(y * (64 / side) + x) as usize] = inside(&edges, reached);
                });
            }
            for y in 0..64 {
                for x in 0..64 {
                    let tile = found[(y / side * (64 / side) + x / side) as usize];
                    for (place, [px, py]) in places.into_iter().enumerate() {
                        let bit = (y % side * side + x % side) as usize * N + place;
                        let at = [x * 256 + px, y * 256 + py].map(i64::from);
                        let wanted = is_inside(&triangle, at);
                        assert_eq!(tile >> bit & 1 == 1, wanted, "{case}: {x} {y} {place}");
                        hits += usize::from(wanted);
                    }
                }
            }
        }
        hits
    }

    #[test]
    fn a_tile_holds_the_samples_that_are_inside_all_edges() {
        let hits = compare(CENTER, TILE, |edges, Reached { tile, ys, .. }| {
            edges.samples(tile.map(|t| t * TILE), ys)
        });
        assert!(hits > 200_000, "{hits}");
        let hits = compare(FOUR, PIXELS, |edges, Reached { tile, xs, ys }| {
            edges.pixels(tile.map(|t| t * PIXELS), xs, ys)
        });
        assert!(hits > 800_000, "{hits}");
    }
}
