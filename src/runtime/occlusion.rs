//! What cells hide along the way from the eye (El-Sana and others 2001, sections 4.2 and 5.2).
//!
//! A walk over the integer grid goes from the middle of the eye's cell to the middle of the node's
//! and sums up how much is hidden, once for each cell and frame at most: while the eye stays in its
//! cell, no probability changes.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use glam::{IVec3, Vec3};

use super::cells::Cells;
use super::walk::{Law, walk};

/// Occlusion probabilities seen from one eye. Clones share what they compute, on any thread: while their eyes are in one
/// cell, a walk is made once for all; clones with other eyes get their own answers.
#[derive(Clone, Debug)]
pub struct Occlusion<'g> {
    cells: &'g Cells,
    law: Law,
    clumping: f32,
    doubt: f32,
    eye: IVec3,
    /// Number of the eye's cell among those visited, from 1.
    stamp: u32,
    known: Arc<Known>,
    computed: u64,
}

/// What was computed, shared by clones.
#[derive(Debug)]
struct Known {
    /// Where the last eye that moved is, and its number.
    last: Mutex<(IVec3, u32)>,
    /// For each cell the number of the eye that its probability was computed for, and the probability's bits. Whoever
    /// finds another number computes the same value: nobody waits.
    cells: Vec<AtomicU64>,
}

impl Known {
    fn nothing(cells: &Cells) -> Arc<Self> {
        let all = cells.solidity().iter();
        Arc::new(Self {
            last: Mutex::new((IVec3::MIN, 0)),
            cells: all.map(|_| AtomicU64::new(0)).collect(),
        })
    }

    /// The number of an eye's cell: the last one's if that is where it is, else a new one.
    fn number(&self, eye: IVec3) -> u32 {
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if last.0 != eye || last.1 == 0 {
            *last = (eye, last.1.wrapping_add(1));
            if last.1 == 0 {
                // After four thousand million eyes numbers begin again.
                self.cells
                    .iter()
                    .for_each(|c| c.store(0, Ordering::Relaxed));
                last.1 = 1;
            }
        }
        last.1
    }

    #[inline]
    fn get(&self, cell: usize, stamp: u32) -> Option<f32> {
        let known = self.cells[cell].load(Ordering::Relaxed);
        ((known >> 32) as u32 == stamp).then_some(f32::from_bits(known as u32))
    }

    #[inline]
    fn set(&self, cell: usize, stamp: u32, value: f32) {
        let known = u64::from(stamp) << 32 | u64::from(value.to_bits());
        self.cells[cell].store(known, Ordering::Relaxed);
    }
}

/// Eyes farther off than this many cells are moved nearer, along the line to the grid's middle.
const FARTHEST: f32 = 1e6;

/// Of more doubt than this f32 leaves no probability to tell apart.
const MOST_DOUBT: f32 = 1.0 - 1e-5;

impl<'g> Occlusion<'g> {
    /// Nothing is computed until it is asked for.
    pub fn new(cells: &'g Cells, law: Law) -> Self {
        Self {
            cells,
            law,
            clumping: 1.0,
            doubt: 0.0,
            eye: IVec3::MIN,
            stamp: 0,
            known: Known::nothing(cells),
            computed: 0,
        }
    }

    /// Lets so much of the extinction count under [`Law::Beer`], 0 to 1: leaves crowd in crowns and on
    /// twigs, and what crowds hides less than what is spread evenly over a cell. Foresters call it
    /// the clumping index and measure 0.5 to 0.9 (Chen and others 2005); what a cut must not lose asks for less.
    pub fn clumped(self, clumping: f32) -> Self {
        Self {
            clumping: clumping.clamp(0.0, 1.0),
            doubt: self.doubt,
            ..Self::new(self.cells, self.law)
        }
    }

    /// Lets only what is surely hidden count: a probability up to `doubt` (0 to below 1) is taken for none, and what is
    /// above it for `(OP - doubt) / (1 - doubt)`, so that nothing jumps. Equation 5 coarsens what may be seen by its
    /// share that is hidden, which is right for a picture; with .999 nearly every triangle that is seen stays as it is.
    pub fn doubting(self, doubt: f32) -> Self {
        Self {
            clumping: self.clumping,
            doubt: if doubt > 0.0 {
                doubt.min(MOST_DOUBT)
            } else {
                0.0
            },
            ..Self::new(self.cells, self.law)
        }
    }

    /// Moves the eye; whether probabilities may have changed.
    pub fn look_from(&mut self, eye: Vec3) -> bool {
        let cell = self.eye_cell(eye);
        if cell == self.eye && self.stamp > 0 {
            return false;
        }
        self.eye = cell;
        self.stamp = self.known.number(cell);
        true
    }

    fn eye_cell(&self, eye: Vec3) -> IVec3 {
        let middle = self.cells.low() + 0.5 * self.cells.edge() * self.cells.count().as_vec3();
        let away = eye - middle;
        let most = FARTHEST * self.cells.edge().min_element();
        if !away.is_finite() {
            return IVec3::splat(-(FARTHEST as i32)); // no such eye: any defined answer
        }
        self.cells.cell_of(middle + away.clamp_length_max(most))
    }

    /// Probability that what is in a point's cell is hidden from the eye, 0 to 1. A point outside
    /// the grid is treated as the nearest cell's.
    #[inline]
    pub fn probability(&mut self, point: Vec3) -> f32 {
        let last = self.cells.count() - 1;
        let cell = self.cells.cell_of(point).clamp(IVec3::ZERO, last);
        let Some(index) = self.cells.index(cell) else {
            return 0.0;
        };
        if let Some(value) = self.known.get(index, self.stamp) {
            return value;
        }
        self.computed += 1;
        let hidden = walk(self.cells, self.eye, cell, self.law, self.clumping);
        let value = ((hidden - self.doubt) / (1.0 - self.doubt)).clamp(0.0, 1.0);
        self.known.set(index, self.stamp, value);
        value
    }

    /// Middle of the eye's cell, and how far off in it an eye may be.
    pub(super) fn eye(&self) -> (Vec3, f32) {
        let edge = self.cells.edge();
        let middle = self.cells.low() + (self.eye.as_vec3() + 0.5) * edge;
        (middle, 0.5 * edge.length())
    }

    /// Walks over the grid so far, without those of clones.
    pub fn computed(&self) -> u64 {
        self.computed
    }

    /// Number that changes with the eye's cell.
    pub fn stamp(&self) -> u32 {
        self.stamp
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of cells of edge 1 along x.
    fn row(solidity: &[f32]) -> Cells {
        let n = solidity.len() as u32;
        let mut cells = Cells::new(Vec3::ZERO, Vec3::new(n as f32, 1.0, 1.0), [n, 1, 1]);
        for (i, &s) in solidity.iter().enumerate() {
            cells.set(IVec3::new(i as i32, 0, 0), s);
        }
        cells
    }

    fn seen(cells: &Cells, law: Law, from: f32) -> Vec<f32> {
        let mut occlusion = Occlusion::new(cells, law);
        occlusion.look_from(Vec3::new(from, 0.5, 0.5));
        (0..cells.count().x)
            .map(|i| occlusion.probability(cells.middle(IVec3::new(i, 0, 0))))
            .collect()
    }

    #[test]
    fn equation_4_by_hand() {
        let cells = row(&[0.2, 0.5, 0.0, 0.3]);
        let found = seen(&cells, Law::Equation4, 0.5);
        // The eye's cell is left after half a unit, the others after one; diagonal sqrt(3).
        let d = 3.0f32.sqrt();
        let (t0, t1, t2) = (
            0.8 * (-0.5 / d).exp(),
            0.5 * (-1.0 / d).exp(),
            (-1.0 / d).exp(),
        );
        let by_hand = [
            0.2,
            0.2 + t0 * 0.5,
            0.2 + t0 * 0.5,
            0.2 + t0 * 0.5 + t0 * t1 * t2 * 0.3,
        ];
        for (a, b) in found.iter().zip(by_hand) {
            assert!((a - b).abs() < 1e-6, "{found:?} {by_hand:?}");
        }
    }

    #[test]
    fn beers_law_by_hand() {
        let found = seen(&row(&[0.2, 0.5, 0.0, 0.3]), Law::Beer, 0.5);
        let half = 1.0 - 0.8f32.sqrt();
        let behind = 1.0 - 0.8f32.sqrt() * 0.5;
        for (a, b) in found.iter().zip([0.0, half, behind, behind]) {
            assert!((a - b).abs() < 1e-6, "{found:?}");
        }
    }

    #[test]
    fn clumping_weakens_all_but_walls() {
        let cells = row(&[0.5, 0.0, 1.0, 0.0]);
        let mut occlusion = Occlusion::new(&cells, Law::Beer).clumped(0.5);
        occlusion.look_from(Vec3::new(-0.5, 0.5, 0.5));
        let mut at = |i: i32| occlusion.probability(cells.middle(IVec3::new(i, 0, 0)));
        assert!((at(1) - (1.0 - 0.5f32.sqrt())).abs() < 1e-6);
        assert_eq!(at(3), 1.0);
    }

    #[test]
    fn what_may_be_seen_stays_where_only_sure_hiding_counts() {
        let cells = row(&[0.5, 0.0, 0.9, 0.0, 1.0, 0.0]);
        let mut occlusion = Occlusion::new(&cells, Law::Beer).doubting(0.9);
        occlusion.look_from(Vec3::new(-0.5, 0.5, 0.5));
        let mut at = |i: i32| occlusion.probability(cells.middle(IVec3::new(i, 0, 0)));
        // Hidden with .5, .95 and 1: none of it, half of what is above .9, all.
        assert_eq!(at(1), 0.0);
        assert!((at(3) - 0.5).abs() < 1e-5);
        assert_eq!(at(5), 1.0);
        for odd in [f32::NAN, -1.0, 1.0, f32::INFINITY] {
            let mut occlusion = Occlusion::new(&cells, Law::Beer).doubting(odd);
            occlusion.look_from(Vec3::new(-0.5, 0.5, 0.5));
            let behind = occlusion.probability(cells.middle(IVec3::new(5, 0, 0)));
            assert_eq!(behind, 1.0, "{odd}");
        }
    }

    #[test]
    fn a_solid_cell_hides_all_behind_it_and_air_hides_nothing() {
        let wall = seen(&row(&[0.0, 0.0, 1.0, 0.0, 0.4, 0.0]), Law::Beer, 0.5);
        assert_eq!(wall, [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
        for law in [Law::Beer, Law::Equation4] {
            assert_eq!(seen(&row(&[0.0; 6]), law, 0.5), [0.0; 6]);
            // A wall right in front of the eye hides by either law.
            let near = seen(&row(&[1.0, 0.0, 0.3]), law, -0.5);
            assert_eq!(near[1..], [1.0, 1.0], "{law:?}");
        }
    }

    #[test]
    fn probabilities_stay_in_bounds_and_never_fall_along_a_line() {
        let mut state = 7u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for _ in 0..50 {
            let mut cells = Cells::new(Vec3::ZERO, Vec3::new(9.0, 7.0, 5.0), [9, 7, 5]);
            for i in 0..9 * 7 * 5 {
                let cell = IVec3::new(i % 9, i / 9 % 7, i / 63);
                cells.set(
                    cell,
                    if random() < 0.1 {
                        1.0
                    } else {
                        random() * random()
                    },
                );
            }
            let eye = Vec3::new(random(), random(), random()) * 30.0 - 10.0;
            for law in [Law::Beer, Law::Equation4] {
                let mut occlusion = Occlusion::new(&cells, law);
                occlusion.look_from(eye);
                let start = occlusion.eye_cell(eye);
                for i in 0..9 * 7 * 5 {
                    let p =
                        occlusion.probability(cells.middle(IVec3::new(i % 9, i / 9 % 7, i / 63)));
                    assert!((0.0..=1.0).contains(&p));
                }
                // Cells in one line with the eye's: multiples of one step.
                let step = IVec3::new(1, (random() * 3.0) as i32 - 1, 1);
                let mut before = 0.0;
                for n in 0..40 {
                    let cell = start + step * n;
                    if cells.index(cell).is_some() {
                        let p = walk(&cells, start, cell, law, 1.0);
                        assert!(p >= before - 1e-6, "{law:?}: {p} after {before}");
                        before = p;
                    }
                }
            }
        }
    }

    #[test]
    fn probabilities_are_computed_once_for_each_cell_of_the_eye() {
        let cells = row(&[0.1; 8]);
        let mut occlusion = Occlusion::new(&cells, Law::Beer);
        assert!(occlusion.look_from(Vec3::splat(0.5)));
        let first = occlusion.probability(Vec3::new(6.5, 0.5, 0.5));
        assert_eq!(occlusion.probability(Vec3::new(6.9, 0.1, 0.5)), first);
        assert_eq!(occlusion.computed(), 1);
        assert!(!occlusion.look_from(Vec3::splat(0.7)));
        occlusion.probability(Vec3::new(6.5, 0.5, 0.5));
        assert_eq!(occlusion.computed(), 1);
        assert!(occlusion.look_from(Vec3::new(1.5, 0.5, 0.5)));
        assert!(occlusion.probability(Vec3::new(6.5, 0.5, 0.5)) < first);
        assert_eq!(occlusion.computed(), 2);
    }

    #[test]
    fn clones_share_walks_and_keep_their_eyes() {
        let cells = row(&[0.1; 8]);
        let mut one = Occlusion::new(&cells, Law::Beer);
        let mut two = one.clone();
        let [here, there] = [Vec3::splat(0.5), Vec3::new(2.5, 0.5, 0.5)];
        let far = Vec3::new(6.5, 0.5, 0.5);
        one.look_from(here);
        two.look_from(here);
        let seen = one.probability(far);
        assert_eq!(two.probability(far), seen);
        assert_eq!((one.computed(), two.computed()), (1, 0));
        // One goes on; the other still sees from where it is, and knows it again when asked twice.
        assert!(one.look_from(there));
        let nearer = one.probability(far);
        assert!(nearer < seen);
        assert_eq!(two.probability(far), seen);
        assert_eq!(one.probability(far), nearer);
        assert!(two.look_from(there) && one.look_from(here));
        assert_eq!((two.probability(far), one.probability(far)), (nearer, seen));
        // What hides less is not the same knowledge.
        let mut thin = one.clone().clumped(0.5);
        thin.look_from(here);
        assert!(thin.probability(far) < seen);
    }

    #[test]
    fn far_and_absent_eyes_have_a_defined_answer() {
        let cells = row(&[0.3; 8]);
        let near = seen(&cells, Law::Beer, -3.0);
        let far = seen(&cells, Law::Beer, -3e12);
        for (a, b) in near.iter().zip(&far) {
            assert!((a - b).abs() < 1e-3, "{near:?} {far:?}");
        }
        let mut occlusion = Occlusion::new(&cells, Law::Beer);
        for eye in [Vec3::INFINITY, Vec3::NAN] {
            occlusion.look_from(eye);
            assert!((0.0..=1.0).contains(&occlusion.probability(Vec3::ONE)));
        }
    }
}
