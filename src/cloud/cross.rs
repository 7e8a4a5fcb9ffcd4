//! Two-cross: two orthogonal billboards that share an axis (Kratt et al. 2014, section 3.3).
//!
//! The axis is the mean of the vectors from the connector to the foliage. Vertices count by the
//! area around them, so that the axis doesn't depend on how finely a leaf is divided. The paper
//! leaves the roll about the axis open: taken is the one for which the foliage's projected area is
//! largest, each face counted on the card that shows more of it. (Counted on both cards, a pair of
//! crossed leaves would pull the cards half-way between them: each would show .71 twice.)

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3, Vec2, Vec3};

use super::card::{Card, Outline};
use super::foliage::Foliage;

/// Where the mean vector is shorter than this share of the foliage's spread, the leaves surround
/// their connector and the mean says nothing: the longest principal axis is taken.
const SHORT_MEAN: f64 = 0.25;

/// Rolls that are tried over the quarter turn after which a cross repeats itself.
const ROLLS: usize = 24;

/// Two cards through the foliage's main axis; `None` without faces.
pub fn cross(foliage: &Foliage<'_>, outline: Outline) -> Option<Vec<Card>> {
    let (center, axis) = main_axis(foliage)?;
    let [a, b] = best_roll(foliage, axis);
    Some(vec![
        upright_card(foliage, center, a, axis, outline),
        upright_card(foliage, center, b, axis, outline),
    ])
}

/// A point on the main axis (the foliage's centre of mass) and the axis' unit direction.
pub fn main_axis(foliage: &Foliage<'_>) -> Option<(DVec3, DVec3)> {
    let axes = foliage.moments().axes()?;
    let mean = axes.centroid - foliage.connector.as_dvec3();
    let spread = axes.variances.iter().sum::<f64>().sqrt();
    let axis = if mean.length() >= SHORT_MEAN * spread {
        mean.try_normalize()
    } else {
        None
    };
    Some((axes.centroid, axis.unwrap_or(axes.axes[2])))
}

/// The two directions across the axis for which the cards show the most.
fn best_roll(foliage: &Foliage<'_>, axis: DVec3) -> [DVec3; 2] {
    let (e, f) = axis.any_orthonormal_pair();
    // Only the part of a face's normal across the axis matters.
    let across = foliage.faces.iter().map(|face| {
        let normal = face.normal.as_dvec3() * f64::from(face.area);
        DVec2::new(normal.dot(e), normal.dot(f))
    });
    let across: Vec<DVec2> = across.collect();
    let shown = |roll: usize| {
        let side = DVec2::from_angle(roll as f64 * FRAC_PI_2 / ROLLS as f64);
        let area = |n: &DVec2| n.dot(side).abs().max(n.dot(side.perp()).abs());
        (side, across.iter().map(area).sum::<f64>())
    };
    // The first of equals, with a margin above rounding: `max_by` would take the last.
    let mut best = shown(0);
    for roll in 1..ROLLS {
        let next = shown(roll);
        if next.1 > best.1 * (1.0 + 1e-9) {
            best = next;
        }
    }
    [best.0, best.0.perp()].map(|d| e * d.x + f * d.y)
}

/// A card through the axis and `side`; a quad keeps its sides along them.
fn upright_card(
    foliage: &Foliage<'_>,
    center: DVec3,
    side: DVec3,
    axis: DVec3,
    outline: Outline,
) -> Card {
    let (origin, u, v) = (center.as_vec3(), side.as_vec3(), axis.as_vec3());
    if outline != Outline::Quad {
        return Card::around(origin, u, v, foliage.vertices(), outline);
    }
    let flat = |p: Vec3| Vec2::new((p - origin).dot(u), (p - origin).dot(v));
    let (low, high) = foliage
        .vertices()
        .map(flat)
        .fold((Vec2::MAX, Vec2::MIN), |(low, high), p| {
            (low.min(p), high.max(p))
        });
    let middle = (low + high) / 2.0;
    let half = crate::space::hull::thickened(high - low) / 2.0;
    Card::rectangle(origin + u * middle.x + v * middle.y, u, v, half)
}

#[cfg(test)]
mod tests {
    use super::super::card::Outline;
    use super::super::foliage::tests::patch;
    use super::super::foliage::{Face, Foliage};
    use super::*;

    fn foliage(faces: &[Face], connector: Vec3) -> Foliage<'_> {
        Foliage { faces, connector }
    }

    /// Two crossed upright leaves, one wide and one high, turned by 20 degrees about y.
    fn crossed_leaves() -> Vec<Face> {
        let (sin, cos) = 20f32.to_radians().sin_cos();
        let (a, b) = (Vec3::new(cos, 0.0, sin), Vec3::new(-sin, 0.0, cos));
        let mut faces = patch(a * -0.5, a, Vec3::Y);
        faces.extend(patch(b * -0.5, b, Vec3::Y));
        faces
    }

    #[test]
    fn crossed_leaves_get_their_own_planes_back() {
        let faces = crossed_leaves();
        let cards = cross(&foliage(&faces, Vec3::Y * -0.2), Outline::Quad).unwrap();
        assert_eq!(cards.len(), 2);
        assert!(cards[0].normal().dot(cards[1].normal()).abs() < 1e-6);
        for card in &cards {
            assert!((card.v - Vec3::Y).length() < 1e-5, "axis {}", card.v);
            assert!(card.is_sound());
            // 24 rolls over 90 degrees: within 1.9 degrees of the leaf.
            let fit = faces.iter().map(|f| f.normal.dot(card.normal()).abs());
            assert!(fit.fold(0.0, f32::max) > 0.9994);
            assert!((card.area() - 1.0).abs() < 0.01, "{}", card.area());
        }
    }

    #[test]
    fn both_cards_show_every_vertex_in_every_outline() {
        let faces = crossed_leaves();
        for outline in [Outline::Quad, Outline::Triangle, Outline::Corners(6)] {
            for card in cross(&foliage(&faces, Vec3::ZERO), outline).unwrap() {
                for p in faces.iter().flat_map(|f| f.corners) {
                    let inside = crate::space::hull::holds(&card.outline, card.project(p), 1e-5);
                    assert!(inside, "{outline:?} {p}");
                }
            }
        }
    }

    #[test]
    fn leaves_around_their_connector_turn_to_the_longest_axis() {
        // A long row of leaves along x, connected in its middle.
        let row = |i: i32| {
            patch(
                Vec3::new(i as f32, 0.0, -0.05),
                Vec3::X * 0.1,
                Vec3::Z * 0.1,
            )
        };
        let faces: Vec<Face> = (-5..=5).flat_map(row).collect();
        let (_, axis) = main_axis(&foliage(&faces, Vec3::ZERO)).unwrap();
        assert!(axis.x.abs() > 0.999, "{axis}");
        // Connected at its side, the mean vector counts.
        let (_, axis) = main_axis(&foliage(&faces, Vec3::Y * -3.0)).unwrap();
        assert!(axis.y > 0.999, "{axis}");
    }

    #[test]
    fn nothing_gives_none_and_one_flat_leaf_gives_two_sound_cards() {
        assert!(cross(&foliage(&[], Vec3::ZERO), Outline::Quad).is_none());
        let flat = patch(Vec3::ZERO, Vec3::X, Vec3::Z);
        let cards = cross(&foliage(&flat, Vec3::ZERO), Outline::Quad).unwrap();
        assert!(cards.iter().all(Card::is_sound), "{cards:?}");
    }
}
