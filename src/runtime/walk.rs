//! The way over the integer grid from one cell to another, and what it sums up.

use glam::IVec3;

use super::cells::Cells;

/// How cells along the way add up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Law {
    /// Equation 4 as printed: `OP = sum_j rho_j prod_{k<j} t_k` with `t = (1 - rho) exp(-length /
    /// longest cell diagonal)`, the node's own cell included.
    ///
    /// Read closely it says that a long way through a cell makes what comes *behind* count less, even
    /// where the cell is empty, so that a wall behind air hides little, and that a node is hidden by
    /// its own cell even from the front.
    Equation4,
    /// What the text means ("cells that include longer portions contribute more"): a cell lets
    /// `(1 - rho)^(length / edge)` pass (Beer's law) and `OP = 1 - prod_{k<i} t_k`; the node's own cell
    /// doesn't hide it. Empty cells hide nothing, a solid one everything behind it.
    #[default]
    Beer,
}

/// Share of a cell by which a crossing may miss the grid's edge: rounding, a million cells away.
const ROUNDING: f64 = 1e-8;

/// Walks from one cell's middle to another's and returns the occlusion probability there.
pub(super) fn walk(cells: &Cells, from: IVec3, to: IVec3, law: Law, clumping: f32) -> f32 {
    let way = to - from;
    let length = (way.as_vec3() * cells.edge()).length();
    let unit = match law {
        Law::Equation4 => cells.edge().length(),
        Law::Beer => cells.edge().element_sum() / 3.0,
    };
    let Some(enter) = entry(cells, from, way) else {
        return 0.0;
    };
    let crossings = Crossings::new(cells, from, way, enter);
    let portion = f64::from(length / unit);
    match law {
        Law::Equation4 => {
            let (mut hidden, mut passing) = (0.0f32, 1.0f32);
            crossings.each(|cell, share, _| {
                let rho = cells.solidity().get(cell).copied().unwrap_or(0.0);
                hidden += rho * passing;
                passing *= (1.0 - rho) * (-(portion * share) as f32).exp();
                passing > 0.0
            });
            hidden.clamp(0.0, 1.0)
        }
        Law::Beer => {
            // What is behind so much is hidden but for less than f32 can tell from all.
            let enough = 17.5 / clumping;
            let mut depth = 0.0f32;
            crossings.each(|cell, share, last| {
                let extinction = cells.extinction().get(cell).copied().unwrap_or(0.0);
                if !last && extinction > 0.0 {
                    depth += extinction * (portion * share) as f32;
                }
                depth < enough
            });
            (1.0 - (-depth * clumping).exp()).clamp(0.0, 1.0)
        }
    }
}

/// The cells between the middles of two, in order.
///
/// Crossing number k of an axis lies at the share (2 k + 1) / (2 steps) of the way. Shares are
/// compared as whole numbers, over the common denominator: ties at corners are ties.
struct Crossings {
    /// Cell, the last one, and how far the next one along each axis is in the list of cells.
    cell: i64,
    last: i64,
    stride: [i64; 3],
    /// The next crossing of each axis, and how far apart they are, over the denominator.
    next: [i64; 3],
    apart: [i64; 3],
    denominator: i64,
    /// Share of the way at which the first cell is entered.
    enter: f64,
}

impl Crossings {
    /// `enter`: the share of the way at which the grid begins.
    fn new(cells: &Cells, from: IVec3, way: IVec3, enter: f64) -> Self {
        let steps = way.abs();
        let count = [0, 1, 2].map(|axis| i64::from(steps[axis].max(1)));
        let others = [
            count[1] * count[2],
            count[0] * count[2],
            count[0] * count[1],
        ];
        let mut taken = IVec3::ZERO;
        for axis in 0..3 {
            // Crossings up to where the grid begins are taken in one leap.
            let past = (enter * f64::from(steps[axis]) + 0.5 + ROUNDING).floor() as i32;
            taken[axis] = past.clamp(0, steps[axis]);
        }
        let size = cells.count();
        let stride = [1, size.x, size.x * size.y];
        let index = |cell: IVec3| i64::from(cell.dot(IVec3::from(stride)));
        Self {
            cell: index(from + way.signum() * taken),
            last: index(from + way),
            stride: [0, 1, 2].map(|axis| i64::from(stride[axis] * way[axis].signum())),
            next: [0, 1, 2].map(|axis| match steps[axis] {
                0 => i64::MAX,
                _ => (2 * i64::from(taken[axis]) + 1) * others[axis],
            }),
            apart: others.map(|o| 2 * o),
            denominator: 2 * count[0] * others[0],
            enter,
        }
    }

    /// Calls `act` with each cell, its share of the way, and whether it is the last, until it says no.
    #[inline]
    fn each(mut self, mut act: impl FnMut(usize, f64, bool) -> bool) {
        let unit = 1.0 / self.denominator as f64;
        let mut at = self.enter;
        loop {
            let end = self.next[0].min(self.next[1]).min(self.next[2]);
            // Rounding may miss a last cell at the grid's edge, but not the end of the way.
            let last = self.cell == self.last || end >= self.denominator;
            let share = if last { 1.0 } else { end as f64 * unit };
            if !act(self.cell as usize, (share - at).max(0.0), last) || last {
                return;
            }
            at = share;
            // Without branches: which axis is crossed next can't be foretold.
            for axis in 0..3 {
                let crossed = -i64::from(self.next[axis] <= end);
                self.cell += self.stride[axis] & crossed;
                self.next[axis] += self.apart[axis] & crossed;
            }
        }
    }
}

/// Share of the way from one cell's middle to another's at which it enters the grid; `None` where it
/// ends before.
fn entry(cells: &Cells, from: IVec3, way: IVec3) -> Option<f64> {
    let mut enter = 0.0f64;
    for axis in 0..3 {
        let (low, high) = (-0.5, f64::from(cells.count()[axis]) - 0.5);
        let (start, step) = (f64::from(from[axis]), f64::from(way[axis]));
        let outside = if start < low {
            low - start
        } else {
            high - start
        };
        if start < low || start > high {
            if step == 0.0 {
                return None;
            }
            enter = enter.max(outside / step);
        }
    }
    (enter <= 1.0).then_some(enter.max(0.0))
}
