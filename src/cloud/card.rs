//! A billboard: a piece of a plane with a convex outline.

use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

use crate::space::hull;

/// A billboard plane with a convex outline, in normalised tree space.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Card {
    /// Where the plane's coordinates start.
    pub origin: Vec3,
    /// Unit direction of the plane's x.
    pub u: Vec3,
    /// Unit direction of the plane's y, orthogonal to `u`; the normal is `u x v`.
    pub v: Vec3,
    /// Counter-clockwise convex polygon in units of `u` and `v`, 3 or more corners.
    pub outline: Vec<Vec2>,
}

/// How tightly an outline follows what the card shows: fewer corners cost fewer triangles, more
/// corners waste fewer pixels and texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Outline {
    /// The smallest triangle: one triangle.
    Triangle,
    /// The smallest rectangle: two triangles.
    Quad,
    /// At most this many corners (3 or more): two triangles fewer than corners.
    Corners(u8),
}

impl Card {
    /// The smallest card of the given outline that shows all `points`, in the plane through
    /// `origin` with the unit, orthogonal directions `u` and `v`. A [`Outline::Quad`] turns `u` and
    /// `v` along its sides and moves the origin to its middle. Degenerate point sets are padded.
    pub fn around(
        origin: Vec3,
        u: Vec3,
        v: Vec3,
        points: impl IntoIterator<Item = Vec3>,
        outline: Outline,
    ) -> Self {
        let flat = points
            .into_iter()
            .map(|p| Vec2::new((p - origin).dot(u), (p - origin).dot(v)));
        let corners = hull::convex_hull(flat);
        match outline {
            Outline::Quad => {
                let rect = hull::min_rect(&corners);
                let turned = |x: Vec2| (u * x.x + v * x.y).normalize_or(u);
                let center = origin + u * rect.center.x + v * rect.center.y;
                Self::rectangle(
                    center,
                    turned(rect.axis),
                    turned(rect.axis.perp()),
                    rect.half,
                )
            }
            Outline::Triangle => Self {
                origin,
                u,
                v,
                outline: hull::min_triangle(&corners).to_vec(),
            },
            Outline::Corners(most) => Self {
                origin,
                u,
                v,
                outline: hull::simplify(&corners, usize::from(most)),
            },
        }
    }

    /// A rectangle with the middle `center` and half sides `half` along `u` and `v`.
    pub fn rectangle(center: Vec3, u: Vec3, v: Vec3, half: Vec2) -> Self {
        let Vec2 { x, y } = half;
        Self {
            origin: center,
            u,
            v,
            outline: vec![
                Vec2::new(-x, -y),
                Vec2::new(x, -y),
                Vec2::new(x, y),
                Vec2::new(-x, y),
            ],
        }
    }

    /// The same piece of the plane with its front where its back is.
    pub fn turned(&self) -> Self {
        let mirrored = self.outline.iter().rev();
        Self {
            u: -self.u,
            outline: mirrored.map(|p| Vec2::new(-p.x, p.y)).collect(),
            ..self.clone()
        }
    }

    /// Unit normal of the front.
    pub fn normal(&self) -> Vec3 {
        self.u.cross(self.v)
    }

    /// Triangles that the card costs, as a fan.
    pub fn triangles(&self) -> usize {
        self.outline.len().saturating_sub(2)
    }

    /// Corners in space, counter-clockwise seen from the front.
    pub fn corners(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.outline.iter().map(|&p| self.point(p))
    }

    /// The point in space at plane coordinates.
    pub fn point(&self, uv: Vec2) -> Vec3 {
        self.origin + self.u * uv.x + self.v * uv.y
    }

    /// Plane coordinates of a point's foot.
    pub fn project(&self, point: Vec3) -> Vec2 {
        let offset = point - self.origin;
        Vec2::new(offset.dot(self.u), offset.dot(self.v))
    }

    /// Signed distance of a point from the (endless) plane, positive in front.
    pub fn height(&self, point: Vec3) -> f32 {
        (point - self.origin).dot(self.normal())
    }

    /// Distance of a point from the card itself, outline included.
    pub fn distance(&self, point: Vec3) -> f32 {
        let foot = self.project(point);
        let aside = hull::distance(&self.outline, foot);
        aside.hypot(self.height(point))
    }

    /// Area of the outline, normalised units squared.
    pub fn area(&self) -> f32 {
        hull::area(&self.outline)
    }

    /// Whether directions are unit and orthogonal, and the outline convex with area.
    pub fn is_sound(&self) -> bool {
        let unit = |v: Vec3| (v.length() - 1.0).abs() < 1e-4;
        let n = self.outline.len();
        let convex = n >= 3
            && (0..n).all(|i| {
                let [a, b, c] = [0, 1, 2].map(|k| self.outline[(i + k) % n]);
                (b - a).perp_dot(c - b) >= -1e-6 * (b - a).length() * (c - b).length()
            });
        unit(self.u)
            && unit(self.v)
            && self.u.dot(self.v).abs() < 1e-4
            && convex
            && self.origin.is_finite()
            && self.area() > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_square_at_height_two() -> Card {
        Card::rectangle(Vec3::Y * 2.0, Vec3::Z, Vec3::X, Vec2::splat(0.5))
    }

    #[test]
    fn a_square_has_the_expected_normal_area_and_corners() {
        let card = unit_square_at_height_two();
        assert_eq!(card.normal(), Vec3::Y);
        assert_eq!((card.triangles(), card.area()), (2, 1.0));
        assert_eq!(card.height(Vec3::new(9.0, 2.5, 7.0)), 0.5);
        let corners: Vec<Vec3> = card.corners().collect();
        assert_eq!(corners[0], Vec3::new(-0.5, 2.0, -0.5));
        // Counter-clockwise seen from the front.
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[1]);
        assert!(normal.dot(card.normal()) > 0.0);
        assert!(card.is_sound());
    }

    #[test]
    fn distance_counts_what_lies_beside_the_outline() {
        let card = unit_square_at_height_two();
        assert!((card.distance(Vec3::new(0.2, 2.3, 0.0)) - 0.3).abs() < 1e-6);
        // 3 beside, 4 above: 5.
        assert!((card.distance(Vec3::new(3.5, 6.0, 0.0)) - 5.0).abs() < 1e-6);
        // Over a corner: (0.3, 0.4) beside.
        assert!((card.distance(Vec3::new(0.8, 2.0, 0.9)) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn outlines_show_every_point_at_their_price() {
        let points: Vec<Vec3> = (0..40)
            .map(|i| {
                let (sin, cos) = (i as f32 * 0.7).sin_cos();
                Vec3::new(3.0 * cos, 1.0 + 0.01 * i as f32, sin)
            })
            .collect();
        let cases = [
            (Outline::Triangle, 1),
            (Outline::Quad, 2),
            (Outline::Corners(6), 4),
        ];
        for (outline, triangles) in cases {
            let card = Card::around(Vec3::Y, Vec3::Z, Vec3::X, points.iter().copied(), outline);
            assert_eq!(card.triangles(), triangles);
            assert!(card.is_sound(), "{card:?}");
            assert!((card.normal() - Vec3::Y).length() < 1e-5);
            for &p in &points {
                assert!(hull::holds(&card.outline, card.project(p), 1e-5));
                assert!((card.point(card.project(p)) - p).length() - card.height(p).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn one_point_makes_a_small_sound_card() {
        for outline in [Outline::Triangle, Outline::Quad, Outline::Corners(5)] {
            let card = Card::around(Vec3::ONE, Vec3::X, Vec3::Y, [Vec3::ONE], outline);
            assert!(card.is_sound() && card.area() < 1e-6, "{card:?}");
        }
    }
}
