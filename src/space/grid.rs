//! A uniform grid over points: nearest neighbours in about O(n) for points spread like leaves.

use glam::{IVec3, Vec3};
use rayon::prelude::*;

/// Points sorted into cubic cells.
pub struct PointGrid<'a> {
    points: &'a [Vec3],
    low: Vec3,
    cell: f32,
    size: IVec3,
    /// Start of each cell in `order`, one more than cells.
    start: Vec<u32>,
    order: Vec<u32>,
}

/// Most cells a side, so that one far point can't make a grid of billions.
const MAX_SIDE: i32 = 128;

impl<'a> PointGrid<'a> {
    /// Sorts points into cells that hold about `per_cell` points each.
    pub fn new(points: &'a [Vec3], per_cell: f32) -> Self {
        let low = points.iter().fold(Vec3::MAX, |a, &p| a.min(p));
        let high = points.iter().fold(Vec3::MIN, |a, &p| a.max(p));
        let extent = if points.is_empty() {
            Vec3::ONE
        } else {
            (high - low).max(Vec3::splat(1e-6))
        };
        let low = if points.is_empty() { Vec3::ZERO } else { low };
        let volume = f64::from(extent.x) * f64::from(extent.y) * f64::from(extent.z);
        let mut wanted = (volume * f64::from(per_cell) / points.len().max(1) as f64).cbrt() as f32;
        let least = extent.max_element() / MAX_SIDE as f32;
        let mut grid = Self::binned(points, low, extent, wanted.max(least));
        // Leaves crowd on twigs and leave most of the box empty: smaller cells, until a point
        // finds about the wanted number in its own.
        for _ in 0..3 {
            let crowd = grid.crowd();
            if crowd <= 3.0 * per_cell || wanted <= least {
                break;
            }
            wanted *= (per_cell / crowd).cbrt();
            grid = Self::binned(points, low, extent, wanted.max(least));
        }
        grid
    }

    /// Points that share a point's cell, in the mean over all points.
    fn crowd(&self) -> f32 {
        let squares = self.start.windows(2).map(|w| u64::from(w[1] - w[0]).pow(2));
        squares.sum::<u64>() as f32 / self.points.len().max(1) as f32
    }

    fn binned(points: &'a [Vec3], low: Vec3, extent: Vec3, cell: f32) -> Self {
        let size = (extent / cell)
            .floor()
            .as_ivec3()
            .min(IVec3::splat(MAX_SIDE - 1))
            + 1;
        let mut grid = Self {
            points,
            low,
            cell,
            size,
            start: Vec::new(),
            order: vec![0; points.len()],
        };
        let cells: Vec<u32> = points
            .iter()
            .map(|&p| grid.index(grid.cell_of(p)))
            .collect();
        let mut start = vec![0u32; (size.x * size.y * size.z) as usize + 1];
        for &c in &cells {
            start[c as usize + 1] += 1;
        }
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        let mut next = start.clone();
        for (i, &c) in cells.iter().enumerate() {
            grid.order[next[c as usize] as usize] = i as u32;
            next[c as usize] += 1;
        }
        grid.start = start;
        grid
    }

    fn cell_of(&self, p: Vec3) -> IVec3 {
        let c = ((p - self.low) / self.cell).floor().as_ivec3();
        c.clamp(IVec3::ZERO, self.size - 1)
    }

    fn index(&self, c: IVec3) -> u32 {
        ((c.z * self.size.y + c.y) * self.size.x + c.x) as u32
    }

    fn in_cell(&self, c: IVec3) -> &[u32] {
        let i = self.index(c) as usize;
        &self.order[self.start[i] as usize..self.start[i + 1] as usize]
    }

    /// The `count` points nearest to `from` (ties by index), without `skip`, nearest first.
    pub fn nearest(&self, from: Vec3, count: usize, skip: Option<u32>) -> Vec<u32> {
        let middle = self.cell_of(from);
        let mut found: Vec<(f32, u32)> = Vec::with_capacity(count * 4);
        for ring in 0..=self.size.max_element() {
            self.visit_ring(middle, ring, |i| {
                if Some(i) != skip {
                    found.push((self.points[i as usize].distance_squared(from), i));
                }
            });
            // A cell `ring` away may hold points nearer than those of the corner of this ring.
            let safe = ring as f32 * self.cell;
            if found.len() >= count && found.iter().filter(|f| f.0 <= safe * safe).count() >= count
            {
                break;
            }
        }
        let order = |a: &(f32, u32), b: &(f32, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if found.len() > count && count > 0 {
            found.select_nth_unstable_by(count - 1, order);
        }
        found.truncate(count);
        found.sort_unstable_by(order);
        // Not collected in place: that would keep the room of all that was looked at.
        let mut nearest = Vec::with_capacity(found.len());
        nearest.extend(found.iter().map(|f| f.1));
        nearest
    }

    fn visit_ring(&self, middle: IVec3, ring: i32, mut visit: impl FnMut(u32)) {
        let low = (middle - ring).max(IVec3::ZERO);
        let high = (middle + ring).min(self.size - 1);
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                let inside = (z - middle.z).abs() < ring && (y - middle.y).abs() < ring;
                let mut x = low.x;
                while x <= high.x {
                    if inside && (x - middle.x).abs() < ring {
                        // Jump over the inner cube, which earlier rings have visited.
                        x = middle.x + ring;
                        continue;
                    }
                    for &i in self.in_cell(IVec3::new(x, y, z)) {
                        visit(i);
                    }
                    x += 1;
                }
            }
        }
    }
}

/// For each point its `count` nearest others, nearest first.
pub fn nearest_neighbours(points: &[Vec3], count: usize) -> Vec<Vec<u32>> {
    let grid = PointGrid::new(points, 4.0);
    (0..points.len())
        .into_par_iter()
        .map(|i| grid.nearest(points[i], count, Some(i as u32)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_neighbours_equal_a_full_search() {
        let mut seed = 7u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / (1 << 24) as f32
        };
        let points: Vec<Vec3> = (0..500)
            .map(|_| Vec3::new(random(), random() * 0.2, random() * random()))
            .collect();
        for (i, near) in nearest_neighbours(&points, 6).iter().enumerate() {
            let mut all: Vec<u32> = (0..500).filter(|&j| j != i as u32).collect();
            all.sort_by(|&a, &b| {
                let d = |j: u32| points[j as usize].distance_squared(points[i]);
                d(a).total_cmp(&d(b)).then(a.cmp(&b))
            });
            assert_eq!(near[..], all[..6], "point {i}");
        }
    }

    #[test]
    fn coincident_points_and_few_points_have_an_answer() {
        assert_eq!(
            nearest_neighbours(&[Vec3::ONE; 3], 5),
            [[1, 2], [0, 2], [0, 1]]
        );
        assert_eq!(nearest_neighbours(&[], 5).len(), 0);
    }
}
