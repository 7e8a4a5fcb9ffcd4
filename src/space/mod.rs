//! Geometry and rasters that know no botany.

pub mod glb;
