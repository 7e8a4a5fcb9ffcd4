//! A uniform grid whose cells know how solid they are.

use glam::{IVec3, Vec3};

/// A grid over a tree or a forest; each cell has a solidity of 0 (rays pass) to 1 (none does).
#[derive(Clone, Debug, PartialEq)]
pub struct Cells {
    low: Vec3,
    edge: Vec3,
    per_edge: Vec3,
    count: IVec3,
    solidity: Vec<f32>,
    /// `-ln(1 - solidity)`: infinite where nothing passes.
    extinction: Vec<f32>,
}

/// Most cells along a side.
const MAX_COUNT: i32 = 1024;

impl Cells {
    /// An empty grid over a box: `count` cells along each side (at least one).
    pub fn new(low: Vec3, high: Vec3, count: [u32; 3]) -> Self {
        let count = IVec3::from_array(count.map(|c| (c.min(MAX_COUNT as u32) as i32).max(1)));
        let extent = (high - low).max(Vec3::splat(1e-6));
        let all = (count.x * count.y * count.z) as usize;
        let edge = extent / count.as_vec3();
        Self {
            low,
            edge,
            per_edge: edge.recip(),
            count,
            solidity: vec![0.0; all],
            extinction: vec![0.0; all],
        }
    }

    /// An empty grid of about cubic cells, `longest` of them along the longest side of the box.
    pub fn cubic(low: Vec3, high: Vec3, longest: u32) -> Self {
        let extent = (high - low).max(Vec3::splat(1e-6));
        let edge = extent.max_element() / longest.max(1) as f32;
        let count = (extent / edge - 1e-3).ceil().max(Vec3::ONE);
        Self::new(low, high, count.to_array().map(|c| c as u32))
    }

    /// Cells along each side.
    #[inline]
    pub fn count(&self) -> IVec3 {
        self.count
    }

    /// Edges of a cell.
    pub fn edge(&self) -> Vec3 {
        self.edge
    }

    /// The lowest corner of the grid.
    pub fn low(&self) -> Vec3 {
        self.low
    }

    /// Solidities, x fastest, z slowest.
    pub fn solidity(&self) -> &[f32] {
        &self.solidity
    }

    /// Sets a cell's solidity, clamped to 0..1; not a number counts as 0.
    pub fn set(&mut self, cell: IVec3, solidity: f32) {
        if let Some(index) = self.index(cell) {
            self.set_index(index, solidity);
        }
    }

    /// As [`Cells::set`], by the place in [`Cells::solidity`].
    pub(crate) fn set_index(&mut self, index: usize, solidity: f32) {
        let known = if solidity.is_nan() { 0.0 } else { solidity };
        self.solidity[index] = known.clamp(0.0, 1.0);
        self.extinction[index] = -(1.0 - self.solidity[index]).ln();
    }

    /// Where a cell is in [`Cells::solidity`]; `None` outside.
    #[inline]
    pub fn index(&self, cell: IVec3) -> Option<usize> {
        let inside = cell.cmpge(IVec3::ZERO).all() && cell.cmplt(self.count).all();
        inside.then(|| ((cell.z * self.count.y + cell.y) * self.count.x + cell.x) as usize)
    }

    /// The cell that a point is in, also outside the grid.
    #[inline]
    pub fn cell_of(&self, point: Vec3) -> IVec3 {
        // `floor` is a call into the C library on plain x86-64.
        let at = (point - self.low) * self.per_edge;
        let cut = at.as_ivec3();
        cut.saturating_sub(IVec3::from(at.cmplt(cut.as_vec3())))
    }

    /// Middle of a cell.
    pub fn middle(&self, cell: IVec3) -> Vec3 {
        self.low + (cell.as_vec3() + 0.5) * self.edge
    }

    pub(super) fn solidity_at(&self, cell: IVec3) -> f32 {
        self.index(cell).map_or(0.0, |i| self.solidity[i])
    }

    /// `-ln(1 - solidity)` of each cell, as [`Cells::solidity`].
    pub(super) fn extinction(&self) -> &[f32] {
        &self.extinction
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_about_cubic_and_cover_the_box() {
        let cells = Cells::cubic(Vec3::ZERO, Vec3::new(10.0, 4.9, 0.0), 5);
        assert_eq!(cells.count(), IVec3::new(5, 3, 1));
        assert_eq!(cells.cell_of(Vec3::new(9.9, 4.8, 0.0)), IVec3::new(4, 2, 0));
        assert_eq!(cells.index(IVec3::new(5, 0, 0)), None);
        assert_eq!(cells.index(IVec3::new(1, 1, 0)), Some(6));
    }
}
