//! What is known of each connected piece of a band: its middle, its radius, what it stands on and
//! how far it is from there to a tip.

use glam::{DVec3, Vec3};

use super::bands::{Bands, Extent};
use super::base::ring_of;
use super::mesh::PartMesh;

/// A connected piece of a band. Lengths in normalised units.
#[derive(Clone, Debug, Default)]
pub struct Piece {
    /// Distances from the base between which it lies.
    pub extent: Extent,
    /// Middle of the level set half-way up, or of its corners where that is empty.
    pub position: Vec3,
    /// Mean distance of that level set from its middle.
    pub radius: f32,
    /// Whether that level set crosses it (a tip's last piece may be lower).
    pub solid: bool,
    /// The piece below that it touches along the greatest length.
    pub parent: Option<u32>,
    /// Pieces above that stand on it, ascending.
    pub children: Vec<u32>,
    /// Length of the longest way from here to a tip.
    pub reach: f32,
    /// Greatest radius from here to the tips.
    pub thickness: f32,
    /// Its upper end, where nothing stands on it: position and radius.
    pub end: (Vec3, f32),
}

/// Sums over the level set half-way up a piece.
#[derive(Clone, Copy, Default)]
struct Curve {
    middle: DVec3,
    length: f64,
    /// Sum of the corners of triangles, and their number.
    corners: (DVec3, f64),
}

/// Describes the pieces of a part; a piece comes after the one that it stands on.
pub fn describe(mesh: &PartMesh, distance: &[f32], bands: &Bands) -> Vec<Piece> {
    let corners = |t: usize| {
        mesh.triangles[t].map(|p| (mesh.points[p as usize].as_dvec3(), distance[p as usize]))
    };
    let mut curves = vec![Curve::default(); bands.extents.len()];
    let mut segments: Vec<(u32, DVec3, f64)> = Vec::with_capacity(bands.cells.len());
    let mut contacts: Vec<(u32, u32, f64)> = Vec::new();
    for t in 0..mesh.triangles.len() {
        let corners = corners(t);
        let mut below: Option<u32> = None;
        for cell in bands.of_triangle(t) {
            let Extent { low, high } = bands.extents[cell.piece as usize];
            let curve = &mut curves[cell.piece as usize];
            for corner in &corners {
                curve.corners.0 += corner.0;
                curve.corners.1 += 1.0;
            }
            if let Some((middle, length)) = crossing(&corners, 0.5 * (low + high)) {
                curve.middle += middle * length;
                curve.length += length;
                segments.push((cell.piece, middle, length));
            }
            if let Some(below) = below {
                let length = crossing(&corners, low).map_or(0.0, |c| c.1);
                contacts.push((cell.piece, below, length));
            }
            below = Some(cell.piece);
        }
    }
    let mut pieces: Vec<Piece> = (bands.extents.iter().zip(&curves))
        .map(|(&extent, curve)| Piece {
            extent,
            position: curve.position().as_vec3(),
            solid: curve.length > 0.0,
            ..Piece::default()
        })
        .collect();
    let mut radii = vec![0.0f64; pieces.len()];
    for (piece, middle, length) in segments {
        let curve = &curves[piece as usize];
        radii[piece as usize] += middle.distance(curve.position()) * length / curve.length;
    }
    for (piece, radius) in pieces.iter_mut().zip(radii) {
        piece.radius = radius as f32;
    }
    stand(&mut pieces, contacts);
    stand_on_points(mesh, distance, bands, &mut pieces);
    find_ends(mesh, distance, bands, &mut pieces);
    find_reach(&mut pieces);
    pieces
}

impl Curve {
    fn position(&self) -> DVec3 {
        if self.length > 0.0 {
            self.middle / self.length
        } else {
            self.corners.0 / self.corners.1.max(1.0)
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

/// Puts every piece on the one below that it touches most, of equal ones the first.
fn stand(pieces: &mut [Piece], mut contacts: Vec<(u32, u32, f64)>) {
    contacts.sort_by_key(|c| (c.0, c.1));
    for of_piece in contacts.chunk_by(|a, b| a.0 == b.0) {
        let mut best: Option<(u32, f64)> = None;
        for run in of_piece.chunk_by(|a, b| a.1 == b.1) {
            let length: f64 = run.iter().map(|c| c.2).sum();
            if best.is_none_or(|b| length > b.1) {
                best = Some((run[0].1, length));
            }
        }
        let (piece, parent) = (of_piece[0].0, best.map(|b| b.0));
        pieces[piece as usize].parent = parent;
        if let Some(parent) = parent {
            pieces[parent as usize].children.push(piece);
        }
    }
}

/// Pieces that touch what is below in a point only: a skin that is pinched, or index buffers that
/// tie branches together. They stand on what else has their lowest corner.
fn stand_on_points(mesh: &PartMesh, distance: &[f32], bands: &Bands, pieces: &mut [Piece]) {
    let mut lowest: Vec<Option<(f32, u32)>> = vec![None; pieces.len()];
    let mut any = false;
    for cell in &bands.cells {
        let piece = cell.piece as usize;
        if piece == 0 || pieces[piece].parent.is_some() {
            continue;
        }
        any = true;
        for p in mesh.triangles[cell.triangle as usize] {
            let d = distance[p as usize];
            if d >= pieces[piece].extent.low && lowest[piece].is_none_or(|l| (d, p) < l) {
                lowest[piece] = Some((d, p));
            }
        }
    }
    if !any {
        return;
    }
    let mut pieces_of_point: Vec<(u32, u32)> = (0u32..)
        .zip(&lowest)
        .filter_map(|(piece, l)| l.map(|l| (l.1, piece)))
        .collect();
    pieces_of_point.sort_unstable();
    let mut found: Vec<Option<u32>> = vec![None; pieces.len()];
    for cell in &bands.cells {
        for p in mesh.triangles[cell.triangle as usize] {
            let start = pieces_of_point.partition_point(|x| x.0 < p);
            for &(_, orphan) in pieces_of_point[start..].iter().take_while(|x| x.0 == p) {
                let below = (Some(cell.piece).filter(|&q| q < orphan))
                    .or(pieces[cell.piece as usize].parent.filter(|&q| q < orphan));
                let best = &mut found[orphan as usize];
                *best = (*best).max(below);
            }
        }
    }
    for (orphan, parent) in found.into_iter().enumerate() {
        if let Some(parent) = parent {
            pieces[orphan].parent = Some(parent);
            pieces[parent as usize].children.push(orphan as u32);
        }
    }
}

/// The upper end of each tip: the ring or point that is farthest from the base.
fn find_ends(mesh: &PartMesh, distance: &[f32], bands: &Bands, pieces: &mut [Piece]) {
    let is_tip: Vec<bool> = pieces.iter().map(|p| p.children.is_empty()).collect();
    let mut corners: Vec<(u32, u32)> = Vec::new();
    for cell in bands.cells.iter().filter(|c| is_tip[c.piece as usize]) {
        let low = pieces[cell.piece as usize].extent.low;
        let points = mesh.triangles[cell.triangle as usize];
        corners.extend(
            (points.into_iter())
                .filter(|&p| distance[p as usize] >= low)
                .map(|p| (cell.piece, p)),
        );
    }
    corners.sort_unstable();
    corners.dedup();
    for piece in pieces.iter_mut() {
        piece.end = (piece.position, piece.radius);
    }
    for run in corners.chunk_by(|a, b| a.0 == b.0) {
        let piece = &mut pieces[run[0].0 as usize];
        let far = run.iter().map(|c| distance[c.1 as usize]);
        let top = far.fold(0.0, f32::max);
        let least = top - 0.1 * (piece.extent.high - piece.extent.low);
        let ring: Vec<u32> = (run.iter().map(|c| c.1))
            .filter(|&p| distance[p as usize] >= least)
            .collect();
        piece.end = ring_of(mesh, &ring);
    }
}

/// How long and thick is what stands on each piece.
fn find_reach(pieces: &mut [Piece]) {
    for p in (0..pieces.len()).rev() {
        let own = pieces[p].position.distance(pieces[p].end.0);
        pieces[p].reach = pieces[p].reach.max(own);
        pieces[p].thickness = pieces[p].thickness.max(pieces[p].radius);
        if let Some(q) = pieces[p].parent.map(|q| q as usize) {
            pieces[q].thickness = pieces[q].thickness.max(pieces[p].thickness);
            let step = pieces[p].position.distance(pieces[q].position);
            pieces[q].reach = pieces[q].reach.max(pieces[p].reach + step);
        }
    }
}
