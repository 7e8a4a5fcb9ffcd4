//! Any wood at all: level sets of the geodesic distance from the base.
//!
//! Verroust and Lazarus, "Extracting skeletal curves from 3D scattered data", The Visual Computer
//! 16, 2000. The surface is cut into bands of equal distance along the surface; each connected
//! piece of a band is a node. Where a band falls into several pieces the wood forks: the thickest
//! and straightest piece goes on as the same chain, the others start chains of their own.

use glam::{DVec3, Vec3};

use super::base::{base, distances, ring_of};
use super::mesh::PartMesh;
use super::{LocalChain, PartSkeleton};
use crate::botany::part::DisjointSets;

/// A side branch shorter than this many radii of its parent is a bump, not a branch.
const SHORTEST_IN_RADII: f32 = 1.2;
/// Most bands from base to tip.
const MAX_BANDS: f32 = 4000.0;

/// The chains of a part; the first one starts at the base.
pub fn trace(mesh: &PartMesh) -> PartSkeleton {
    let sources = base(mesh);
    let distance = distances(mesh, &sources);
    let farthest = distance.iter().copied().fold(0.0, f32::max);
    if farthest <= 0.0 {
        return one_node(mesh);
    }
    let step = band_height(mesh, farthest);
    let bands = Bands::new(mesh, &distance, step);
    let pieces = bands.pieces(mesh, &distance);
    grow_chains(mesh, &bands, pieces, ring_of(mesh, &sources))
}

/// Bands somewhat lower than the median edge is long: what the mesh resolves.
fn band_height(mesh: &PartMesh, farthest: f32) -> f32 {
    let mut lengths: Vec<f32> = (mesh.edges.iter())
        .map(|e| mesh.points[e.ends[0] as usize].distance(mesh.points[e.ends[1] as usize]))
        .collect();
    lengths.sort_unstable_by(f32::total_cmp);
    let median = lengths.get(lengths.len() / 2).copied().unwrap_or(farthest);
    // A few giant triangles among tiny ones must not be cut into thousands of bands each.
    let mean = lengths.iter().map(|&l| l as f64).sum::<f64>() / lengths.len().max(1) as f64;
    (0.7 * median.max(mean as f32 / 16.0)).clamp(farthest / MAX_BANDS, farthest / 4.0)
}

fn one_node(mesh: &PartMesh) -> PartSkeleton {
    PartSkeleton {
        chains: vec![LocalChain {
            nodes: vec![super::tube::ring_node(&mesh.points)],
            parent: None,
        }],
        node_of_triangle: vec![(0, 0); mesh.triangles.len()],
        by_segment: false,
    }
}

/// Each triangle cut into its bands; `cell = first[triangle] + band - low[triangle]`.
struct Bands {
    step: f32,
    first: Vec<u32>,
    low: Vec<u32>,
    /// For each cell its connected piece.
    piece: Vec<u32>,
    count: usize,
}

impl Bands {
    fn new(mesh: &PartMesh, distance: &[f32], step: f32) -> Self {
        let band = |p: u32| (distance[p as usize] / step) as u32;
        let (mut first, mut low) = (Vec::new(), Vec::new());
        let mut cells = 0u32;
        for t in &mesh.triangles {
            let bands = t.map(band);
            let (a, b) = (bands.into_iter().min(), bands.into_iter().max());
            let (a, b) = (a.unwrap_or(0), b.unwrap_or(0));
            first.push(cells);
            low.push(a);
            cells += b - a + 1;
        }
        let mut sets = DisjointSets::new(cells as usize);
        for edge in &mesh.edges {
            let ends = edge.ends.map(band);
            let [s, t] = edge.sides.map(|s| s as usize);
            if s != t {
                for b in ends[0].min(ends[1])..=ends[0].max(ends[1]) {
                    sets.unite(first[s] + b - low[s], first[t] + b - low[t]);
                }
            }
        }
        let (piece, count) = sets.labels();
        Self {
            step,
            first,
            low,
            piece,
            count,
        }
    }

    fn cells_of(&self, triangle: usize) -> std::ops::Range<usize> {
        let end = self
            .first
            .get(triangle + 1)
            .map_or(self.piece.len(), |&e| e as usize);
        self.first[triangle] as usize..end
    }

    fn pieces(&self, mesh: &PartMesh, distance: &[f32]) -> Vec<Piece> {
        let mut pieces = vec![Piece::default(); self.count];
        let mut sums = vec![(DVec3::ZERO, 0.0f64, DVec3::ZERO, 0.0f64); self.count];
        let mut curves: Vec<(u32, DVec3, f64)> = Vec::new();
        for (index, t) in mesh.triangles.iter().enumerate() {
            let corners = t.map(|p| (mesh.points[p as usize].as_dvec3(), distance[p as usize]));
            let center = corners.iter().map(|c| c.0).sum::<DVec3>() / 3.0;
            let cells = self.cells_of(index);
            for (k, cell) in cells.clone().enumerate() {
                let piece = self.piece[cell] as usize;
                let band = self.low[index] + k as u32;
                pieces[piece].band = band;
                let sum = &mut sums[piece];
                sum.2 += center;
                sum.3 += 1.0;
                if let Some((middle, length)) = crossing(&corners, (band as f32 + 0.5) * self.step)
                {
                    sum.0 += middle * length;
                    sum.1 += length;
                    curves.push((piece as u32, middle, length));
                }
                if k > 0 {
                    let below = self.piece[cell - 1];
                    let contact = crossing(&corners, band as f32 * self.step).map_or(0.0, |c| c.1);
                    pieces[piece].add_below(below, contact);
                }
            }
        }
        for (piece, &(at, length, centers, count)) in pieces.iter_mut().zip(&sums) {
            piece.solid = length > 0.0;
            let position = if piece.solid {
                at / length
            } else {
                centers / count.max(1.0)
            };
            piece.position = position.as_vec3();
            piece.weight = length;
        }
        for (piece, middle, length) in curves {
            let p = &mut pieces[piece as usize];
            let share = length / p.weight;
            p.radius += (middle.distance(p.position.as_dvec3()) * share) as f32;
        }
        self.find_ends(mesh, distance, &mut pieces);
        pieces
    }
}

impl Bands {
    /// The upper end of each piece: the ring or point that is farthest from the base.
    fn find_ends(&self, mesh: &PartMesh, distance: &[f32], pieces: &mut [Piece]) {
        let mut corners: Vec<(u32, u32)> = Vec::with_capacity(mesh.triangles.len() * 3);
        for (index, t) in mesh.triangles.iter().enumerate() {
            for &p in t {
                let band = (distance[p as usize] / self.step) as u32;
                let cell = self.first[index] + band - self.low[index];
                corners.push((self.piece[cell as usize], p));
            }
        }
        corners.sort_unstable();
        corners.dedup();
        for run in corners.chunk_by(|a, b| a.0 == b.0) {
            let top = run
                .iter()
                .map(|c| distance[c.1 as usize])
                .fold(0.0, f32::max);
            let ring: Vec<u32> = (run.iter().map(|c| c.1))
                .filter(|&p| distance[p as usize] >= top - 0.1 * self.step)
                .collect();
            pieces[run[0].0 as usize].end = ring_of(mesh, &ring);
        }
    }
}

/// Where the surface crosses a distance inside a triangle: middle and length of the segment.
fn crossing(corners: &[(DVec3, f32); 3], level: f32) -> Option<(DVec3, f64)> {
    let mut ends = [DVec3::ZERO; 2];
    let mut found = 0;
    for i in 0..3 {
        let ((p, a), (q, b)) = (corners[i], corners[(i + 1) % 3]);
        if (a < level) != (b < level) && found < 2 {
            let along = ((level - a) / (b - a)) as f64;
            ends[found] = p + (q - p) * along;
            found += 1;
        }
    }
    // A twig that is crushed to a line still has a middle.
    let length = ends[0].distance(ends[1]).max(1e-12);
    (found == 2).then(|| ((ends[0] + ends[1]) / 2.0, length))
}

/// A connected piece of a band.
#[derive(Clone, Debug, Default)]
struct Piece {
    band: u32,
    position: Vec3,
    radius: f32,
    weight: f64,
    /// Whether the band's middle crosses it (a tip's last piece may be lower).
    solid: bool,
    /// Pieces below it and how long it touches them.
    below: Vec<(u32, f64)>,
    /// Length of the longest way from here to a tip.
    reach: f32,
    /// Its upper end: position and radius.
    end: (Vec3, f32),
}

impl Piece {
    fn add_below(&mut self, piece: u32, contact: f64) {
        match self.below.iter_mut().find(|b| b.0 == piece) {
            Some(entry) => entry.1 += contact,
            None => self.below.push((piece, contact)),
        }
    }

    fn parent(&self) -> Option<usize> {
        (self.below.iter())
            .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))
            .map(|b| b.0 as usize)
    }
}

/// Pieces become chains; `foot` is the ring where the first one starts.
fn grow_chains(
    mesh: &PartMesh,
    bands: &Bands,
    mut pieces: Vec<Piece>,
    foot: (Vec3, f32),
) -> PartSkeleton {
    let parent: Vec<Option<usize>> = pieces.iter().map(Piece::parent).collect();
    let mut upward: Vec<usize> = (0..pieces.len()).collect();
    upward.sort_by_key(|&p| (pieces[p].band, p));
    let mut children = vec![Vec::new(); pieces.len()];
    for &p in upward.iter().rev() {
        let own = pieces[p].position.distance(pieces[p].end.0);
        pieces[p].reach = pieces[p].reach.max(own);
        if let Some(q) = parent[p] {
            let step = pieces[p].position.distance(pieces[q].position);
            pieces[q].reach = pieces[q].reach.max(pieces[p].reach + step);
            children[q].push(p);
        }
    }

    let mut chains: Vec<LocalChain> = Vec::new();
    let mut place: Vec<Option<(u32, u32)>> = vec![None; pieces.len()];
    let root = upward.iter().copied().find(|&p| parent[p].is_none());
    let mut starts: Vec<(usize, Option<(u32, u32)>)> = vec![(root.unwrap_or(0), None)];
    while chains.len() < starts.len() {
        let (start, from) = starts[chains.len()];
        let nodes = if from.is_none() {
            vec![foot]
        } else {
            Vec::new()
        };
        let (chain, forks) = follow(
            &pieces,
            &children,
            start,
            nodes,
            chains.len() as u32,
            &mut place,
        );
        starts.extend(forks);
        chains.push(LocalChain {
            nodes: chain,
            parent: from,
        });
    }

    // Bumps belong to the node that they grow from.
    for &p in &upward {
        if place[p].is_none() {
            place[p] = parent[p].and_then(|q| place[q]).or(Some((0, 0)));
        }
    }
    let node_of_triangle = (0..mesh.triangles.len())
        .map(|t| {
            let cells = bands.cells_of(t);
            place[bands.piece[(cells.start + cells.end) / 2] as usize].unwrap_or((0, 0))
        })
        .collect();
    PartSkeleton {
        chains,
        node_of_triangle,
        by_segment: false,
    }
}

/// A branch that forks off: its first piece, and the chain and node that carry it.
type Fork = (usize, Option<(u32, u32)>);

/// Follows a chain from its first piece to its tip; gives its nodes and what forks off.
fn follow(
    pieces: &[Piece],
    children: &[Vec<usize>],
    start: usize,
    mut nodes: Vec<(Vec3, f32)>,
    chain: u32,
    place: &mut [Option<(u32, u32)>],
) -> (Vec<(Vec3, f32)>, Vec<Fork>) {
    let mut forks = Vec::new();
    let mut at_fork = Vec::new();
    let mut trail = vec![start];
    let mut at = start;
    loop {
        let piece = &pieces[at];
        if piece.solid || nodes.is_empty() {
            nodes.push((piece.position, piece.radius));
        }
        let node = nodes.len() - 1;
        place[at] = Some((chain, node as u32));
        let Some(on) = continuation(pieces, &trail, &children[at]) else {
            break;
        };
        for &child in children[at].iter().filter(|&&c| c != on) {
            let thick = piece.radius.max(pieces[child].radius);
            if pieces[child].reach > SHORTEST_IN_RADII * thick {
                forks.push((child, place[at]));
                at_fork.push(node);
            }
        }
        at = on;
        trail.push(at);
    }
    straighten(&mut nodes, &at_fork);
    let (tip, radius) = pieces[at].end;
    if let Some(last) = nodes.last().copied()
        && last.0.distance(tip) > 0.25 * last.1.max(1e-9)
    {
        nodes.push((tip, radius));
    }
    (nodes, forks)
}

/// Where a branch leaves, a level set holds both and its middle lies between them: those nodes
/// are put on the line between their neighbours.
fn straighten(nodes: &mut [(Vec3, f32)], at_fork: &[usize]) {
    let is_fork = |i: usize| at_fork.binary_search(&i).is_ok();
    for &i in at_fork {
        let below = (0..i).rev().find(|&j| !is_fork(j));
        let above = (i + 1..nodes.len()).find(|&j| !is_fork(j));
        let (Some(below), Some(above)) = (below, above) else {
            continue;
        };
        let along = (i - below) as f32 / (above - below) as f32;
        let ((p, a), (q, b)) = (nodes[below], nodes[above]);
        nodes[i] = (p.lerp(q, along), a + (b - a) * along);
    }
}

/// The child that carries the chain on: thick, straight ahead, and far from its tip.
fn continuation(pieces: &[Piece], trail: &[usize], children: &[usize]) -> Option<usize> {
    let at = *trail.last()?;
    let back = trail[trail.len().saturating_sub(4)];
    let ahead = (pieces[at].position - pieces[back].position).normalize_or_zero();
    let thickest = children
        .iter()
        .map(|&c| pieces[c].radius)
        .fold(1e-12, f32::max);
    let farthest = children
        .iter()
        .map(|&c| pieces[c].reach)
        .fold(1e-12, f32::max);
    let score = |c: usize| {
        let p = &pieces[c];
        let straight = ahead.dot((p.position - pieces[at].position).normalize_or_zero());
        p.radius / thickest + 0.5 * straight + 0.5 * p.reach / farthest
    };
    (children.iter().copied()).max_by(|&a, &b| score(a).total_cmp(&score(b)).then(b.cmp(&a)))
}
