//! STEP 1: a glTF file becomes a [`Tree`].

pub mod load;
pub mod model;
pub mod tree;

pub use model::Model;
pub use tree::Tree;
