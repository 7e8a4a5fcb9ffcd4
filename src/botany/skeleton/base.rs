//! Where a piece of wood begins, and how far along its surface every point lies from there.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::{DVec3, Vec3};

use super::mesh::PartMesh;

/// The points that the distance is counted from: the widest ring of the boundary, the lowest of
/// those that are nearly as wide. Where there is none, the lowest point of a closed skin if it
/// lies at one of its ends, or else the thicker end.
pub fn base(mesh: &PartMesh) -> Vec<u32> {
    let rings: Vec<(&Vec<u32>, (Vec3, f32))> = (mesh.loops.iter())
        .filter(|l| l.len() < mesh.points.len() && is_ring(mesh, l))
        .map(|l| (l, ring_of(mesh, l)))
        .collect();
    let widest = rings.iter().map(|r| r.1.1).fold(0.0, f32::max);
    let best = (rings.iter())
        .filter(|r| r.1.1 >= 0.7 * widest)
        .min_by(|a, b| a.1.0.y.total_cmp(&b.1.0.y));
    if let Some((ring, _)) = best {
        return (*ring).clone();
    }
    let one = farthest_from(mesh, 0).0;
    let (other, length) = farthest_from(mesh, one);
    let y = |p: u32| mesh.points[p as usize].y;
    let lowest = (0..mesh.points.len() as u32).min_by(|&a, &b| y(a).total_cmp(&y(b)));
    match lowest {
        Some(low) if mesh.loops.is_empty() && farthest_from(mesh, low).1 > 0.6 * length => {
            vec![low]
        }
        _ if thickness(mesh, other, length) > thickness(mesh, one, length) => vec![other],
        _ => vec![one],
    }
}

/// Whether points spread over a plane instead of along a line, as the outline of a torn strip
/// does: `1 - trace(M^2)` of their normalised covariance is 1/2 on a circle and 0 on a line.
fn is_ring(mesh: &PartMesh, points: &[u32]) -> bool {
    let center = ring_of(mesh, points).0.as_dvec3();
    let mut m = [0.0f64; 6];
    for &p in points {
        let d = mesh.points[p as usize].as_dvec3() - center;
        let products = [
            d.x * d.x,
            d.y * d.y,
            d.z * d.z,
            d.x * d.y,
            d.y * d.z,
            d.z * d.x,
        ];
        for (sum, value) in m.iter_mut().zip(products) {
            *sum += value;
        }
    }
    let trace = m[0] + m[1] + m[2];
    let [xx, yy, zz, xy, yz, zx] = m.map(|v| v / trace.max(1e-300));
    1.0 - (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx)) > 0.15
}

/// How far the points near one end of a part spread (root mean square).
fn thickness(mesh: &PartMesh, end: u32, length: f32) -> f64 {
    let distance = distances(mesh, &[end]);
    let near: Vec<DVec3> = (mesh.points.iter().zip(&distance))
        .filter(|(_, d)| **d <= 0.1 * length)
        .map(|(p, _)| p.as_dvec3())
        .collect();
    let center = near.iter().sum::<DVec3>() / near.len().max(1) as f64;
    let spread: f64 = near.iter().map(|p| p.distance_squared(center)).sum();
    (spread / near.len().max(1) as f64).sqrt()
}

/// The point that is farthest from another along the surface, and how far that is.
fn farthest_from(mesh: &PartMesh, point: u32) -> (u32, f32) {
    let distance = distances(mesh, &[point]);
    let far = (0u32..).zip(&distance);
    far.fold(
        (point, 0.0),
        |best, (p, &d)| if d > best.1 { (p, d) } else { best },
    )
}

/// Dijkstra over the edges; points that can't be reached get 0.
pub fn distances(mesh: &PartMesh, sources: &[u32]) -> Vec<f32> {
    let mut distance = vec![f32::MAX; mesh.points.len()];
    let mut queue = BinaryHeap::new();
    for &s in sources {
        distance[s as usize] = 0.0;
        queue.push(Reverse((0u32, s)));
    }
    while let Some(Reverse((bits, p))) = queue.pop() {
        // Bits of non-negative floats are ordered like the floats.
        let d = f32::from_bits(bits);
        if d > distance[p as usize] {
            continue;
        }
        for &q in mesh.neighbours(p) {
            let through = d + mesh.points[p as usize].distance(mesh.points[q as usize]);
            if through < distance[q as usize] {
                distance[q as usize] = through;
                queue.push(Reverse((through.to_bits(), q)));
            }
        }
    }
    for d in &mut distance {
        if *d == f32::MAX {
            *d = 0.0;
        }
    }
    distance
}

/// Centre and radius of a ring of points.
pub fn ring_of(mesh: &PartMesh, points: &[u32]) -> (Vec3, f32) {
    let points: Vec<Vec3> = points.iter().map(|&p| mesh.points[p as usize]).collect();
    super::tube::ring_node(&points)
}
