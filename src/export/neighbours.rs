//! Ranks texels of equal score by what is around them.
//!
//! Where all views see other things in front of a texel it has no vote, and a threshold could take only
//! all of these or none.

use fixedbitset::FixedBitSet;
use rayon::prelude::*;

/// Share of its neighbours' mean that a texel takes over.
const NEIGHBOURS: f32 = 0.1;

/// Times that a part of it is taken over: news travels so many texels.
const PASSES: u32 = 3;

/// Rows of the page that a thread changes at a time.
const BAND: usize = 64;

/// Moves the score of every `owned` texel of a page a little towards the mean of those around it.
pub fn follow_neighbours(score: &mut [f32], owned: &FixedBitSet, width: usize) {
    for _ in 0..PASSES {
        // A band's rows are changed in place; what must be kept as it was are the rows beside bands.
        let ends = |band: &[f32]| [band[..width].to_vec(), band[band.len() - width..].to_vec()];
        let ends: Vec<[Vec<f32>; 2]> = score.chunks(BAND * width).map(ends).collect();
        let bands = score.par_chunks_mut(BAND * width).enumerate();
        bands.for_each(|(number, band)| {
            let above = number.checked_sub(1).map(|n| ends[n][1].as_slice());
            let below = ends.get(number + 1).map(|e| e[0].as_slice());
            in_band(band, [above, below], owned, (number * BAND, width));
        });
    }
}

/// One pass over a band that begins at a row of the page; `beside` are the rows above and below it, where
/// there are any.
fn in_band(
    band: &mut [f32],
    beside: [Option<&[f32]>; 2],
    owned: &FixedBitSet,
    (first_row, width): (usize, usize),
) {
    let mut above = beside[0].map(<[f32]>::to_vec);
    for y in 0..band.len() / width {
        let (changed, rest) = band.split_at_mut((y + 1) * width);
        let row = &mut changed[y * width..];
        let here = row.to_vec();
        let below = match rest.is_empty() {
            true => beside[1],
            false => Some(&rest[..width]),
        };
        let at = first_row + y;
        let rows = [above.as_deref(), Some(&here), below];
        // Row `i` of these is row `at + i - 1` of the page.
        let near = (0..3).filter_map(|i| Some((rows[i]?, (at + i - 1) * width)));
        let near: Vec<(&[f32], usize)> = near.collect();
        for (x, value) in row.iter_mut().enumerate() {
            if !owned[at * width + x] {
                continue;
            }
            let columns = x.saturating_sub(1)..(x + 2).min(width);
            let cells = near
                .iter()
                .flat_map(|&(row, first)| columns.clone().map(move |u| (row[u], first + u)));
            let cells = cells.filter(|&(_, at)| owned[at]);
            let (sum, count) = cells.fold((0.0, 0.0), |(s, n), (v, _)| (s + v, n + 1.0));
            *value += NEIGHBOURS / PASSES as f32 * (sum / count - *value);
        }
        above = Some(here);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_texel_takes_over_a_thirtieth_of_the_mean_at_a_time() {
        // One row; the last texel is nobody's, and counts for nothing.
        let mut score = [0.0, 1.0, 0.0, 9.0];
        let owned = FixedBitSet::from_iter([0, 1, 2]);
        follow_neighbours(&mut score, &owned, 4);
        let mut wanted = [0.0f32, 1.0, 0.0];
        for _ in 0..3 {
            let [a, b, c] = wanted;
            let towards = |v: f32, mean: f32| v + (mean - v) / 30.0;
            wanted = [
                towards(a, (a + b) / 2.0),
                towards(b, (a + b + c) / 3.0),
                towards(c, (b + c) / 2.0),
            ];
        }
        for (found, wanted) in score.iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-6, "{found} {wanted}");
        }
        assert_eq!(score[3], 9.0);
    }

    #[test]
    fn bands_do_not_show() {
        // A page that is the same from row to row, but where it begins and ends.
        let (width, height) = (7, 3 * BAND + 5);
        let across = |x: usize| (x * x % 5) as f32;
        let mut score: Vec<f32> = (0..width * height).map(|i| across(i % width)).collect();
        // A stripe across the first seam of two bands, and one in the middle of a band.
        let stripes = [BAND, BAND + BAND / 2];
        for y in stripes {
            score[y * width..][..width].fill(3.0);
        }
        let before = score.clone();
        let owned = FixedBitSet::from_iter(0..width * height);
        follow_neighbours(&mut score, &owned, width);
        let row = |y: usize| &score[y * width..][..width];
        for off in 0..4 {
            assert_eq!(row(stripes[0] + off), row(stripes[1] + off));
            assert_eq!(row(stripes[0] - off), row(stripes[1] - off));
        }
        assert_ne!(score, before);
        assert_ne!(row(BAND), row(BAND + 10));
    }
}
