//! Geometry and rasters that know no botany.

pub mod directions;
pub mod eigen;
pub mod glb;
pub mod grid;
pub mod hull;
mod min_triangle;
pub mod polyline;
pub mod raster;
pub mod root;
pub mod sha256;
pub mod texture;
pub mod view;
