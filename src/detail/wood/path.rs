//! The centre line of a chain with radii that hold the surface of its triangles.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::botany::Tree;

/// Points nearer than this (normalised units) are one point.
const SAME_POINT: f64 = 1e-7;

/// A centre line from base to tip; at least two points, all apart.
pub(super) struct Path {
    /// Points, normalised units.
    pub points: Vec<DVec3>,
    /// Radii of circles at the points; the round tube has the surface `area`.
    pub radii: Vec<f64>,
    /// Arc length from the base.
    pub along: Vec<f64>,
    /// Unit vectors across the path that turn as little as possible along it: angle zero.
    pub across: Vec<DVec3>,
    /// Surface of the chain's triangles.
    pub area: f64,
    /// Where a simplified tube starts so that no gap opens: inside the carrying branch.
    pub base: DVec3,
    /// For each node of the chain, its point.
    pub slot_to_point: Vec<u32>,
}

impl Path {
    /// The path of a chain, or `None` where it has no length or no surface.
    pub fn new(
        tree: &Tree,
        chain: u32,
        triangles: &[u32],
        slots: &[u32],
        area: f64,
    ) -> Option<Self> {
        let (mut points, mut radii, slot_to_point) = distinct_points(tree, chain);
        if points.len() < 2 || area <= 0.0 {
            return None;
        }
        reach_the_ends(tree, &mut points, triangles, slots, &slot_to_point);
        let mut along = vec![0.0];
        for pair in points.windows(2) {
            along.push(along[along.len() - 1] + pair[0].distance(pair[1]));
        }
        hold_surface(&mut radii, &along, area)?;
        let across = least_turning(&points);
        let tangent = (points[1] - points[0]).normalize_or_zero();
        let base = embedded_base(tree, chain, slots, points[0], tangent);
        Some(Self {
            points,
            radii,
            along,
            across,
            area,
            base,
            slot_to_point,
        })
    }

    /// Arc length.
    pub fn length(&self) -> f64 {
        self.along[self.along.len() - 1]
    }

    /// Unit direction of the path at a point: the mean of its two segments.
    pub fn tangent(&self, i: usize) -> DVec3 {
        tangent(&self.points, i)
    }

    /// The nearest point of the path on the segments on both sides of point `near`.
    pub fn nearest(&self, position: DVec3, near: usize) -> DVec3 {
        let (i, t) = self.nearest_segment(position, near);
        self.points[i].lerp(self.points[i + 1], t)
    }

    /// Arc length and angle (radians, from `across` counter-clockwise about the direction of
    /// growth) of a position, sought on the segments on both sides of point `near`.
    pub fn locate(&self, position: DVec3, near: usize) -> (f64, f64) {
        let (i, t) = self.nearest_segment(position, near);
        let forward = (self.points[i + 1] - self.points[i]).normalize_or_zero();
        let zero = self.across[i].lerp(self.across[i + 1], t);
        let zero = (zero - forward * zero.dot(forward)).normalize_or_zero();
        let out = position - self.points[i].lerp(self.points[i + 1], t);
        let angle = out.dot(forward.cross(zero)).atan2(out.dot(zero));
        (
            self.along[i] + t * (self.along[i + 1] - self.along[i]),
            angle,
        )
    }

    fn nearest_segment(&self, position: DVec3, near: usize) -> (usize, f64) {
        let (mut best, mut at) = (f64::INFINITY, (0, 0.0));
        for i in near.saturating_sub(1)..(near + 1).min(self.points.len() - 1) {
            let (a, b) = (self.points[i], self.points[i + 1]);
            let t = ((position - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
            let distance = position.distance_squared(a.lerp(b, t));
            if distance < best {
                (best, at) = (distance, (i, t));
            }
        }
        at
    }
}

/// The nodes of a chain without repeated points; a lone node is joined to its parent.
fn distinct_points(tree: &Tree, chain: u32) -> (Vec<DVec3>, Vec<f64>, Vec<u32>) {
    let nodes = &tree.skeleton.nodes;
    let chain = &tree.skeleton.chains[chain as usize];
    let (mut points, mut radii, mut slots) = (Vec::<DVec3>::new(), Vec::<f64>::new(), Vec::new());
    if let [only] = chain.nodes[..]
        && let Some(parent) = nodes.get(nodes[only as usize].parent as usize)
    {
        points.push(parent.position.as_dvec3());
        radii.push(f64::from(nodes[only as usize].radius));
    }
    for &n in &chain.nodes {
        let node = &nodes[n as usize];
        let (point, radius) = (node.position.as_dvec3(), f64::from(node.radius.max(0.0)));
        match points.last() {
            Some(last) if last.distance(point) <= SAME_POINT => {
                let last = radii.len() - 1;
                radii[last] = radii[last].max(radius);
            }
            _ => {
                points.push(point);
                radii.push(radius);
            }
        }
        slots.push(points.len() as u32 - 1);
    }
    (points, radii, slots)
}

/// Moves the end points outwards to where the triangles of the end nodes end: nodes are middles
/// of bands, and a tube that stops half a band early would have to be thicker to hold its area.
fn reach_the_ends(
    tree: &Tree,
    points: &mut [DVec3],
    triangles: &[u32],
    slots: &[u32],
    slot_to_point: &[u32],
) {
    let last = points.len() - 1;
    let inward = [
        (points[1] - points[0]).normalize_or_zero(),
        (points[last - 1] - points[last]).normalize_or_zero(),
    ];
    let room = [
        points[1].distance(points[0]),
        points[last - 1].distance(points[last]),
    ];
    let ends = [points[0], points[last]];
    let mut reach = [0.0f64; 2];
    for &t in triangles {
        let slot = slots[tree.wood_node[t as usize] as usize] as usize;
        let point = slot_to_point[slot] as usize;
        for end in 0..2 {
            if point == [0, last][end] {
                for corner in tree.model.corners(t) {
                    let out = (ends[end] - corner.as_dvec3()).dot(inward[end]);
                    reach[end] = reach[end].max(out);
                }
            }
        }
    }
    for end in 0..2 {
        points[[0, last][end]] -= inward[end] * reach[end].min(room[end]);
    }
}

/// Scales the radii so that the round tube has the given surface; `None` if that is impossible.
fn hold_surface(radii: &mut [f64], along: &[f64], area: f64) -> Option<()> {
    let mut round = 0.0;
    for i in 1..radii.len() {
        let length = along[i] - along[i - 1];
        round += TAU * 0.5 * (radii[i] + radii[i - 1]) * length;
    }
    let length = along[along.len() - 1];
    if length <= SAME_POINT {
        return None;
    }
    if round > 1e-6 * area {
        for radius in radii.iter_mut() {
            *radius *= area / round;
        }
    } else {
        // No radius is known: an even tube.
        radii.fill(area / (TAU * length));
    }
    Some(())
}

fn tangent(points: &[DVec3], i: usize) -> DVec3 {
    let before = points[i.saturating_sub(1)..=i].windows(2);
    let after = points[i..(i + 2).min(points.len())].windows(2);
    let sum: DVec3 = before
        .chain(after)
        .map(|p| (p[1] - p[0]).normalize_or_zero())
        .sum();
    // A path that folds back on itself has no mean direction: take the way in.
    sum.try_normalize()
        .unwrap_or_else(|| (points[i] - points[i - 1]).normalize_or_zero())
}

/// Parallel transport of a vector across the path.
fn least_turning(points: &[DVec3]) -> Vec<DVec3> {
    let mut across = Vec::with_capacity(points.len());
    let mut last = tangent(points, 0).any_orthonormal_vector();
    for i in 0..points.len() {
        let forward = tangent(points, i);
        last = (last - forward * last.dot(forward))
            .try_normalize()
            .unwrap_or_else(|| forward.any_orthonormal_vector());
        across.push(last);
    }
    across
}

/// Radii of the carrier up to which a tube reaches for its axis: what starts farther off touches it nowhere.
const FARTHEST_AXIS: f64 = 3.0;

/// The point inside the carrying branch where a tube starts: backwards along its own direction
/// if that meets the carrier (then nothing bends), else the nearest point of its axis, and where that
/// is far off, as where branches stand free and a skeleton joins them all the same, its own first point.
fn embedded_base(tree: &Tree, chain: u32, slots: &[u32], first: DVec3, tangent: DVec3) -> DVec3 {
    let nodes = &tree.skeleton.nodes;
    let base = &nodes[tree.skeleton.chains[chain as usize].nodes[0] as usize];
    let Some(parent) = nodes.get(base.parent as usize) else {
        return first;
    };
    let carrier = carrier_axis(tree, base.parent, slots);
    let radius = f64::from(parent.radius);
    // A triangle of equal perimeter reaches inwards to 0.6 of the radius: start deeper.
    let inside = |p: DVec3| {
        carrier
            .windows(2)
            .any(|s| distance_to_segment(p, s[0], s[1]) <= 0.5 * radius)
    };
    (0..=12)
        .map(|step| first - tangent * (radius * f64::from(step) / 4.0))
        .find(|&p| inside(p))
        .unwrap_or_else(|| {
            let near = carrier.windows(2).map(|s| nearest_on(first, s[0], s[1]));
            near.min_by(|a, b| a.distance(first).total_cmp(&b.distance(first)))
                .filter(|p| p.distance(first) <= FARTHEST_AXIS * radius)
                .unwrap_or(first)
        })
}

/// The centre line of the carrier near a node, at least two points.
fn carrier_axis(tree: &Tree, node: u32, slots: &[u32]) -> Vec<DVec3> {
    let nodes = &tree.skeleton.nodes;
    let chain = &tree.skeleton.chains[nodes[node as usize].chain as usize].nodes;
    let slot = slots[node as usize] as usize;
    let near = &chain[slot.saturating_sub(2)..(slot + 3).min(chain.len())];
    let mut axis: Vec<_> = near
        .iter()
        .map(|&n| nodes[n as usize].position.as_dvec3())
        .collect();
    axis.push(axis[axis.len() - 1]);
    axis
}

fn distance_to_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    p.distance(nearest_on(p, a, b))
}

/// The point between a and b that is nearest to p.
fn nearest_on(p: DVec3, a: DVec3, b: DVec3) -> DVec3 {
    let length = (b - a).length_squared();
    let t = if length > 0.0 {
        ((p - a).dot(b - a) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    a.lerp(b, t)
}
