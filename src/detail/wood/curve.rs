//! What a chain costs: options on the lower convex hull of error against triangles.

use std::f64::consts::PI;

use super::fit::{Fit, Ring, fit};
use super::path::Path;
use super::rings::{removal_order, samples};

/// Options that a curve keeps at most.
const MOST_OPTIONS: usize = 12;

/// The options of a chain.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainCurve {
    /// Fewest triangles first; triangles rise, errors fall, and their slopes flatten. Never
    /// empty. The first may have no triangle, the last has the error zero.
    pub options: Vec<WoodOption>,
}

/// One way to draw a chain.
#[derive(Clone, Debug, PartialEq)]
pub struct WoodOption {
    /// Triangles.
    pub triangles: u32,
    /// Half the chain's surface times its mean squared displacement, normalised units to the
    /// fourth.
    pub error: f64,
    /// What is drawn.
    pub shape: Shape,
}

impl WoodOption {
    /// Whether it is seen from all around: a tube of three sides or more, or the original.
    pub fn is_round(&self) -> bool {
        match self.shape {
            Shape::Absent => false,
            Shape::Original => true,
            Shape::Tube { sides, .. } => sides >= 3,
        }
    }
}

/// What stands for a chain.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// Nothing; a neighbour is drawn wider instead (see [`Wood::widening`](super::Wood::widening)).
    Absent,
    /// Its own triangles.
    Original,
    /// Rings of `sides` corners, or of two for a flat ribbon; a last ring of radius zero is a
    /// point.
    Tube {
        /// Corners of a ring: 3 to 8, or 2 for a ribbon that turns both faces.
        sides: u32,
        /// Rings from base to tip.
        rings: Vec<Ring>,
        /// A ribbon whose two faces are two sets of triangles.
        two_faces: bool,
    },
}

impl ChainCurve {
    /// The curve of a chain that can only be kept as it is.
    pub(super) fn original(triangles: u32) -> Self {
        let shape = Shape::Original;
        Self {
            options: vec![WoodOption {
                triangles,
                error: 0.0,
                shape,
            }],
        }
    }

    /// Adds the option of no triangle at all, with its error, and drops what it makes needless.
    pub(super) fn may_be_absent(&mut self, error: Option<f64>) {
        let Some(error) = error else { return };
        let slope = |o: &WoodOption| (error - o.error) / f64::from(o.triangles.max(1));
        let steepest = self.options.iter().map(slope).fold(f64::MIN, f64::max);
        // Tangent from the new point to the hull: what lies before it is no bargain any more.
        let keep = self.options.iter().position(|o| slope(o) >= steepest);
        self.options.drain(..keep.unwrap_or(0));
        if self.options[0].triangles > 0 {
            let absent = WoodOption {
                triangles: 0,
                error: error.max(self.options[0].error),
                shape: Shape::Absent,
            };
            self.options.insert(0, absent);
        }
    }

    /// The option with the least `error + multiplier * triangles`; of equals the cheapest.
    pub fn choose(&self, multiplier: f64) -> usize {
        let cost = |o: &WoodOption| o.error + multiplier * f64::from(o.triangles);
        let mut best = 0;
        for i in 1..self.options.len() {
            if cost(&self.options[i]) < cost(&self.options[best]) {
                best = i;
            }
        }
        best
    }
}

/// The curve of a chain with `original` triangles.
pub(super) fn chain_curve(path: &Path, original: u32, double_sided: bool) -> ChainCurve {
    let samples = samples(path);
    let order = removal_order(path, &samples);
    let mut fits = Vec::new();
    let mut options = vec![Candidate::original(original)];
    for segments in segment_counts(path.points.len() - 1) {
        let knots = last_removed(path.points.len(), &order, segments);
        for pointed in [true, false] {
            let fit = fit(path, &samples, &knots, pointed);
            offer(&mut options, &fit, fits.len(), pointed, double_sided);
            fits.push(fit);
        }
    }
    options.retain(|o| o.triangles < original || o.fit.is_none());
    let hull = thin_out(lower_hull(options));
    let options = hull.into_iter().map(|c| c.option(&fits)).collect();
    ChainCurve { options }
}

/// A point in the plane of triangles and error.
#[derive(Clone, Copy)]
struct Candidate {
    triangles: u32,
    error: f64,
    /// Index of the fit; `None` for the original.
    fit: Option<usize>,
    sides: u32,
    two_faces: bool,
}

impl Candidate {
    fn original(triangles: u32) -> Self {
        Self {
            triangles,
            error: 0.0,
            fit: None,
            sides: 0,
            two_faces: false,
        }
    }

    fn option(self, fits: &[Fit]) -> WoodOption {
        let shape = match self.fit {
            None => Shape::Original,
            Some(index) => Shape::Tube {
                sides: self.sides,
                rings: fits[index].rings.clone(),
                two_faces: self.two_faces,
            },
        };
        WoodOption {
            triangles: self.triangles,
            error: self.error,
            shape,
        }
    }
}

/// Adds a fit as tubes of all numbers of sides, and as a ribbon.
fn offer(options: &mut Vec<Candidate>, fit: &Fit, index: usize, pointed: bool, double_sided: bool) {
    let segments = fit.rings.len() as u32 - 1;
    for sides in [2, 3, 4, 5, 6, 8] {
        let ribbon = sides == 2;
        let two_faces = ribbon && !double_sided;
        // A pointed tip has triangles where the others have quads.
        let quads = 2 * segments - u32::from(pointed);
        let width = match (ribbon, two_faces) {
            (true, false) => 1,
            (true, true) => 2,
            _ => sides,
        };
        let error = match ribbon {
            true => fit.flat,
            false => fit.displacement + polygon_deviation(sides) * fit.roundness,
        };
        options.push(Candidate {
            triangles: width * quads,
            error: error / 2.0,
            fit: Some(index),
            sides,
            two_faces,
        });
    }
}

/// Mean squared difference between the radius of a regular polygon and that of the circle with
/// the same perimeter, whose radius is one.
///
/// With x = pi/k the polygon's radius at angle a from the middle of a side is c / cos a,
/// c = x / tan x; the mean of (c / cos a - 1)^2 over 0..x is c + 1 - 2 c asinh(tan x) / x.
pub(super) fn polygon_deviation(sides: u32) -> f64 {
    let x = PI / f64::from(sides);
    let c = x / x.tan();
    c + 1.0 - 2.0 * c * x.tan().asinh() / x
}

/// Numbers of segments to try: all small ones, then in steps of about a third.
fn segment_counts(most: usize) -> Vec<usize> {
    let mut counts = Vec::new();
    let mut count = 1;
    while count < most {
        counts.push(count);
        count += (count / 3).max(1);
    }
    counts.push(most);
    counts
}

/// The points that are left when `segments` segments are.
fn last_removed(points: usize, order: &[u32], segments: usize) -> Vec<u32> {
    let mut knots = order[order.len() - (segments - 1)..].to_vec();
    knots.extend([0, points as u32 - 1]);
    knots.sort_unstable();
    knots
}

/// The lower convex hull, fewest triangles first.
fn lower_hull(mut options: Vec<Candidate>) -> Vec<Candidate> {
    options.sort_by(|a, b| {
        let key = |o: &Candidate| (o.triangles, o.fit);
        a.triangles
            .cmp(&b.triangles)
            .then(a.error.total_cmp(&b.error))
            .then(key(a).cmp(&key(b)))
    });
    let mut hull: Vec<Candidate> = Vec::new();
    for option in options {
        match hull.last() {
            Some(last) if last.error <= option.error => continue,
            _ => {}
        }
        while let [.., a, b] = hull[..]
            && slope(&a, &b) <= slope(&b, &option)
        {
            hull.pop();
        }
        hull.push(option);
    }
    hull
}

/// Error saved for each triangle between two options.
fn slope(a: &Candidate, b: &Candidate) -> f64 {
    (a.error - b.error) / f64::from(b.triangles - a.triangles)
}

/// Leaves out the options that bend the hull least until few enough are left.
fn thin_out(mut hull: Vec<Candidate>) -> Vec<Candidate> {
    while hull.len() > MOST_OPTIONS {
        let bend = |i: usize| slope(&hull[i - 1], &hull[i]) / slope(&hull[i], &hull[i + 1]);
        let weakest = (1..hull.len() - 1)
            .min_by(|&a, &b| bend(a).total_cmp(&bend(b)))
            .unwrap_or(1);
        hull.remove(weakest);
    }
    hull
}
