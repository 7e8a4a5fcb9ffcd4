//! What decides the alpha of a page's texels.

/// Mips that can be told what to show: gutters keep cards apart in four, the fifth is what the fourth is
/// mixed with.
pub const MIPS: usize = 5;

/// What texels become, and which blocks of them pass.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    /// Score from which a texel is opaque.
    pub threshold: f32,
    /// Alpha of opaque texels and of others, where no mip asks for another.
    pub alphas: [u8; 2],
    /// For each mip the mean opacity from which a block passes; `None`: as it comes. The first is for
    /// blocks of 2 x 2 texels.
    pub passes: [Option<f32>; MIPS],
}

impl Rule {
    /// A texel's alpha where no mip asks for another.
    #[inline]
    pub fn alpha(&self, score: f32) -> u8 {
        match score >= self.threshold {
            true => self.alphas[0],
            false if score > f32::NEG_INFINITY => self.alphas[1],
            // Texels of no chart stay empty: they would only bleed into their neighbours' mips.
            false => 0,
        }
    }
}
