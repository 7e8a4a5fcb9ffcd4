//! Convex outlines in the plane: hull, smallest rectangle, few corners.

use glam::{DVec2, Vec2};

pub use super::min_triangle::min_triangle;

/// Outlines are never thinner than this, in normalised units (2 mm on a tree of 20 m), nor than
/// [`MIN_THICKNESS_RATIO`] of their length: a card of no area would be dropped by every importer.
pub const MIN_THICKNESS: f32 = 2e-4;
/// See [`MIN_THICKNESS`].
pub const MIN_THICKNESS_RATIO: f32 = 1e-3;

/// A rectangle in the plane with the corners `center ± axis * half.x ± perp(axis) * half.y`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rect2 {
    /// Middle.
    pub center: Vec2,
    /// Unit direction of the first side; the second is a quarter turn counter-clockwise of it.
    pub axis: Vec2,
    /// Half the lengths of the sides; never zero.
    pub half: Vec2,
}

impl Rect2 {
    /// Counter-clockwise corners.
    pub fn corners(&self) -> [Vec2; 4] {
        let (a, b) = (self.axis * self.half.x, self.axis.perp() * self.half.y);
        [
            self.center - a - b,
            self.center + a - b,
            self.center + a + b,
            self.center - a + b,
        ]
    }
}

/// The convex hull, counter-clockwise from the leftmost lowest corner, without collinear corners
/// (Andrew's monotone chain). One corner for coincident points, two for collinear ones.
pub fn convex_hull(points: impl IntoIterator<Item = Vec2>) -> Vec<Vec2> {
    let mut points: Vec<Vec2> = points.into_iter().filter(|p| p.is_finite()).collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut hull: Vec<Vec2> = Vec::with_capacity(32);
    half_hull(&mut hull, points.iter());
    half_hull(&mut hull, points.iter().rev());
    hull
}

/// Appends the lower (or, for reversed points, the upper) chain without its last point.
fn half_hull<'a>(hull: &mut Vec<Vec2>, points: impl Iterator<Item = &'a Vec2>) {
    let start = hull.len();
    for &point in points {
        while hull.len() >= start + 2
            && turn(hull[hull.len() - 2], hull[hull.len() - 1], point) <= 0.0
        {
            hull.pop();
        }
        hull.push(point);
    }
    hull.pop();
}

/// Area of a counter-clockwise polygon.
pub fn area(polygon: &[Vec2]) -> f32 {
    let Some(&first) = polygon.first() else {
        return 0.0;
    };
    let fan = polygon.windows(2).map(|w| turn(first, w[0], w[1]));
    (fan.sum::<f64>() / 2.0) as f32
}

/// The smallest rectangle around a hull: one of its sides lies along a hull edge (Freeman and
/// Shapira 1975). Degenerate hulls get a thin rectangle. Time is quadratic in the hull's corners.
pub fn min_rect(hull: &[Vec2]) -> Rect2 {
    let along = |axis: DVec2| {
        let (mut low, mut high) = (DVec2::MAX, DVec2::MIN);
        for p in hull.iter().map(|p| p.as_dvec2()) {
            let q = DVec2::new(p.dot(axis), p.dot(axis.perp()));
            (low, high) = (low.min(q), high.max(q));
        }
        (axis, low, high)
    };
    let edges = (0..hull.len()).filter_map(|i| {
        let edge = hull[(i + 1) % hull.len()].as_dvec2() - hull[i].as_dvec2();
        edge.try_normalize()
    });
    let best = edges
        .map(along)
        .min_by(|a, b| rect_area(a).total_cmp(&rect_area(b)));
    let (axis, low, high) = match best {
        Some(best) => best,
        None if hull.is_empty() => (DVec2::X, DVec2::ZERO, DVec2::ZERO),
        None => along(DVec2::X),
    };
    let middle = (low + high) / 2.0;
    Rect2 {
        center: (axis * middle.x + axis.perp() * middle.y).as_vec2(),
        axis: axis.as_vec2(),
        half: thickened((high - low).as_vec2()) / 2.0,
    }
}

/// The sides of a rectangle, none of them under [`MIN_THICKNESS`].
pub fn thickened(size: Vec2) -> Vec2 {
    let least = MIN_THICKNESS.max(size.max_element() * MIN_THICKNESS_RATIO);
    size.max(Vec2::splat(least))
}

fn rect_area((_, low, high): &(DVec2, DVec2, DVec2)) -> f64 {
    (high.x - low.x) * (high.y - low.y)
}

/// A convex polygon of at most `most` corners (3 or more) around a hull, counter-clockwise.
///
/// Removes the edge whose neighbours, prolonged until they meet, add the least area; takes the
/// smallest rectangle or triangle where those are smaller still. Degenerate hulls are padded.
pub fn simplify(hull: &[Vec2], most: usize) -> Vec<Vec2> {
    let hull = thick(hull);
    if hull.len() <= most.max(3) {
        return hull;
    }
    if most <= 3 {
        return min_triangle(&hull).to_vec();
    }
    let trimmed = shrink(&hull, most);
    let rect = min_rect(&hull).corners();
    if trimmed.len() > most || area(&rect) <= area(&trimmed) {
        rect.to_vec()
    } else {
        trimmed
    }
}

/// The hull, or where it has no area the thin rectangle around it.
pub(super) fn thick(hull: &[Vec2]) -> Vec<Vec2> {
    let rect = min_rect(hull);
    let least = thickened(Vec2::new(rect.half.max_element() * 2.0, 0.0)).y;
    let thin = rect.half.min_element() * 2.0 <= least * (1.0 + 1e-5);
    if hull.len() < 3 || thin {
        rect.corners().to_vec()
    } else {
        hull.to_vec()
    }
}

/// Removes edges, least added area first, until `most` corners (4 or more) are left.
pub(super) fn shrink(hull: &[Vec2], most: usize) -> Vec<Vec2> {
    let mut corners: Vec<DVec2> = hull.iter().map(|p| p.as_dvec2()).collect();
    while corners.len() > most.max(4) {
        let n = corners.len();
        let removal = |i: usize| {
            let [before, a, b, after] = [n - 1, 0, 1, 2].map(|k| corners[(i + k) % n]);
            let (d, e) = (a - before, b - after);
            let tip = meet(a, d, b, e)?;
            // The tip must lie in front of both: prolonged neighbours, not their other ends.
            let outside = (tip - a).dot(d) >= 0.0 && (tip - b).dot(e) >= 0.0;
            outside.then(|| (cross(b - tip, a - tip).abs(), i, tip))
        };
        let least = (0..n)
            .filter_map(removal)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let Some((_, i, tip)) = least else { break };
        corners[i] = tip;
        corners.remove((i + 1) % n);
    }
    corners.iter().map(|p| p.as_vec2()).collect()
}

/// Where two lines meet, or `None` for (nearly) parallel ones.
pub(super) fn meet(p: DVec2, d: DVec2, q: DVec2, e: DVec2) -> Option<DVec2> {
    let across = cross(d, e);
    if across.abs() <= 1e-12 * d.length() * e.length() {
        return None;
    }
    let point = p + d * (cross(q - p, e) / across);
    point.is_finite().then_some(point)
}

pub(super) fn cross(a: DVec2, b: DVec2) -> f64 {
    a.perp_dot(b)
}

/// Twice the signed area of a triangle; differences of f32 are exact in f64.
fn turn(a: Vec2, b: Vec2, c: Vec2) -> f64 {
    let a = a.as_dvec2();
    cross(b.as_dvec2() - a, c.as_dvec2() - a)
}

/// Distance of a point from a counter-clockwise convex polygon; zero inside.
pub fn distance(polygon: &[Vec2], point: Vec2) -> f32 {
    if !polygon.is_empty() && holds(polygon, point, 0.0) {
        return 0.0;
    }
    let to_edge = |i: usize| {
        let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        let edge = b - a;
        let share = (point - a).dot(edge) / edge.length_squared().max(f32::MIN_POSITIVE);
        (a + edge * share.clamp(0.0, 1.0)).distance(point)
    };
    (0..polygon.len()).map(to_edge).fold(f32::MAX, f32::min)
}

/// Whether a counter-clockwise convex polygon holds a point, up to `slack` outside of it.
pub fn holds(polygon: &[Vec2], point: Vec2, slack: f32) -> bool {
    (0..polygon.len()).all(|i| {
        let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
        let edge = (b - a).as_dvec2();
        cross(edge, (point - a).as_dvec2()) >= -f64::from(slack) * edge.length()
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    fn v(x: f32, y: f32) -> Vec2 {
        Vec2::new(x, y)
    }

    /// Pseudo-random points (a linear congruential generator), stretched and turned.
    pub(in crate::space) fn cloud(seed: u32, count: usize) -> Vec<Vec2> {
        let mut state = seed.wrapping_mul(2_654_435_761).wrapping_add(12_345);
        let mut next = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 16_777_216.0 - 0.5
        };
        let turn = Vec2::from_angle(seed as f32);
        let stretch = 1.0 + (seed % 7) as f32 * 3.0;
        (0..count)
            .map(|_| turn.rotate(v(next() * stretch, next())))
            .collect()
    }

    #[test]
    fn hull_of_a_square_with_points_inside_and_on_its_edges() {
        let square = [v(0., 0.), v(1., 0.), v(1., 1.), v(0., 1.)];
        let more = [v(0.5, 0.5), v(0.5, 0.0), v(1.0, 0.3), v(0., 0.)];
        let hull = convex_hull(square.into_iter().chain(more));
        assert_eq!(hull, square);
        assert_eq!(area(&hull), 1.0);
    }

    #[test]
    fn smallest_rectangle_of_a_turned_one() {
        let known = Rect2 {
            center: v(3.0, -2.0),
            axis: Vec2::from_angle(0.4),
            half: v(2.0, 0.5),
        };
        let rect = min_rect(&convex_hull(known.corners()));
        assert!((rect.half.x * rect.half.y - 1.0).abs() < 1e-5, "{rect:?}");
        assert!((rect.center - known.center).length() < 1e-5);
    }

    #[test]
    fn outlines_hold_every_point_and_stay_small() {
        for seed in 0..200 {
            let points = cloud(seed, 3 + seed as usize);
            let hull = convex_hull(points.iter().copied());
            let triangle = min_triangle(&hull);
            let shapes = [3, 4, 5, 8].map(|k| (k, simplify(&hull, k)));
            for p in &points {
                assert!(holds(&triangle, *p, 1e-5), "triangle, seed {seed}");
                for (k, shape) in &shapes {
                    assert!(holds(shape, *p, 1e-5), "{k} corners, seed {seed}");
                }
            }
            for (k, shape) in &shapes {
                assert!(shape.len() <= *k && shape.len() >= 3);
                assert!(
                    area(shape) <= 2.05 * area(&hull),
                    "{k} corners, seed {seed}"
                );
            }
            let sizes = [&triangle[..], &shapes[1].1, &shapes[2].1, &shapes[3].1].map(area);
            assert!(sizes[1] <= area(&min_rect(&hull).corners()) * 1.0001);
            assert!(
                sizes[3] <= sizes[2] * 1.0001 && sizes[2] <= sizes[1] * 1.0001,
                "{sizes:?}"
            );
        }
    }

    #[test]
    fn degenerate_hulls_get_thin_outlines() {
        let cases: [&[Vec2]; 4] = [
            &[],
            &[v(1., 2.)],
            &[v(0., 0.), v(1., 1.)],
            &[v(0., 0.), v(0.5, 0.5), v(1., 1.0)],
        ];
        for points in cases {
            let hull = convex_hull(points.iter().copied());
            for k in 3..6 {
                let outline = simplify(&hull, k);
                assert!((3..=k).contains(&outline.len()), "{points:?} {k}");
                assert!(area(&outline) > 0.0, "{points:?} {k} {outline:?}");
                assert!(points.iter().all(|&p| holds(&outline, p, 1e-6)));
            }
        }
    }
}
