//! A clean tube: rings of equally many points, one after the other.
//!
//! Counting edges from the ring at one end gives exactly the rings that the tube was made of, so
//! the nodes are those of whoever grew the tree.

use glam::{DVec3, Vec3};

use super::mesh::PartMesh;
use super::{LocalChain, PartSkeleton};

/// The chain of a tube, or `None` where the part is no clean tube.
pub fn trace(mesh: &PartMesh) -> Option<PartSkeleton> {
    let start = match mesh.loops.as_slice() {
        [one] => one,
        // Start at the wider end: a tip may have shrunk to a point.
        [a, b] => {
            if extent(mesh, a) >= extent(mesh, b) {
                a
            } else {
                b
            }
        }
        _ => return None,
    };
    let level = levels_from(mesh, start)?;
    let count = level.iter().max().map_or(0, |&l| l as usize + 1);
    let mut rings = vec![Vec::new(); count];
    for (point, &l) in level.iter().enumerate() {
        rings[l as usize].push(mesh.points[point]);
    }
    let sides = start.len();
    let (last, body) = rings.split_last()?;
    let clean = !body.is_empty()
        && body.iter().all(|ring| ring.len() == sides)
        && (last.len() == sides || last.len() == 1);
    if !clean {
        return None;
    }
    let mut nodes: Vec<(Vec3, f32)> = rings.iter().map(|ring| ring_node(ring)).collect();
    drop_flat_cap(&mut nodes, last.len());
    let top = nodes.len() as u32 - 1;
    let node_of_triangle = (mesh.triangles.iter())
        .map(|t| {
            t.map(|p| level[p as usize])
                .into_iter()
                .max()
                .unwrap_or(0)
                .clamp(1, top.max(1))
        })
        .map(|node| (0, node.min(top)))
        .collect();
    Some(PartSkeleton {
        chains: vec![LocalChain {
            nodes,
            parent: None,
        }],
        node_of_triangle,
        by_segment: true,
    })
}

/// Number of edges from the ring `start` to every point.
fn levels_from(mesh: &PartMesh, start: &[u32]) -> Option<Vec<u32>> {
    let mut level = vec![u32::MAX; mesh.points.len()];
    let mut front = start.to_vec();
    for &p in start {
        level[p as usize] = 0;
    }
    let mut depth = 0;
    let mut seen = front.len();
    while !front.is_empty() {
        depth += 1;
        let mut next = Vec::with_capacity(front.len());
        for &p in &front {
            for &q in mesh.neighbours(p) {
                if level[q as usize] == u32::MAX {
                    level[q as usize] = depth;
                    next.push(q);
                }
            }
        }
        // A ring never has more points than the first: this is no tube.
        if next.len() > start.len() {
            return None;
        }
        seen += next.len();
        front = next;
    }
    (seen == mesh.points.len()).then_some(level)
}

fn extent(mesh: &PartMesh, ring: &[u32]) -> f32 {
    let points: Vec<Vec3> = ring.iter().map(|&p| mesh.points[p as usize]).collect();
    ring_node(&points).1
}

/// Centre and mean radius of a ring.
pub fn ring_node(ring: &[Vec3]) -> (Vec3, f32) {
    let count = ring.len().max(1) as f64;
    let center = ring.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / count;
    let radius = ring
        .iter()
        .map(|p| p.as_dvec3().distance(center))
        .sum::<f64>()
        / count;
    (center.as_vec3(), radius as f32)
}

/// The middle point of a flat cap is no node of its own.
fn drop_flat_cap(nodes: &mut Vec<(Vec3, f32)>, last_ring: usize) {
    if let [.., before, last] = nodes.as_slice()
        && last_ring == 1
        && nodes.len() > 2
        && before.0.distance(last.0) < 0.5 * before.1
    {
        nodes.pop();
    }
}
