//! One interface for everything that says how visible a sub-tree is.

use glam::Vec3;

use super::hierarchy::Node;
use super::place::Place;

/// How a sub-tree is seen. It is drawn as a whole where `distance >= visibility * switch_distance`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Distance from the eye, scaled by what the estimator knows; the tree's own units.
    pub distance: f32,
    /// Share that is thought to be visible, 0 to 1: it shortens the distance at which detail is worth its cost.
    pub visibility: f32,
    /// By how much `distance` changes at most when the eye moves by one unit and the epoch stays
    /// the same. Infinite: unknown, so the sub-tree is looked at again in every frame.
    pub rate: f32,
}

/// An estimator of visibility.
///
/// A sight may only change as its `rate` says, and an occlusion only with [`Visibility::epoch`]: that
/// lets a cut leave alone what can't have changed, and still be the same as a cut made anew.
pub trait Visibility {
    /// How a node of a tree at `place` is seen by an eye, given in the tree's own space.
    fn sight(&mut self, node: &Node, index: u32, eye: Vec3, place: &Place) -> Sight;

    /// Probability that a node is hidden, 0 to 1, which lessens its visibility (equation 5 of El-Sana).
    /// Asked only of nodes that would else be opened: it may cost more than a sight, and may only
    /// change with the epoch.
    fn occlusion(&mut self, node: &Node, place: &Place) -> f32 {
        let _ = (node, place);
        0.0
    }

    /// A number that changes when occlusions may have; asked once a frame, before everything else.
    fn epoch(&mut self, eye: Vec3) -> u64 {
        let _ = eye;
        0
    }
}

/// Distance alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Plain;

impl Visibility for Plain {
    #[inline]
    fn sight(&mut self, node: &Node, _: u32, eye: Vec3, _: &Place) -> Sight {
        Sight {
            distance: node.center.distance(eye),
            visibility: 1.0,
            rate: 1.0,
        }
    }
}
