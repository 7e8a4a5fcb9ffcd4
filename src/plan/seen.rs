//! From where a path shows trees.

use glam::Vec3;

use crate::space::sector::Sector;

/// Azimuths are kept apart in sectors of so many degrees.
const BIN_DEG: f32 = 5.0;
const BINS: usize = 72;
/// What elevations may be off by, degrees.
const ROUNDING_DEG: f32 = 0.01;
/// A gap in the azimuths that is narrower than this is none, degrees: trees are seen from all around.
const LEAST_GAP_DEG: f32 = 60.0;

/// Directions from which trees of one kind are seen, in a tree's own space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// A bit for each sector of azimuths.
    azimuths: u128,
    /// Lowest and highest elevation, degrees; the wrong way round where nothing was seen.
    elevations_deg: [f32; 2],
}

impl Default for Seen {
    fn default() -> Self {
        Self {
            azimuths: 0,
            elevations_deg: [f32::MAX, f32::MIN],
        }
    }
}

impl Seen {
    /// Adds an eye at `towards` (not of unit length), in radii of the tree, from its middle; every part of the tree is
    /// seen from another direction. `None`: from the same elevation, but any azimuth.
    pub fn add(&mut self, towards: Vec3, around: bool) {
        let radii = towards.length();
        let elevation = (towards.y / radii.max(1e-9)).clamp(-1.0, 1.0).asin();
        let half = (1.0 / radii.max(1.0)).asin();
        let [low, high] = &mut self.elevations_deg;
        *low = low.min((elevation - half).to_degrees().max(-90.0));
        *high = high.max((elevation + half).to_degrees().min(90.0));
        // Where the cone holds the zenith, all azimuths are in it.
        let wide = half.sin() / elevation.cos();
        if around || wide >= 1.0 || wide.is_nan() {
            self.azimuths = (1 << BINS) - 1;
            return;
        }
        let (azimuth, wide) = (
            towards.x.atan2(towards.z).to_degrees(),
            wide.asin().to_degrees(),
        );
        let (from, to) = (azimuth - wide, azimuth + wide);
        let bins = (from / BIN_DEG).floor() as i32..=(to / BIN_DEG).floor() as i32;
        for bin in bins {
            self.azimuths |= 1 << bin.rem_euclid(BINS as i32);
        }
    }

    /// Adds all that another has.
    pub fn join(&mut self, other: &Self) {
        self.azimuths |= other.azimuths;
        let ([low, high], [from, to]) = (self.elevations_deg, other.elevations_deg);
        self.elevations_deg = [low.min(from), high.max(to)];
    }

    /// The smallest sector that holds all; `None` where nothing was seen.
    pub fn sector(&self) -> Option<Sector> {
        let [low, high] = self.elevations_deg;
        if self.azimuths == 0 || low > high {
            return None;
        }
        // What is a hair over a step is rounding.
        let (low, high) = (
            (low + ROUNDING_DEG) / BIN_DEG,
            (high - ROUNDING_DEG) / BIN_DEG,
        );
        Some(Sector {
            azimuths_deg: self.arc(),
            elevations_deg: [low.floor() * BIN_DEG, high.ceil() * BIN_DEG],
        })
    }

    /// All azimuths but the widest gap, degrees.
    fn arc(&self) -> [f32; 2] {
        let has = |bin: usize| self.azimuths >> (bin % BINS) & 1 == 1;
        // How many sectors without begin behind each that has.
        let gap = |bin: usize| (1..BINS).take_while(|k| !has(bin + k)).count();
        let widest = (0..BINS)
            .filter(|&bin| has(bin))
            .max_by_key(|&bin| (gap(bin), std::cmp::Reverse(bin)));
        let (last, gap) = widest.map_or((0, 0), |bin| (bin, gap(bin)));
        if gap as f32 * BIN_DEG < LEAST_GAP_DEG {
            return Sector::default().azimuths_deg;
        }
        let from = (last + 1 + gap) % BINS;
        let from = from as f32 * BIN_DEG;
        [from, from + (BINS - gap) as f32 * BIN_DEG]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn eye(azimuth_deg: f32, elevation_deg: f32, radii: f32) -> Vec3 {
        let (a, e) = (azimuth_deg.to_radians(), elevation_deg.to_radians());
        Vec3::new(a.sin() * e.cos(), e.sin(), a.cos() * e.cos()) * radii
    }

    fn sector(eyes: &[Vec3]) -> Sector {
        let mut seen = Seen::default();
        eyes.iter().for_each(|&e| seen.add(e, false));
        seen.sector().unwrap()
    }

    #[test]
    fn an_arc_holds_all_eyes_and_passes_north() {
        // From 100 radii a tree is seen within .57 degrees.
        let found = sector(&[
            eye(352.0, 2.0, 100.0),
            eye(8.0, 11.0, 100.0),
            eye(31.0, 3.0, 100.0),
        ]);
        assert_eq!(found.azimuths_deg, [350.0, 395.0]);
        assert_eq!(found.elevations_deg, [0.0, 15.0]);
        // From two radii, 30 degrees to each side.
        let found = sector(&[eye(90.0, 0.0, 2.0)]);
        assert_eq!(found.elevations_deg, [-30.0, 30.0]);
        let [from, to] = found.azimuths_deg;
        assert!((55.0..=60.0).contains(&from) && (120.0..=125.0).contains(&to));
    }

    #[test]
    fn what_is_near_above_or_all_around_is_seen_from_everywhere() {
        let whole = Sector::default();
        assert_eq!(sector(&[eye(10.0, 0.0, 0.5)]), whole);
        let above = sector(&[eye(10.0, 85.0, 5.0)]);
        assert_eq!(above.azimuths_deg, whole.azimuths_deg);
        assert_eq!(above.elevations_deg, [70.0, 90.0]);
        let ring: Vec<Vec3> = (0..8).map(|i| eye(i as f32 * 45.0, 0.0, 50.0)).collect();
        assert_eq!(sector(&ring).azimuths_deg, whole.azimuths_deg);
        let mut turned = Seen::default();
        turned.add(eye(10.0, 4.0, 100.0), true);
        let found = turned.sector().unwrap();
        assert_eq!(found.azimuths_deg, whole.azimuths_deg);
        assert_eq!(found.elevations_deg, [0.0, 5.0]);
        assert_eq!(Seen::default().sector(), None);
    }

    #[test]
    fn joined_frames_hold_what_both_saw() {
        let [mut a, mut b] = [Seen::default(); 2];
        a.add(eye(10.0, 0.0, 100.0), false);
        b.add(eye(70.0, 20.0, 100.0), false);
        a.join(&b);
        let both = sector(&[eye(10.0, 0.0, 100.0), eye(70.0, 20.0, 100.0)]);
        assert_eq!(a.sector(), Some(both));
        let before = a;
        a.join(&Seen::default());
        assert_eq!(a, before);
    }
}
