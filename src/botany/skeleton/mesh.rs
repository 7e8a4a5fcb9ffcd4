//! One welded part as a small mesh of its own: points, edges, boundary loops.

use glam::Vec3;

use crate::botany::part::{DisjointSets, Parts};

/// A part with local indices.
#[derive(Clone, Debug, Default)]
pub struct PartMesh {
    /// Points of the part.
    pub points: Vec<Vec3>,
    /// Triangles over `points`, in the order of the part (second sides included).
    pub triangles: Vec<[u32; 3]>,
    /// Edges, ascending, with the triangles on both sides: each once, or where more than two
    /// triangles meet (a skin that is pinched), once for each two that follow each other.
    pub edges: Vec<Edge>,
    /// Loops (or pieces) of edges that only one triangle has: their points.
    pub loops: Vec<Vec<u32>>,
    starts: Vec<u32>,
    neighbours: Vec<u32>,
}

/// An edge of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Its points, the smaller first.
    pub ends: [u32; 2],
    /// Triangles on both sides; equal on a boundary.
    pub sides: [u32; 2],
}

impl PartMesh {
    /// Cuts a part out of the model.
    pub fn new(parts: &Parts, triangles: &[u32]) -> Self {
        let mut global: Vec<u32> = (triangles.iter())
            .flat_map(|&t| parts.welded[t as usize])
            .collect();
        global.sort_unstable();
        global.dedup();
        let local = |p: u32| global.binary_search(&p).unwrap_or(0) as u32;
        let points: Vec<Vec3> = global.iter().map(|&p| parts.points[p as usize]).collect();
        let local_triangles: Vec<[u32; 3]> = (triangles.iter())
            .map(|&t| parts.welded[t as usize].map(local))
            .collect();
        let single: Vec<u32> = (0..triangles.len() as u32)
            .filter(|&i| !parts.duplicate[triangles[i as usize] as usize])
            .collect();
        let edges = edges_of(&local_triangles, &single);
        let (starts, neighbours) = adjacency(points.len(), &edges);
        let mut mesh = Self {
            points,
            triangles: local_triangles,
            edges,
            loops: Vec::new(),
            starts,
            neighbours,
        };
        mesh.loops = mesh.boundary_loops();
        mesh
    }

    /// The points joined to `point` by an edge.
    pub fn neighbours(&self, point: u32) -> &[u32] {
        let i = point as usize;
        &self.neighbours[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    fn boundary_loops(&self) -> Vec<Vec<u32>> {
        let mut sets = DisjointSets::new(self.points.len());
        let mut on_boundary = vec![false; self.points.len()];
        for edge in self.edges.iter().filter(|e| e.sides[0] == e.sides[1]) {
            sets.unite(edge.ends[0], edge.ends[1]);
            for end in edge.ends {
                on_boundary[end as usize] = true;
            }
        }
        let mut of_root = vec![u32::MAX; self.points.len()];
        let mut loops: Vec<Vec<u32>> = Vec::new();
        for point in (0..self.points.len() as u32).filter(|&p| on_boundary[p as usize]) {
            let root = sets.root(point) as usize;
            if of_root[root] == u32::MAX {
                of_root[root] = loops.len() as u32;
                loops.push(Vec::new());
            }
            loops[of_root[root] as usize].push(point);
        }
        loops
    }
}

fn edges_of(triangles: &[[u32; 3]], single: &[u32]) -> Vec<Edge> {
    let mut all: Vec<([u32; 2], u32)> = Vec::with_capacity(single.len() * 3);
    for &i in single {
        let t = triangles[i as usize];
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            if a != b {
                all.push(([a.min(b), a.max(b)], i));
            }
        }
    }
    all.sort_unstable();
    let mut edges = Vec::with_capacity(all.len() / 2);
    for run in all.chunk_by(|a, b| a.0 == b.0) {
        let edge = |a: u32, b: u32| Edge {
            ends: run[0].0,
            sides: [a, b],
        };
        match run {
            [(_, only)] => edges.push(edge(*only, *only)),
            _ => edges.extend(run.windows(2).map(|w| edge(w[0].1, w[1].1))),
        }
    }
    edges
}

fn adjacency(points: usize, edges: &[Edge]) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0u32; points + 1];
    for end in edges.iter().flat_map(|e| e.ends) {
        starts[end as usize + 1] += 1;
    }
    for i in 0..points {
        starts[i + 1] += starts[i];
    }
    let mut next = starts.clone();
    let mut neighbours = vec![0; starts[points] as usize];
    for edge in edges {
        let [a, b] = edge.ends;
        for (from, to) in [(a, b), (b, a)] {
            neighbours[next[from as usize] as usize] = to;
            next[from as usize] += 1;
        }
    }
    (starts, neighbours)
}
