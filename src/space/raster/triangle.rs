//! One triangle on the sample grid: which samples are inside, and how values vary over it.
//!
//! Edge functions after Pineda ("A parallel algorithm for polygon rasterization", SIGGRAPH 1988)
//! in integers, with the top-left rule: of two triangles that share an edge exactly one owns each
//! sample on it, so a closed mesh has neither holes nor double hits.

use super::camera::{Corner, SUBSAMPLES};
use super::pane::Pane;

/// A triangle ready to be scanned; corners run clockwise on the screen (y down).
pub(super) struct Triangle {
    corners: [Corner; 3],
    /// Which corner of the model's triangle each corner is.
    order: [usize; 3],
    /// Twice the area in sub-samples, positive.
    area2: i64,
    /// Whether its front is seen.
    pub front: bool,
}

/// The value of a quantity at any sample: `at + dx * x + dy * y`.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plane {
    at: f32,
    /// Change from a sample to its right neighbour.
    pub dx: f32,
    /// Change from a sample to the one below.
    pub dy: f32,
    x0: f32,
    y0: f32,
}

impl Plane {
    pub fn value(&self, x: i32, y: i32) -> f32 {
        self.row(y).value(x)
    }

    /// At a place between samples.
    #[inline]
    pub fn at(&self, [x, y]: [f32; 2]) -> f32 {
        self.at + self.dy * (y - self.y0) + self.dx * (x - self.x0)
    }

    /// The values of a row.
    pub fn row(&self, y: i32) -> Row {
        Row {
            at: self.at + self.dy * (y as f32 - self.y0),
            dx: self.dx,
            x0: self.x0,
        }
    }
}

impl Plane {
    /// No less than any value in a square with so many samples along an edge from `x`, `y` on.
    #[inline]
    pub fn highest(&self, [x, y]: [i32; 2], edge: i32) -> f32 {
        let across = self.dx * (x as f32 - self.x0);
        let down = self.dy * (y as f32 - self.y0);
        let within = (self.dx.max(0.0) + self.dy.max(0.0)) * (edge - 1) as f32;
        // Each of these terms, and so the sum, is rounded.
        let size = self.at.abs() + across.abs() + down.abs() + within;
        self.at + across + down + within + size * 4.0 * f32::EPSILON
    }
}

/// A [`Plane`] along one row of samples.
#[derive(Clone, Copy)]
pub(super) struct Row {
    pub at: f32,
    /// Change from a sample to the next.
    pub dx: f32,
    pub x0: f32,
}

impl Row {
    #[inline]
    pub fn value(&self, x: i32) -> f32 {
        self.at + self.dx * (x as f32 - self.x0)
    }
}

impl Triangle {
    /// `None`: empty after snapping, a back face that is culled, or outside.
    pub fn new(corners: [Corner; 3], double_sided: bool) -> Option<Self> {
        let [a, b, c] = corners;
        if a.is_outside() || b.is_outside() || c.is_outside() {
            return None;
        }
        let area2 = cross(&a, &b, &c);
        // Counter-clockwise in a space with y up is negative here, where y is down.
        let front = area2 < 0;
        if area2 == 0 || !(front || double_sided) {
            return None;
        }
        let (corners, order) = if front {
            ([a, c, b], [0, 2, 1])
        } else {
            (corners, [0, 1, 2])
        };
        Some(Self {
            corners,
            order,
            area2: area2.abs(),
            front,
        })
    }

    /// How a quantity with these values at the model's corners varies over the screen.
    pub fn plane(&self, values: [f32; 3]) -> Plane {
        let [a, b, c] = &self.corners;
        let [fa, fb, fc] = self.order.map(|i| values[i]);
        let (bx, by) = ((b.x - a.x) as f32, (b.y - a.y) as f32);
        let (cx, cy) = ((c.x - a.x) as f32, (c.y - a.y) as f32);
        let per_area = SUBSAMPLES as f32 / self.area2 as f32;
        let grain = 1.0 / SUBSAMPLES as f32;
        Plane {
            at: fa,
            dx: ((fb - fa) * cy - (fc - fa) * by) * per_area,
            dy: ((fc - fa) * bx - (fb - fa) * cx) * per_area,
            x0: a.x as f32 * grain - 0.5,
            y0: a.y as f32 * grain - 0.5,
        }
    }

    /// The plane of [`Corner::near`].
    pub fn near_plane(&self, corners: [Corner; 3]) -> Plane {
        self.plane(corners.map(|c| c.near))
    }

    /// The first and last column, and row, of a pane that may have samples inside, if any.
    pub fn reach(&self, pane: &Pane) -> Option<[[i32; 2]; 2]> {
        reach(&self.corners, pane, CENTER)
    }

    /// Calls `span(y, from, to)` for every row with samples `from..to` inside.
    pub fn scan(&self, pane: &Pane, mut span: impl FnMut(i32, i32, i32)) {
        self.rows(pane, CENTER, |y, row| {
            let [(from, to)] = row.spans();
            if from < to {
                span(y, from, to);
            }
        });
    }

    /// Calls `row(y, ..)` for every row of a pane that the triangle may reach, with samples at several
    /// `places` of each pixel, in sub-samples from its left upper corner. Who needs nothing of a row
    /// does not ask for its spans, and saves most of what it costs.
    pub fn rows<const N: usize>(
        &self,
        pane: &Pane,
        places: [[i32; 2]; N],
        mut row: impl FnMut(i32, &mut Spans<N>),
    ) {
        let Some([x, [y0, y1]]) = reach(&self.corners, pane, places) else {
            return;
        };
        let mut spans = Spans {
            triangle: self,
            x,
            y: [y0, y0],
            places,
            edges: None,
        };
        for y in y0..=y1 {
            spans.y[1] = y;
            row(y, &mut spans);
        }
    }
}

/// The first and last column, and row, of a pane that may have samples inside; `None` where none
/// has.
pub(super) fn reach<const N: usize>(
    corners: &[Corner; 3],
    pane: &Pane,
    places: [[i32; 2]; N],
) -> Option<[[i32; 2]; 2]> {
    let [a, b, c] = corners;
    if a.is_outside() || b.is_outside() || c.is_outside() {
        return None;
    }
    let ends = |axis: usize, values: [i32; 3], [first, end]: [i32; 2]| {
        let low = values[0].min(values[1]).min(values[2]);
        let high = values[0].max(values[1]).max(values[2]);
        // Whole numbers k with low <= 256 k + place <= high, of all places.
        let most = places.iter().fold(i32::MIN, |m, p| m.max(p[axis]));
        let least = places.iter().fold(i32::MAX, |m, p| m.min(p[axis]));
        let from = (low - most + SUBSAMPLES - 1).div_euclid(SUBSAMPLES);
        let to = (high - least).div_euclid(SUBSAMPLES);
        [from.max(first), to.min(end - 1)]
    };
    let x = ends(0, [a.x, b.x, c.x], pane.x);
    let y = ends(1, [a.y, b.y, c.y], pane.y);
    (x[0] <= x[1] && y[0] <= y[1]).then_some([x, y])
}

/// Whether any sample may be inside, each of several places of a pixel asked for itself.
pub(super) fn may_hit<const N: usize>(corners: &[Corner; 3], places: [[i32; 2]; N]) -> bool {
    let [a, b, c] = corners;
    let (x0, x1) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
    let (y0, y1) = (a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y));
    // Whether there is a whole number k with low <= 256 k + place <= high.
    let between = |low: i32, high: i32, place: i32| {
        high.saturating_sub(place).div_euclid(SUBSAMPLES)
            > low.saturating_sub(place + 1).div_euclid(SUBSAMPLES)
    };
    places
        .iter()
        .any(|&[x, y]| between(x0, x1, x) && between(y0, y1, y))
}

/// A row of a triangle with `N` samples a pixel.
pub(super) struct Spans<'t, const N: usize> {
    triangle: &'t Triangle,
    /// First and last pixel that may be inside.
    x: [i32; 2],
    /// The triangle's first row, and this one.
    y: [i32; 2],
    places: [[i32; 2]; N],
    /// At the first pixel of the first row; made on first use.
    edges: Option<[[Edge; 3]; N]>,
}

impl<const N: usize> Spans<'_, N> {
    /// The pixels `from..to` outside of which nothing is inside.
    #[inline]
    pub fn reach(&self) -> [i32; 2] {
        [self.x[0], self.x[1] + 1]
    }

    /// For each place the pixels `from..to` whose sample there is inside; equal ends: none.
    #[inline]
    pub fn spans(&mut self) -> [(i32, i32); N] {
        let ([x0, x1], [y0, y]) = (self.x, self.y);
        let (triangle, places) = (self.triangle, self.places);
        let edges = self
            .edges
            .get_or_insert_with(|| triangle.edges([x0, y0].map(|o| o * SUBSAMPLES), places));
        let below = (y - y0) as i64;
        std::array::from_fn(|i| {
            let edges = edges[i].map(|edge| Edge {
                value: edge.value + below * edge.down,
                ..edge
            });
            let (from, to) = if x1 - x0 < SHORT_ROW {
                step_row(&edges, x1 - x0)
            } else {
                solve_row(&edges, x1 - x0)
            };
            (x0 + from, x0 + to)
        })
    }
}

impl Triangle {
    /// The edges at each place of a pixel.
    fn edges<const N: usize>(&self, [x, y]: [i32; 2], places: [[i32; 2]; N]) -> [[Edge; 3]; N] {
        let [a, b, c] = &self.corners;
        let at_corner = [(a, b), (b, c), (c, a)].map(|(from, to)| Edge::new(from, to, [x, y]));
        places.map(|[px, py]| at_corner.map(|edge| edge.moved(px, py)))
    }
}

/// The place of a pixel's only sample.
pub(super) const CENTER: [[i32; 2]; 1] = [[SUBSAMPLES / 2; 2]];

/// Rows shorter than this are stepped through; longer ones are solved for their ends.
const SHORT_ROW: i32 = 4;

fn cross(a: &Corner, b: &Corner, c: &Corner) -> i64 {
    let (bx, by) = ((b.x - a.x) as i64, (b.y - a.y) as i64);
    let (cx, cy) = ((c.x - a.x) as i64, (c.y - a.y) as i64);
    bx * cy - by * cx
}

/// An edge function: not negative on the inner side.
#[derive(Clone, Copy)]
struct Edge {
    value: i64,
    right: i64,
    down: i64,
    /// One over the size of `right`.
    per_right: f64,
}

impl Edge {
    /// At a point in sub-samples.
    fn new(from: &Corner, to: &Corner, [x, y]: [i32; 2]) -> Self {
        let (dx, dy) = ((to.x - from.x) as i64, (to.y - from.y) as i64);
        let grain = SUBSAMPLES as i64;
        let (px, py) = (x as i64 - from.x as i64, y as i64 - from.y as i64);
        // A sample on the edge itself belongs to the triangle whose top or left edge it is.
        let owns = dy < 0 || (dy == 0 && dx > 0);
        let right = -dy * grain;
        Self {
            value: dx * py - dy * px - if owns { 0 } else { 1 },
            right,
            down: dx * grain,
            per_right: 1.0 / right.abs() as f64,
        }
    }

    /// The same edge at a place so many sub-samples to the right and below.
    fn moved(self, x: i32, y: i32) -> Self {
        let grain = SUBSAMPLES as i64;
        Self {
            value: self.value + (self.down / grain) * y as i64 + (self.right / grain) * x as i64,
            ..self
        }
    }

    /// The first step to the right that is inside, where `right` is positive.
    fn enters(&self) -> i64 {
        if self.value >= 0 {
            return 0;
        }
        // A multiplication that is off by less than one, then put right.
        let steps = (-self.value as f64 * self.per_right) as i64;
        steps + i64::from(steps.saturating_mul(self.right) < -self.value)
    }

    /// The last step to the right that is inside, where `right` is negative; -1 if none is.
    fn leaves(&self) -> i64 {
        if self.value < 0 {
            return -1;
        }
        let steps = (self.value as f64 * self.per_right) as i64;
        let (over, next) = (
            steps.saturating_mul(-self.right),
            (steps + 1).saturating_mul(-self.right),
        );
        steps - i64::from(over > self.value) + i64::from(next <= self.value)
    }
}

/// The samples `from..to` of a row that are inside, by trying each one.
fn step_row(edges: &[Edge; 3], last: i32) -> (i32, i32) {
    let [mut a, mut b, mut c] = edges.map(|e| e.value);
    let (mut from, mut to) = (0, 0);
    for x in 0..=last {
        if (a | b | c) >= 0 {
            if to == 0 {
                from = x;
            }
            to = x + 1;
        } else if to > 0 {
            break;
        }
        a += edges[0].right;
        b += edges[1].right;
        c += edges[2].right;
    }
    (from, to)
}

/// The samples `from..to` of a row that are inside, by solving for both ends.
fn solve_row(edges: &[Edge; 3], last: i32) -> (i32, i32) {
    let (mut from, mut to) = (0i64, last as i64);
    for edge in edges {
        if edge.right > 0 {
            from = from.max(edge.enters());
        } else if edge.right < 0 {
            to = to.min(edge.leaves());
        } else if edge.value < 0 {
            return (0, 0);
        }
    }
    if from <= to {
        (from as i32, to as i32 + 1)
    } else {
        (0, 0)
    }
}
