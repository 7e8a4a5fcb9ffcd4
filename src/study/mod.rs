//! The papers' own experiments, on any tree: each gives a table and a picture.
//!
//! ```text
//! lee      which leaves to draw under a budget, by four priorities
//! ```

mod leaves;
pub mod lee;
mod measure;
mod picture;
