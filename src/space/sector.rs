//! The directions from which a scene shows a tree.

use glam::Vec3;

use super::directions::{Direction, direction, training};

/// Steps in which a sector is looked through, degrees.
const STEP_DEG: f32 = 5.0;
/// Elevation from which a view counts as one from the top, degrees.
const TOP_DEG: f32 = 75.0;
/// Directions from which colours are compared.
const TONING: u32 = 12;
/// Fractions of the plastic number (Roberts 2018): points of this sequence leave no gaps in a rectangle.
const SPREAD: [f32; 2] = [0.754_877_7, 0.569_840_3];

/// Azimuths and elevations from which a tree is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sector {
    /// From and to around y, degrees, at most 360 apart; 0 looks from +z, 90 from +x.
    pub azimuths_deg: [f32; 2],
    /// From and to above the horizon, degrees.
    pub elevations_deg: [f32; 2],
}

impl Default for Sector {
    fn default() -> Self {
        Self {
            azimuths_deg: [0.0, 360.0],
            elevations_deg: [-90.0, 90.0],
        }
    }
}

impl Sector {
    /// Whether it is all directions.
    pub fn is_whole(&self) -> bool {
        let (azimuths, [low, high]) = (self.width_deg(), self.elevations_deg);
        azimuths >= 360.0 && low <= -90.0 && high >= 90.0
    }

    /// Whether the tree is seen from all around, be it not from above.
    pub fn is_around(&self) -> bool {
        self.width_deg() >= 360.0
    }

    /// Whether the tree is seen from the top.
    pub fn has_top(&self) -> bool {
        self.elevations_deg[1] >= TOP_DEG
    }

    /// The arc of azimuths, degrees.
    pub fn width_deg(&self) -> f32 {
        (self.azimuths_deg[1] - self.azimuths_deg[0]).clamp(0.0, 360.0)
    }

    /// The azimuth at a share of the arc, degrees.
    pub fn azimuth_deg(&self, share: f32) -> f32 {
        (self.azimuths_deg[0] + share * self.width_deg()).rem_euclid(360.0)
    }

    /// The elevation at a share of them, degrees.
    pub fn elevation_deg(&self, share: f32) -> f32 {
        let [low, high] = self.elevations_deg;
        low + share * (high - low)
    }

    /// Directions for training: those of [`training`] where the tree is seen from everywhere, else as many that
    /// fill the sector evenly.
    pub fn training(&self, count: u32) -> Vec<Direction> {
        if self.is_whole() {
            return training(count);
        }
        let at = |i: u32| {
            let share = |axis: usize| (0.5 + i as f32 * SPREAD[axis]).fract();
            direction(self.azimuth_deg(share(0)), self.elevation_deg(share(1)))
        };
        (0..count).map(at).collect()
    }

    /// Directions from which colours are compared: those of a quarter turn are the same again where the tree is seen
    /// from everywhere, so that its colours do not depend on how it is turned.
    pub fn toning(&self) -> Vec<Direction> {
        const QUARTERS: [f32; 4] = [0.0, 90.0, 180.0, 270.0];
        if !self.is_whole() {
            return self.training(TONING);
        }
        let ring = |(azimuth, elevation): (f32, f32)| {
            QUARTERS.map(|quarter| direction(azimuth + quarter, elevation))
        };
        let rings = [(15.0, 0.0), (45.0, 30.0), (75.0, -15.0)].map(ring);
        rings.as_flattened().to_vec()
    }

    /// Where its eyes are, for who asks of many planes.
    pub fn eyes(&self) -> Eyes {
        Eyes(match self.is_whole() {
            true => Vec::new(),
            false => self.samples().collect(),
        })
    }

    /// Share of upright planes, of all azimuths, whose both sides are seen.
    pub fn both_sides(&self) -> f64 {
        const PLANES: u32 = 180;
        let eyes = self.eyes();
        let both = |i: &u32| {
            let normal = -direction(*i as f32, 0.0).forward;
            eyes.sides(normal) == [true; 2]
        };
        (0..PLANES).filter(both).count() as f64 / f64::from(PLANES)
    }

    /// Unit vectors to the eye, all over the sector, its rim included.
    fn samples(&self) -> impl Iterator<Item = Vec3> + '_ {
        let [low, high] = self.elevations_deg;
        let steps = |length: f32| (length / STEP_DEG).ceil().max(1.0) as u32;
        let (across, up) = (steps(self.width_deg()), steps(high - low));
        (0..=across).flat_map(move |i| {
            let azimuth_deg = self.azimuth_deg(i as f32 / across as f32);
            (0..=up).map(move |k| {
                let elevation_deg = self.elevation_deg(k as f32 / up as f32);
                -direction(azimuth_deg, elevation_deg).forward
            })
        })
    }
}

/// Unit vectors from the tree to the eye, all over a sector; none where that is all directions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Eyes(Vec<Vec3>);

impl Eyes {
    /// Whether they are everywhere.
    pub fn are_everywhere(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether the front and the back of a plane with this normal are seen by any of them.
    pub fn sides(&self, normal: Vec3) -> [bool; 2] {
        let sees = |sign: f32| self.0.iter().any(|eye| sign * eye.dot(normal) > 0.0);
        match self.are_everywhere() {
            true => [true; 2],
            false => [sees(1.0), sees(-1.0)],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sector(azimuths_deg: [f32; 2], elevations_deg: [f32; 2]) -> Sector {
        Sector {
            azimuths_deg,
            elevations_deg,
        }
    }

    #[test]
    fn all_directions_train_as_ever_and_a_sector_by_directions_within() {
        let whole = Sector::default();
        assert!(whole.is_whole() && whole.has_top());
        assert_eq!(whole.training(24), training(24));
        // A quarter that passes north, seen from a hill.
        let quarter = sector([-45.0, 45.0], [-20.0, 10.0]);
        assert!(!quarter.is_whole() && !quarter.has_top());
        let mut sectors = [0; 9];
        for d in quarter.training(90) {
            let eye = -d.forward;
            let (azimuth, elevation) = (eye.x.atan2(eye.z), eye.y.asin());
            let (azimuth, elevation) = (azimuth.to_degrees(), elevation.to_degrees());
            assert!(azimuth.abs() <= 45.01 && (-20.01..=10.01).contains(&elevation));
            sectors[((azimuth + 45.0) / 10.01) as usize] += 1;
        }
        assert!(sectors.iter().all(|n| (7..=13).contains(n)), "{sectors:?}");
    }

    #[test]
    fn a_plane_shows_both_sides_only_where_its_edge_is_seen() {
        let front = sector([-30.0, 30.0], [0.0, 0.0]);
        let eyes = front.eyes();
        assert_eq!(eyes.sides(Vec3::Z), [true, false]);
        assert_eq!(eyes.sides(-Vec3::Z), [false, true]);
        assert_eq!(eyes.sides(Vec3::X), [true, true]);
        // Level planes are seen from above alone.
        let above = sector([-30.0, 30.0], [5.0, 40.0]);
        assert_eq!(above.eyes().sides(Vec3::Y), [true, false]);
        // A sixth of a circle sweeps over the edges of a third of all planes.
        assert!((front.both_sides() - 1.0 / 3.0).abs() < 0.02);
        assert_eq!(sector([0.0, 0.0], [0.0, 0.0]).both_sides(), 0.0);
        assert_eq!(sector([0.0, 360.0], [-5.0, 5.0]).both_sides(), 1.0);
        assert_eq!(Sector::default().both_sides(), 1.0);
    }
}
