//! Bare triangles: lists from strips and fans, vertices in use, areas, normals.

use glam::{DVec3, Vec3};

/// The triangles of a primitive of mode 4 (list), 5 (strip) or 6 (fan); `None` for other modes.
pub(super) fn list(mode: u32, flat: &[u32]) -> Option<Vec<[u32; 3]>> {
    Some(match mode {
        4 => flat.as_chunks::<3>().0.to_vec(),
        // Every second triangle of a strip turns the other way (glTF 2.0, section 3.7.2.1).
        5 => flat
            .windows(3)
            .enumerate()
            .map(|(i, w)| [w[0], w[1 + i % 2], w[2 - i % 2]])
            .collect(),
        6 => flat
            .windows(2)
            .skip(1)
            .map(|w| [flat[0], w[0], w[1]])
            .collect(),
        _ => return None,
    })
}

/// Numbers the vertices in use from 0 in ascending order of their old numbers; returns the old.
pub(super) fn renumber(triangles: &mut [[u32; 3]]) -> Vec<u32> {
    let flat = || triangles.iter().flatten().copied();
    let (Some(low), Some(high)) = (flat().min(), flat().max()) else {
        return Vec::new();
    };
    let span = (high - low) as usize + 1;
    // A few triangles of a huge shared buffer: sorting costs less than a table of its length.
    if span / 16 > triangles.len() {
        let mut used: Vec<u32> = flat().collect();
        used.sort_unstable();
        used.dedup();
        for v in triangles.iter_mut().flatten() {
            *v = used.partition_point(|u| u < v) as u32;
        }
        return used;
    }
    let mut new = vec![u32::MAX; span];
    flat().for_each(|v| new[(v - low) as usize] = 0);
    let mut used = Vec::new();
    for (slot, old) in new.iter_mut().zip(low..) {
        if *slot == 0 {
            *slot = used.len() as u32;
            used.push(old);
        }
    }
    for v in triangles.iter_mut().flatten() {
        *v = new[(*v - low) as usize];
    }
    used
}

/// Twice the area vector of a triangle; exact zero where its corners lie on one line of the f32 grid.
fn cross([a, b, c]: [u32; 3], positions: &[Vec3]) -> DVec3 {
    let [a, b, c] = [a, b, c].map(|i| positions[i as usize].as_dvec3());
    (b - a).cross(c - a)
}

pub(super) fn has_area(triangle: [u32; 3], positions: &[Vec3]) -> bool {
    cross(triangle, positions) != DVec3::ZERO
}

/// Normals of vertices: the sum of their faces' normals, weighted by area.
///
/// The specification asks for flat normals, which would need three vertices a triangle; files
/// without normals (MTree's) are welded skins, which their authors see smooth.
pub(super) fn face_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![DVec3::ZERO; positions.len()];
    // Any face serves where faces cancel out (a vertex shared by both sides of a leaf).
    let mut one = vec![DVec3::ZERO; positions.len()];
    for &triangle in triangles {
        let normal = cross(triangle, positions);
        for i in triangle {
            sums[i as usize] += normal;
            one[i as usize] = normal;
        }
    }
    let unit = |(sum, one): (DVec3, DVec3)| {
        let sum = if sum.length_squared() > 1e-12 * one.length_squared() {
            sum
        } else {
            one
        };
        // Scaled first: areas of small triangles underflow when they are squared.
        let largest = sum.abs().max_element();
        (sum / largest)
            .try_normalize()
            .unwrap_or(DVec3::Y)
            .as_vec3()
    };
    sums.into_iter().zip(one).map(unit).collect()
}
