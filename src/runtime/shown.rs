//! Cuts by measured visibility (ours): what the tree itself hides from where the eye is counts less.

use super::hierarchy::{Hierarchy, Node};
use super::measured::Measured;
use super::place::Place;
use super::visibility::{Sight, Visibility};

/// What was measured of the trees of a few species: pixels that a sub-tree shows, over those that it has.
#[derive(Clone, Debug, Default)]
pub struct Shown {
    species: Vec<Species>,
}

#[derive(Clone, Debug)]
struct Species {
    measured: Measured,
    /// For each node of the hierarchy the sub-tree that was measured.
    subtrees: Vec<u32>,
}

impl Shown {
    /// For each species its hierarchy, and what was measured of the sub-trees that it was made from.
    pub fn new(species: Vec<(&Hierarchy, Measured)>) -> Self {
        let of = |(hierarchy, measured): (&Hierarchy, Measured)| Species {
            measured,
            subtrees: hierarchy.origins().iter().map(|o| o.subtree).collect(),
        };
        Self {
            species: species.into_iter().map(of).collect(),
        }
    }
}

impl Visibility for Shown {
    /// A species or node that was not measured is fully visible.
    #[inline]
    fn sight(&mut self, node: &Node, index: u32, eye: glam::Vec3, place: &Place) -> Sight {
        let to_eye = eye - node.center;
        let distance = to_eye.length();
        let share = self.species.get(place.species as usize).and_then(|s| {
            let subtree = *s.subtrees.get(index as usize)?;
            Some(
                s.measured
                    .at(subtree as usize, to_eye / distance.max(1e-20)),
            )
        });
        Sight {
            distance,
            visibility: share.unwrap_or(1.0),
            // It turns with the direction, which is quick where the eye is near.
            rate: f32::INFINITY,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::runtime::{ActiveCut, Drawn, Form, Measuring, Subtree, View};

    /// Two branches, of which the one on +x is hidden from everywhere but +x.
    fn halves() -> (Hierarchy, Measured) {
        let whole = Subtree {
            leaves: 2,
            switch_distance: 100.0,
            ..Subtree::default()
        };
        let half = |x: f32| Subtree {
            parent: Some(0),
            leaves: 1,
            center: Vec3::X * x,
            switch_distance: 30.0,
            ..Subtree::default()
        };
        let mut measuring = Measuring::new(3, 8);
        for (texel, to_eye) in measuring.directions().into_iter().enumerate() {
            let free = if to_eye.x > 0.0 { 1.0 } else { 0.0 };
            measuring.set(texel, &[1.0, free, 1.0]);
        }
        let hierarchy = Hierarchy::new(&[whole, half(1.0), half(-1.0)]).unwrap();
        (hierarchy, measuring.finish())
    }

    fn forms(cut: &mut ActiveCut<Shown>, eye: Vec3) -> Vec<(u32, Form)> {
        let view = View::looking(eye, -eye.normalize(), 1.0, 1.0);
        let mut drawn: Vec<Drawn> = Vec::new();
        cut.update(&view);
        cut.collect(&view, &mut drawn);
        drawn.iter().map(|d| (d.node, d.form)).collect()
    }

    #[test]
    fn what_the_tree_hides_stays_a_billboard() {
        let (hierarchy, measured) = halves();
        let shown = Shown::new(vec![(&hierarchy, measured)]);
        let mut cut = ActiveCut::new(hierarchy, Place::at(Vec3::ZERO), shown);
        cut.fade = 0.0;
        let (near, behind) = ((1, Form::Geometry), (1, Form::Billboard));
        let other = (2, Form::Geometry);
        assert_eq!(forms(&mut cut, Vec3::X * 20.0), [near, other]);
        assert_eq!(forms(&mut cut, Vec3::X * -20.0), [behind, other]);
        assert_eq!(forms(&mut cut, Vec3::X * 20.0), [near, other]);
    }

    #[test]
    fn what_was_not_measured_is_seen() {
        let (hierarchy, _) = halves();
        let mut cut = ActiveCut::new(hierarchy, Place::at(Vec3::ZERO), Shown::default());
        cut.fade = 0.0;
        let all = [(1, Form::Geometry), (2, Form::Geometry)];
        assert_eq!(forms(&mut cut, Vec3::X * -20.0), all);
    }
}
