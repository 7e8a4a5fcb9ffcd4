//! STEP 2: a sub-tree becomes billboards, each with cost and error.

pub mod card;
pub use card::{Card, Outline};
