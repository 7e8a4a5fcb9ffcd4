//! Directions to look from, and the framing of a tree in the picture.

use glam::Vec3;

use super::raster::Camera;
use super::sector::Sector;

/// Elevations of the rings of views where nothing else is asked for, degrees above the horizon.
pub const ELEVATIONS: [f32; 3] = [0.0, 30.0, -15.0];

/// Views that [`views`] gives where nothing else is asked for: five azimuths at three elevations
/// and the top. An odd number of azimuths, since opposite views show mirrored silhouettes.
pub const DEFAULT_VIEWS: usize = 16;

/// How lines of sight run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// In parallel: a picture without distance, as in figures of the literature.
    Parallel,
    /// They meet in the eye. The focal length is in pixels: what is `d` away and `h` high takes
    /// `focal * h / d` pixels.
    Focal(f64),
}

impl Lens {
    /// Lines of the screen that distances are stated for.
    pub const SCREEN_LINES: f64 = 1080.0;
    /// Vertical field of view that distances are stated for, degrees.
    pub const FIELD_OF_VIEW_DEG: f64 = 60.0;

    /// The lens of a screen with so many lines and a vertical field of view in degrees:
    /// `f = lines / (2 tan(fov / 2))`.
    pub fn of_screen(lines: f64, fov_deg: f64) -> Self {
        Self::Focal(lines / (2.0 * (fov_deg / 2.0).to_radians().tan()))
    }

    /// Focal length in pixels; `None` where lines of sight are parallel.
    pub fn focal_px(self) -> Option<f64> {
        match self {
            Self::Parallel => None,
            Self::Focal(focal_px) => Some(focal_px),
        }
    }
}

/// 1080 lines and 60 degrees: 935.3 pixels.
impl Default for Lens {
    fn default() -> Self {
        Self::of_screen(Self::SCREEN_LINES, Self::FIELD_OF_VIEW_DEG)
    }
}

/// The eye stays at least so far from the middle of the unit sphere, in radii. Where a flat tree
/// would be seen from nearer, or from within, the lens is longer instead, as a photographer would do.
const NEAREST_EYE: f32 = 1.5;

/// Radius that a picture has room for: levels may reach a little beyond the original's unit sphere.
const ROOM: f32 = 1.05;

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

/// `count` views: equal azimuths at the elevations 0, 30 and -15 degrees, and the top.
///
/// Another `offset_deg` (degrees of azimuth) gives another set, so that what was fitted to some
/// views can be judged by others.
pub fn views(count: usize, offset_deg: f32) -> Vec<View> {
    views_at(&ELEVATIONS, count, offset_deg)
}

/// As [`views`], at other elevations (degrees above the horizon): the first ones have an azimuth more where they can't
/// all have as many, and each has one at least.
pub fn views_at(elevations: &[f32], count: usize, offset_deg: f32) -> Vec<View> {
    let (around, rings) = (count.saturating_sub(1), elevations.len().max(1));
    let ring = |(number, elevation_deg): (usize, f32)| {
        let more = usize::from(number < around % rings);
        let azimuths = (around / rings + more).max(1);
        (0..azimuths).map(move |i| {
            let azimuth_deg = (360.0 * i as f32 / azimuths as f32 + offset_deg).rem_euclid(360.0);
            View {
                name: view_name(azimuth_deg, elevation_deg),
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
        .enumerate()
        .flat_map(ring)
        .chain([top])
        .collect()
}

/// As [`views_at`], of a sector: its arc takes the azimuths, elevations outside are those of its rim, and there is
/// a view from the top where it has one.
pub fn views_of(sector: &Sector, elevations: &[f32], count: usize, offset_deg: f32) -> Vec<View> {
    if sector.is_whole() {
        return views_at(elevations, count, offset_deg);
    }
    let [low, high] = sector.elevations_deg;
    let mut inside: Vec<f32> = elevations.iter().map(|e| e.clamp(low, high)).collect();
    inside.sort_by(f32::total_cmp);
    inside.dedup();
    let mut views = views_at(&inside, count, offset_deg);
    if !sector.has_top() {
        views.pop();
    }
    for view in views.iter_mut().filter(|view| view.name != "top") {
        // The first and the last lie half a step inside; a full circle stays as it is.
        view.azimuth_deg = match sector.is_around() {
            true => view.azimuth_deg,
            false => sector.azimuth_deg(view.azimuth_deg / 360.0),
        };
        view.name = view_name(view.azimuth_deg, view.elevation_deg);
    }
    views
}

fn view_name(azimuth_deg: f32, elevation_deg: f32) -> String {
    format!("azimuth {azimuth_deg:.0} elevation {elevation_deg:.0}")
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
        let pixels_per_unit = height_px as f32 / height;
        let side = even_side(pixels_per_unit * ROOM);
        let forward = -self.towards_eye();
        Camera::orthographic(forward, self.up(), Vec3::ZERO, pixels_per_unit, side, side)
    }

    /// As [`View::camera`], through a lens: with a focal length the eye is where the tree's height
    /// takes `height_px`, at the distance `focal * height / height_px` from the middle.
    pub fn camera_through(&self, lens: Lens, height: f32, height_px: u32) -> Camera {
        let flat = self.camera(height, height_px);
        let Some(focal_px) = lens.focal_px() else {
            return flat;
        };
        let distance = (focal_px as f32 / flat.pixels).max(NEAREST_EYE);
        let focal_px = distance * flat.pixels;
        // The sphere's rim is seen where lines of sight touch it.
        let rim = focal_px * ROOM / (distance * distance - ROOM * ROOM).sqrt();
        let side = even_side(rim);
        Camera {
            origin: self.towards_eye() * distance,
            pixels: focal_px,
            perspective: true,
            width: side,
            height: side,
            ..flat
        }
    }

    /// Straight from above, "up" is where the view at the same azimuth looks to.
    fn up(&self) -> Vec3 {
        if self.elevation_deg.abs() > 89.0 {
            let (sin, cos) = self.azimuth_deg.to_radians().sin_cos();
            Vec3::new(-sin, 0.0, -cos)
        } else {
            Vec3::Y
        }
    }
}

/// Side of a picture in pixels with room for so much around its middle, which is a pixel's corner.
fn even_side(half: f32) -> u32 {
    ((2.0 * half).ceil() as u32 + 4).next_multiple_of(2)
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
    fn there_are_as_many_views_as_are_asked_for_if_every_elevation_has_one() {
        let elevations = [0.0, 30.0, -15.0, 60.0];
        for (count, rings) in [(26, [7, 6, 6, 6]), (29, [7; 4]), (7, [2, 2, 1, 1])] {
            let views = views_at(&elevations, count, 11.0);
            assert_eq!(views.len(), count);
            let found = elevations.map(|e| views.iter().filter(|v| v.elevation_deg == e).count());
            assert_eq!(found, rings);
        }
        assert_eq!(views_at(&elevations, 2, 0.0).len(), 5);
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

    #[test]
    fn a_lens_shows_the_height_at_the_distance_that_levels_state() {
        // 1080 lines, 60 degrees: f = 1080 / (2 tan 30 degrees) = 935.3.
        let focal_px = Lens::default().focal_px().unwrap() as f32;
        assert!((focal_px - 935.307).abs() < 1e-3, "{focal_px}");
        for (height, height_px) in [(1.4, 512), (1.4, 64), (1.9, 32)] {
            for view in views(16, 11.0) {
                let camera = view.camera_through(Lens::default(), height, height_px);
                let distance = camera.origin.length();
                assert!((distance - focal_px * height / height_px as f32).abs() < 1e-4);
                // What is as far as the middle and as high as the tree takes its height in pixels.
                let top = camera.on_picture(camera.up * height).unwrap();
                assert!((top.y + height_px as f32).abs() < 1e-2, "{top}");
                // The whole sphere is in the picture, whatever side its rim is on.
                for i in 0..64 {
                    let angle = i as f32 / 64.0 * std::f32::consts::TAU;
                    let rim = (1.0 / distance).acos();
                    let out = camera.right * angle.cos() + camera.up * angle.sin();
                    let p = -camera.forward * rim.cos() + out * rim.sin();
                    let at = camera.on_picture(p).unwrap();
                    assert!(at.abs().max_element() < camera.width as f32 / 2.0);
                }
            }
        }
    }

    #[test]
    fn nobody_looks_at_a_flat_tree_from_within_it() {
        let view = &views(1, 0.0)[0];
        let camera = view.camera_through(Lens::default(), 0.2, 512);
        assert_eq!(camera.origin.length(), 1.5);
        let top = camera.on_picture(camera.up * 0.2).unwrap();
        assert!((top.y + 512.0).abs() < 1e-2);
    }
}
