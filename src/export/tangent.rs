//! Tangents for surfaces with a normal map, where the source has none.
//!
//! Per vertex the area-weighted mean of its triangles' texture directions, made perpendicular to
//! the normal (Lengyel, "Computing tangent space basis vectors for an arbitrary mesh", 2001).
//! glTF's v points down, so the bitangent `w * (normal x tangent)` follows decreasing v.

use glam::{Vec2, Vec3};

/// One tangent with handedness for each vertex; any perpendicular where texture coordinates
/// don't vary.
pub fn tangents(
    positions: &[Vec3],
    normals: &[Vec3],
    uvs: &[Vec2],
    triangles: &[[u32; 3]],
) -> Vec<[f32; 4]> {
    let mut along = vec![(Vec3::ZERO, Vec3::ZERO); positions.len()];
    for corners in triangles {
        let [a, b, c] = corners.map(|i| i as usize);
        let (p, q) = (positions[b] - positions[a], positions[c] - positions[a]);
        let (s, t) = (uvs[b] - uvs[a], uvs[c] - uvs[a]);
        let turn = s.perp_dot(t);
        if turn == 0.0 {
            continue;
        }
        // Scaled by the sign of the determinant alone: long texture gradients get no more weight.
        let u = (p * t.y - q * s.y) * turn.signum();
        let v = (q * s.x - p * t.x) * turn.signum();
        for i in [a, b, c] {
            along[i].0 += u;
            along[i].1 += v;
        }
    }
    along
        .iter()
        .zip(normals)
        .map(|(&(u, v), &n)| {
            let tangent = (u - n * n.dot(u)).normalize_or(n.any_orthonormal_vector());
            let w = if n.cross(tangent).dot(v) > 0.0 {
                -1.0
            } else {
                1.0
            };
            [tangent.x, tangent.y, tangent.z, w]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square in the plane z = 0: u to the right, v down. Then the bitangent points up.
    #[test]
    fn tangent_follows_u_and_bitangent_decreasing_v() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let uvs = [Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::ZERO];
        let all = tangents(&positions, &[Vec3::Z; 3], &uvs, &[[0, 1, 2]]);
        assert_eq!(all, [[1.0, 0.0, 0.0, 1.0]; 3]);
        let mirrored = uvs.map(|uv| Vec2::new(1.0 - uv.x, uv.y));
        let all = tangents(&positions, &[Vec3::Z; 3], &mirrored, &[[0, 1, 2]]);
        assert_eq!(all, [[-1.0, 0.0, 0.0, -1.0]; 3]);
    }

    #[test]
    fn missing_coordinates_give_a_unit_perpendicular() {
        let all = tangents(&[Vec3::X; 3], &[Vec3::Y; 3], &[Vec2::ZERO; 3], &[[0, 1, 2]]);
        let t = Vec3::from_slice(&all[0][..3]);
        assert!((t.length() - 1.0).abs() < 1e-6 && t.dot(Vec3::Y).abs() < 1e-6);
    }
}
