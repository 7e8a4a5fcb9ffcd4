//! Where a tree stands, and from where it is looked at.

use glam::{Vec2, Vec3};

/// Where an instance of a species stands: turned around y, scaled, moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Where the tree's origin is in the world.
    pub position: Vec3,
    /// Cosine and sine of the angle around y, counter-clockwise seen from above.
    pub turn: Vec2,
    /// Uniform scale.
    pub scale: f32,
    /// Index of the species.
    pub species: u32,
}

impl Place {
    /// Species 0, upright as it is.
    pub fn at(position: Vec3) -> Self {
        Self {
            position,
            turn: Vec2::X,
            scale: 1.0,
            species: 0,
        }
    }

    /// A point of the tree in the world.
    #[inline]
    pub fn to_world(&self, p: Vec3) -> Vec3 {
        let (cos, sin) = (self.turn.x, self.turn.y);
        let turned = Vec3::new(p.x * cos + p.z * sin, p.y, p.z * cos - p.x * sin);
        self.position + turned * self.scale
    }

    /// A point of the world in the tree's own space.
    #[inline]
    pub fn to_local(&self, p: Vec3) -> Vec3 {
        let p = (p - self.position) / self.scale;
        let (cos, sin) = (self.turn.x, self.turn.y);
        Vec3::new(p.x * cos - p.z * sin, p.y, p.z * cos + p.x * sin)
    }
}

/// A camera: where it is, what it sees, and how much it magnifies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The eye, in the world.
    pub eye: Vec3,
    /// Unit vector into the picture.
    pub forward: Vec3,
    /// Unit vector to the right of the picture.
    pub right: Vec3,
    /// Tangents of half the field of view: to the right and up.
    pub half: Vec2,
    /// Focal length over the one that switch distances were made for: pixels at one metre's
    /// distance are `zoom` times as many. Doubling the screen's lines doubles it.
    pub zoom: f32,
}

impl View {
    /// A camera with an upright picture; `fov_y` is the full vertical angle in radians, `aspect`
    /// width over height. Switch distances are taken for this field of view (`zoom` 1).
    pub fn looking(eye: Vec3, forward: Vec3, fov_y: f32, aspect: f32) -> Self {
        let forward = forward.normalize_or(Vec3::NEG_Z);
        let tan = (0.5 * fov_y).tan();
        Self {
            eye,
            forward,
            right: forward.cross(Vec3::Y).normalize_or(Vec3::X),
            half: Vec2::new(tan * aspect, tan),
            zoom: 1.0,
        }
    }

    /// Whether there is a picture at all. From infinity, or with no field of view, nothing is
    /// seen: cuts are as coarse as they get, and nothing is drawn.
    #[inline]
    pub fn sees(&self) -> bool {
        let angle = |tan: f32| tan > 0.0 && tan.is_finite();
        self.eye.is_finite()
            && self.forward.is_finite()
            && self.right.is_finite()
            && angle(self.half.x)
            && angle(self.half.y)
            && angle(self.zoom)
    }

    /// Whether any of a sphere may be in the picture.
    pub fn meets(&self, center: Vec3, radius: f32) -> bool {
        Pyramid::new(self).meets(center, radius)
    }
}

/// What a camera sees: a pyramid without an end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pyramid {
    eye: Vec3,
    forward: Vec3,
    /// Unit normals of the sides: `aside * x - depth * y`, where x and y are the parts of these.
    sides: [(Vec3, Vec2); 2],
}

impl Pyramid {
    pub fn new(view: &View) -> Self {
        let side = |axis: Vec3, tan: f32| (axis, Vec2::new(1.0, tan) / (1.0 + tan * tan).sqrt());
        Self {
            eye: view.eye,
            forward: view.forward,
            sides: [
                side(view.right, view.half.x),
                side(view.right.cross(view.forward), view.half.y),
            ],
        }
    }

    /// Whether any of a sphere may be inside.
    #[inline]
    pub fn meets(&self, center: Vec3, radius: f32) -> bool {
        let at = center - self.eye;
        let depth = at.dot(self.forward);
        let outside = |(axis, n): (Vec3, Vec2)| at.dot(axis).abs() * n.x - depth * n.y > radius;
        // No branches: what is in the picture can't be foretold, and four spheres are tested at once.
        (depth > -radius) & !outside(self.sides[0]) & !outside(self.sides[1])
    }

    /// For each of many spheres 0 where it may be inside, infinity where not.
    pub fn veils(&self, spheres: &Spheres, veil: &mut Vec<f32>) {
        let [x, y, z, radius] = &spheres.0;
        let count = radius.len();
        veil.resize(count, 0.0);
        let (x, y, z, veil) = (&x[..count], &y[..count], &z[..count], &mut veil[..count]);
        for i in 0..count {
            let inside = self.meets(Vec3::new(x[i], y[i], z[i]), radius[i]);
            veil[i] = if inside { 0.0 } else { f32::INFINITY };
        }
    }
}

/// Many spheres, each of their numbers in a list of its own: x, y, z of the centres, and radii.
#[derive(Clone, Debug, Default)]
pub(super) struct Spheres([Vec<f32>; 4]);

impl Spheres {
    /// From centres and radii.
    pub fn new(all: impl Iterator<Item = (Vec3, f32)>) -> Self {
        let mut out = Self::default();
        for (center, radius) in all {
            let numbers = [center.x, center.y, center.z, radius];
            for (list, number) in out.0.iter_mut().zip(numbers) {
                list.push(number);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn local_and_world_are_inverse_and_a_quarter_turn_goes_from_x_to_minus_z() {
        let place = Place {
            position: Vec3::new(3.0, 1.0, -2.0),
            turn: Vec2::new(0.0, 1.0),
            scale: 2.0,
            species: 0,
        };
        assert!((place.to_world(Vec3::X) - Vec3::new(3.0, 1.0, -4.0)).length() < 1e-6);
        let p = Vec3::new(0.3, -4.0, 9.0);
        assert!((place.to_local(place.to_world(p)) - p).length() < 1e-5);
    }

    #[test]
    fn the_picture_has_four_sides_and_a_back() {
        let view = View::looking(Vec3::ZERO, Vec3::NEG_Z, std::f32::consts::FRAC_PI_2, 2.0);
        assert!(view.meets(Vec3::new(0.0, 0.0, -10.0), 0.1));
        assert!(!view.meets(Vec3::new(0.0, 0.0, 10.0), 1.0));
        // 45 degrees up is the edge; a sphere of radius 1 leaves it when its centre is 1 outside.
        assert!(view.meets(Vec3::new(0.0, 11.3, -10.0), 1.0));
        assert!(!view.meets(Vec3::new(0.0, 11.5, -10.0), 1.0));
        assert!(view.meets(Vec3::new(-19.0, 0.0, -10.0), 0.0));
        assert!(!view.meets(Vec3::new(-21.0, 0.0, -10.0), 0.0));
        assert!(view.meets(Vec3::new(0.0, 0.0, 1.0), 1.5)); // inside the sphere
    }

    #[test]
    fn a_camera_at_infinity_or_without_a_field_of_view_sees_nothing() {
        let view = View::looking(Vec3::ZERO, Vec3::X, 1.0, 1.0);
        assert!(view.sees());
        for bad in [
            View {
                eye: Vec3::INFINITY,
                ..view
            },
            View {
                eye: Vec3::NAN,
                ..view
            },
            View::looking(Vec3::ZERO, Vec3::X, 0.0, 1.0),
            View { zoom: 0.0, ..view },
        ] {
            assert!(!bad.sees());
        }
    }
}
