//! What is asked of a measurement.

use crate::botany::Model;
use crate::space::view::{Lens, View};

/// What is to be measured.
pub struct Asked<'a> {
    /// The original.
    pub original: &'a Model,
    /// Its levels, nearest first.
    pub levels: &'a [&'a Model],
    /// From where.
    pub views: &'a [View],
    /// Through what.
    pub lens: Lens,
    /// For each level its sizes: heights of the tree in pixels.
    pub heights_px: &'a [Vec<u32>],
    /// Heights at which the original has figures, too.
    pub original_px: &'a [u32],
    /// For each level the height from which it is shown, where jumps and orbits are wanted.
    pub starts_px: &'a [u32],
    /// Whether colours, depths and normals are compared, not silhouettes alone.
    pub looks: bool,
    /// Whether everything is also drawn as an engine does.
    pub client: bool,
    /// Whether the causes of what is lost there are wanted: base colours, and few samples alone.
    pub causes: bool,
}
