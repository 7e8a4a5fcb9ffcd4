//! STEP 1: a glTF file becomes a [`Tree`].

pub mod apart;
pub mod attach;
pub mod branch;
pub mod grow;
pub mod leaf;
pub mod load;
pub mod model;
pub mod organ;
pub mod part;
pub mod portrait;
pub mod prototype;
pub mod recognise;
pub mod skeleton;
pub mod stance;
pub mod subtree;
pub mod tree;

pub use model::Model;
pub use recognise::recognise;
pub use tree::Tree;
