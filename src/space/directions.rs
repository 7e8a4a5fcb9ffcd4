//! Directions from which a tree is looked at.

use glam::Vec3;

/// A camera's axes: an orthographic picture with `forward` into it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Unit vector from the eye into the scene.
    pub forward: Vec3,
    /// A unit vector that is not parallel to `forward` and shows up in the picture.
    pub up: Vec3,
}

/// The direction at an azimuth around y and an elevation above the horizon, in degrees.
pub fn direction(azimuth_deg: f32, elevation_deg: f32) -> Direction {
    let (a, e) = (azimuth_deg.to_radians(), elevation_deg.to_radians());
    let to_eye = Vec3::new(a.sin() * e.cos(), e.sin(), a.cos() * e.cos());
    let up = if elevation_deg.abs() > 89.0 {
        Vec3::new(-a.sin(), 0.0, -a.cos())
    } else {
        Vec3::Y
    };
    Direction {
        forward: -to_eye,
        up,
    }
}

/// `count` directions for training: azimuths by the golden angle, elevations as trees are seen
/// (mostly level, some from above and below), and the top for every twelfth.
pub fn training(count: u32) -> Vec<Direction> {
    const ELEVATIONS_DEG: [f32; 8] = [0.0, 30.0, -15.0, 12.0, 45.0, -8.0, 22.0, 5.0];
    const GOLDEN_ANGLE_DEG: f32 = 137.507_77;
    (0..count)
        .map(|i| {
            let azimuth = i as f32 * GOLDEN_ANGLE_DEG;
            let top = i % 12 == 11;
            let elevation = if top {
                90.0
            } else {
                ELEVATIONS_DEG[i as usize % 8]
            };
            direction(azimuth, elevation)
        })
        .collect()
}
