//! Deng's visibility: rear branches count as farther off, as far as their siblings are dense.
//!
//! With the direction v from the eye to a sub-tree, the direction b of the order-1 branch that
//! carries it and the density rho of that branch's siblings, occlusion is `max(0, v . b) * rho` and
//! the distance that is compared with the optimal one is `d * (1 + k * occlusion)`. (The paper says
//! "scaling factor" and leaves the form open.) Since `d * v` is the vector from the eye, that is
//! `d + k * rho * max(0, (center - eye) . b)`, which changes by at most `1 + k * rho` a metre.

use glam::Vec3;

use super::hierarchy::Node;
use super::place::Place;
use super::visibility::{Sight, Visibility};

/// Density-adapted visibility (Deng and others, "Fast Forest Visualization on Hierarchical Images
/// and Visibility", section "Visibility Algorithm").
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Density {
    /// `k`: how much farther off a sub-tree right behind a dense crown counts; 0 or more.
    pub strength: f32,
}

impl Default for Density {
    fn default() -> Self {
        Self { strength: 1.0 }
    }
}

/// The dot product alone, whatever the density (Deng, Zhang and Jaeger 2007).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DotProduct {
    /// As [`Density::strength`].
    pub strength: f32,
}

impl Visibility for Density {
    #[inline]
    fn sight(&mut self, node: &Node, _: u32, eye: Vec3, _: &Place) -> Sight {
        scaled(node, eye, self.strength * node.density.min(1.0))
    }
}

impl Visibility for DotProduct {
    #[inline]
    fn sight(&mut self, node: &Node, _: u32, eye: Vec3, _: &Place) -> Sight {
        scaled(node, eye, self.strength)
    }
}

#[inline]
fn scaled(node: &Node, eye: Vec3, strength: f32) -> Sight {
    let from_eye = node.center - eye;
    Sight {
        distance: from_eye.length() + strength * from_eye.dot(node.branch).max(0.0),
        visibility: 1.0,
        rate: 1.0 + strength,
    }
}

/// An order-1 branch among its siblings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sibling {
    /// Its middle.
    pub middle: Vec3,
    /// Siblings whose middles are as near as this are in its neighbourhood.
    pub reach: f32,
    /// Number of siblings that hides what is behind it; above 0.
    pub full: f32,
}

/// Density of each order-1 branch: the number of siblings in its neighbourhood over the number that
/// hides what is behind it, at most 1 (Fig. 1(b) of the paper draws a neighbourhood without a size).
pub fn sibling_density(siblings: &[Sibling]) -> Vec<f32> {
    let density = |a: &Sibling| {
        let within = |b: &&Sibling| a.middle.distance_squared(b.middle) <= a.reach * a.reach;
        let near = siblings.iter().filter(within).count().saturating_sub(1);
        (near as f32 / a.full.max(1e-6)).min(1.0)
    };
    siblings.iter().map(density).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(branch: Vec3, density: f32) -> Node {
        Node {
            center: branch * 2.0,
            radius: 1.0,
            switch_distance: 10.0,
            branch,
            density,
            end: 1,
        }
    }

    fn sight(mut v: impl Visibility, node: &Node, eye: Vec3) -> f32 {
        v.sight(node, 0, eye, &Place::at(Vec3::ZERO)).distance
    }

    #[test]
    fn a_rear_branch_counts_as_farther_off_by_its_density() {
        // The eye looks along +z; the branch points away from it: d = 12, v . b = 1.
        let eye = Vec3::new(0.0, 0.0, -10.0);
        let rear = |rho| node(Vec3::Z, rho);
        let k = Density { strength: 0.5 };
        assert_eq!(sight(k, &rear(1.0), eye), 18.0);
        assert_eq!(sight(k, &rear(0.5), eye), 15.0);
        // Sparse crown (Fig. 1(a)): fully visible from behind, though the dot product says no.
        assert_eq!(sight(k, &rear(0.0), eye), 12.0);
        assert_eq!(sight(DotProduct { strength: 0.5 }, &rear(0.0), eye), 18.0);
    }

    #[test]
    fn front_branches_and_the_trunk_count_as_they_are() {
        let eye = Vec3::new(0.0, 0.0, -10.0);
        let k = Density { strength: 3.0 };
        assert_eq!(sight(k, &node(Vec3::NEG_Z, 1.0), eye), 8.0);
        assert_eq!(sight(k, &node(Vec3::ZERO, 1.0), eye), 10.0);
    }

    #[test]
    fn density_counts_neighbours_and_saturates() {
        let ring = |reach: f32| -> Vec<Sibling> {
            (0..8)
                .map(|i| {
                    let (sin, cos) = (i as f32 * std::f32::consts::FRAC_PI_4).sin_cos();
                    Sibling {
                        middle: Vec3::new(cos, 0.0, sin),
                        reach,
                        full: 4.0,
                    }
                })
                .collect()
        };
        // Neighbours on the ring are 0.77 apart, the next but one 1.41.
        assert_eq!(sibling_density(&ring(0.8)), [0.5; 8]);
        assert_eq!(sibling_density(&ring(1.5)), [1.0; 8]);
        assert_eq!(sibling_density(&ring(1.5)[..1]), [0.0]);
    }
}
