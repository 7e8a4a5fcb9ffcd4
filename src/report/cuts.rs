//! The cuts that a bake chose from, and those that became levels.

use serde::{Deserialize, Serialize};

use crate::detail::optimal_cut::Candidate;

/// Error against triangles: what every budget could have, and what was baked.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cuts {
    /// Every budget's best cut, finest first.
    pub best: Vec<Candidate>,
    /// The levels, nearest first.
    pub levels: Vec<Candidate>,
}
