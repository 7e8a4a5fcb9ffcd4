//! A surface cut into bands of equal distance from the base, as low as the mesh is fine *there*.
//!
//! One height of bands for a whole tree is too coarse for its twigs or too fine for its trunk. So
//! a band is halved, each of its connected pieces on its own, until a piece holds no corner of the
//! mesh (a prism: nothing can happen in it) or is lower than the edges that end in it are long.
//! What leaves a trunk is cut off at its own scale, and long tubes stay whole between their rings.

use super::mesh::{Edge, PartMesh};
use crate::botany::part::DisjointSets;

/// Height of a band over the shortest edge of the triangles that have a corner in it.
const HEIGHT_IN_EDGES: f32 = 0.5;
/// An edge of the boundary that climbs by more than this share of its length runs along the wood:
/// it is a tear, no rim.
const TEAR: f32 = 0.7;
/// Most halvings: a band of a millionth of the part.
const MOST_HALVINGS: u32 = 20;

/// What one triangle has in one piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// The triangle.
    pub triangle: u32,
    /// The piece.
    pub piece: u32,
}

/// A band's height: distances from the base, normalised units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extent {
    /// Where it begins.
    pub low: f32,
    /// Where it ends; the next piece begins there.
    pub high: f32,
}

/// Connected pieces of bands.
#[derive(Clone, Debug, Default)]
pub struct Bands {
    /// Height of each piece.
    pub extents: Vec<Extent>,
    /// All cells by triangle, each triangle's from low to high.
    pub cells: Vec<Cell>,
    /// First cell of each triangle, and the number of cells at the end.
    pub first: Vec<u32>,
}

impl Bands {
    /// The cells of a triangle, from low to high.
    pub fn of_triangle(&self, triangle: usize) -> &[Cell] {
        &self.cells[self.first[triangle] as usize..self.first[triangle + 1] as usize]
    }
}

/// A piece that may still be cut.
struct Region {
    extent: Extent,
    halvings: u32,
    triangles: Vec<u32>,
    /// Edges (indices) that cross it.
    edges: Vec<u32>,
}

/// Cuts a part whose points lie at these distances from its base.
pub fn cut(mesh: &PartMesh, distance: &[f32]) -> Bands {
    let mut cutter = Cutter::new(mesh, distance);
    let farthest = distance.iter().copied().fold(0.0, f32::max);
    let whole = Extent {
        low: 0.0,
        // Above every point, so that the last band holds the tips.
        high: farthest * 1.0001 + f32::MIN_POSITIVE,
    };
    let triangles = (0..mesh.triangles.len() as u32).collect();
    let edges = (0..mesh.edges.len() as u32).collect();
    let mut open = cutter.connected(whole, 0, triangles, edges);
    let mut pieces: Vec<Region> = Vec::new();
    while let Some(mut region) = open.pop() {
        let middle = 0.5 * (region.extent.low + region.extent.high);
        let halves = region.extent.low < middle && middle < region.extent.high;
        if !halves || region.halvings >= MOST_HALVINGS || cutter.is_fine(&region) {
            // What hangs on a point begins there.
            let begins = region
                .triangles
                .iter()
                .map(|&t| cutter.ranges[t as usize][0]);
            region.extent.low = region.extent.low.max(begins.fold(f32::MAX, f32::min));
            pieces.push(region);
        } else {
            open.extend(cutter.halve(region, middle));
        }
    }
    // From the base upwards, whatever order they were cut in.
    pieces.sort_by(|a, b| {
        (a.extent.low.total_cmp(&b.extent.low)).then(a.triangles[0].cmp(&b.triangles[0]))
    });
    gather(mesh.triangles.len(), &pieces)
}

fn gather(triangles: usize, pieces: &[Region]) -> Bands {
    let mut first = vec![0u32; triangles + 1];
    for &t in pieces.iter().flat_map(|p| &p.triangles) {
        first[t as usize + 1] += 1;
    }
    for i in 0..triangles {
        first[i + 1] += first[i];
    }
    let mut next = first.clone();
    let blank = Cell {
        triangle: 0,
        piece: 0,
    };
    let mut cells = vec![blank; first[triangles] as usize];
    for (piece, region) in (0u32..).zip(pieces) {
        for &triangle in &region.triangles {
            let place = &mut next[triangle as usize];
            cells[*place as usize] = Cell { triangle, piece };
            *place += 1;
        }
    }
    Bands {
        extents: pieces.iter().map(|p| p.extent).collect(),
        cells,
        first,
    }
}

/// Bands somewhat lower than the median edge is long: in lower ones the strips between tears
/// would be branches.
fn torn_height(mesh: &PartMesh, distance: &[f32]) -> f32 {
    let farthest = distance.iter().copied().fold(0.0, f32::max);
    let mut lengths: Vec<f32> = (mesh.edges.iter())
        .map(|e| mesh.points[e.ends[0] as usize].distance(mesh.points[e.ends[1] as usize]))
        .collect();
    lengths.sort_unstable_by(f32::total_cmp);
    let median = lengths.get(lengths.len() / 2).copied().unwrap_or(farthest);
    // A few giant triangles among tiny ones must not be cut into thousands of bands each.
    let mean = lengths.iter().map(|&l| l as f64).sum::<f64>() / lengths.len().max(1) as f64;
    (0.7 * median.max(mean as f32 / 16.0)).min(farthest / 4.0)
}

struct Cutter<'a> {
    mesh: &'a PartMesh,
    distance: &'a [f32],
    /// For each triangle its least and greatest distance.
    ranges: Vec<[f32; 2]>,
    /// Shortest edge of each triangle.
    shortest: Vec<f32>,
    /// Bands of torn surfaces are not lower than this.
    torn_height: f32,
    /// Where a triangle is in the region that is being cut.
    slot: Vec<u32>,
}

impl<'a> Cutter<'a> {
    fn new(mesh: &'a PartMesh, distance: &'a [f32]) -> Self {
        let range = |t: &[u32; 3]| {
            let d = t.map(|p| distance[p as usize]);
            [d[0].min(d[1]).min(d[2]), d[0].max(d[1]).max(d[2])]
        };
        let shortest = |t: &[u32; 3]| {
            let p = t.map(|p| mesh.points[p as usize]);
            let sides = [
                p[0].distance(p[1]),
                p[1].distance(p[2]),
                p[2].distance(p[0]),
            ];
            let lengths = sides.into_iter().filter(|&l| l > 0.0);
            lengths.fold(f32::MAX, f32::min)
        };
        Self {
            mesh,
            distance,
            ranges: mesh.triangles.iter().map(range).collect(),
            shortest: mesh.triangles.iter().map(shortest).collect(),
            torn_height: torn_height(mesh, distance),
            slot: vec![0; mesh.triangles.len()],
        }
    }

    /// Whether a region needs no cut: nothing can begin or end in it.
    fn is_fine(&self, region: &Region) -> bool {
        let Extent { low, high } = region.extent;
        let (mut lowest, mut highest, mut shortest) = (f32::MAX, f32::MIN, f32::MAX);
        for &t in &region.triangles {
            for &p in &self.mesh.triangles[t as usize] {
                let d = self.distance[p as usize];
                if (low..high).contains(&d) {
                    (lowest, highest) = (lowest.min(d), highest.max(d));
                    shortest = shortest.min(self.shortest[t as usize]);
                }
            }
        }
        let height = high - low;
        lowest >= highest
            || height <= HEIGHT_IN_EDGES * shortest
            || height <= self.torn_height && region.edges.iter().any(|&e| self.is_tear(e))
    }

    fn is_tear(&self, edge: u32) -> bool {
        let Edge { ends, sides } = self.mesh.edges[edge as usize];
        let [low, high] = self.range_of_edge(edge);
        let [a, b] = ends.map(|p| self.mesh.points[p as usize]);
        sides[0] == sides[1] && high - low > TEAR * a.distance(b)
    }

    fn halve(&mut self, region: Region, middle: f32) -> Vec<Region> {
        let Extent { low, high } = region.extent;
        let mut out = Vec::new();
        for (extent, below) in [
            (Extent { low, high: middle }, true),
            (Extent { low: middle, high }, false),
        ] {
            let inside = |[low, high]: [f32; 2]| if below { low < middle } else { high >= middle };
            let triangles = (region.triangles.iter().copied())
                .filter(|&t| inside(self.ranges[t as usize]))
                .collect();
            let edges = (region.edges.iter().copied())
                .filter(|&e| inside(self.range_of_edge(e)))
                .collect();
            out.extend(self.connected(extent, region.halvings + 1, triangles, edges));
        }
        out
    }

    fn range_of_edge(&self, edge: u32) -> [f32; 2] {
        let [a, b] = (self.mesh.edges[edge as usize].ends).map(|p| self.distance[p as usize]);
        [a.min(b), a.max(b)]
    }

    /// The connected pieces of a set of triangles; `edges` are those that cross its band.
    fn connected(
        &mut self,
        extent: Extent,
        halvings: u32,
        triangles: Vec<u32>,
        edges: Vec<u32>,
    ) -> Vec<Region> {
        let mut sets = DisjointSets::new(triangles.len());
        for (slot, &t) in (0u32..).zip(&triangles) {
            self.slot[t as usize] = slot;
        }
        for &e in &edges {
            let [s, t] = self.mesh.edges[e as usize].sides;
            sets.unite(self.slot[s as usize], self.slot[t as usize]);
        }
        let (label, count) = sets.labels();
        let region = |triangles, edges| Region {
            extent,
            halvings,
            triangles,
            edges,
        };
        if count == 1 {
            return vec![region(triangles, edges)];
        }
        let mut out: Vec<Region> = (0..count).map(|_| region(Vec::new(), Vec::new())).collect();
        for &e in &edges {
            let side = self.mesh.edges[e as usize].sides[0];
            out[label[self.slot[side as usize] as usize] as usize]
                .edges
                .push(e);
        }
        for (&t, &label) in triangles.iter().zip(&label) {
            out[label as usize].triangles.push(t);
        }
        out
    }
}
