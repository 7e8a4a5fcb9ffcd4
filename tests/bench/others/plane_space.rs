//! The space of planes, and how much of a model each plane could stand for.
//!
//! Décoret, Durand, Sillion and Dorsey, "Billboard clouds for extreme model simplification" (SIGGRAPH
//! 2003), section 3: a plane is a unit normal (theta, phi) and a distance rho from the origin; it is
//! valid for a face if all corners of the face are within epsilon of it. The density of a plane is its
//! coverage (area of its valid faces, projected on it) less a penalty for faces that it nearly misses:
//! those that a plane shifted outwards by at most epsilon would be valid for.
//!
//! Lengths are normalised units (the model's bounding sphere has radius one).

use glam::{Vec2, Vec3};
use rayon::prelude::*;

/// Weight of faces that a plane nearly misses. Foliage is no surface that planes could be tangent to:
/// a weight of 10 drives them to the outside of the crown (F1 of ez_oak_medium .867 instead of .900).
pub const PENALTY: f64 = 1.0;
/// Steps of the azimuth of a normal over the full turn.
const AZIMUTHS: usize = 48;
/// Steps of its elevation from the horizon to the pole; a plane has two normals, one is enough.
const ELEVATIONS: usize = 12;
/// Steps of the distance in each epsilon.
const STEPS: f32 = 4.0;

/// All points `p` with `normal . p = rho`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: Vec3,
    /// Distance from the origin along the normal.
    pub rho: f32,
}

impl Plane {
    /// From azimuth and elevation of the normal, radians.
    pub fn at([azimuth, elevation]: [f32; 2], rho: f32) -> Self {
        let (sin, cos) = azimuth.sin_cos();
        let flat = elevation.cos();
        Self {
            normal: Vec3::new(sin * flat, elevation.sin(), cos * flat),
            rho,
        }
    }

    /// Largest distance of a face's corners.
    pub fn distance(&self, face: &Face) -> f32 {
        let away = face.corners.map(|c| (c.dot(self.normal) - self.rho).abs());
        away[0].max(away[1]).max(away[2])
    }
}

/// A triangle of the model.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// In normalised space.
    pub corners: [Vec3; 3],
    /// Normal of the length of its area.
    pub area: Vec3,
}

impl Face {
    /// A face between three corners.
    pub fn new(corners: [Vec3; 3]) -> Self {
        let [a, b, c] = corners;
        Self {
            corners,
            area: (b - a).cross(c - a) * 0.5,
        }
    }

    /// Distances of the planes with this normal that are valid, or `None`.
    fn valid(&self, normal: Vec3, epsilon: f32) -> Option<[f32; 2]> {
        let [a, b, c] = self.corners.map(|p| p.dot(normal));
        let ends = [a.max(b).max(c) - epsilon, a.min(b).min(c) + epsilon];
        (ends[0] <= ends[1]).then_some(ends)
    }
}

/// What a plane is worth: coverage, and coverage less penalty.
pub fn density<'f>(plane: Plane, faces: impl Iterator<Item = &'f Face>, epsilon: f32) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for face in faces {
        let Some([from, to]) = face.valid(plane.normal, epsilon) else {
            continue;
        };
        let area = f64::from(face.area.dot(plane.normal).abs());
        if from <= plane.rho && plane.rho <= to {
            sums = [sums[0] + area, sums[1] + area];
        } else if from - epsilon <= plane.rho && plane.rho < from && plane.rho >= 0.0
            || to < plane.rho && plane.rho <= to + epsilon && plane.rho < 0.0
        {
            sums[1] -= PENALTY * area;
        }
    }
    sums
}

/// Densities of a lattice of planes over all faces that are left.
pub struct PlaneSpace {
    epsilon: f32,
    directions: Vec<Direction>,
}

/// The planes of one normal.
struct Direction {
    angles: [f32; 2],
    normal: Vec3,
    /// Changes of coverage and of density from each distance to the next.
    changes: Vec<[f64; 2]>,
}

/// Steps of the lattice around a plane: radians of azimuth and elevation, distance.
pub type Steps = [f32; 3];

impl PlaneSpace {
    /// The planes of a model with these faces.
    pub fn new(faces: &[Face], epsilon: f32) -> Self {
        let angles = (0..ELEVATIONS).flat_map(|e| {
            let elevation = (e as f32 + 0.5) / ELEVATIONS as f32 * 90.0_f32.to_radians();
            // Rings near the pole are short, and need fewer normals.
            let count = (AZIMUTHS as f32 * elevation.cos()).ceil();
            let azimuth = move |a: usize| (a as f32 + 0.5) / count * 360.0_f32.to_radians();
            (0..count as usize).map(move |a| [azimuth(a), elevation])
        });
        let directions = angles.map(|angles| Direction {
            angles,
            normal: Plane::at(angles, 0.0).normal,
            changes: vec![[0.0; 2]; Self::bins(epsilon) + 1],
        });
        let mut space = Self {
            epsilon,
            directions: directions.collect(),
        };
        space.add(faces.iter(), 1.0);
        space
    }

    fn bins(epsilon: f32) -> usize {
        (2.0 * STEPS / epsilon).ceil() as usize
    }

    fn rho(bin: usize, epsilon: f32) -> f32 {
        (bin as f32 + 0.5) * epsilon / STEPS - 1.0
    }

    /// Half of the lattice's steps: as far as another lattice plane may be better known.
    pub fn steps(&self) -> Steps {
        let turn = 360.0_f32.to_radians();
        [
            turn / AZIMUTHS as f32,
            turn / 4.0 / ELEVATIONS as f32,
            self.epsilon / STEPS,
        ]
    }

    /// Takes faces out.
    pub fn remove<'f>(&mut self, faces: impl Iterator<Item = &'f Face> + Clone + Send + Sync) {
        self.add(faces, -1.0);
    }

    fn add<'f>(&mut self, faces: impl Iterator<Item = &'f Face> + Clone + Send + Sync, sign: f64) {
        let epsilon = self.epsilon;
        self.directions.par_iter_mut().for_each(|direction| {
            for face in faces.clone() {
                if let Some(ends) = face.valid(direction.normal, epsilon) {
                    let area = f64::from(face.area.dot(direction.normal).abs());
                    direction.add(ends, sign * area, epsilon);
                }
            }
        });
    }

    /// The angles and the distance of the lattice plane of the highest density among those that
    /// cover anything; of equal ones the first.
    pub fn densest(&self) -> Option<([f32; 2], f32)> {
        let of_direction = |(index, direction): (usize, &Direction)| {
            let (density, bin) = direction.densest()?;
            Some((density, index, bin))
        };
        let all = self
            .directions
            .par_iter()
            .enumerate()
            .filter_map(of_direction);
        let (_, index, bin) = all.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
        let angles = self.directions[index].angles;
        Some((angles, Self::rho(bin, self.epsilon)))
    }
}

impl Direction {
    fn add(&mut self, [from, to]: [f32; 2], area: f64, epsilon: f32) {
        let last = self.changes.len() - 1;
        // The first distance that is not less.
        let bin =
            |rho: f32| (((rho + 1.0) * STEPS / epsilon - 0.5).ceil().max(0.0) as usize).min(last);
        let zero = bin(0.0);
        let mut sum = |from: usize, to: usize, what: [f64; 2]| {
            if from < to {
                for (i, value) in what.into_iter().enumerate() {
                    self.changes[from][i] += value;
                    self.changes[to][i] -= value;
                }
            }
        };
        let (first, end) = (bin(from), bin(to));
        sum(first, end, [area, area]);
        let missed = [0.0, -PENALTY * area];
        sum(bin(from - epsilon).max(zero), first, missed);
        sum(end, bin(to + epsilon).min(zero), missed);
    }

    /// Density and number of the best distance.
    fn densest(&self) -> Option<(f64, usize)> {
        // What is left of sums after everything was taken out again.
        const NOTHING: f64 = 1e-9;
        let mut now = [0.0; 2];
        let mut best: Option<(f64, usize)> = None;
        for (bin, change) in self.changes.iter().enumerate() {
            now = [now[0] + change[0], now[1] + change[1]];
            if now[0] > NOTHING && best.is_none_or(|b| now[1] > b.0) {
                best = Some((now[1], bin));
            }
        }
        best
    }
}

/// A point in the coordinates of a picture of the plane.
pub fn flat(point: Vec3, [u, v]: [Vec3; 2]) -> Vec2 {
    Vec2::new(point.dot(u), point.dot(v))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of side one half at this height, facing up.
    fn tile(y: f32) -> [Face; 2] {
        let at = |x: f32, z: f32| Vec3::new(x * 0.25, y, z * 0.25);
        let [a, b, c, d] = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
        [Face::new([a, b, c]), Face::new([a, c, d])]
    }

    #[test]
    fn a_plane_covers_what_is_within_epsilon_and_pays_for_what_it_nearly_misses() {
        let faces: Vec<Face> = [tile(0.5), tile(0.58)].concat();
        let up = |rho| Plane {
            normal: Vec3::Y,
            rho,
        };
        let at = |rho| density(up(rho), faces.iter(), 0.05);
        assert_eq!(at(0.52).map(|v| (v * 1e4).round()), [2500.0, 0.0]);
        assert_eq!(at(0.54).map(|v| (v * 1e4).round()), [5000.0, 5000.0]);
        assert_eq!(at(0.6).map(|v| (v * 1e4).round()), [2500.0, 2500.0]);
        assert_eq!(at(0.7), [0.0, 0.0]);
    }

    #[test]
    fn the_lattice_finds_a_sheet_and_forgets_it_when_it_is_taken_out() {
        let faces: Vec<Face> = [tile(0.5), tile(-0.3)].concat();
        let mut space = PlaneSpace::new(&faces[..2], 0.1);
        let (angles, rho) = space.densest().unwrap();
        assert!(angles[1] > 80.0_f32.to_radians() && (rho - 0.5).abs() <= 0.1);
        space.remove(faces[..2].iter());
        assert!(space.densest().is_none());
    }
}
