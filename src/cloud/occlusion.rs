//! How deep in the crown a point lies: metaballs around the leaves (Kratt et al. 2014, section
//! 3.4, after Luft, Balzer and Deussen 2007).
//!
//! ```text
//! D_i(q)   = (1 - (|q - p_i| / r)^2)^2  inside r, else 0
//! d_q      = sum of D_i(q)
//! sigma(q) = 1 for d_q <= 0, 1 - d_q / d_min up to d_min, 0 above
//! ```
//!
//! **The radius.** The paper's 25.0 is a length in its host program, whose unit is the centimetre
//! (CINEMA 4D): a fortieth of a tree of 10 m. As lengths here are relative to the tree, the radius
//! is [`RADIUS_TO_HEIGHT`] of its height, and not under [`RADIUS_TO_SPACING`] of the mean spacing
//! of leaves: with big leaves (palms, twig cards) balls would otherwise meet no neighbour and call
//! every leaf fully visible.
//!
//! **The lower bound `d_min`.** The paper gives no value. Taken is the density that the densest
//! tenth of the leaves exceeds, so that `sigma` spans its range on every tree, but not under
//! [`LEAST_D_MIN`]: a crown that is sparse everywhere hides nothing.

use glam::{IVec3, Vec3};

/// Influence radius over tree height: 25 cm on a tree of 10 m.
pub const RADIUS_TO_HEIGHT: f32 = 0.025;
/// Least influence radius over the leaves' mean spacing, `(box volume / leaves)^(1/3)`.
pub const RADIUS_TO_SPACING: f32 = 1.5;
/// Share of leaves with a lower density than `d_min`.
const D_MIN_QUANTILE: f64 = 0.9;
/// Four leaves in one place; a single leaf (density one at its own centre) keeps `sigma >= 0.75`.
pub const LEAST_D_MIN: f64 = 4.0;

/// The most cells of a grid; where the radius asks for more, cells are wider than the radius.
const MOST_CELLS: f32 = 4e6;

/// The sum of metaballs, on a uniform grid whose cells are at least one radius wide, so that a
/// point's density needs the 27 cells around it and is exact.
#[derive(Clone, Debug, Default)]
pub struct Density {
    radius: f32,
    /// Lowest corner of the grid.
    low: Vec3,
    /// Width of a cell.
    width: f32,
    /// Number of cells along each axis.
    size: IVec3,
    /// Start of each cell in `centers`; one more than there are cells.
    starts: Vec<u32>,
    /// Centres, sorted by cell.
    centers: Vec<Vec3>,
}

impl Density {
    /// Balls of one radius around finite centres. A radius that isn't positive gives a field of
    /// zero.
    pub fn new(centers: &[Vec3], radius: f32) -> Self {
        if centers.is_empty() || radius <= 0.0 || !radius.is_finite() {
            return Self::default();
        }
        let low = centers.iter().fold(Vec3::MAX, |a, &p| a.min(p));
        let high = centers.iter().fold(Vec3::MIN, |a, &p| a.max(p));
        let cells = |width: f32| ((high - low) / width).floor() + Vec3::ONE;
        let mut width = radius;
        while cells(width).element_product() > MOST_CELLS {
            width *= 2.0;
        }
        let size = cells(width).as_ivec3();
        let mut density = Self {
            radius,
            low,
            width,
            size,
            starts: vec![0; size.element_product() as usize + 1],
            centers: vec![Vec3::ZERO; centers.len()],
        };
        density.fill(centers);
        density
    }

    /// The density `d_q` at a point: zero far from all leaves, at least one in a leaf's centre.
    pub fn at(&self, q: Vec3) -> f64 {
        if self.centers.is_empty() {
            return 0.0;
        }
        // Clamped before it becomes an integer: points may lie anywhere.
        let home = ((q - self.low) / self.width).floor();
        let home = home.clamp(Vec3::splat(-2.0), self.size.as_vec3() + 2.0);
        let home = home.as_ivec3();
        let first = (home - IVec3::ONE).max(IVec3::ZERO);
        let last = (home + IVec3::ONE).min(self.size - IVec3::ONE);
        let mut sum = 0.0;
        for z in first.z..=last.z {
            for y in first.y..=last.y {
                if first.x > last.x {
                    continue;
                }
                // Cells in a row lie one after the other.
                let row = self.index(IVec3::new(first.x, y, z));
                let end = self.index(IVec3::new(last.x, y, z)) + 1;
                let span = self.starts[row] as usize..self.starts[end] as usize;
                let balls = self.centers[span].iter();
                sum += balls.map(|&p| ball(q, p, self.radius)).sum::<f64>();
            }
        }
        sum
    }

    /// Counting sort of the centres into cells; stable, so that sums have one order.
    fn fill(&mut self, centers: &[Vec3]) {
        let cell = |d: &Self, p: Vec3| {
            let cell = ((p - d.low) / d.width).floor().as_ivec3();
            d.index(cell.clamp(IVec3::ZERO, d.size - IVec3::ONE))
        };
        for &p in centers {
            let i = cell(self, p);
            self.starts[i + 1] += 1;
        }
        for i in 1..self.starts.len() {
            self.starts[i] += self.starts[i - 1];
        }
        let mut next = self.starts.clone();
        for &p in centers {
            let i = cell(self, p);
            self.centers[next[i] as usize] = p;
            next[i] += 1;
        }
    }

    fn index(&self, cell: IVec3) -> usize {
        ((cell.z * self.size.y + cell.y) * self.size.x + cell.x) as usize
    }
}

/// `D_i(q)`: one in the centre, falling smoothly to zero at the radius.
pub fn ball(q: Vec3, center: Vec3, radius: f32) -> f64 {
    let ratio = f64::from(q.distance_squared(center)) / f64::from(radius).powi(2);
    if ratio < 1.0 {
        (1.0 - ratio).powi(2)
    } else {
        0.0
    }
}

/// `sigma(q)` for a density: 1 fully visible, 0 hidden.
pub fn transfer(density: f64, d_min: f64) -> f64 {
    if density <= 0.0 {
        1.0
    } else if density >= d_min {
        0.0
    } else {
        1.0 - density / d_min
    }
}

/// The view-independent visibility of every point of a crown.
#[derive(Clone, Debug, Default)]
pub struct Occlusion {
    density: Density,
    d_min: f64,
}

impl Occlusion {
    /// From the leaves' centres of mass and the tree's height; see the head of this file for the
    /// radius and the lower bound.
    pub fn of_leaves(centers: &[Vec3], height: f32) -> Self {
        let density = Density::new(centers, influence_radius(centers, height));
        let mut at_leaves: Vec<f64> = centers.iter().map(|&p| density.at(p)).collect();
        at_leaves.sort_by(f64::total_cmp);
        let rank = (at_leaves.len() as f64 * D_MIN_QUANTILE) as usize;
        let dense = at_leaves.get(rank.min(at_leaves.len().saturating_sub(1)));
        Self::new(density, dense.map_or(LEAST_D_MIN, |d| d.max(LEAST_D_MIN)))
    }

    /// From a given field and lower bound.
    pub fn new(density: Density, d_min: f64) -> Self {
        Self { density, d_min }
    }

    /// The density from which on a point counts as hidden.
    pub fn d_min(&self) -> f64 {
        self.d_min
    }

    /// Influence radius, normalised units.
    pub fn radius(&self) -> f32 {
        self.density.radius
    }

    /// `sigma(q)`: 1 fully visible, 0 hidden.
    pub fn sigma(&self, q: Vec3) -> f64 {
        transfer(self.density.at(q), self.d_min)
    }

    /// `sigma(P)`: the mean over the points of a part; 1 without points.
    pub fn mean_sigma(&self, points: impl IntoIterator<Item = Vec3>) -> f64 {
        let add = |(sum, n): (f64, u64), p| (sum + self.sigma(p), n + 1);
        match points.into_iter().fold((0.0, 0), add) {
            (_, 0) => 1.0,
            (sum, n) => sum / n as f64,
        }
    }
}

/// The radius for leaves on a tree of the given height; see the head of this file.
pub fn influence_radius(centers: &[Vec3], height: f32) -> f32 {
    let low = centers.iter().fold(Vec3::MAX, |a, &p| a.min(p));
    let high = centers.iter().fold(Vec3::MIN, |a, &p| a.max(p));
    if centers.is_empty() {
        return height * RADIUS_TO_HEIGHT;
    }
    let volume = (high - low).element_product() / centers.len() as f32;
    (height * RADIUS_TO_HEIGHT).max(volume.cbrt() * RADIUS_TO_SPACING)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_ball_worked_by_hand() {
        // At half the radius: (1 - 1/4)^2.
        assert!((ball(Vec3::X, Vec3::ZERO, 2.0) - 0.5625).abs() < 1e-9);
        assert_eq!(ball(Vec3::ZERO, Vec3::ZERO, 2.0), 1.0);
        assert_eq!(ball(Vec3::X * 2.0, Vec3::ZERO, 2.0), 0.0);
        assert_eq!(ball(Vec3::X * 9.0, Vec3::ZERO, 2.0), 0.0);
    }

    #[test]
    fn the_transfer_function_falls_from_one_to_zero() {
        let cases = [
            (-1.0, 1.0),
            (0.0, 1.0),
            (1.0, 0.75),
            (3.0, 0.25),
            (4.0, 0.0),
            (9.0, 0.0),
        ];
        for (density, sigma) in cases {
            assert_eq!(transfer(density, 4.0), sigma, "{density}");
        }
    }

    #[test]
    fn two_leaves_worked_by_hand() {
        // Between two leaves at +-1 with radius 2 the density is 2 * 0.5625.
        let density = Density::new(&[Vec3::X, -Vec3::X], 2.0);
        assert!((density.at(Vec3::ZERO) - 1.125).abs() < 1e-6);
        let occlusion = Occlusion::new(density, 4.5);
        assert!((occlusion.sigma(Vec3::ZERO) - 0.75).abs() < 1e-6);
        // Far away fully visible; the mean of both.
        let mean = occlusion.mean_sigma([Vec3::ZERO, Vec3::Y * 50.0]);
        assert!((mean - 0.875).abs() < 1e-6);
    }

    #[test]
    fn the_grid_sums_what_a_plain_loop_sums() {
        let at = |i: u32| {
            let f = |k: f32| (i as f32 * k).sin() * (0.2 + k);
            Vec3::new(f(0.71), f(1.13), f(0.37))
        };
        let centers: Vec<Vec3> = (0..500).map(at).collect();
        for radius in [0.05, 0.3, 5.0] {
            let density = Density::new(&centers, radius);
            for q in (0..200).map(|i| at(i + 1000) * 1.3) {
                let plain: f64 = centers.iter().map(|&p| ball(q, p, radius)).sum();
                assert!((density.at(q) - plain).abs() < 1e-9, "{q} {radius}");
            }
        }
    }

    #[test]
    fn a_crown_is_hidden_inside_and_seen_outside() {
        let step = |i: i32| i as f32 / 8.0;
        let all =
            (-8..=8).flat_map(|x| (-8..=8).flat_map(move |y| (-8..=8).map(move |z| (x, y, z))));
        let crown: Vec<Vec3> = all
            .map(|(x, y, z)| Vec3::new(step(x), step(y), step(z)))
            .filter(|p| p.length() <= 1.0)
            .collect();
        let occlusion = Occlusion::of_leaves(&crown, 3.0);
        let [inner, rim, outside] = [0.0, 1.0, 3.0].map(|x| occlusion.sigma(Vec3::X * x));
        assert!(inner < rim && rim < outside, "{inner} {rim} {outside}");
        assert_eq!(outside, 1.0);
    }

    #[test]
    fn a_sparse_crown_hides_nothing_much_and_none_hides_nothing() {
        let lone = Occlusion::of_leaves(&[Vec3::ZERO], 1.0);
        assert_eq!(lone.d_min(), LEAST_D_MIN);
        assert!((lone.sigma(Vec3::ZERO) - 0.75).abs() < 1e-9);
        let none = Occlusion::of_leaves(&[], 1.0);
        assert_eq!((none.sigma(Vec3::ZERO), none.mean_sigma([])), (1.0, 1.0));
        assert_eq!(Density::new(&[Vec3::ZERO], 0.0).at(Vec3::ZERO), 0.0);
    }

    #[test]
    fn a_tiny_radius_keeps_the_grid_small() {
        let density = Density::new(&[Vec3::ZERO, Vec3::ONE * 2.0], 1e-7);
        assert!(density.starts.len() < 5_000_000);
        assert_eq!(density.at(Vec3::ONE * 2.0), 1.0);
    }
}
