//! Weighted second moments that can be merged, and the principal axes of what they sum up.
//!
//! Moments keep the mean and the scatter *about the mean*, and merge by the pairwise formula of
//! Chan, Golub and LeVeque ("Algorithms for computing the sample variance", Amer. Stat. 37(3),
//! 1983). So a leaf of a millimetre far from the origin loses nothing to cancellation, as sums of
//! squares about the origin would. Everything is f64.

use glam::{DMat3, DVec3, Vec3};
use nalgebra::{Matrix3, SymmetricEigen};

/// A direction counts as having no spread below this ratio of its variance to the largest
/// (one to ten thousand in length; inputs are f32, whose rounding lies at one to ten million).
const FLAT_VARIANCE_RATIO: f64 = 1e-8;

/// Weight, mean and scatter of points or triangles; lengths in normalised units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// Sum of the weights.
    pub weight: f64,
    /// Weighted mean.
    pub mean: DVec3,
    /// Weighted sum of `(p - mean)(p - mean)^T`.
    pub scatter: DMat3,
}

/// Principal axes of a distribution, from least spread to most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// Weighted mean: every least-squares plane and line goes through it.
    pub centroid: DVec3,
    /// Variances along `axes`, ascending, never negative, in squared normalised units.
    pub variances: [f64; 3],
    /// Right-handed orthonormal directions. `axes[0]` is the normal of the least-squares plane,
    /// `axes[2]` the direction of the least-squares line.
    pub axes: [DVec3; 3],
}

impl Moments {
    /// Moments of weighted points, in two passes.
    pub fn of_points(points: impl IntoIterator<Item = (Vec3, f64)> + Clone) -> Self {
        let (mut weight, mut sum) = (0.0, DVec3::ZERO);
        for (point, w) in points.clone() {
            weight += w;
            sum += point.as_dvec3() * w;
        }
        if weight <= 0.0 {
            return Self::default();
        }
        let mean = sum / weight;
        let scatter = points.into_iter().fold(DMat3::ZERO, |scatter, (point, w)| {
            scatter + outer(point.as_dvec3() - mean) * w
        });
        Self {
            weight,
            mean,
            scatter,
        }
    }

    /// Moments of one triangle whose `weight` (its area, say) is spread evenly over it.
    ///
    /// The covariance of the uniform distribution over a triangle is `1/12 sum (v - c)(v - c)^T`.
    pub fn of_triangle(corners: [Vec3; 3], weight: f64) -> Self {
        let corners = corners.map(|p| p.as_dvec3());
        let mean = (corners[0] + corners[1] + corners[2]) / 3.0;
        let scatter = corners
            .iter()
            .fold(DMat3::ZERO, |s, &corner| s + outer(corner - mean));
        Self {
            weight,
            mean,
            scatter: scatter * (weight / 12.0),
        }
    }

    /// Adds one point.
    pub fn add_point(&mut self, point: Vec3, weight: f64) {
        *self = self.merged(&Self {
            weight,
            mean: point.as_dvec3(),
            scatter: DMat3::ZERO,
        });
    }

    /// Adds one triangle; see [`Moments::of_triangle`].
    pub fn add_triangle(&mut self, corners: [Vec3; 3], weight: f64) {
        *self = self.merged(&Self::of_triangle(corners, weight));
    }

    /// The moments of both together.
    pub fn merged(&self, other: &Self) -> Self {
        let weight = self.weight + other.weight;
        if other.weight <= 0.0 {
            return *self;
        }
        if self.weight <= 0.0 {
            return *other;
        }
        let apart = other.mean - self.mean;
        let share = other.weight / weight;
        Self {
            weight,
            mean: self.mean + apart * share,
            scatter: self.scatter + other.scatter + outer(apart) * (self.weight * share),
        }
    }

    /// Variances and covariances; zero without weight.
    pub fn covariance(&self) -> DMat3 {
        if self.weight > 0.0 {
            self.scatter * (1.0 / self.weight)
        } else {
            DMat3::ZERO
        }
    }

    /// Centroid and principal axes, or `None` without weight or with a number that isn't finite.
    /// For points on one line or in one place the missing directions are still unit and
    /// orthogonal, but arbitrary: ask [`Axes::dimensions`].
    pub fn axes(&self) -> Option<Axes> {
        let finite = self.mean.is_finite() && self.scatter.is_finite();
        if !(finite && self.weight > 0.0 && self.weight.is_finite()) {
            return None;
        }
        let (variances, axes) = symmetric_eigen(&self.covariance())?;
        Some(Axes {
            centroid: self.mean,
            variances: variances.map(|v| v.max(0.0)),
            axes,
        })
    }

    /// Sum of weighted squared distances to the least-squares plane: what one plane loses.
    pub fn plane_error(&self) -> f64 {
        self.axes().map_or(0.0, |a| a.variances[0] * self.weight)
    }

    /// Sum of weighted squared distances to the plane through `origin` with the unit `normal`.
    pub fn error_to_plane(&self, origin: DVec3, normal: DVec3) -> f64 {
        let height = (self.mean - origin).dot(normal);
        (normal.dot(self.scatter * normal) + self.weight * height * height).max(0.0)
    }
}

impl Axes {
    /// Normal of the least-squares plane.
    pub fn normal(&self) -> DVec3 {
        self.axes[0]
    }

    /// How many directions the data spreads in: 0 a point, 1 a line, 2 a plane, 3 a body.
    pub fn dimensions(&self) -> usize {
        let floor = (self.variances[2] * FLAT_VARIANCE_RATIO).max(f64::MIN_POSITIVE);
        self.variances.iter().filter(|&&v| v > floor).count()
    }
}

/// Eigenvalues (ascending) and right-handed unit eigenvectors of a symmetric matrix; `None` where
/// it holds a number that isn't finite. The signs of the first two are fixed by their largest
/// component being positive, so that equal inputs give equal frames on every machine.
pub fn symmetric_eigen(matrix: &DMat3) -> Option<([f64; 3], [DVec3; 3])> {
    // Scaled to entries of about one: the iteration's tolerance is absolute near zero, and leaves
    // a millimetre wide have variances of 1e-9.
    let scale = matrix
        .to_cols_array()
        .iter()
        .fold(0.0f64, |a, x| a.max(x.abs()));
    if !matrix.is_finite() {
        return None;
    }
    if scale <= f64::MIN_POSITIVE {
        return Some(([0.0; 3], [DVec3::Y, DVec3::Z, DVec3::X]));
    }
    let scaled = Matrix3::from_column_slice(&(*matrix * (1.0 / scale)).to_cols_array());
    let eigen = SymmetricEigen::try_new(scaled, f64::EPSILON, 1000)?;
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let axis = |i: usize| DVec3::from_slice(eigen.eigenvectors.column(i).as_slice());
    let first = upright(axis(order[0]).normalize());
    let second = upright((axis(order[1]) - first * axis(order[1]).dot(first)).normalize());
    let vectors = [first, second, first.cross(second)];
    let values = order.map(|i| eigen.eigenvalues[i] * scale);
    vectors
        .iter()
        .all(|v| v.is_finite())
        .then_some((values, vectors))
}

/// The same line, pointing so that its largest component is positive.
fn upright(v: DVec3) -> DVec3 {
    let a = v.abs();
    let largest = if a.x >= a.y && a.x >= a.z {
        v.x
    } else if a.y >= a.z {
        v.y
    } else {
        v.z
    };
    if largest < 0.0 { -v } else { v }
}

fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn weighted(points: &[Vec3]) -> Vec<(Vec3, f64)> {
        points.iter().map(|&p| (p, 1.0)).collect()
    }

    /// A 5 x 3 grid with steps of 0.1 in the plane of `u` and z, a thousand units away.
    fn tilted_grid(far: f32) -> Vec<(Vec3, f64)> {
        let u = Vec3::new(0.8, 0.6, 0.0);
        let at = |i: i32| Vec3::Y * far + u * (i % 5) as f32 * 0.1 + Vec3::Z * (i / 5) as f32 * 0.1;
        (0..15).map(|i| (at(i), 1.0)).collect()
    }

    #[test]
    fn finds_the_plane_of_a_known_grid_near_and_far() {
        for far in [0.0, 10.0] {
            let axes = Moments::of_points(tilted_grid(far)).axes().unwrap();
            let normal = axes.normal();
            assert!(
                normal.dot(DVec3::new(0.6, -0.8, 0.0)).abs() > 1.0 - 1e-6,
                "{normal}"
            );
            // Five steps of 0.1: variance 0.02; three: 0.02 / 3.
            assert!(
                (axes.variances[2] - 0.02).abs() < 1e-5,
                "{:?}",
                axes.variances
            );
            assert!((axes.variances[1] - 0.02 / 3.0).abs() < 1e-5);
            assert_eq!(axes.dimensions(), 2);
        }
    }

    #[test]
    fn a_triangle_has_the_moments_of_its_area() {
        // Right triangle with legs of one: variance 1/18 along both, covariance -1/36.
        let m = Moments::of_triangle([Vec3::ZERO, Vec3::X, Vec3::Y], 0.5);
        let c = m.covariance();
        assert!((c.x_axis.x - 1.0 / 18.0).abs() < 1e-12);
        assert!((c.x_axis.y + 1.0 / 36.0).abs() < 1e-12);
        assert!((m.mean - DVec3::new(1.0 / 3.0, 1.0 / 3.0, 0.0)).length() < 1e-12);
        // Four quarter triangles together are the whole.
        let mid = |a: Vec3, b: Vec3| (a + b) / 2.0;
        let (a, b, c) = (Vec3::ZERO, Vec3::X, Vec3::Y);
        let (ab, bc, ca) = (mid(a, b), mid(b, c), mid(c, a));
        let mut sum = Moments::default();
        for t in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
            sum.add_triangle(t, 0.125);
        }
        assert!((sum.weight - m.weight).abs() < 1e-12);
        let apart = (sum.scatter - m.scatter).to_cols_array();
        assert!(apart.iter().all(|x| x.abs() < 1e-9), "{apart:?}");
    }

    #[test]
    fn merging_equals_summing_at_once() {
        let all = tilted_grid(3.0);
        let (left, right) = all.split_at(4);
        let merged = Moments::of_points(left.to_vec()).merged(&Moments::of_points(right.to_vec()));
        let whole = Moments::of_points(all.clone());
        assert!((merged.mean - whole.mean).length() < 1e-12);
        let apart = (merged.scatter - whole.scatter).to_cols_array();
        assert!(apart.iter().all(|x| x.abs() < 1e-12), "{apart:?}");
        let mut one_by_one = Moments::default();
        for (p, w) in all {
            one_by_one.add_point(p, w);
        }
        assert!((one_by_one.plane_error() - whole.plane_error()).abs() < 1e-12);
    }

    #[test]
    fn error_to_a_plane_is_the_sum_of_squared_heights() {
        // Heights 1 and 3 above the plane y = 1, weights 2 and 1: 2 * 0 + 4.
        let m = Moments::of_points([(Vec3::Y, 2.0), (Vec3::new(5.0, 3.0, 0.0), 1.0)]);
        assert!((m.error_to_plane(DVec3::Y, DVec3::Y) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn degenerate_input_has_a_defined_answer() {
        assert!(Moments::default().axes().is_none());
        let nan = Moments::of_points([(Vec3::new(f32::NAN, 0.0, 0.0), 1.0)]);
        assert!(nan.axes().is_none());
        let point = Moments::of_points(weighted(&[Vec3::ONE; 4]))
            .axes()
            .unwrap();
        assert_eq!(point.dimensions(), 0);
        let line = Moments::of_points(weighted(&[Vec3::ZERO, Vec3::ONE, Vec3::ONE * 2.0]));
        let line = line.axes().unwrap();
        assert_eq!(line.dimensions(), 1);
        assert!(line.axes[2].dot(DVec3::ONE.normalize()).abs() > 1.0 - 1e-9);
        for axes in [point, line] {
            let [a, b, c] = axes.axes;
            assert!(a.dot(b).abs() < 1e-9 && (a.cross(b) - c).length() < 1e-9);
        }
    }

    #[test]
    fn tiny_clusters_keep_their_axes() {
        let points = tilted_grid(0.0)
            .into_iter()
            .map(|(p, w)| (p * 1e-4 + Vec3::X, w));
        let axes = Moments::of_points(points).axes().unwrap();
        assert!(axes.variances[2] > 1.9e-10 && axes.variances[2] < 2.1e-10);
        assert!(axes.axes[2].dot(DVec3::new(0.8, 0.6, 0.0)).abs() > 0.999);
    }
}
