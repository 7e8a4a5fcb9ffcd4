//! `pleach` bakes levels of detail for botanical trees.
//!
//! A polygonal tree (glTF) goes in; a package of levels that a game engine loads comes out. The
//! way of the data is the order of the modules:
//!
//! ```text
//! botany  glTF file -> Tree          load, parts, organs, skeleton, leaves, sub-trees
//! cloud   sub-tree  -> billboards    cross, plane, strip, each with cost and error
//! detail  billboards -> levels       cuts for the distances that the scene requires
//! export  levels -> package          projection, atlas, glTF, manifest
//! report  package -> evidence        reads the files back, renders, measures
//! ```

pub mod botany;
pub mod cli;
pub mod cloud;
pub mod describe;
pub mod detail;
pub mod error;
pub mod export;
pub mod knobs;
pub mod ladder;
pub mod level;
pub mod pipeline;
pub mod recipe;
pub mod report;
pub mod scene;
pub mod space;
pub mod watch;

pub use error::{Error, Result};
