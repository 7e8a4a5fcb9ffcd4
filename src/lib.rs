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
//!
//! `pipeline` is that way in one file. Around it: `batch` bakes many trees, `plan` says which levels a
//! scene needs, `sweep` measures speed against accuracy, `study` repeats the papers' experiments on
//! `runtime`, which is what an engine calls every frame.

#[cfg(feature = "bake")]
pub mod batch;
#[cfg(feature = "bake")]
mod beside;
#[cfg(feature = "bake")]
pub mod botany;
#[cfg(feature = "bake")]
pub mod cli;
#[cfg(feature = "bake")]
pub mod client;
#[cfg(feature = "bake")]
pub mod cloud;
#[cfg(feature = "bake")]
pub mod describe;
#[cfg(feature = "bake")]
pub mod detail;
#[cfg(feature = "bake")]
pub mod error;
#[cfg(feature = "bake")]
pub mod export;
#[cfg(feature = "bake")]
pub mod knobs;
#[cfg(feature = "bake")]
pub mod ladder;
#[cfg(feature = "bake")]
pub mod level;
#[cfg(feature = "bake")]
mod levels;
#[cfg(feature = "bake")]
mod measured_visibility;
#[cfg(feature = "bake")]
pub mod pipeline;
#[cfg(feature = "bake")]
pub mod plan;
#[cfg(feature = "bake")]
mod prepared;
#[cfg(feature = "bake")]
mod provenance;
#[cfg(feature = "bake")]
pub mod recipe;
#[cfg(feature = "bake")]
pub mod report;
#[cfg(feature = "bake")]
mod request;
pub mod runtime;
#[cfg(feature = "bake")]
pub mod scene;
#[cfg(feature = "bake")]
mod sharing;
#[cfg(feature = "bake")]
mod solid;
#[cfg(feature = "bake")]
pub mod space;
#[cfg(feature = "bake")]
pub mod species;
#[cfg(feature = "bake")]
pub mod study;
#[cfg(feature = "bake")]
pub mod sweep;
#[cfg(feature = "bake")]
pub mod threads;
#[cfg(feature = "bake")]
pub mod tiles;
#[cfg(feature = "bake")]
pub mod verdict;
#[cfg(feature = "bake")]
pub mod watch;
#[cfg(feature = "bake")]
mod written;

#[cfg(feature = "bake")]
pub use error::{Error, Result};
