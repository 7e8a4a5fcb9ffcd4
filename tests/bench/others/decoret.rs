//! Décoret's billboard cloud: greedy choice of planes (section 3.3 of the paper that `plane_space` names).
//!
//! A minimal baker of our own, to compare with, not the authors' program: the lattice is sampled at the
//! middle of its bins, and a bin is refined by looking at ever nearer neighbours of the best plane
//! instead of by dividing bins. Lengths are normalised units.

use glam::{Vec2, Vec3};
use pleach::botany::Model;
use pleach::space::hull::{convex_hull, min_rect};

use crate::plane_space::{Face, Plane, PlaneSpace, Steps, density, flat};

/// How often the steps around the best plane are halved.
const REFINEMENTS: u32 = 5;

/// What a billboard cloud is asked to be.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Most planes; faces that none of them is valid for are dropped.
    pub planes: usize,
    /// How far from its plane a face may be, normalised units.
    pub epsilon: f32,
}

/// A textured rectangle.
#[derive(Clone, Debug)]
pub struct Billboard {
    /// Middle of the rectangle.
    pub center: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Half edges; their cross product points along the normal.
    pub half: [Vec3; 2],
    /// Faces that it stands for.
    pub faces: Vec<u32>,
    /// All faces that it is valid for, also those that another stands for: painted as well, so that
    /// no cracks show between planes (F1 of ez_oak_medium .900 instead of .856).
    pub painted: Vec<u32>,
}

/// The faces of a model.
pub fn faces(model: &Model) -> Vec<Face> {
    let all = 0..model.triangles.len() as u32;
    all.map(|t| Face::new(model.corners(t))).collect()
}

/// Chooses planes until every face has one, or there are as many as asked for.
pub fn billboards(faces: &[Face], settings: &Settings) -> Vec<Billboard> {
    let mut space = PlaneSpace::new(faces, settings.epsilon);
    let mut left: Vec<u32> = (0..faces.len() as u32).collect();
    let mut out = Vec::new();
    while !left.is_empty() && out.len() < settings.planes {
        let chosen = match space.densest() {
            Some(at) => refined(at, faces, &left, space.steps(), settings.epsilon),
            None => own_plane(faces, &left),
        };
        let fits = |&&face: &&u32| chosen.distance(&faces[face as usize]) <= settings.epsilon;
        let mut taken: Vec<u32> = left.iter().filter(fits).copied().collect();
        let chosen = if taken.is_empty() {
            // Rounding at the very edge of a bin: the largest face is always valid for its own plane.
            let own = own_plane(faces, &left);
            taken = vec![largest(faces, &left)];
            own
        } else {
            chosen
        };
        space.remove(taken.iter().map(|&face| &faces[face as usize]));
        left.retain(|face| taken.binary_search(face).is_err());
        out.push(Billboard::around(chosen, faces, taken, settings.epsilon));
    }
    out
}

/// The best plane near a lattice plane, by densities without a lattice.
fn refined(
    (mut angles, mut rho): ([f32; 2], f32),
    faces: &[Face],
    left: &[u32],
    mut steps: Steps,
    epsilon: f32,
) -> Plane {
    // Only faces near the plane matter: what it turns by moves nothing farther than this.
    let reach = 3.0 * epsilon + steps[0] + steps[1] + steps[2];
    let start = Plane::at(angles, rho);
    let near: Vec<&Face> = left
        .iter()
        .map(|&face| &faces[face as usize])
        .filter(|face| start.distance(face) <= reach)
        .collect();
    let worth = |angles, rho| {
        let [covered, density] = density(Plane::at(angles, rho), near.iter().copied(), epsilon);
        if covered > 0.0 { density } else { f64::MIN }
    };
    let mut best = worth(angles, rho);
    for _ in 0..REFINEMENTS {
        steps = steps.map(|step| step / 2.0);
        let (middle, mid_rho) = (angles, rho);
        for (a, e, r) in neighbours() {
            let tried = [middle[0] + a * steps[0], middle[1] + e * steps[1]];
            let tried_rho = mid_rho + r * steps[2];
            let found = worth(tried, tried_rho);
            if found > best {
                (best, angles, rho) = (found, tried, tried_rho);
            }
        }
    }
    Plane::at(angles, rho)
}

fn neighbours() -> impl Iterator<Item = (f32, f32, f32)> {
    let step = |digit: i32| (digit % 3 - 1) as f32;
    (0..27).map(move |i| (step(i), step(i / 3), step(i / 9)))
}

fn largest(faces: &[Face], left: &[u32]) -> u32 {
    let area = |face: &u32| faces[*face as usize].area.length();
    let best = left
        .iter()
        .max_by(|a, b| area(a).total_cmp(&area(b)).then(b.cmp(a)));
    *best.expect("called with faces left")
}

/// The plane of the largest face that is left.
fn own_plane(faces: &[Face], left: &[u32]) -> Plane {
    let face = &faces[largest(faces, left) as usize];
    let normal = face.area.normalize_or(Vec3::Y);
    let [a, b, c] = face.corners;
    Plane {
        normal,
        rho: normal.dot((a + b + c) / 3.0),
    }
}

impl Billboard {
    /// The smallest rectangle on the plane that holds the shadow of these faces.
    fn around(plane: Plane, all: &[Face], faces: Vec<u32>, epsilon: f32) -> Self {
        let u = plane.normal.any_orthonormal_vector();
        let axes = [u, plane.normal.cross(u)];
        let corners = faces.iter().flat_map(|&face| all[face as usize].corners);
        let hull = convex_hull(corners.map(|c| flat(c, axes)));
        let rect = min_rect(&hull);
        let solid = |p: Vec2| axes[0] * p.x + axes[1] * p.y;
        let valid = |&face: &u32| plane.distance(&all[face as usize]) <= epsilon;
        Self {
            painted: (0..all.len() as u32).filter(valid).collect(),
            center: solid(rect.center) + plane.normal * plane.rho,
            normal: plane.normal,
            half: [
                solid(rect.axis) * rect.half.x,
                solid(rect.axis.perp()) * rect.half.y,
            ],
            faces,
        }
    }

    /// Its corners, counter-clockwise seen from the normal's end, beginning at the lower left.
    pub fn corners(&self) -> [Vec3; 4] {
        let [u, v] = self.half;
        [
            self.center - u - v,
            self.center + u - v,
            self.center + u + v,
            self.center - u + v,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::palm;

    #[test]
    fn every_face_has_one_plane_and_lies_within_epsilon_of_it() {
        let faces = faces(&palm());
        let epsilon = 0.05;
        let settings = Settings {
            planes: usize::MAX,
            epsilon,
        };
        let cloud = billboards(&faces, &settings);
        let mut owners = vec![0; faces.len()];
        for billboard in &cloud {
            let plane = Plane {
                normal: billboard.normal,
                rho: billboard.normal.dot(billboard.center),
            };
            let axes = billboard.half.map(|h| h.normalize());
            let shown = |face| billboard.painted.binary_search(face).is_ok();
            assert!(billboard.faces.iter().all(shown));
            for &face in &billboard.faces {
                owners[face as usize] += 1;
                let face = &faces[face as usize];
                assert!(plane.distance(face) <= epsilon * 1.001);
                for corner in face.corners {
                    let at = flat(corner - billboard.center, axes).abs();
                    let half = billboard.half.map(Vec3::length);
                    assert!(at.x <= half[0] * 1.001 && at.y <= half[1] * 1.001);
                }
            }
        }
        assert!(owners.iter().all(|&n| n == 1));
        assert!(
            cloud.len() > 3 && cloud.len() < 500,
            "{} planes",
            cloud.len()
        );
    }

    #[test]
    fn two_sheets_farther_apart_than_epsilon_allows_are_two_planes() {
        let sheet = |z: f32| {
            (0..20).map(move |i| {
                let at = |x: f32, y: f32| Vec3::new(0.04 * i as f32 - 0.4 + x, y, z);
                Face::new([at(0.0, -0.2), at(0.03, -0.2), at(0.0, 0.2)])
            })
        };
        let faces: Vec<Face> = sheet(0.3).chain(sheet(-0.2)).collect();
        let settings = Settings {
            planes: 9,
            epsilon: 0.06,
        };
        let cloud = billboards(&faces, &settings);
        assert_eq!(cloud.len(), 2);
        for billboard in cloud {
            assert_eq!(billboard.faces.len(), 20);
            assert!(billboard.normal.z.abs() > 0.98, "{}", billboard.normal);
        }
    }
}
