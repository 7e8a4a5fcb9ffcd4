//! Geometry and rasters that know no botany.

pub mod eigen;
pub mod glb;
pub mod hull;
pub mod raster;
