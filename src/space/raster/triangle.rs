//! One triangle on the sample grid: which samples are inside, and how values vary over it.
//!
//! Edge functions after Pineda ("A parallel algorithm for polygon rasterization", SIGGRAPH 1988)
//! in integers, with the top-left rule: of two triangles that share an edge exactly one owns each
//! sample on it, so a closed mesh has neither holes nor double hits.

use super::camera::{Corner, SUBSAMPLES};

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
    #[cfg(test)]
    pub fn new(at: f32, [dx, dy]: [f32; 2], [x0, y0]: [f32; 2]) -> Self {
        Self { at, dx, dy, x0, y0 }
    }

    /// The column of the corner from which it is counted: one for all planes of a triangle.
    #[inline]
    pub fn x0(&self) -> f32 {
        self.x0
    }

    pub fn value(&self, x: i32, y: i32) -> f32 {
        self.left(y) + self.across(x)
    }

    /// At a place between samples.
    #[inline]
    pub fn at(&self, [x, y]: [f32; 2]) -> f32 {
        self.at + self.dy * (y - self.y0) + self.dx * (x - self.x0)
    }

    /// The part of a row's values that is the same in all of it.
    #[inline]
    pub fn left(&self, y: i32) -> f32 {
        self.at + self.dy * (y as f32 - self.y0)
    }

    /// What a column adds to [`Self::left`].
    #[inline]
    pub fn across(&self, x: i32) -> f32 {
        self.dx * (x as f32 - self.x0)
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

    /// The ends of its edges, the inner side to the right of each.
    pub fn sides(&self) -> [(&Corner, &Corner); 3] {
        let [a, b, c] = &self.corners;
        [(a, b), (b, c), (c, a)]
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
}

/// The place of a pixel's only sample.
pub(super) const CENTER: [[i32; 2]; 1] = [[SUBSAMPLES / 2; 2]];

fn cross(a: &Corner, b: &Corner, c: &Corner) -> i64 {
    let (bx, by) = ((b.x - a.x) as i64, (b.y - a.y) as i64);
    let (cx, cy) = ((c.x - a.x) as i64, (c.y - a.y) as i64);
    bx * cy - by * cx
}
