//! A block of texels with all smaller ones in it: what becomes of them where some are to pass.

use super::rule::{Rule, alpha};
use crate::space::raster::ScorePage;

/// What a mean alpha must be to pass.
pub const CUTOFF: f32 = 127.5;

/// Opaque texels and blocks that are to pass have this alpha at least: three steps of room, since every
/// mip is rounded.
const PASSING: f32 = 131.0;

/// Others have this alpha at most.
const FAILING: f32 = 125.0;

/// Between which ends a mean alpha may lie.
#[derive(Clone, Copy, Default)]
struct Span {
    low: f32,
    high: f32,
    /// What it would be if nothing else asked for another.
    own: f32,
}

impl Span {
    /// As near to this as it can be, and on the same side of the cutoff if that can be.
    #[inline]
    fn towards(mut self, wanted: f32) -> Self {
        if wanted >= CUTOFF && self.high >= PASSING {
            self.low = self.low.max(PASSING);
        } else if wanted < CUTOFF && self.low <= FAILING {
            self.high = self.high.min(FAILING);
        }
        self.own = wanted.clamp(self.low, self.high);
        self
    }
}

/// A square of `1 << halvings` texels and its mips, the finest first.
pub struct Block {
    halvings: usize,
    /// Where each mip begins.
    starts: Vec<usize>,
    spans: Vec<Span>,
}

impl Block {
    /// Of nothing yet.
    pub fn new(halvings: usize) -> Self {
        let mut starts = vec![0];
        for mip in 0..=halvings {
            starts.push(starts[mip] + (1 << (2 * (halvings - mip))));
        }
        let count = starts[halvings + 1];
        Self {
            halvings,
            starts,
            spans: vec![Span::default(); count],
        }
    }

    /// Texels along a side of a mip.
    fn side(&self, mip: usize) -> usize {
        1 << (self.halvings - mip)
    }

    /// Reads the texels that begin at a column of so many.
    pub fn read(&mut self, scores: &[f32], (width, left): (usize, usize), rule: &Rule) {
        let side = self.side(0);
        for (y, row) in scores.chunks_exact(width).enumerate() {
            let out = &mut self.spans[y * side..][..side];
            for (span, &score) in out.iter_mut().zip(&row[left..]) {
                // Those of no chart, too: where cards are a few texels large, empty ones between them would let hardly
                // a block of texels pass.
                let (low, high) = match score >= rule.threshold {
                    true => (PASSING, 255.0),
                    false => (0.0, FAILING),
                };
                let own = alpha(score - rule.threshold).clamp(low, high);
                *span = Span { low, high, own };
            }
        }
    }

    /// What may become of its mips, given which of their texels pass: those of `mips`, whose blocks begin here.
    pub fn join(&mut self, mips: &[&ScorePage], [left, top]: [usize; 2], rule: &Rule) {
        for mip in 0..self.halvings {
            let side = self.side(mip);
            let (finer, coarser) = self.spans.split_at_mut(self.starts[mip + 1]);
            let finer = &finer[self.starts[mip]..];
            let asked = rule.passes.get(mip).copied().flatten();
            let asked = asked.map(|least| (least, mips[mip]));
            each_four(side, |at, four| {
                let mean =
                    |of: fn(&Span) -> f32| four.iter().map(|&i| of(&finer[i])).sum::<f32>() / 4.0;
                let span = Span {
                    low: mean(|span| span.low),
                    high: mean(|span| span.high),
                    own: mean(|span| span.own),
                };
                coarser[at] = match asked {
                    Some((least, page)) => {
                        let [x, y] = [left >> (mip + 1), top >> (mip + 1)];
                        let score = page.score([x + at % (side / 2), y + at / (side / 2)]);
                        span.towards(alpha(score - least))
                    }
                    None => span,
                };
            });
        }
    }

    /// From the mean of all to those of its parts, down to texels: each moves by the same part of the
    /// way that it can.
    pub fn share_out(&mut self) {
        for mip in (0..self.halvings).rev() {
            let side = self.side(mip);
            let (finer, coarser) = self.spans.split_at_mut(self.starts[mip + 1]);
            let finer = &mut finer[self.starts[mip]..];
            each_four(side, |at, four| {
                let sum = |of: fn(&Span) -> f32| four.iter().map(|&i| of(&finer[i])).sum::<f32>();
                let own = sum(|s| s.own);
                let more = 4.0 * coarser[at].own - own;
                if more == 0.0 {
                    return;
                }
                let end: fn(&Span) -> f32 = if more > 0.0 { |s| s.high } else { |s| s.low };
                // No less than what is asked for: sums are rounded.
                let way = (sum(end) - own).abs().max(more.abs());
                for i in four {
                    let span = &mut finer[i];
                    span.own += (end(span) - span.own) * (more.abs() / way);
                }
            });
        }
    }

    /// Writes what became of the texels.
    pub fn write(&self, alpha: &mut [u8], (width, left): (usize, usize)) {
        let side = self.side(0);
        for (y, row) in alpha.chunks_exact_mut(width).enumerate() {
            let spans = &self.spans[y * side..][..side];
            for (out, span) in row[left..].iter_mut().zip(spans) {
                *out = (span.own + 0.5) as u8;
            }
        }
    }
}

/// Calls `each` with the places of the four texels under each of the next mip, in a square of so many
/// a side.
#[inline]
fn each_four(side: usize, mut each: impl FnMut(usize, [usize; 4])) {
    let half = side / 2;
    for y in 0..half {
        for x in 0..half {
            let first = 2 * y * side + 2 * x;
            let below = first + side;
            each(y * half + x, [first, first + 1, below, below + 1]);
        }
    }
}
