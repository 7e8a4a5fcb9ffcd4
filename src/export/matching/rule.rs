//! What decides the alpha of a page's texels.

use super::block::CUTOFF;

/// Mips that can be told what to show: gutters keep cards apart in four, the fifth is what the fourth is
/// mixed with.
pub const MIPS: usize = 5;

/// What alpha grows by with a score. Even slopes keep outlines where scores put them, whatever mixes texels: two alphas
/// in place of a slope swell single leaves or shrink them. Steeper, it is as good as two; flatter, mips have less to be
/// made of.
const GAIN: f32 = 200.0;

/// Beyond so much above or below a threshold alpha is full or none.
pub const REACH: f32 = CUTOFF / GAIN;

/// Which texels and which blocks of them pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// Score from which a texel is opaque.
    pub threshold: f32,
    /// For each mip the score from which one of its texels is; `None`: as it comes. The first is half as large as the page.
    pub passes: [Option<f32>; MIPS],
}

/// The alpha of what scores so much more than is needed, 0 to 255.
#[inline]
pub fn alpha(above: f32) -> f32 {
    (CUTOFF + GAIN * above).clamp(0.0, 255.0)
}

impl Rule {
    /// Of which no mip asks for anything.
    pub fn of(threshold: f32) -> Self {
        Self {
            threshold,
            passes: [None; MIPS],
        }
    }

    /// A texel's alpha where no mip asks for another.
    #[inline]
    pub fn alpha(&self, score: f32) -> u8 {
        // Texels of no chart score minus infinity: they are empty.
        let above = score - self.threshold;
        let alpha = alpha(above).round() as u8;
        match above >= 0.0 {
            true => alpha.max(CUTOFF.ceil() as u8),
            false => alpha.min(CUTOFF.floor() as u8),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alpha_rises_evenly_through_the_cutoff() {
        let rule = Rule::of(0.5);
        // 127.5 + 200 * (score - .5).
        for (score, alpha) in [
            (f32::NEG_INFINITY, 0),
            (-0.2, 0),
            (0.3, 88),
            (0.499_99, 127),
            (0.5, 128),
            (0.7, 168),
            (0.5 + REACH, 255),
            (2.0, 255),
        ] {
            assert_eq!(rule.alpha(score), alpha, "{score}");
        }
    }
}
