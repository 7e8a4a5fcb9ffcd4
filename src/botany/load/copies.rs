//! Triangles that lie exactly on others: nothing shows them, everything pays for them.
//!
//! Exports double meshes by mistake, and a tree that is in the file twice would be two trees to all that
//! follows. Dropped is a triangle whose corners, their order and texture coordinates, and whose
//! material are those of an earlier one; blended ones stay, because two of them look denser than one.

use std::hash::{DefaultHasher, Hash, Hasher};

use crate::botany::model::{AlphaMode, Model};

/// Positions and texture coordinates of the corners, from the least on, and the material.
type Key = ([[u32; 5]; 3], u32);

/// Drops triangles that others cover exactly; returns how many.
pub(super) fn drop_copies(model: &mut Model) -> u64 {
    let key = |t: u32| key(model, t);
    let hashed = |t: u32| {
        let mut hasher = DefaultHasher::new();
        key(t).hash(&mut hasher);
        (hasher.finish(), t)
    };
    let mut all: Vec<(u64, u32)> = (0..model.triangles.len() as u32).map(hashed).collect();
    all.sort_unstable();
    let mut dropped = vec![false; all.len()];
    for alike in all.chunk_by(|a, b| a.0 == b.0).filter(|a| a.len() > 1) {
        // Equal hashes are equal keys but for chance: the first of each key stays.
        let mut kept: Vec<Key> = Vec::new();
        for &(_, t) in alike {
            let key = key(t);
            let blended = model.materials[key.1 as usize].alpha_mode == AlphaMode::Blend;
            match kept.contains(&key) {
                true => dropped[t as usize] = !blended,
                false => kept.push(key),
            }
        }
    }
    let count = dropped.iter().filter(|d| **d).count() as u64;
    if count > 0 {
        model.retain_triangles(|t| !dropped[t as usize]);
    }
    count
}

fn key(model: &Model, triangle: u32) -> Key {
    let object = model.triangle_object[triangle as usize];
    let corner = |i: u32| {
        let (p, uv) = (model.positions[i as usize], model.uvs[0][i as usize]);
        // Both zeros are one place.
        [p.x, p.y, p.z, uv.x, uv.y].map(|v| (v + 0.0).to_bits())
    };
    let mut corners = model.triangles[triangle as usize].map(corner);
    let least = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
    corners.rotate_left(least);
    (corners, model.objects[object as usize].material)
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;
    use crate::botany::model::{Material, Object};

    /// The same three points twice, and a fourth.
    fn model(triangles: &[[u32; 3]], second_uv: f32) -> Model {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let mut uvs = vec![Vec2::ZERO; 7];
        uvs[4] = Vec2::splat(second_uv);
        Model {
            positions: [&corners[..], &corners[..], &[Vec3::Z]].concat(),
            uvs: [uvs, Vec::new()],
            triangles: triangles.to_vec(),
            triangle_object: (0..triangles.len() as u32).map(|t| t % 2).collect(),
            objects: vec![Object::default(); 2],
            materials: vec![Material::default()],
            ..Model::default()
        }
    }

    #[test]
    fn a_triangle_on_another_is_dropped_from_whatever_corner_it_starts() {
        let mut model = model(&[[0, 1, 2], [4, 5, 3], [0, 1, 6]], 0.0);
        assert_eq!(drop_copies(&mut model), 1);
        assert_eq!(model.triangles, [[0, 1, 2], [0, 1, 6]]);
        assert_eq!(model.triangle_object, [0, 0]);
    }

    #[test]
    fn backs_other_textures_other_materials_and_blended_ones_stay() {
        let back = [[0, 1, 2], [3, 5, 4]];
        assert_eq!(drop_copies(&mut model(&back, 0.0)), 0);
        let twice = [[0, 1, 2], [3, 4, 5]];
        assert_eq!(drop_copies(&mut model(&twice, 0.5)), 0);
        let mut other = model(&twice, 0.0);
        other.objects[1].material = 1;
        other.materials.push(Material::default());
        assert_eq!(drop_copies(&mut other), 0);
        let mut blended = model(&twice, 0.0);
        blended.materials[0].alpha_mode = AlphaMode::Blend;
        assert_eq!(drop_copies(&mut blended), 0);
        assert_eq!(drop_copies(&mut model(&twice, 0.0)), 1);
    }
}
