//! Bark as one welded piece: a patch of the parent's surface is cut out where a branch leaves, and
//! the branch's first ring is stitched to the rim.
//!
//! Vertices on a rim are repeated for the branch's texture coordinates, with the same position and
//! normal: the surface is closed and smooth, and welding by position joins it.

use glam::{Vec2, Vec3};

use super::mesh::Mesh;
use super::species::Species;
use super::stem::Stem;
use super::tube::{Ring, Surface, ring_at, rings};

/// The rim that a branch is stitched to: positions and normals, counter-clockwise from outside.
type Rim = Vec<(Vec3, Vec3)>;

/// A child on its parent's surface.
struct Socket {
    child: usize,
    /// Middle of the hole along the parent, and half its length.
    along: f32,
    half: f32,
    /// First column of the hole and their number.
    column: u32,
    columns: u32,
}

/// Children that leave a stem between the same two rings.
struct Band {
    low: f32,
    high: f32,
    sockets: Vec<Socket>,
}

/// All stems as one skin: a mesh for each, rims shared to the last bit.
pub(super) fn skin(species: &Species, stems: &[Stem]) -> Vec<Mesh> {
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); stems.len()];
    for (i, stem) in stems.iter().enumerate() {
        if let Some(parent) = stem.parent {
            children[parent as usize].push(i);
        }
    }
    let mut rims: Vec<Rim> = vec![Rim::new(); stems.len()];
    let mut out = Vec::with_capacity(stems.len());
    for (i, stem) in stems.iter().enumerate() {
        let rim = std::mem::take(&mut rims[i]);
        let parent = stem.parent.map(|p| &stems[p as usize]);
        let start = parent.map_or(stem.along[0], |parent| emerges(parent, stem));
        let bands = bands(species, stems, stem, start, &children[i]);
        out.push(sheathe(species, stem, start, &rim, &bands, &mut rims));
    }
    out
}

/// Sine and cosine of the angle at which a child leaves its parent.
fn departure(parent: &Stem, child: &Stem) -> (f32, f32) {
    let direction = (child.points[1] - child.points[0]).normalize_or(Vec3::Y);
    let cos = direction.dot(parent.at(child_along(parent, child)).1);
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    (sin.max(0.35), cos)
}

/// Where on the parent's centre line a child begins.
fn child_along(parent: &Stem, child: &Stem) -> f32 {
    let (low, high) = parent.extent();
    let base = child.points[0];
    // The base lies on the centre line: find its segment by distance.
    let mut best = (f32::MAX, low);
    for i in 1..parent.points.len() {
        let (a, b) = (parent.points[i - 1], parent.points[i]);
        let t = ((base - a).dot(b - a) / (b - a).length_squared().max(1e-12)).clamp(0.0, 1.0);
        let distance = a.lerp(b, t).distance_squared(base);
        if distance < best.0 {
            let (s, e) = (parent.along[i - 1], parent.along[i]);
            best = (distance, s + (e - s) * t);
        }
    }
    best.1.clamp(low, high)
}

/// Distance along a child at which its whole ring is outside its parent.
fn emerges(parent: &Stem, child: &Stem) -> f32 {
    let (sin, _) = departure(parent, child);
    let (_, _, radius) = parent.at(child_along(parent, child));
    let (start, end) = child.extent();
    start + (1.1 * radius / sin + 0.5 * child.radii[0]).min(0.45 * (end - start))
}

/// The holes of a stem, in bands that do not overlap.
fn bands(
    species: &Species,
    stems: &[Stem],
    stem: &Stem,
    start: f32,
    children: &[usize],
) -> Vec<Band> {
    let end = stem.extent().1;
    let inset = 0.002 * (end - start);
    let rings = rings(stem, None);
    let surface = Surface::new(species, stem);
    let mut sockets: Vec<Socket> = children
        .iter()
        .map(|&child| {
            let mut socket = socket(stem, &rings, &surface, child, &stems[child]);
            socket.along = socket.along.clamp(start + inset, end - inset);
            socket
        })
        .collect();
    sockets.sort_by(|a, b| a.along.total_cmp(&b.along).then(a.child.cmp(&b.child)));
    let mut groups: Vec<Vec<Socket>> = Vec::new();
    for socket in sockets {
        match groups.last_mut() {
            Some(group) if shares(group, &socket, surface.sides) => group.push(socket),
            _ => groups.push(vec![socket]),
        }
    }
    spread(groups, start, end)
}

/// Whether a hole fits beside others between the same two rings.
fn shares(group: &[Socket], socket: &Socket, sides: u32) -> bool {
    let near = socket.along - group[0].along < 0.5 * (group[0].half + socket.half);
    let free = group.iter().all(|other| {
        let gap = (socket.column + sides - other.column) % sides;
        gap >= other.columns && sides - gap >= socket.columns
    });
    near && free
}

/// Gives each group a stretch of the stem; neighbours meet half-way at most.
fn spread(groups: Vec<Vec<Socket>>, start: f32, end: f32) -> Vec<Band> {
    let n = groups.len();
    let step = (end - start) / (4 * n + 4) as f32;
    let apart = step.min(1e-3 * (end - start));
    let mut middle: Vec<f32> = groups
        .iter()
        .map(|g| g.iter().map(|s| s.along).sum::<f32>() / g.len() as f32)
        .collect();
    for i in 1..n {
        middle[i] = middle[i].max(middle[i - 1] + apart);
    }
    let mut ceiling = end - 0.5 * apart;
    for m in middle.iter_mut().rev() {
        *m = m.min(ceiling);
        ceiling = *m - apart;
    }
    groups
        .into_iter()
        .enumerate()
        .map(|(i, sockets)| {
            let half = sockets.iter().fold(0.0f32, |a, s| a.max(s.half));
            let before = if i == 0 { start } else { middle[i - 1] };
            let after = if i + 1 == n { end } else { middle[i + 1] };
            let below = half.min(0.48 * (middle[i] - before));
            let above = half.min(0.48 * (after - middle[i]));
            Band {
                low: middle[i] - below,
                high: middle[i] + above,
                sockets,
            }
        })
        .collect()
}

/// Where a child's hole lies on its parent's surface, and how large it is.
fn socket(stem: &Stem, rings: &[Ring], surface: &Surface, index: usize, child: &Stem) -> Socket {
    let (sin, cos) = departure(stem, child);
    let base = child_along(stem, child);
    let (_, _, radius) = stem.at(base);
    let along = base + radius * cos / sin;
    let ring = ring_at(rings, along);
    let direction = (child.points[1] - child.points[0]).normalize_or(Vec3::Y);
    let own = child.radii[0];
    let width = 2.0 * std::f32::consts::PI * ring.radius / surface.sides as f32;
    let columns =
        ((2.0 * own / width.max(1e-6)).round() as u32).clamp(1, (surface.sides / 3).max(1));
    // The column whose middle looks most in the child's direction.
    let facing = |side: u32| {
        let middle = surface.point(&ring, side).1 + surface.point(&ring, side + columns).1;
        middle.normalize_or_zero().dot(direction)
    };
    let column = (0..surface.sides)
        .max_by(|&a, &b| facing(a).total_cmp(&facing(b)).then(b.cmp(&a)))
        .unwrap_or(0);
    Socket {
        child: index,
        along,
        half: own / sin,
        column,
        columns,
    }
}

/// One stem: stitched to its rim, rings with holes, a closed tip.
fn sheathe(
    species: &Species,
    stem: &Stem,
    start: f32,
    rim: &Rim,
    bands: &[Band],
    rims: &mut [Rim],
) -> Mesh {
    let surface = Surface::new(species, stem);
    let mut mesh = Mesh::default();
    // The first vertex of each ring looks at the rim's first corner.
    let nodes = rings(stem, rim.first().map(|r| r.0));
    let mut below: Option<u32> = None;
    let mut last = ring_at(&nodes, start);
    for (along, hole) in stations(&nodes, start, bands) {
        let ring = ring_at(&nodes, along);
        let first = surface.add_ring(&mut mesh, &ring);
        match below {
            None if !rim.is_empty() => stitch(&mut mesh, &surface, &ring, first, rim),
            None => {}
            Some(below) => {
                let sockets = hole.map_or(&[][..], |b| &bands[b].sockets);
                wall(&mut mesh, surface.sides, below, first, sockets);
                for s in sockets {
                    rims[s.child] = rim_of(&mesh, surface.sides, below, first, s);
                }
            }
        }
        below = Some(first);
        last = ring;
    }
    if let Some(first) = below {
        surface.add_tip(&mut mesh, &last, first);
    }
    mesh
}

/// Where a stem has rings, and for the upper ring of a band, which band ends there.
fn stations(nodes: &[Ring], start: f32, bands: &[Band]) -> Vec<(f32, Option<usize>)> {
    let mut out = vec![(start, None)];
    let free =
        |along: f32| along > start + 1e-4 && !bands.iter().any(|b| along > b.low && along < b.high);
    out.extend(
        nodes
            .iter()
            .map(|r| r.along)
            .filter(|&a| free(a))
            .map(|a| (a, None)),
    );
    for (i, band) in bands.iter().enumerate() {
        out.extend([(band.low, None), (band.high, Some(i))]);
    }
    out.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
    out.dedup_by(|b, a| {
        a.0 == b.0 && (b.1.is_none() || a.1.is_none()) && {
            a.1 = a.1.or(b.1);
            true
        }
    });
    out
}

/// Quads between two rings, without the holes.
fn wall(mesh: &mut Mesh, sides: u32, below: u32, above: u32, sockets: &[Socket]) {
    for side in 0..sides {
        let open = sockets
            .iter()
            .any(|s| (side + sides - s.column) % sides < s.columns);
        if !open {
            let (a, b) = (below + side, above + side);
            mesh.quad([a, a + 1, b + 1, b]);
        }
    }
}

fn rim_of(mesh: &Mesh, sides: u32, below: u32, above: u32, socket: &Socket) -> Rim {
    let at = |first: u32, column: u32| {
        let i = (first + (socket.column + column) % sides) as usize;
        (mesh.positions[i], mesh.normals[i])
    };
    let lower = (0..=socket.columns).map(|c| at(below, c));
    let upper = (0..=socket.columns).rev().map(|c| at(above, c));
    lower.chain(upper).collect()
}

/// Triangles between a rim and a ring: always along the shorter diagonal.
fn stitch(mesh: &mut Mesh, surface: &Surface, ring: &Ring, first: u32, rim: &Rim) {
    let (m, n) = (rim.len(), surface.sides as usize);
    let seam = surface.uv(ring, surface.sides).x - surface.uv(ring, 0).x;
    let corners: Vec<u32> = (0..=m)
        .map(|i| {
            let (position, normal) = rim[i % m];
            let down = position.distance(ring.center);
            let at = Ring {
                along: ring.along - down,
                ..*ring
            };
            let u = surface.uv(ring, 0).x + seam * i as f32 / m as f32;
            mesh.vertex(position, normal, Vec2::new(u, surface.uv(&at, 0).y))
        })
        .collect();
    let (mut i, mut j) = (0, 0);
    while i < m || j < n {
        let reach = |i: usize, j: usize| {
            let ring = mesh.positions[first as usize + j];
            mesh.positions[corners[i] as usize].distance_squared(ring)
        };
        let along_rim = i < m && (j == n || reach(i + 1, j) <= reach(i, j + 1));
        let (foot, head) = (corners[i], first + j as u32);
        if along_rim {
            mesh.triangles.push([foot, corners[i + 1], head]);
            i += 1;
        } else {
            mesh.triangles.push([foot, head + 1, head]);
            j += 1;
        }
    }
}
