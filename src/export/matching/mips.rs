//! Alpha of which every mip shows as much as it should.
//!
//! An engine's mips are means of alpha: what is sparse falls under the cutoff sooner or later and
//! dissolves, what is dense closes up. But the test asks only whether a texel reaches the cutoff, not
//! by how much. How far each opaque texel stands above it, and each other one below, is free, and tells
//! which texels of the mips pass: from the finest mip to the coarsest, between which ends the mean of
//! each block of texels may lie, given whether it is to pass; then back, each block's mean shared out
//! among its texels ([`super::block`]). What none of this asks for stays as it was.

use rayon::prelude::*;

use super::block::Block;
use super::rule::{MIPS, Rule};
use crate::space::raster::ScorePage;

/// Sets alpha from the scores of a page and of its mips.
pub fn fill(alpha: &mut [u8], page: &ScorePage, mips: &[&ScorePage], rule: &Rule) {
    let scores = page.scores();
    if rule.passes == [None; MIPS] {
        let texels = alpha.par_iter_mut().zip(scores);
        texels.for_each(|(alpha, &score)| *alpha = rule.alpha(score));
        return;
    }
    let (width, halvings) = (page.size()[0], halvings(page.size()));
    let band = width << halvings;
    let bands = alpha.par_chunks_mut(band).zip(scores.par_chunks(band));
    bands.enumerate().for_each_init(
        || Block::new(halvings),
        |block, (number, (alpha, scores))| {
            for left in (0..width).step_by(1 << halvings) {
                block.read(scores, (width, left), rule);
                block.join(mips, [left, number << halvings], rule);
                block.share_out();
                block.write(alpha, (width, left));
            }
        },
    );
}

/// Halvings of the largest blocks that a page is made of.
fn halvings([width, height]: [usize; 2]) -> usize {
    (width | height | 1 << MIPS).trailing_zeros() as usize
}

/// How much more opaque a texel is for the score by which it is above the threshold. The steeper, the more a block's score is
/// the number of its texels that are opaque; the flatter, the more how sure they are, which keeps single texels from passing for
/// whole blocks. Of levels of birch_6142, aspen_hex and the fan palm in a client: 4, 1, .7, .5, .3 and .15 give an F1 of .844,
/// .849, .852, .852, .853 and .852, and areas that are .029, .027, .025, .023, .021 and .020 off.
const SURENESS: f32 = 0.3;

/// The scores of a page's mips, the finest first: how opaque blocks of texels are in the mean, of which one is half
/// opaque where its score is this threshold. Texels of no chart don't count.
pub fn means(page: &ScorePage, threshold: f32) -> Vec<ScorePage> {
    let opacity = |score: f32| match score > f32::NEG_INFINITY {
        true => ((score - threshold) * SURENESS + 0.5).clamp(0.0, 1.0),
        false => score,
    };
    let [mut width, mut height] = page.size();
    let mut mips: Vec<ScorePage> = Vec::new();
    for _ in 0..halvings(page.size()).min(MIPS) {
        let scores = match mips.last() {
            Some(mip) => coarser(mip.scores(), width, |score| score),
            // Of the page itself no opacities are kept: it is the largest.
            None => coarser(page.scores(), width, opacity),
        };
        (width, height) = (width / 2, height / 2);
        mips.push(ScorePage::new(width as u32, height as u32, scores));
    }
    mips
}

/// The means of blocks of 2 x 2 texels of rows of so many, of each what `of` makes of it.
fn coarser(scores: &[f32], width: usize, of: impl Fn(f32) -> f32 + Sync) -> Vec<f32> {
    let mut out = vec![0.0; scores.len() / 4];
    let rows = out.par_chunks_exact_mut(width / 2);
    rows.zip(scores.par_chunks_exact(2 * width))
        .for_each(|(out, two)| {
            let (above, below) = two.split_at(width);
            let pairs = above.chunks_exact(2).zip(below.chunks_exact(2));
            for (out, (a, b)) in out.iter_mut().zip(pairs) {
                *out = mean([a[0], a[1], b[0], b[1]].map(&of));
            }
        });
    out
}

/// Of those that are of a chart.
fn mean(four: [f32; 4]) -> f32 {
    let some = four.iter().filter(|score| score.is_finite());
    let (sum, count) = some.fold((0.0, 0), |(sum, count), score| (sum + score, count + 1));
    match count {
        0 => f32::NEG_INFINITY,
        _ => sum / count as f32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of texels that score .9 and .1 where one of .5 is half opaque.
    const OPACITIES: [f32; 2] = [0.5 + 0.4 * SURENESS, 0.5 - 0.4 * SURENESS];

    /// A page of leaves of 2 x 2 texels, one in 16 texels: every block of 8 x 8 has 4 of 64 opaque, or 8 on the left half.
    fn leaves(size: [u32; 2]) -> Vec<f32> {
        let leaf =
            |x: u32, y: u32| x % 8 < 2 && y % 8 < 2 || x < size[0] / 2 && x % 8 == 6 && y % 8 > 3;
        let score = |i: u32| match leaf(i % size[0], i / size[0]) {
            true => 0.9,
            false => 0.1,
        };
        (0..size[0] * size[1]).map(score).collect()
    }

    /// Box filtered, as engines do.
    fn halved(alpha: &[u8], width: usize) -> Vec<u8> {
        let rows = alpha.chunks_exact(2 * width);
        rows.flat_map(|pair| {
            (0..width / 2).map(|x| {
                let four = [2 * x, 2 * x + 1, width + 2 * x, width + 2 * x + 1];
                let sum: u32 = four.iter().map(|&i| u32::from(pair[i])).sum();
                ((sum + 2) / 4) as u8
            })
        })
        .collect()
    }

    fn page(scores: &[f32], size: [u32; 2]) -> ScorePage {
        ScorePage::new(size[0], size[1], scores.to_vec())
    }

    fn passed(alpha: &[u8]) -> f32 {
        alpha.iter().filter(|&&a| a >= 128).count() as f32 / alpha.len() as f32
    }

    #[test]
    fn where_no_mip_asks_each_texel_has_the_alpha_of_its_score() {
        let size = [64, 32];
        let mut scores = leaves(size);
        scores[5] = f32::NEG_INFINITY;
        let mut alpha = vec![7; scores.len()];
        fill(&mut alpha, &page(&scores, size), &[], &Rule::of(0.5));
        for (at, (&alpha, &score)) in alpha.iter().zip(&scores).enumerate() {
            // 127.5 + 200 * .4, and as much below.
            let wanted = if score > 0.5 { 208 } else { 48 };
            assert_eq!(alpha, if at == 5 { 0 } else { wanted }, "{at}");
        }
    }

    #[test]
    fn scores_of_mips_are_mean_opacities() {
        let mut scores = vec![0.3; 64 * 32];
        // The first block of 2 x 2: far above, at the threshold, far below, nobody's.
        for (at, score) in [(0, 2.0), (1, 0.3), (64, -2.0), (65, f32::NEG_INFINITY)] {
            scores[at] = score;
        }
        let mips = means(&page(&scores, [64, 32]), 0.3);
        let sizes: Vec<[usize; 2]> = mips.iter().map(ScorePage::size).collect();
        assert_eq!(sizes, [[32, 16], [16, 8], [8, 4], [4, 2], [2, 1]]);
        // (1 + .5 + 0) / 3 and .5 are alike; of it and three blocks of a half, too.
        assert_eq!(mips[0].score([0, 0]), 0.5);
        assert_eq!(mips[0].score([1, 0]), 0.5);
        scores[0] = -2.0;
        let mips = means(&page(&scores, [64, 32]), 0.3);
        assert!((mips[0].score([0, 0]) - 0.5 / 3.0).abs() < 1e-6);
        assert!((mips[1].score([0, 0]) - (0.5 / 3.0 + 1.5) / 4.0).abs() < 1e-6);
    }

    #[test]
    fn sparse_leaves_show_in_a_coarse_mip_where_they_are_densest_and_keep_their_shape() {
        let size = [64, 32];
        let scores = leaves(size);
        let page = page(&scores, size);
        let mips = means(&page, 0.5);
        // Of blocks of 8 x 8 texels, of which 4 or 8 are opaque (.9), those on the left half.
        let [leaf, open] = OPACITIES;
        let between = (6.0 * leaf + 58.0 * open) / 64.0;
        let mut rule = Rule::of(0.5);
        rule.passes[2] = Some(between);
        let mut alpha = vec![0; scores.len()];
        fill(&mut alpha, &page, &mips.iter().collect::<Vec<_>>(), &rule);
        // No texel changes sides.
        for (at, (&alpha, &score)) in alpha.iter().zip(&scores).enumerate() {
            assert_eq!(alpha >= 128, score > 0.5, "{at}");
        }
        let first = halved(&alpha, 64);
        let second = halved(&first, 32);
        let third = halved(&second, 16);
        assert_eq!(passed(&third), 0.5);
        for (at, &alpha) in third.iter().enumerate() {
            assert_eq!(alpha >= 128, at % 8 < 4, "{at}: {alpha}");
        }
    }

    #[test]
    fn texels_of_no_chart_help_blocks_to_pass() {
        let size = [64, 32];
        // Of every block of 4 x 4 texels one is opaque and two are nobody's, as between cards of a few texels.
        let score = |i: u32| match (i % size[0] % 4, i / size[0] % 4) {
            (1, 1) => 0.9,
            (3, 3) | (0, 3) => f32::NEG_INFINITY,
            _ => 0.1,
        };
        let scores: Vec<f32> = (0..size[0] * size[1]).map(score).collect();
        let page = page(&scores, size);
        let mips = means(&page, 0.5);
        let filled = |least: f32| {
            let mut rule = Rule::of(0.5);
            rule.passes[1] = Some(least);
            let mut alpha = vec![0; scores.len()];
            fill(&mut alpha, &page, &mips.iter().collect::<Vec<_>>(), &rule);
            for (at, (&alpha, &score)) in alpha.iter().zip(&scores).enumerate() {
                assert_eq!(alpha >= 128, score > 0.5, "{at}");
            }
            let second = halved(&halved(&alpha, 64), 32);
            (alpha, passed(&second))
        };
        let [leaf, open] = OPACITIES;
        let mean = (leaf + 13.0 * open) / 14.0;
        let (alpha, shown) = filled(mean - 0.05);
        assert_eq!(shown, 1.0);
        assert!(alpha[3 * 64] > 100, "{}", alpha[3 * 64]);
        assert_eq!(filled(mean + 0.05).1, 0.0);
    }

    #[test]
    fn dense_leaves_open_up_where_they_are_thinnest() {
        let size = [64, 32];
        // Mostly opaque, with a hole in every block of 4 x 4; larger ones on the right.
        let hole = |x: u32, y: u32| {
            x.is_multiple_of(4) && y.is_multiple_of(4) || x >= 32 && x % 4 == 1 && y % 4 < 2
        };
        let score = |i: u32| if hole(i % 64, i / 64) { 0.1 } else { 0.9 };
        let scores: Vec<f32> = (0..64 * 32).map(score).collect();
        let page = page(&scores, size);
        let mips = means(&page, 0.5);
        // One texel of 16 is a hole on the left, three are on the right.
        let mut rule = Rule::of(0.5);
        let [leaf, hole] = OPACITIES;
        rule.passes[1] = Some(leaf - (leaf - hole) * 2.0 / 16.0);
        let mut alpha = vec![0; scores.len()];
        fill(&mut alpha, &page, &mips.iter().collect::<Vec<_>>(), &rule);
        let second = halved(&halved(&alpha, 64), 32);
        assert_eq!(passed(&second), 0.5);
        assert!(
            alpha
                .iter()
                .zip(&scores)
                .all(|(&a, &s)| (a >= 128) == (s > 0.5))
        );
    }
}
