//! The similarity that moves one list of points onto another.
//!
//! Rotation after Kabsch ("A discussion of the solution for the best rotation to relate two sets of
//! vectors", Acta Crystallographica A34, 1978), scale after Umeyama ("Least-squares estimation of
//! transformation parameters between two point patterns", IEEE PAMI 13, 1991). Never a reflection.

use glam::{DMat3, DQuat, DVec3};
use nalgebra::{Matrix3, SVD};

/// `p -> translation + scale * (rotation * p)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Above zero.
    pub scale: f64,
    /// Of unit length.
    pub rotation: DQuat,
    /// In the units of the target.
    pub translation: DVec3,
}

impl Similarity {
    /// Where it moves a point.
    pub fn apply(&self, p: DVec3) -> DVec3 {
        self.translation + self.scale * (self.rotation * p)
    }

    /// As an engine reads it: every number rounded to f32.
    pub fn rounded(&self) -> Self {
        let rotation = DQuat::from_array(self.rotation.to_array().map(|v| f64::from(v as f32)));
        Self {
            scale: f64::from(self.scale as f32),
            rotation: rotation.normalize(),
            translation: self.translation.as_vec3().as_dvec3(),
        }
    }
}

/// The similarity that brings the points `from` as near as can be to the points `to`, one by one
/// (least squares); `None` where there are none, their numbers differ, or they are all one point.
pub fn align(from: &[DVec3], to: &[DVec3]) -> Option<Similarity> {
    if from.is_empty() || from.len() != to.len() {
        return None;
    }
    let center = |points: &[DVec3]| points.iter().sum::<DVec3>() / points.len() as f64;
    let (a, b) = (center(from), center(to));
    let (mut product, mut spread) = (Matrix3::<f64>::zeros(), [0.0f64; 2]);
    for (p, q) in from.iter().zip(to) {
        let (p, q) = ((*p - a).to_array(), (*q - b).to_array());
        for row in 0..3 {
            for column in 0..3 {
                product[(row, column)] += q[row] * p[column];
            }
        }
        spread[0] += p.iter().map(|v| v * v).sum::<f64>();
        spread[1] += q.iter().map(|v| v * v).sum::<f64>();
    }
    let scale = (spread[1] / spread[0]).sqrt();
    if !(scale.is_finite() && scale > 0.0) {
        return None;
    }
    // Scaled to a spread of one: the decomposition has absolute tolerances.
    let svd = SVD::new(product / (spread[0] * spread[1]).sqrt(), true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut flip = Matrix3::identity();
    if u.determinant() * v_t.determinant() < 0.0 {
        // The direction that matters least is turned around: a rotation, not a reflection.
        let least = svd.singular_values.imin();
        flip[(least, least)] = -1.0;
    }
    let turned = u * flip * v_t;
    let rotation = DQuat::from_mat3(&DMat3::from_cols_array(&std::array::from_fn(|i| {
        turned[(i % 3, i / 3)]
    })));
    Some(Similarity {
        scale,
        rotation: rotation.normalize(),
        translation: b - scale * (rotation * a),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placed(points: &[DVec3], s: &Similarity) -> Vec<DVec3> {
        points.iter().map(|&p| s.apply(p)).collect()
    }

    fn solid() -> Vec<DVec3> {
        let corner = |i: u32| {
            let part = |k: u32| f64::from((i * 7 + k * 13) % 11) / 11.0 - 0.4;
            DVec3::new(part(1), 0.6 * part(2), 0.3 * part(3))
        };
        (0..9).map(corner).collect()
    }

    #[test]
    fn a_placed_copy_is_found_at_any_size_and_flat_ones_too() {
        let quad = [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]];
        let flat: Vec<DVec3> = quad.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect();
        for points in [solid(), flat] {
            for scale in [1e-6, 1.0, 1e6] {
                let wanted = Similarity {
                    scale,
                    rotation: DQuat::from_axis_angle(DVec3::new(0.36, 0.48, 0.8), 2.1),
                    translation: DVec3::new(3.0, -1.0, 0.5) * scale,
                };
                let target = placed(&points, &wanted);
                let found = align(&points, &target).unwrap();
                assert!((found.scale / scale - 1.0).abs() < 1e-12);
                assert!((found.rotation.dot(wanted.rotation).abs() - 1.0).abs() < 1e-12);
                for (p, q) in points.iter().zip(&target) {
                    assert!(found.apply(*p).distance(*q) < 1e-12 * scale);
                }
            }
        }
    }

    #[test]
    fn a_mirrored_copy_is_not_reached_by_a_rotation() {
        let points = solid();
        let mirrored: Vec<DVec3> = points.iter().map(|p| DVec3::new(-p.x, p.y, p.z)).collect();
        let found = align(&points, &mirrored).unwrap();
        let off = points.iter().zip(&mirrored);
        let worst = off.map(|(p, q)| found.apply(*p).distance(*q));
        assert!(worst.fold(0.0, f64::max) > 0.1);
    }

    #[test]
    fn points_in_one_place_or_of_another_number_have_no_similarity() {
        let one = [DVec3::ONE; 4];
        assert_eq!(align(&one, &one), None);
        assert_eq!(align(&solid(), &one), None);
        assert_eq!(align(&[], &[]), None);
    }
}
