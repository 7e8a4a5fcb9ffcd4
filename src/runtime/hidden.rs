//! Cuts that pass over what a grid's cells hide (El-Sana and others 2001, equation 5).

use std::f32::consts::PI;

use glam::Vec3;

use super::hierarchy::Node;
use super::occlusion::Occlusion;
use super::place::Place;
use super::visibility::{Sight, Visibility};

/// Equation 5: the level of detail between the one that the view alone asks for and the lowest,
/// `(1 - OP) * view + OP * lowest`. Any measure of detail that grows with it will do; cuts use one
/// over the distance, with 0 for the lowest.
#[inline]
pub fn blend(view: f32, lowest: f32, occlusion: f32) -> f32 {
    (1.0 - occlusion) * view + occlusion * lowest
}

/// Another estimator, and what the grid hides besides.
///
/// Detail is one over the distance at which it is worth its cost, and the lowest is none, so
/// equation 5 makes `1 / d` to `(1 - OP) / d`: a hidden sub-tree counts as `1 / (1 - OP)` times as far off.
#[derive(Clone, Debug)]
pub struct Hidden<'g, V> {
    /// What is known without the grid.
    pub inner: V,
    /// Probabilities, cached for each cell.
    pub occlusion: Occlusion<'g>,
    /// Steradians.
    least_sr: f32,
}

/// Where a node's bounding sphere is looked at besides its middle, and at which part of its radius.
const SIDES: [Vec3; 6] = [
    Vec3::Y,
    Vec3::NEG_Y,
    Vec3::X,
    Vec3::NEG_X,
    Vec3::Z,
    Vec3::NEG_Z,
];
const PROBED: f32 = 0.7;

impl<'g, V> Hidden<'g, V> {
    /// What `occlusion` hides of what `inner` sees, by the probability of each node's middle.
    pub fn new(inner: V, occlusion: Occlusion<'g>) -> Self {
        Self {
            inner,
            occlusion,
            least_sr: 0.0,
        }
    }

    /// Lets a node count as hidden only as far as what it is expected to show falls short of `least_sr`, steradians of
    /// the sphere around the eye: the solid angle of its bounding sphere times the largest share that is seen of seven
    /// of its points (the middle, and six around it). The middle of a large sub-tree may be hidden while a side
    /// looks out, and what is hidden with the same probability shows the more the larger it is. 0 and less: by the
    /// middle's probability alone. Costs up to seven look-ups a node instead of one.
    pub fn expecting(self, least_sr: f32) -> Self {
        let least_sr = if least_sr > 0.0 { least_sr } else { 0.0 };
        Self { least_sr, ..self }
    }

    /// How far a node counts as hidden, 0 to 1.
    #[inline]
    fn hidden(&mut self, node: &Node, place: &Place) -> f32 {
        let middle = place.to_world(node.center);
        let hidden = self.occlusion.probability(middle);
        match self.least_sr > 0.0 && hidden > 0.0 {
            true => self.expected(1.0 - hidden, middle, node, place),
            false => hidden,
        }
    }

    /// The same by [`Hidden::expecting`], where so much is `seen` of the middle.
    // Apart, so that the usual path stays short: inlined, it costs every cut a sixth of its time.
    #[inline(never)]
    fn expected(&mut self, mut seen: f32, middle: Vec3, node: &Node, place: &Place) -> f32 {
        let (eye, off) = self.occlusion.eye();
        let (distance, radius) = (middle.distance(eye) - off, node.radius * place.scale);
        if distance.is_nan() || distance <= radius {
            return 0.0;
        }
        let solid_sr = PI * (radius / distance).powi(2);
        for side in SIDES {
            if seen * solid_sr >= self.least_sr {
                return 0.0;
            }
            let point = place.to_world(node.center + side * (PROBED * node.radius));
            seen = seen.max(1.0 - self.occlusion.probability(point));
        }
        1.0 - (seen * solid_sr / self.least_sr).min(1.0)
    }
}

impl<V: Visibility> Visibility for Hidden<'_, V> {
    #[inline]
    fn sight(&mut self, node: &Node, index: u32, eye: Vec3, place: &Place) -> Sight {
        self.inner.sight(node, index, eye, place)
    }

    #[inline]
    fn occlusion(&mut self, node: &Node, place: &Place) -> f32 {
        let inner = self.inner.occlusion(node, place);
        1.0 - blend(1.0 - inner, 0.0, self.hidden(node, place))
    }

    fn epoch(&mut self, eye: Vec3) -> u64 {
        self.occlusion.look_from(eye);
        let inner = self.inner.epoch(eye);
        inner.wrapping_mul(0x1_0000_0001) ^ u64::from(self.occlusion.stamp())
    }
}

#[cfg(test)]
mod tests {
    use glam::IVec3;

    use super::*;
    use crate::runtime::{Cells, Law, Plain};

    #[test]
    fn equation_5_blends_towards_the_lowest() {
        assert_eq!(
            (
                blend(8.0, 2.0, 0.0),
                blend(8.0, 2.0, 0.5),
                blend(8.0, 2.0, 1.0)
            ),
            (8.0, 5.0, 2.0)
        );
    }

    #[test]
    fn what_looks_over_a_wall_or_is_near_is_not_hidden() {
        // Cells of edge 1 and a wall at x = 4 whose uppermost row is free.
        let mut cells = Cells::new(Vec3::ZERO, Vec3::splat(10.0), [10; 3]);
        for i in 0..90 {
            cells.set(IVec3::new(4, i / 10, i % 10), 1.0);
        }
        let hidden = |radius: f32, least_sr: f32| {
            let occlusion = Occlusion::new(&cells, Law::Beer);
            let mut hidden = Hidden::new(Plain, occlusion).expecting(least_sr);
            hidden.epoch(Vec3::new(0.5, 9.5, 5.5));
            let node = Node {
                center: Vec3::new(8.5, 6.0, 5.5),
                radius,
                switch_distance: 1.0,
                branch: Vec3::ZERO,
                density: 0.0,
                end: 1,
            };
            hidden.occlusion(&node, &Place::at(Vec3::ZERO))
        };
        for least_sr in [0.0, -1.0, f32::NAN] {
            assert_eq!(hidden(5.0, least_sr), 1.0, "by the middle alone");
        }
        assert_eq!(hidden(1.0, 1e-3), 1.0, "nothing of it looks over the wall");
        // Its top, 3.5 above the middle, does. The nearest corner of the eye's cell is sqrt(3)/2 nearer than its middle.
        let distance = (8.0f32 * 8.0 + 3.5 * 3.5).sqrt() - 0.75f32.sqrt();
        let solid_sr = PI * (5.0 / distance).powi(2);
        assert_eq!(hidden(5.0, 0.5 * solid_sr), 0.0);
        assert!((hidden(5.0, 4.0 * solid_sr) - 0.75).abs() < 1e-5);
        assert_eq!(hidden(9.0, 1e9), 0.0, "the eye is in it");
    }
}
