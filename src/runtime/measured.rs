//! Measured visibility (ours): pixels counted beforehand, looked up by direction.
//!
//! Item buffers are drawn once, offline, from directions over the whole sphere: the middles of an
//! octahedral map's texels (Meyer and others 2010), so that a direction finds its four neighbours
//! in a few operations. What is kept is one byte an item and direction.

use glam::{Vec2, Vec3};

/// Numbers from 0 to 1 for each item and direction.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured {
    /// Texels along the map's edge.
    side: u32,
    /// `side * side` bytes an item, rows of the map from below; 255 is 1.
    bytes: Vec<u8>,
}

/// Collects measurements.
#[derive(Clone, Debug)]
pub struct Measuring {
    side: u32,
    items: usize,
    seen: Vec<f32>,
}

impl Measuring {
    /// For so many items; `side * side` directions.
    pub fn new(items: usize, side: u32) -> Self {
        let side = side.clamp(1, 64);
        Self {
            side,
            items,
            seen: vec![0.0; items * (side * side) as usize],
        }
    }

    /// Unit vectors from the tree to the eye from which to measure.
    pub fn directions(&self) -> Vec<Vec3> {
        (0..self.side * self.side)
            .map(|texel| self.direction(texel))
            .collect()
    }

    fn direction(&self, texel: u32) -> Vec3 {
        let at = Vec2::new((texel % self.side) as f32, (texel / self.side) as f32) + 0.5;
        unfold(at / self.side as f32 * 2.0 - 1.0)
    }

    /// Stores what was measured from direction number `texel`: one number an item, 0 to 1.
    pub fn set(&mut self, texel: usize, shares: &[f32]) {
        let all = (self.side * self.side) as usize;
        for (item, &share) in shares.iter().enumerate().take(self.items) {
            self.seen[item * all + texel] = share;
        }
    }

    /// In the form that is kept.
    pub fn finish(self) -> Measured {
        Measured {
            side: self.side,
            bytes: self
                .seen
                .iter()
                .map(|s| (s.clamp(0.0, 1.0) * 255.0).round() as u8)
                .collect(),
        }
    }
}

impl Measured {
    /// From bytes as [`Measured::bytes`] gives them; `None` where they don't fill whole items.
    pub fn from_bytes(side: u32, bytes: Vec<u8>) -> Option<Self> {
        let whole = (1..=64).contains(&side) && bytes.len().is_multiple_of((side * side) as usize);
        whole.then_some(Self { side, bytes })
    }

    /// `side * side` bytes an item.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Texels along the map's edge.
    pub fn side(&self) -> u32 {
        self.side
    }

    /// What was measured of an item, from the direction of the unit vector `to_eye`; between
    /// directions linearly. An item that was not measured is fully visible.
    pub fn at(&self, item: usize, to_eye: Vec3) -> f32 {
        let side = self.side as usize;
        let Some(map) = self.bytes.get(item * side * side..(item + 1) * side * side) else {
            return 1.0;
        };
        let at = (fold(to_eye) * 0.5 + 0.5) * side as f32 - 0.5;
        let low = at.floor();
        let part = at - low;
        let (x, y) = (low.x as i32, low.y as i32);
        let texel = |x: i32, y: i32| f32::from(map[wrap(x, y, side as i32)]);
        let below = texel(x, y) + part.x * (texel(x + 1, y) - texel(x, y));
        let above = texel(x, y + 1) + part.x * (texel(x + 1, y + 1) - texel(x, y + 1));
        (below + part.y * (above - below)) / 255.0
    }
}

/// A texel of the map, also one step over its edge: there the octahedron's lower faces meet their
/// neighbours, mirrored.
fn wrap(x: i32, y: i32, side: i32) -> usize {
    let last = side - 1;
    let (mut x, mut y) = (x, y);
    if x < 0 || x > last {
        (x, y) = (x.clamp(0, last), last - y);
    }
    if y < 0 || y > last {
        (x, y) = (last - x, y.clamp(0, last));
    }
    (y.clamp(0, last) * side + x.clamp(0, last)) as usize
}

/// The square -1..1 of an octahedron's surface, y up in its middle.
fn fold(direction: Vec3) -> Vec2 {
    let n = direction.abs().element_sum().max(1e-20);
    let flat = Vec2::new(direction.x, direction.z) / n;
    if direction.y >= 0.0 {
        return flat;
    }
    let sign = |v: f32| if v >= 0.0 { 1.0 } else { -1.0 };
    Vec2::new(
        (1.0 - flat.y.abs()) * sign(flat.x),
        (1.0 - flat.x.abs()) * sign(flat.y),
    )
}

fn unfold(at: Vec2) -> Vec3 {
    let y = 1.0 - at.x.abs() - at.y.abs();
    let sign = |v: f32| if v >= 0.0 { 1.0 } else { -1.0 };
    let flat = if y >= 0.0 {
        at
    } else {
        Vec2::new(
            (1.0 - at.y.abs()) * sign(at.x),
            (1.0 - at.x.abs()) * sign(at.y),
        )
    };
    Vec3::new(flat.x, y, flat.y).normalize_or(Vec3::Y)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measure(side: u32, value: impl Fn(Vec3) -> f32) -> Measured {
        let mut measuring = Measuring::new(1, side);
        for (texel, direction) in measuring.directions().into_iter().enumerate() {
            measuring.set(texel, &[value(direction)]);
        }
        measuring.finish()
    }

    #[test]
    fn folding_and_unfolding_are_inverse() {
        for direction in Measuring::new(1, 9).directions() {
            assert!((unfold(fold(direction)) - direction).length() < 1e-5);
        }
    }

    #[test]
    fn what_was_measured_is_found_again() {
        let value = |d: Vec3| 0.5 + 0.4 * d.dot(Vec3::new(0.6, -0.48, 0.64));
        let measured = measure(8, value);
        for direction in Measuring::new(1, 8).directions() {
            assert!((measured.at(0, direction) - value(direction)).abs() < 0.003);
        }
    }

    #[test]
    fn between_directions_it_is_smooth_also_over_the_maps_edge() {
        let value = |d: Vec3| 0.5 + 0.4 * d.dot(Vec3::new(0.6, -0.48, 0.64));
        let measured = measure(8, value);
        let mut worst = 0.0f32;
        for direction in Measuring::new(1, 37).directions() {
            worst = worst.max((measured.at(0, direction) - value(direction)).abs());
        }
        assert!(worst < 0.07, "{worst}");
    }

    #[test]
    fn strange_items_and_directions_have_an_answer() {
        let measured = measure(4, |_| 0.5);
        assert_eq!(measured.at(7, Vec3::X), 1.0);
        assert!((0.0..=1.0).contains(&measured.at(0, Vec3::ZERO)));
        assert!(Measured::from_bytes(4, vec![0; 17]).is_none());
        assert!(Measured::from_bytes(0, vec![]).is_none());
    }
}
