//! The smallest triangle around a convex hull.
//!
//! The smallest triangle follows O'Rourke, Aggarwal, Maddila and Baldwin ("An optimal algorithm
//! for finding minimal enclosing triangles", J. Algorithms 7, 1986): one with two sides flush
//! with hull edges exists, and the third touches the hull at its own midpoint or is flush too.
//! (With one side flush, the midpoints of the others touch; where both touch in a corner, the
//! triangle can be sheared along the flush side at equal area until one of them is flush.) With
//! outlines this small, trying all pairs is simpler and sturdier than their linear sweep.

use glam::{DVec2, Vec2};

use super::hull::{Rect2, cross, meet, min_rect, shrink, thick};

/// Hulls are brought to this many corners before the smallest triangle is searched for; the
/// search takes the cube of it. On random hulls it costs less than a percent of area.
const TRIANGLE_SEARCH_CORNERS: usize = 16;

/// Less than one by more than what hulls may stick out of a triangle and still count as held.
const CERTAIN: f64 = 1.0 - 1e-4;

/// The smallest triangle around a hull, counter-clockwise (see the head of this file; hulls with
/// more than 16 corners are simplified first, so the answer is then near the smallest). Degenerate
/// hulls get a thin triangle. The area is at most twice the hull's.
pub fn min_triangle(hull: &[Vec2]) -> [Vec2; 3] {
    let hull = thick(hull);
    let hull: Vec<DVec2> = shrink(&hull, TRIANGLE_SEARCH_CORNERS)
        .iter()
        .map(|p| p.as_dvec2())
        .collect();
    let n = hull.len();
    let sides: Vec<Side> = (0..n)
        .map(|k| Side {
            at: hull[k],
            along: (hull[(k + 1) % n] - hull[k]).normalize(),
        })
        .collect();
    let mut best = Smallest {
        hull: &hull,
        found: None,
    };
    for i in 0..n {
        for j in (0..n).filter(|&j| i != j) {
            best.third_sides(&sides, i, j);
        }
    }
    match best.found {
        Some((_, triangle)) => triangle.map(|p| p.as_vec2()),
        None => triangle_of_rect(&min_rect(
            &hull.iter().map(|p| p.as_vec2()).collect::<Vec<_>>(),
        )),
    }
}

/// A line along a hull edge.
struct Side {
    at: DVec2,
    /// Unit direction, the hull to its left.
    along: DVec2,
}

/// The smallest triangle so far, with twice its area.
struct Smallest<'h> {
    hull: &'h [DVec2],
    found: Option<(f64, [DVec2; 3])>,
}

impl Smallest<'_> {
    /// Tries the triangles with sides along hull edges `i` and `j`, where `j` follows `i` at the
    /// triangle's corner between them. The third side runs over the hull corners after `j`.
    fn third_sides(&mut self, sides: &[Side], i: usize, j: usize) {
        let both = [&sides[i], &sides[j]];
        let [(pi, di), (pj, dj)] = both.map(|side| (side.at, side.along));
        if cross(di, dj) <= 1e-9 {
            return;
        }
        let Some(apex) = meet(pi, di, pj, dj) else {
            return;
        };
        // A point that lies s and t along the sides, seen from the apex, is within sides of lengths a and b
        // only where s/a + t/b <= 1, and then a b >= 4 s t: most pairs are passed over by that.
        let turn = cross(di, dj);
        let least = |q: &DVec2| -4.0 * cross(*q - apex, dj) * cross(di, *q - apex) / turn;
        let least = self.hull.iter().map(least).fold(0.0, f64::max);
        if self
            .found
            .is_some_and(|(found, _)| least * CERTAIN >= found)
        {
            return;
        }
        for (number, k) in sides.iter().enumerate() {
            self.close(apex, both, number, k.along);
            // The side whose midpoint is p: from a on line j to b on line i with a + b = 2 p.
            let across = 2.0 * (k.at - apex);
            let (s, t) = (
                cross(across, di) / cross(dj, di),
                cross(across, dj) / cross(di, dj),
            );
            if let Some(direction) = (di * t - dj * s).try_normalize() {
                self.close(apex, both, number, direction);
            }
        }
    }

    /// Keeps the triangle whose far side runs through corner `k` of the hull along `d`, if it is one,
    /// smaller than those before, and holds the hull. What is found out fastest is asked first.
    fn close(&mut self, apex: DVec2, [before, after]: [&Side; 2], k: usize, d: DVec2) {
        let (di, dj) = (before.along, after.along);
        if cross(dj, d) <= 0.0 || cross(d, di) <= 0.0 {
            return;
        }
        let (hull, n, p) = (self.hull, self.hull.len(), self.hull[k]);
        let holds = |q: DVec2| cross(d, q - p) >= -1e-9;
        if !holds(hull[(k + 1) % n]) || !holds(hull[(k + n - 1) % n]) {
            return;
        }
        // The far side meets line i before the hull and line j behind it, and keeps the hull to its left.
        let meet = |side: &Side| meet(p, d, side.at, side.along);
        let (Some(a), Some(b)) = (meet(after), meet(before)) else {
            return;
        };
        let ahead = (a - apex).dot(dj) > 0.0 && (b - apex).dot(di) < 0.0 && (b - a).dot(d) > 0.0;
        let size = cross(a - apex, b - apex);
        let smaller = size > 0.0 && self.found.is_none_or(|(least, _)| size < least);
        if ahead && smaller && hull.iter().all(|&q| holds(q)) {
            self.found = Some((size, [apex, a, b]));
        }
    }
}

/// A triangle around a rectangle, of twice its area.
fn triangle_of_rect(rect: &Rect2) -> [Vec2; 3] {
    let [a, b, _, d] = rect.corners();
    [a, b + (b - a), d + (d - a)]
}

#[cfg(test)]
mod tests {
    use super::super::hull::tests::cloud;
    use super::super::hull::{area, convex_hull};
    use super::*;

    fn v(x: f32, y: f32) -> Vec2 {
        Vec2::new(x, y)
    }

    #[test]
    fn smallest_triangle_of_known_shapes() {
        let triangle = [v(0., 0.), v(4., 0.), v(1., 3.)];
        assert!((area(&min_triangle(&convex_hull(triangle))) - 6.0).abs() < 1e-5);
        // Around a square it has twice the area; around a regular hexagon of side one, the
        // triangle of side three.
        let square = convex_hull([v(0., 0.), v(1., 0.), v(1., 1.), v(0., 1.)]);
        assert!((area(&min_triangle(&square)) - 2.0).abs() < 1e-5);
        let hexagon =
            convex_hull((0..6).map(|i| Vec2::from_angle(i as f32 * std::f32::consts::FRAC_PI_3)));
        let expected = 9.0 * 3.0f32.sqrt() / 4.0;
        assert!((area(&min_triangle(&hexagon)) - expected).abs() < 1e-4);
    }

    /// No triangle from a fine search over the directions of its three sides is smaller.
    #[test]
    fn no_smaller_triangle_is_found_by_brute_force() {
        for seed in 0..8 {
            let hull = convex_hull(cloud(seed, 9));
            let found = f64::from(area(&min_triangle(&hull)));
            let support = |angle: f64| {
                let out = DVec2::from_angle(angle);
                let far = hull.iter().map(|p| p.as_dvec2().dot(out));
                (out * far.fold(f64::MIN, f64::max), out.perp())
            };
            let step = std::f64::consts::TAU / 90.0;
            for i in 0..90 {
                for j in i + 1..i + 45 {
                    for k in j + 1..j + 45 {
                        let sides = [i, j, k].map(|x| support(f64::from(x) * step));
                        if (k - i) <= 45 {
                            continue;
                        }
                        let corner = |a: usize, b: usize| {
                            meet(sides[a].0, sides[a].1, sides[b].0, sides[b].1)
                        };
                        let (Some(a), Some(b), Some(c)) =
                            (corner(0, 1), corner(1, 2), corner(2, 0))
                        else {
                            continue;
                        };
                        let size = cross(b - a, c - a) / 2.0;
                        assert!(size >= found * 0.9999, "seed {seed}: {size} under {found}");
                    }
                }
            }
        }
    }
}
