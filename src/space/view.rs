//! Directions to look from, and the framing of a tree in the picture.

use glam::Vec3;

use super::raster::Camera;

/// Elevations of the rings of views where nothing else is asked for, degrees above the horizon.
pub const ELEVATIONS: [f32; 3] = [0.0, 30.0, -15.0];

/// Views that [`views`] gives where nothing else is asked for: five azimuths at three elevations
/// and the top. An odd number of azimuths, since opposite views show mirrored silhouettes.
pub const DEFAULT_VIEWS: usize = 16;

/// A direction from which a tree is looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// "azimuth 72 elevation -15" or "top".
    pub name: String,
    /// Degrees around the y axis; 0 looks from +z, 90 from +x.
    pub azimuth_deg: f32,
    /// Degrees above the horizon; 90 looks straight down.
    pub elevation_deg: f32,
}

/// At least `count` views: equal azimuths at the elevations 0, 30 and -15 degrees, and the top.
///
/// Another `offset_deg` (degrees of azimuth) gives another set, so that what was fitted to some
/// views can be judged by others.
pub fn views(count: usize, offset_deg: f32) -> Vec<View> {
    views_at(&ELEVATIONS, count, offset_deg)
}

/// As [`views`], at other elevations (degrees above the horizon).
pub fn views_at(elevations: &[f32], count: usize, offset_deg: f32) -> Vec<View> {
    let rings = elevations.len().max(1);
    let azimuths = count.saturating_sub(1).div_ceil(rings).max(1);
    let ring = |elevation_deg: f32| {
        (0..azimuths).map(move |i| {
            let azimuth_deg = (360.0 * i as f32 / azimuths as f32 + offset_deg).rem_euclid(360.0);
            View {
                name: format!("azimuth {azimuth_deg:.0} elevation {elevation_deg:.0}"),
                azimuth_deg,
                elevation_deg,
            }
        })
    };
    let top = View {
        name: "top".into(),
        azimuth_deg: offset_deg.rem_euclid(360.0),
        elevation_deg: 90.0,
    };
    elevations
        .iter()
        .copied()
        .flat_map(ring)
        .chain([top])
        .collect()
}

impl View {
    /// Unit vector from the tree to the eye.
    pub fn towards_eye(&self) -> Vec3 {
        let (azimuth, elevation) = (
            self.azimuth_deg.to_radians(),
            self.elevation_deg.to_radians(),
        );
        let (sin, cos) = azimuth.sin_cos();
        Vec3::new(
            sin * elevation.cos(),
            elevation.sin(),
            cos * elevation.cos(),
        )
    }

    /// An orthographic camera on the unit sphere at the origin.
    ///
    /// The picture is square and the same size for every view; where the tree has an extent
    /// along y of `height` (units of the sphere's radius), that extent is `height_px` pixels.
    pub fn camera(&self, height: f32, height_px: u32) -> Camera {
        self.camera_in_steps(height, height_px, 1)
    }

    /// As [`View::camera`], with sides that can be divided into `step` even parts.
    pub fn camera_in_steps(&self, height: f32, height_px: u32, step: u32) -> Camera {
        let pixels_per_unit = height_px as f32 / height;
        // A margin for levels that reach a little beyond the original's sphere.
        let side = ((pixels_per_unit * 2.1).ceil() as u32 + 4).next_multiple_of(2 * step);
        let (sin, cos) = self.azimuth_deg.to_radians().sin_cos();
        // Straight from above, "up" is where the view at the same azimuth looks to.
        let up = if self.elevation_deg.abs() > 89.0 {
            Vec3::new(-sin, 0.0, -cos)
        } else {
            Vec3::Y
        };
        let forward = -self.towards_eye();
        Camera::orthographic(forward, up, Vec3::ZERO, pixels_per_unit, side, side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_views_are_five_azimuths_at_three_elevations_and_the_top() {
        let views = views(DEFAULT_VIEWS, 0.0);
        assert_eq!(views.len(), 16);
        assert_eq!(views[6].name, "azimuth 72 elevation 30");
        assert_eq!(views[15].name, "top");
        assert!((views[15].towards_eye() - Vec3::Y).length() < 1e-6);
        assert!((views[0].towards_eye() - Vec3::Z).length() < 1e-6);
    }

    #[test]
    fn an_offset_gives_a_disjoint_set() {
        let (a, b) = (views(16, 0.0), views(16, 36.0));
        assert!(a.iter().filter(|v| v.name != "top").all(|v| !b.contains(v)));
    }

    #[test]
    fn every_camera_is_orthonormal_and_right_handed() {
        for view in views(25, 11.0) {
            let camera = view.camera(1.4, 256);
            assert!((camera.right.cross(camera.up) + camera.forward).length() < 1e-5);
            assert_eq!(camera.pixels, 256.0 / 1.4);
            assert!(camera.width as f32 > 2.0 * camera.pixels);
        }
    }
}
