//! Geometry and rasters that know no botany.

pub mod align;
pub mod directions;
pub mod eigen;
pub mod glb;
pub mod grid;
pub mod hull;
pub mod lab;
mod min_triangle;
pub mod polyline;
pub mod random;
pub mod raster;
pub mod sector;
pub mod sha256;
pub mod texture;
pub mod view;
