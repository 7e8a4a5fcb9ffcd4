//! What a group of leaves shows: its faces, and the point where the group is connected.

use glam::Vec3;

use crate::botany::Tree;
use crate::space::eigen::Moments;

/// One triangle of foliage; lengths in normalised units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// Corners.
    pub corners: [Vec3; 3],
    /// Unit normal.
    pub normal: Vec3,
    /// Surface area (one side).
    pub area: f32,
}

/// The faces of a group of leaves, which billboard generators and measures look at.
#[derive(Clone, Copy, Debug)]
pub struct Foliage<'a> {
    /// Faces with area.
    pub faces: &'a [Face],
    /// Where the group grows from.
    pub connector: Vec3,
}

impl Face {
    /// The face with these corners, or `None` where it has no area or a number isn't finite.
    pub fn new(corners: [Vec3; 3]) -> Option<Self> {
        let [a, b, c] = corners.map(|p| p.as_dvec3());
        let cross = (b - a).cross(c - a);
        let normal = cross.try_normalize()?;
        let area = (cross.length() / 2.0) as f32;
        (area > 0.0 && area.is_finite()).then_some(Self {
            corners,
            normal: normal.as_vec3(),
            area,
        })
    }

    /// Centre of mass.
    pub fn center(&self) -> Vec3 {
        let [a, b, c] = self.corners;
        (a + b + c) / 3.0
    }

    /// Area of the face seen along the unit direction `along`.
    pub fn projected(&self, along: Vec3) -> f64 {
        f64::from(self.area) * f64::from(self.normal.dot(along).abs())
    }

    /// Points with weights that sum up to the area and integrate quadratic functions over the
    /// face exactly: three quarters in the middle, a twelfth in each corner.
    pub fn samples(&self) -> [(Vec3, f64); 4] {
        let area = f64::from(self.area);
        let [a, b, c] = self.corners.map(|p| (p, area / 12.0));
        [(self.center(), area * 0.75), a, b, c]
    }
}

/// The faces of the given leaves, in their order.
pub fn faces_of(tree: &Tree, leaves: &[u32]) -> Vec<Face> {
    let triangles = leaves
        .iter()
        .flat_map(|&leaf| &tree.leaves[leaf as usize].triangles);
    triangles
        .filter_map(|&t| Face::new(tree.model.corners(t)))
        .collect()
}

impl<'a> Foliage<'a> {
    /// Corners of all faces; a shared vertex comes once for each face.
    pub fn vertices(&self) -> impl Iterator<Item = Vec3> + Clone + use<'a> {
        self.faces.iter().flat_map(|f| f.corners)
    }

    /// Total surface area (one side): the `A` of the error `A - C`.
    pub fn area(&self) -> f64 {
        self.faces.iter().map(|f| f64::from(f.area)).sum()
    }

    /// Moments of the area.
    pub fn moments(&self) -> Moments {
        let mut moments = Moments::default();
        for face in self.faces {
            moments.add_triangle(face.corners, f64::from(face.area));
        }
        moments
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Two faces that make the parallelogram `corner`, `corner + a`, ..., for the tests of this step.
    pub(crate) fn patch(corner: Vec3, a: Vec3, b: Vec3) -> Vec<Face> {
        [
            [corner, corner + a, corner + a + b],
            [corner, corner + a + b, corner + b],
        ]
        .into_iter()
        .filter_map(Face::new)
        .collect()
    }

    #[test]
    fn a_patch_has_area_centre_and_shadow() {
        let faces = patch(Vec3::ZERO, Vec3::X * 2.0, Vec3::Z);
        let foliage = Foliage {
            faces: &faces,
            connector: Vec3::ZERO,
        };
        assert!((foliage.area() - 2.0).abs() < 1e-6);
        let mean = foliage.moments().mean.as_vec3();
        assert!((mean - Vec3::new(1.0, 0.0, 0.5)).length() < 1e-6);
        let slanted = Vec3::new(0.0, 0.6, 0.8);
        assert!((faces[0].projected(slanted) - 0.6).abs() < 1e-6);
        let weight: f64 = faces[0].samples().iter().map(|s| s.1).sum();
        assert!((weight - 1.0).abs() < 1e-6);
        // The samples integrate x^2: over the whole rectangle it is 8/3.
        let squares = faces.iter().flat_map(Face::samples);
        let integral: f64 = squares.map(|(p, w)| f64::from(p.x * p.x) * w).sum();
        assert!((integral - 8.0 / 3.0).abs() < 1e-5, "{integral}");
    }

    #[test]
    fn faces_without_area_are_none() {
        assert!(Face::new([Vec3::ZERO, Vec3::X, Vec3::X * 2.0]).is_none());
        assert!(Face::new([Vec3::ZERO, Vec3::X, Vec3::NAN]).is_none());
    }
}
