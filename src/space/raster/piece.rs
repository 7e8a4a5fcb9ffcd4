//! Perspective along a row of samples, a straight piece at a time.
//!
//! Texture coordinates are quotients of two linear functions. Over `n` samples in which the divisor
//! changes by the factor `r` a straight line between the two ends is off by at most about
//! `n |r - 1| / 4` samples, in the middle: nothing for a leaf of a tree that is some heights away,
//! and for a card a matter of short pieces.

use super::triangle::Row;

/// Largest displacement of a texture, in samples. Corners are snapped to 1/256 of one.
pub(super) const MOST_OFF: f32 = 1.0 / 32.0;

/// The longest pieces, samples.
const LONGEST: i32 = 64;

/// How long pieces may be, a power of two, where the divisor changes by `dq` from a sample to the
/// next and is at least `least`.
pub(super) fn longest(dq: f32, least: f32) -> i32 {
    // n |r - 1| / 4 where r - 1 is n dq / q.
    let most = (4.0 * MOST_OFF * least / dq.abs()).sqrt();
    // Infinite, or not a number, where nothing changes.
    let most = most.min(LONGEST as f32).max(1.0) as i32;
    1 << most.ilog2()
}

/// Samples of a row over which `u / q` and `v / q` are as good as straight.
pub(super) struct Piece {
    /// The sample after the last.
    pub end: i32,
    pub u: Row,
    pub v: Row,
}

impl Piece {
    /// The piece that holds the sample `x`, all pieces of the row having this length. They are counted
    /// from the triangle's first corner: how much of the row is drawn does not matter.
    #[inline]
    pub fn of([u, v, q]: [Row; 3], x: i32, length: i32) -> Self {
        let corner = u.x0 as i32;
        let first = corner + ((x - corner) & !(length - 1));
        let last = first + length - 1;
        let (start, end) = (1.0 / q.value(first), 1.0 / q.value(last));
        let per_step = 1.0 / (length as f32 - 1.0).max(1.0);
        let straight = |row: Row| {
            let at = row.value(first) * start;
            Row {
                at,
                dx: (row.value(last) * end - at) * per_step,
                x0: first as f32,
            }
        };
        Self {
            end: last + 1,
            u: straight(u),
            v: straight(v),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_stay_within_a_part_of_a_sample_of_the_quotient() {
        let mut long = 0;
        for case in 0..200 {
            let random = |k: u32| ((case * 7 + k) as f32 * 0.618_034).fract();
            let row = |at: f32, dx: f32| Row { at, dx, x0: 2.5 };
            // The eye one to three units away from what gets nearer or farther by up to .3 % a sample.
            let q = row(0.4 + random(0), (random(1) - 0.5) * 2e-3);
            let step = (0.2 + random(3)) * 1e-3;
            let rows = [row(random(2), step), row(0.3, -step), q];
            let (mut x, end) = (3, 203);
            let least = (x..end).map(|x| q.value(x)).fold(f32::MAX, f32::min);
            let length = longest(q.dx, least);
            assert!(length >= 4, "{length}");
            while x < end {
                let piece = Piece::of(rows, x, length);
                assert!(x < piece.end && (piece.end - 2) % length == 0);
                let length = piece.end.min(end) - x;
                for at in x..x + length {
                    let [u, q] = [rows[0].value(at), q.value(at)];
                    // The quotient's own step, where it is least over the piece.
                    let slope = |at: i32| {
                        let q = rows[2].value(at);
                        (rows[0].dx - rows[0].value(at) / q * rows[2].dx).abs() / q
                    };
                    let slope = slope(x).max(slope(piece.end - 1));
                    let off = (piece.u.value(at) - u / q).abs() / slope.max(1e-6);
                    assert!(off <= 0.05, "case {case}: {off} of {length}");
                }
                long += usize::from(length > 8);
                x += length;
            }
        }
        assert!(long > 300, "{long} pieces of more than 8 samples");
    }
}
