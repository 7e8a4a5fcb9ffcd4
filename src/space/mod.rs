//! Geometry and rasters that know no botany.

#[cfg(feature = "bake")]
pub mod align;
pub mod directions;
#[cfg(feature = "bake")]
pub mod eigen;
#[cfg(feature = "bake")]
pub mod glb;
#[cfg(feature = "bake")]
pub mod grid;
pub mod hull;
#[cfg(feature = "bake")]
pub mod lab;
mod min_triangle;
pub mod polyline;
#[cfg(feature = "bake")]
pub mod random;
pub mod raster;
pub mod root;
pub mod sector;
pub mod sha256;
#[cfg(feature = "bake")]
pub mod texture;
pub mod view;
