//! STEP 2: a sub-tree becomes billboards, each with cost and error.

pub mod card;
pub mod coverage;
pub mod cross;
pub mod foliage;
pub mod occlusion;
pub mod plane;
pub mod strip;

pub use card::{Card, Outline};
pub use coverage::{Coverage, coverage};
pub use foliage::{Face, Foliage};
pub use occlusion::Occlusion;
