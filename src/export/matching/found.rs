//! What the matching finds.

/// What was found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matched {
    /// Score from which a texel is opaque.
    pub threshold: f32,
    /// Covered area over the original's, supersampled from the base level.
    pub near_ratio: f64,
    /// Covered area over the original's as a client draws it: where the level starts, and at each twice
    /// the distance of the one before.
    pub ratios: Vec<f64>,
}
