//! Fits the cards' texels to the original's silhouettes.
//!
//! A leaf that moved to its card's plane lands beside its true place in most views. What matters
//! is the outline of the whole, so every texel is asked, over many training views, whether the
//! original covers the cells that it would cover, given what the other cards cover there already:
//!
//! * the original covers the cell and nothing else does: the texel should be opaque (+1);
//! * the original leaves it free: transparent, the more the fewer others spoil it (-1/others);
//! * covered either way: no vote.
//!
//! The mean vote is added to the projected coverage and thresholded; a few rounds let cards
//! agree. Views are orthographic, so a card's texels map to cells by one affine map a view.

use std::ops::Range;
use std::sync::LazyLock;

use fixedbitset::FixedBitSet;
use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::chart::{Chart, Shape};
use super::foliage::Foliage;
use super::neighbours::follow_neighbours;

/// The original from one direction, on a grid of cells.
#[derive(Clone, Debug)]
pub struct Target {
    /// Cells for one unit to the right.
    pub right: Vec3,
    /// Cells for one unit down.
    pub down: Vec3,
    /// Cell coordinates of the origin.
    pub base: Vec2,
    /// Width and height in cells.
    pub size: [u32; 2],
    /// Whether the original covers the cell.
    pub wanted: FixedBitSet,
    /// Whether geometry that is not on cards (tubes) covers the cell already.
    pub taken: FixedBitSet,
    /// The charts that are seen: those of this tree, where several share a page.
    pub charts: Range<usize>,
}

/// Settings of the fit.
#[derive(Clone, Copy, Debug)]
pub struct Refine {
    /// Rounds of votes.
    pub rounds: u32,
    /// What a unanimous vote adds to the projected coverage.
    pub weight: f32,
}

/// Charts that vote at a time: votes take several times the memory of what comes of them.
const BATCH: usize = 512;

/// For each texel of the page, the projected coverage corrected by the views' votes.
pub fn refine(foliage: &Foliage, targets: &[&Target], options: Refine) -> Vec<f32> {
    let mut mean = vec![0.0f32; foliage.texels.len()];
    let score = |at: usize, mean: f32| foliage.texels.coverage(at) + options.weight * mean;
    let rows: Vec<Vec<u32>> = foliage.charts.iter().map(Chart::row_lengths).collect();
    // Windows show texels of others, and the rows of outlines' boxes hold some.
    let several = |c: &Chart| matches!(c.shape, Shape::Window | Shape::Mask(_));
    let overlap = foliage.charts.iter().any(several);
    for round in 0..options.rounds {
        let on = Shown::new(foliage, &rows, |at| score(at, mean[at]) >= 0.5);
        // Views take turns, a third of them a round where there are rounds for all: a third of the
        // work, and on three trees no F1 fell by more than .004.
        let turns = options.rounds.min(3) as usize;
        let turn = round as usize % turns;
        let asked: Vec<&Target> = targets.iter().skip(turn).step_by(turns).copied().collect();
        let opinions: Vec<Vec<u8>> = asked
            .par_iter()
            .map(|target| opinions(target, on.count(target, &target.charts)))
            .collect();
        // Later rounds move less, so that two cards do not swap a cell for ever.
        let step = 1.0 / (round as f32 + 1.0).sqrt();
        let mut settle = |at: usize, (sum, hits): Votes| {
            mean[at] += step * (sum / hits.max(1) as f32 - mean[at]);
        };
        if overlap {
            let mut sums: Vec<Votes> = vec![(0.0, 0); foliage.texels.len()];
            on.each_vote(&asked, &opinions, |at, (sum, hits)| {
                sums[at].0 += sum;
                sums[at].1 += hits;
            });
            let owned = (0..sums.len()).filter(|&at| foliage.owned[at]);
            owned.for_each(|at| settle(at, sums[at]));
        } else {
            // Every texel has its votes from one card: no second page of them.
            on.each_vote(&asked, &opinions, settle);
        }
    }
    // In place: a page of 4096 x 4096 has 67 MB of them.
    let mut scores = mean;
    let all = scores.par_iter_mut().enumerate();
    all.for_each(|(at, mean)| *mean = score(at, *mean));
    let width = foliage.size[0] as usize;
    follow_neighbours(&mut scores, &foliage.owned, width);
    scores
}

/// Sum of a texel's votes, and how many there are.
type Votes = (f32, u32);

/// The page's texels as its cards show them, some opaque.
struct Shown<'f> {
    foliage: &'f Foliage,
    /// Of each chart its [`Chart::row_lengths`].
    rows: &'f [Vec<u32>],
    /// Whether each texel of a chart is opaque, in the chart's own order.
    on: Vec<FixedBitSet>,
}

impl<'f> Shown<'f> {
    /// `opaque` tells it of each texel of the page.
    fn new(
        foliage: &'f Foliage,
        rows: &'f [Vec<u32>],
        opaque: impl Fn(usize) -> bool + Sync,
    ) -> Self {
        let width = foliage.size[0];
        let of_chart = |chart: &Chart| {
            let [w, h] = chart.size;
            let mut on = FixedBitSet::with_capacity((w * h) as usize);
            for (texel, [x, y]) in (0..h).flat_map(|y| (0..w).map(move |x| [x, y])).enumerate() {
                let [ax, ay] = chart.in_atlas(x, y);
                on.set(texel, opaque((ay * width + ax) as usize));
            }
            on
        };
        Self {
            on: foliage.charts.par_iter().map(of_chart).collect(),
            foliage,
            rows,
        }
    }

    /// How many opaque texels of some charts each cell sees, at most 255.
    fn count(&self, target: &Target, charts: &Range<usize>) -> Vec<u8> {
        let [w, h] = target.size;
        let mut counts = vec![0u8; (w * h) as usize];
        for i in charts.clone() {
            let on = &self.on[i];
            let chart = (&self.foliage.charts[i], &self.rows[i][..]);
            scan(chart, self.foliage.one_sided, target, |cell, texel| {
                counts[cell] = counts[cell].saturating_add(u8::from(on[texel]));
            });
        }
        counts
    }

    /// Visits what each card votes on each of the page's texels that it shows.
    fn each_vote(
        &self,
        targets: &[&Target],
        opinions: &[Vec<u8>],
        mut visit: impl FnMut(usize, Votes),
    ) {
        let charts = &self.foliage.charts;
        for first in (0..charts.len()).step_by(BATCH) {
            let some = first..(first + BATCH).min(charts.len());
            let of_chart = |i: usize| {
                let seen = targets.iter().copied().zip(opinions);
                let seen = seen.filter(|(target, _)| target.charts.contains(&i));
                let chart = (&charts[i], &self.rows[i][..]);
                vote(chart, self.foliage.one_sided, seen, &self.on[i])
            };
            let votes: Vec<Vec<Votes>> = some.clone().into_par_iter().map(of_chart).collect();
            for (i, votes) in some.zip(votes) {
                let chart = &charts[i];
                for (y, &length) in (0..).zip(&self.rows[i]) {
                    for x in 0..length {
                        let [ax, ay] = chart.in_atlas(x, y);
                        let at = (ay * self.foliage.size[0] + ax) as usize;
                        visit(at, votes[(y * chart.size[0] + x) as usize]);
                    }
                }
            }
        }
    }
}

/// F1 of some cards and of what is there beside them against their original, mean over its views; a
/// texel is opaque from half on.
pub fn f1(foliage: &Foliage, charts: Range<usize>, targets: &[Target]) -> f64 {
    let rows: Vec<Vec<u32>> = foliage.charts.iter().map(Chart::row_lengths).collect();
    let on = Shown::new(foliage, &rows, |at| foliage.alpha[at] >= 128);
    let of_view = |target: &Target| {
        let counts = on.count(target, &charts);
        let (mut both, mut any) = (0u64, 0u64);
        for (cell, count) in counts.into_iter().enumerate() {
            let wanted = target.wanted[cell];
            let covered = target.taken[cell] || count > 0;
            both += 2 * u64::from(wanted && covered);
            any += u64::from(wanted) + u64::from(covered);
        }
        both as f64 / any.max(1) as f64
    };
    let views: Vec<f64> = targets.par_iter().map(of_view).collect();
    views.iter().sum::<f64>() / views.len().max(1) as f64
}

/// Opinions of more overlapping cards than this are alike.
const MOST: u8 = 250;

/// What a cell says to a texel: nothing, whatever the texel is.
const SILENT: u8 = 2;

/// Of each number that [`opinions`] gives, what a cell says to a texel that is transparent, and to one
/// that is opaque there and so one of those that were counted.
static SAID: LazyLock<[[f32; 2]; 256]> = LazyLock::new(|| {
    let wanted = |others: u8| f32::from(u8::from(others == 0));
    let unwanted = |others: u8| -1.0 / (f32::from(others) + 1.0);
    let both = |count: u8| [count, count.saturating_sub(1)];
    std::array::from_fn(|number| match number as u8 {
        count @ 0..=SILENT => both(count).map(wanted),
        number => both(number - SILENT - 1).map(unwanted),
    })
});

/// For every cell a number that says, by [`SAID`], what it says to texels: how many cover it, up to
/// two where that is wanted, and three more where it is not.
fn opinions(target: &Target, mut counts: Vec<u8>) -> Vec<u8> {
    for (cell, count) in counts.iter_mut().enumerate() {
        *count = match (target.taken[cell], target.wanted[cell]) {
            (true, _) => SILENT,
            (false, true) => (*count).min(SILENT),
            (false, false) => (*count).min(MOST) + SILENT + 1,
        };
    }
    counts
}

fn vote<'t>(
    chart: (&Chart, &[u32]),
    one_sided: bool,
    seen: impl Iterator<Item = (&'t Target, &'t Vec<u8>)>,
    on: &FixedBitSet,
) -> Vec<Votes> {
    let mut sums = vec![(0.0f32, 0u32); on.len()];
    let said = &*SAID;
    for (target, opinions) in seen {
        scan(chart, one_sided, target, |cell, texel| {
            let (sum, hits) = &mut sums[texel];
            *sum += said[usize::from(opinions[cell])][usize::from(on[texel])];
            *hits += 1;
        });
    }
    sums
}

/// Visits every cell whose centre the card covers, with the chart's texel that lies there; `rows` are
/// the chart's [`Chart::row_lengths`]. A card that is `one_sided` covers nothing where its back is seen.
fn scan(
    (chart, rows): (&Chart, &[u32]),
    one_sided: bool,
    target: &Target,
    mut visit: impl FnMut(usize, usize),
) {
    let cell = |p: Vec3| target.base + Vec2::new(p.dot(target.right), p.dot(target.down));
    let corner: Vec<Vec2> = chart.corners.iter().map(|&p| cell(p)).collect();
    let texel: Vec<Vec2> = chart.corners[..3].iter().map(|&p| chart.texel(p)).collect();
    let (a, b) = (corner[1] - corner[0], corner[2] - corner[0]);
    let area = a.perp_dot(b);
    // Seen edge-on the card covers nothing that a cell could vote on. Rows run down: fronts turn clockwise.
    if area.abs() < 0.05 || one_sided && area > 0.0 {
        return;
    }
    let (ta, tb) = (texel[1] - texel[0], texel[2] - texel[0]);
    let per_x = (ta * b.y - tb * a.y) / area;
    let per_y = (tb * a.x - ta * b.x) / area;
    let low = corner.iter().fold(Vec2::MAX, |m, &c| m.min(c)).y;
    let high = corner.iter().fold(Vec2::MIN, |m, &c| m.max(c)).y;
    let first = (low - 0.5).ceil().max(0.0) as u32;
    let last = ((high - 0.5).floor() + 1.0).clamp(0.0, target.size[1] as f32) as u32;
    for y in first..last {
        let middle = y as f32 + 0.5;
        let (mut from, mut to) = (f32::MAX, f32::MIN);
        for i in 0..corner.len() {
            let (p, q) = (corner[i], corner[(i + 1) % corner.len()]);
            if (p.y <= middle) != (q.y <= middle) {
                let x = p.x + (middle - p.y) / (q.y - p.y) * (q.x - p.x);
                (from, to) = (from.min(x), to.max(x));
            }
        }
        let x_first = (from - 0.5).ceil().max(0.0) as u32;
        let x_last = ((to - 0.5).floor() + 1.0).clamp(0.0, target.size[0] as f32) as u32;
        let mut at = texel[0]
            + per_x * (x_first as f32 + 0.5 - corner[0].x)
            + per_y * (middle - corner[0].y);
        for x in x_first..x_last {
            // Negative numbers become 0.
            let (tx, ty) = (at.x as u32, at.y as u32);
            if rows.get(ty as usize).is_some_and(|&length| tx < length) {
                let texel = (ty * chart.size[0] + tx) as usize;
                visit((y * target.size[0] + x) as usize, texel);
            }
            at += per_x;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_ask_for_what_is_missing_and_against_what_is_too_much() {
        let target = Target {
            right: Vec3::X,
            down: Vec3::NEG_Y,
            base: Vec2::ZERO,
            size: [6, 1],
            wanted: [0, 1, 2, 5].into_iter().collect(),
            taken: [5].into_iter().collect(),
            charts: 0..1,
        };
        let numbers = opinions(&target, vec![0, 1, 4, 0, 2, 0]);
        let said: Vec<[f32; 2]> = numbers.iter().map(|&n| SAID[usize::from(n)]).collect();
        // What is wanted: to the only one that may cover it; what is not: less, the more others do.
        assert_eq!(said[0], [1.0, 1.0]);
        assert_eq!(said[1], [0.0, 1.0]);
        assert_eq!(said[2], [0.0, 0.0]);
        assert_eq!(said[3], [-1.0, -1.0]);
        assert_eq!(said[4], [-1.0 / 3.0, -0.5]);
        assert_eq!(said[5], [0.0, 0.0]);
    }

    #[test]
    fn f1_is_twice_the_common_cells_over_both_areas() {
        let target = |wanted: &[usize], taken: &[usize]| Target {
            right: Vec3::X,
            down: Vec3::NEG_Y,
            base: Vec2::ZERO,
            size: [4, 1],
            wanted: wanted.iter().copied().collect(),
            taken: taken.iter().copied().collect(),
            charts: 0..1,
        };
        // Three wanted, two covered, one of them wanted: 2 * 1 / (3 + 2).
        let some = target(&[0, 1, 2], &[2, 3]);
        // All right.
        let all = target(&[0], &[0]);
        let nothing = Foliage::default();
        assert!((f1(&nothing, 0..0, std::slice::from_ref(&some)) - 0.4).abs() < 1e-12);
        assert!((f1(&nothing, 0..0, &[some, all]) - 0.7).abs() < 1e-12);
    }
}
