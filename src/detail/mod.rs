//! STEP 3: billboards become levels of detail.

pub mod adapt;
pub mod adaptive_level;
pub mod element;
pub mod facing;
pub mod level;
pub mod likeness;
pub mod merge;
pub mod opaque;
pub mod optimal_cut;
pub mod optimal_distance;
pub mod reassign;
pub mod tiles;
pub mod whole_tree;
pub mod wood;
