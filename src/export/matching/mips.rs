//! Alpha of which chosen mips show as much as they should.
//!
//! An engine's mips are means of alpha: what is sparse falls under the cutoff sooner or later and
//! dissolves, what is dense closes up. But the test asks only whether a texel reaches the cutoff, not
//! by how much. How far each opaque texel stands above it, and each other one below, is free, and tells
//! which texels of the mips pass: from the finest mip to the coarsest, between which ends the mean of
//! each block of texels may lie, given whether it is to pass; then back, each block's mean shared out
//! among its texels ([`super::block`]). What none of this asks for stays as it was.

use rayon::prelude::*;

use super::block::{Block, CUTOFF};
use super::rule::{MIPS, Rule};

/// Opacities that blocks are told apart by.
const STEPS: usize = 1024;

/// Sets alpha from the scores of a page.
pub fn fill(alpha: &mut [u8], scores: &[f32], size: [u32; 2], rule: &Rule) {
    if rule.passes == [None; MIPS] {
        let texels = alpha.par_iter_mut().zip(scores);
        texels.for_each(|(alpha, &score)| *alpha = rule.alpha(score));
        return;
    }
    let (width, halvings) = (size[0] as usize, halvings(size));
    let band = width << halvings;
    let bands = alpha.par_chunks_mut(band).zip(scores.par_chunks(band));
    bands.for_each_init(
        || Block::new(halvings),
        |block, (alpha, scores)| {
            for left in (0..width).step_by(1 << halvings) {
                block.read(scores, (width, left), rule);
                block.join(rule);
                block.share_out();
                block.write(alpha, (width, left));
            }
        },
    );
}

/// Halvings of the largest blocks that a page is made of.
fn halvings([width, height]: [u32; 2]) -> usize {
    (width | height | 1 << MIPS).trailing_zeros() as usize
}

/// What blocks of each mip there are where no mip asks for anything.
pub struct Survey {
    /// Opaque texels.
    opaque: usize,
    mips: [Blocks; MIPS],
}

/// The blocks of one mip.
#[derive(Clone)]
struct Blocks {
    /// How many have each opacity.
    count: Vec<u32>,
    /// How many pass.
    passed: usize,
}

impl Survey {
    /// Of a page.
    pub fn new(scores: &[f32], size: [u32; 2], rule: &Rule) -> Self {
        let (width, halvings) = (size[0] as usize, halvings(size));
        let passes = [None; MIPS];
        let rule = Rule { passes, ..*rule };
        let add = |(mut survey, mut block): (Self, Block), scores: &[f32]| {
            for left in (0..width).step_by(1 << halvings) {
                survey.opaque += block.read(scores, (width, left), &rule);
                block.join(&rule);
                for (of_mip, mip) in survey.mips.iter_mut().zip(1..=halvings) {
                    block.each(mip, |opacity, alpha| of_mip.add(opacity, alpha));
                }
            }
            (survey, block)
        };
        let bands = scores.par_chunks(width << halvings);
        let counted = bands.fold(|| (Self::empty(), Block::new(halvings)), add);
        let counted = counted.map(|(survey, _)| survey);
        counted.reduce(Self::empty, Self::and)
    }

    fn empty() -> Self {
        let blocks = Blocks {
            count: vec![0; STEPS],
            passed: 0,
        };
        Self {
            opaque: 0,
            mips: std::array::from_fn(|_| blocks.clone()),
        }
    }

    fn and(mut self, other: Self) -> Self {
        self.opaque += other.opaque;
        for (own, other) in self.mips.iter_mut().zip(&other.mips) {
            own.passed += other.passed;
            own.count
                .iter_mut()
                .zip(&other.count)
                .for_each(|(a, b)| *a += b);
        }
        self
    }

    /// Of each mip the share of the page that passes, over that of texels which are opaque.
    pub fn shares(&self) -> [f32; MIPS] {
        let texels = |mip: usize| self.mips[mip].passed << (2 * (mip + 1));
        std::array::from_fn(|mip| texels(mip) as f32 / self.opaque.max(1) as f32)
    }

    /// The opacity from which blocks of a mip (counted from 0) pass such that this is the share that does.
    pub fn least(&self, mip: usize, share: f32) -> f32 {
        self.mips[mip].least(share * self.opaque as f32 / (1usize << (2 * (mip + 1))) as f32)
    }
}

impl Blocks {
    fn add(&mut self, opacity: f32, alpha: f32) {
        self.count[(opacity * (STEPS - 1) as f32) as usize] += 1;
        self.passed += usize::from(alpha >= CUTOFF);
    }

    /// The opacity that as many blocks have at least.
    fn least(&self, wanted: f32) -> f32 {
        let mut passed = 0.0;
        for (step, &count) in self.count.iter().enumerate().rev() {
            passed += count as f32;
            if passed > wanted {
                // The part of the step that is not wanted.
                let over = (passed - wanted) / count as f32;
                return (step as f32 + over) / (STEPS - 1) as f32;
            }
        }
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    fn survey(scores: &[f32], size: [u32; 2], alphas: [u8; 2]) -> Survey {
        let rule = Rule {
            threshold: 0.5,
            alphas,
            passes: [Some(0.1); MIPS],
        };
        Survey::new(scores, size, &rule)
    }

    fn passed(alpha: &[u8]) -> f32 {
        alpha.iter().filter(|&&a| a >= 128).count() as f32 / alpha.len() as f32
    }

    #[test]
    fn where_no_mip_asks_there_are_two_alphas_and_no_texel_changes_sides() {
        let size = [64, 32];
        let mut scores = leaves(size);
        scores[5] = f32::NEG_INFINITY;
        let mut alpha = vec![7; scores.len()];
        let rule = Rule {
            threshold: 0.5,
            alphas: [250, 20],
            passes: [None; MIPS],
        };
        fill(&mut alpha, &scores, size, &rule);
        for (at, (&alpha, &score)) in alpha.iter().zip(&scores).enumerate() {
            let wanted = if score > 0.5 { 250 } else { 20 };
            assert_eq!(alpha, if at == 5 { 0 } else { wanted }, "{at}");
        }
    }

    #[test]
    fn a_survey_counts_what_passes_and_finds_the_opacity_of_a_share() {
        let size = [64, 32];
        let survey = survey(&leaves(size), size, [255, 0]);
        assert_eq!(survey.opaque, 32 * 4 + 16 * 4);
        // Blocks of 2 x 2: leaves lie on them, stems of one texel in width are halves, which pass, too.
        let shares = survey.shares();
        assert_eq!(
            shares[0],
            (32 * 4 + 16 * 2 * 4) as f32 / survey.opaque as f32
        );
        // Blocks of 4 x 4: a quarter of one, a quarter of another: none passes.
        assert_eq!(shares[1], 0.0);
        // All 16 blocks of 8 x 8 on the left are more opaque than all on the right.
        let half = survey.least(2, 16.0 * 64.0 / survey.opaque as f32);
        assert!(
            half > (4.0 * 0.9 + 60.0 * 0.1) / 64.0 && half < 0.2,
            "{half}"
        );
    }

    #[test]
    fn sparse_leaves_show_in_a_coarse_mip_where_they_are_densest_and_keep_their_shape() {
        let size = [64, 32];
        let scores = leaves(size);
        let survey = survey(&scores, size, [255, 32]);
        // Of blocks of 8 x 8 texels those on the left half.
        let mut passes = [None; MIPS];
        passes[2] = Some(survey.least(2, 16.0 * 64.0 / survey.opaque as f32));
        let rule = Rule {
            threshold: 0.5,
            alphas: [255, 32],
            passes,
        };
        let mut alpha = vec![0; scores.len()];
        fill(&mut alpha, &scores, size, &rule);
        // No texel changes sides, none on the right changes at all.
        for (at, (&alpha, &score)) in alpha.iter().zip(&scores).enumerate() {
            assert_eq!(alpha >= 128, score > 0.5, "{at}");
            let as_it_was = if score > 0.5 { 255 } else { 32 };
            assert!(at % 64 < 32 || alpha == as_it_was, "{at}: {alpha}");
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
    fn dense_leaves_open_up_where_they_are_thinnest() {
        let size = [64, 32];
        // Mostly opaque, with a hole in every block of 4 x 4; larger ones on the right.
        let hole = |x: u32, y: u32| {
            x.is_multiple_of(4) && y.is_multiple_of(4) || x >= 32 && x % 4 == 1 && y % 4 < 2
        };
        let score = |i: u32| if hole(i % 64, i / 64) { 0.1 } else { 0.9 };
        let scores: Vec<f32> = (0..64 * 32).map(score).collect();
        let survey = survey(&scores, size, [255, 0]);
        let mut passes = [None; MIPS];
        passes[1] = Some(survey.least(1, 0.5 * 64.0 * 32.0 / survey.opaque as f32));
        let rule = Rule {
            threshold: 0.5,
            alphas: [255, 0],
            passes,
        };
        let mut alpha = vec![0; scores.len()];
        fill(&mut alpha, &scores, size, &rule);
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
