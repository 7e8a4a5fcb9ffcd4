//! Nearest pieces of branches: a uniform grid over tapered segments.

use glam::{IVec3, Vec3};

/// A piece of a branch between two nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Centres of both ends.
    pub ends: [Vec3; 2],
    /// Radii at both ends.
    pub radii: [f32; 2],
    /// The chain that it is part of.
    pub chain: u32,
    /// Its number in the chain: it joins nodes `index` and `index + 1`.
    pub index: u32,
}

/// Where a point lies relative to a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Distance from the centre line.
    pub distance: f32,
    /// Radius of the branch there.
    pub radius: f32,
    /// Place along the segment, 0 to 1.
    pub along: f32,
}

impl Contact {
    /// Distance outside the surface; 0 inside.
    pub fn gap(&self) -> f32 {
        (self.distance - self.radius).max(0.0)
    }
}

impl Segment {
    /// The point of the centre line that is nearest to `p`.
    pub fn contact(&self, p: Vec3) -> Contact {
        let d = self.ends[1] - self.ends[0];
        let square = d.length_squared();
        let along = if square > 0.0 {
            ((p - self.ends[0]).dot(d) / square).clamp(0.0, 1.0)
        } else {
            0.0
        };
        Contact {
            distance: p.distance(self.ends[0] + d * along),
            radius: self.radii[0] + (self.radii[1] - self.radii[0]) * along,
            along,
        }
    }
}

/// Segments sorted into cells that their surfaces may touch.
#[derive(Clone, Debug)]
pub struct Grid {
    /// All segments.
    pub segments: Vec<Segment>,
    low: Vec3,
    cell: f32,
    size: IVec3,
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Grid {
    /// About two cells a segment.
    pub fn new(segments: Vec<Segment>) -> Self {
        let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
        for end in segments.iter().flat_map(|s| s.ends) {
            (low, high) = (low.min(end), high.max(end));
        }
        if segments.is_empty() {
            (low, high) = (Vec3::ZERO, Vec3::ZERO);
        }
        let extent = (high - low).max(Vec3::splat(1e-4));
        let wanted = (segments.len() as f32 * 2.0).clamp(1.0, 4e6);
        let cell = (extent.x * extent.y * extent.z / wanted)
            .cbrt()
            .max(extent.max_element() / 256.0);
        let size = (extent / cell).ceil().as_ivec3().max(IVec3::ONE);
        let mut grid = Self {
            segments,
            low,
            cell,
            size,
            starts: Vec::new(),
            items: Vec::new(),
        };
        grid.fill();
        grid
    }

    /// Edge of a cell.
    pub fn cell(&self) -> f32 {
        self.cell
    }

    fn fill(&mut self) {
        let cells = (self.size.x * self.size.y * self.size.z) as usize;
        let mut starts = vec![0u32; cells + 1];
        for s in &self.segments {
            self.each_cell(s, |c| starts[c + 1] += 1);
        }
        for i in 0..cells {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts[cells] as usize];
        for (index, s) in self.segments.iter().enumerate() {
            self.each_cell(s, |c| {
                items[next[c] as usize] = index as u32;
                next[c] += 1;
            });
        }
        (self.starts, self.items) = (starts, items);
    }

    /// The cells that a segment's surface may touch: boxes along the segment, so that a long
    /// slanted one does not fill the whole grid.
    fn each_cell(&self, s: &Segment, mut visit: impl FnMut(usize)) {
        let radius = s.radii[0].max(s.radii[1]);
        let (low, high) = (s.ends[0].min(s.ends[1]), s.ends[0].max(s.ends[1]));
        let (low, high) = (self.place(low - radius), self.place(high + radius));
        let reach = radius + self.cell * 0.87;
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    let at = IVec3::new(x, y, z);
                    let center = self.low + (at.as_vec3() + 0.5) * self.cell;
                    let edge = x == 0 || y == 0 || z == 0 || at.cmpeq(self.size - 1).any();
                    if edge || s.contact(center).distance <= reach {
                        visit(self.index(at));
                    }
                }
            }
        }
    }

    fn place(&self, p: Vec3) -> IVec3 {
        let at = ((p - self.low) / self.cell).floor();
        at.clamp(Vec3::ZERO, (self.size - 1).as_vec3()).as_ivec3()
    }

    fn index(&self, at: IVec3) -> usize {
        ((at.z * self.size.y + at.y) * self.size.x + at.x) as usize
    }

    /// Calls `visit` for every segment whose surface may come within `reach` of `p` (some twice).
    pub fn each_near(&self, p: Vec3, reach: f32, mut visit: impl FnMut(&Segment)) {
        let (low, high) = (self.place(p - reach), self.place(p + reach));
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    let c = self.index(IVec3::new(x, y, z));
                    for &i in &self.items[self.starts[c] as usize..self.starts[c + 1] as usize] {
                        visit(&self.segments[i as usize]);
                    }
                }
            }
        }
    }

    /// The reach at which a search from `p` has seen everything.
    pub fn whole(&self, p: Vec3) -> f32 {
        let extent = self.size.as_vec3() * self.cell;
        p.distance(self.low + extent * 0.5) + extent.length()
    }
}
