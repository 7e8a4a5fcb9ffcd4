//! Perspective along a row of samples, a straight piece at a time.
//!
//! Texture coordinates are quotients of two linear functions. Over `n` samples in which the divisor
//! changes by the factor `r` a straight line between the two ends is off by at most about
//! `n |r - 1| / 4` samples, in the middle: nothing for a leaf of a tree that is some heights away,
//! and for a card a matter of short pieces.

use super::triangle::Row;

/// Largest displacement of a texture, in samples. Corners are snapped to 1/256 of one.
const MOST_OFF: f32 = 1.0 / 32.0;

/// Pieces no shorter than this, samples: nothing that is seen at such a slant has finer texels.
const LEAST: f32 = 4.0;

/// Samples of a row over which `u / q` and `v / q` are as good as straight.
pub(super) struct Piece {
    /// Number of samples.
    pub length: usize,
    pub u: Row,
    pub v: Row,
}

impl Piece {
    /// The longest piece that starts at the sample `from` and has at most `most` samples.
    #[inline]
    pub fn new([u, v, q]: [Row; 3], from: i32, most: usize) -> Self {
        let first = q.value(from);
        let longest = (4.0 * MOST_OFF * first / q.dx.abs()).sqrt();
        // Infinite where q does not change at all.
        let length = (longest.max(LEAST).min(most as f32) as usize).clamp(1, most.max(1));
        let last = from + length as i32 - 1;
        let (start, end) = (1.0 / first, 1.0 / q.value(last));
        let per_step = 1.0 / (length as f32 - 1.0).max(1.0);
        let straight = |row: Row| {
            let at = row.value(from) * start;
            Row {
                at,
                dx: (row.value(last) * end - at) * per_step,
                x0: from as f32,
            }
        };
        Self {
            length,
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
            // The eye one to ten units away from what gets nearer or farther by up to 1 % a sample.
            let q = row(0.1 + random(0), (random(1) - 0.5) * 2e-3);
            let step = (0.2 + random(3)) * 1e-3;
            let rows = [row(random(2), step), row(0.3, -step), q];
            let (mut x, end) = (3, 203);
            while x < end {
                let piece = Piece::new(rows, x, (end - x) as usize);
                let length = piece.length as i32;
                assert!(length >= 1 && x + length <= end);
                for at in x..x + length {
                    let [u, q] = [rows[0].value(at), q.value(at)];
                    if q < 0.02 {
                        continue;
                    }
                    // The quotient's own step, where it is least over the piece.
                    let slope = |at: i32| {
                        let q = rows[2].value(at);
                        (rows[0].dx - rows[0].value(at) / q * rows[2].dx).abs() / q
                    };
                    let slope = slope(x).max(slope(x + length - 1));
                    let off = (piece.u.value(at) - u / q).abs() / slope.max(1e-6);
                    let allowed = if length > 4 { 0.05 } else { 0.5 };
                    assert!(off <= allowed, "case {case}: {off} of {length}");
                }
                long += usize::from(length > 8);
                x += length;
            }
        }
        assert!(long > 1000, "{long} pieces of more than 8 samples");
    }
}
