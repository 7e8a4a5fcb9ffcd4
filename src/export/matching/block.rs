//! A block of texels with all smaller ones in it: what becomes of them where some are to pass.

use super::rule::Rule;

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
    /// On its side of the cutoff, if it can be.
    #[inline]
    fn on_side(mut self, passes: bool) -> Self {
        if passes && self.high >= PASSING {
            self.low = self.low.max(PASSING);
            self.own = self.own.max(self.low);
        } else if !passes && self.low <= FAILING {
            self.high = self.high.min(FAILING);
            self.own = self.own.min(self.high);
        }
        self
    }
}

/// A square of `1 << halvings` texels and its mips, the finest first.
pub struct Block {
    halvings: usize,
    /// Where each mip begins.
    starts: Vec<usize>,
    spans: Vec<Span>,
    /// Mean opacities: a texel's is a half where its score is at the threshold.
    opacity: Vec<f32>,
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
            opacity: vec![0.0; count],
        }
    }

    /// Texels along a side of a mip.
    fn side(&self, mip: usize) -> usize {
        1 << (self.halvings - mip)
    }

    /// Reads the texels that begin at a column of so many; returns how many are opaque.
    pub fn read(&mut self, scores: &[f32], (width, left): (usize, usize), rule: &Rule) -> usize {
        let side = self.side(0);
        let mut count = 0;
        for (y, row) in scores.chunks_exact(width).enumerate() {
            let out = self.spans[y * side..][..side].iter_mut();
            let out = out.zip(&mut self.opacity[y * side..][..side]);
            for ((span, opacity), &score) in out.zip(&row[left..]) {
                *opacity = (score - rule.threshold + 0.5).clamp(0.0, 1.0);
                let (low, high) = match score >= rule.threshold {
                    true => (PASSING, 255.0),
                    false if score > f32::NEG_INFINITY => (0.0, FAILING),
                    false => (0.0, 0.0),
                };
                count += usize::from(score >= rule.threshold);
                let own = f32::from(rule.alpha(score)).clamp(low, high);
                *span = Span { low, high, own };
            }
        }
        count
    }

    /// What may become of its mips, given which of their texels pass.
    pub fn join(&mut self, rule: &Rule) {
        for mip in 0..self.halvings {
            let side = self.side(mip);
            let (from, to) = (self.starts[mip], self.starts[mip + 1]);
            let (finer, coarser) = self.spans.split_at_mut(to);
            let (seen, coarser_seen) = self.opacity.split_at_mut(to);
            let (finer, seen) = (&finer[from..], &seen[from..]);
            each_four(side, |at, four| {
                let four = four.map(|i| (finer[i], seen[i]));
                let mean = |of: fn(&(Span, f32)) -> f32| four.iter().map(of).sum::<f32>() / 4.0;
                coarser_seen[at] = mean(|(_, opacity)| *opacity);
                let span = Span {
                    low: mean(|(span, _)| span.low),
                    high: mean(|(span, _)| span.high),
                    own: mean(|(span, _)| span.own),
                };
                coarser[at] = match rule.passes[mip] {
                    Some(least) => span.on_side(coarser_seen[at] >= least),
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

    /// Calls `each` with the opacity and the mean alpha of every texel of a mip.
    pub fn each(&self, mip: usize, mut each: impl FnMut(f32, f32)) {
        let of_mip = self.starts[mip]..self.starts[mip + 1];
        let both = self.opacity[of_mip.clone()].iter().zip(&self.spans[of_mip]);
        both.for_each(|(&opacity, span)| each(opacity, span.own));
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
