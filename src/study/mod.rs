//! The papers' own experiments, on any tree: each gives a table and a picture.
//!
//! ```text
//! lee      which leaves to draw under a budget, by four priorities
//! deng     billboards and texels along a path: distance, dot product, density, occlusion
//! el_sana  triangles, splits and merges along a path, with and without occlusion
//! kratt    precision and recall of baked levels, adaptive loop and optimal cut
//! ```

pub mod deng;
pub mod el_sana;
mod frame;
pub mod kratt;
mod leaves;
pub mod lee;
mod measure;
mod picture;
pub mod scenes;
pub mod species;
pub mod stand;
