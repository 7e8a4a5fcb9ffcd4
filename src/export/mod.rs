//! STEP 4: levels become a package on disk.

pub mod atlas;
pub mod blocks;
pub mod chart;
pub mod coarser;
pub mod combined;
pub mod edge;
pub mod enough;
mod exchange;
pub mod foliage;
pub mod gltf;
pub mod hierarchy;
pub mod instanced;
mod joined;
mod leftovers;
pub mod level_scene;
pub mod manifest;
mod manifest_check;
mod manifest_cuts;
pub mod manifest_tiles;
pub mod maps;
pub mod matching;
pub mod mip;
mod neighbours;
pub mod original;
pub mod package;
pub mod png;
pub mod project;
pub mod refine;
pub mod share;
pub mod shipped;
pub mod sides;
pub mod surface;
pub mod tangent;
pub mod texel;
pub mod tileset;
#[cfg(feature = "xatlas")]
pub mod xatlas;
