//! Skins: a skinned mesh that rests in its bind pose is as good as a plain one.

use glam::{DMat4, Mat4};

use super::accessor::Integers;
use super::buffer::{Asset, BROKEN};
use super::warning::Warnings;
use crate::Result;

/// Bones may differ by this much, relative to the largest entry: rounding of f32 matrices.
const SAME_POSE: f64 = 1e-4;

/// The one matrix that all bones agree on in the file's pose (a node's own transform does not
/// count for a skinned mesh: glTF 2.0, section 3.7.3.3).
pub(super) fn rest(
    asset: &Asset,
    index: usize,
    worlds: &[Option<DMat4>],
    place: &str,
    warnings: &mut Warnings,
) -> Result<DMat4> {
    let Some(skin) = asset.json.skins.get(index) else {
        return Err(asset.fault(place, format!("there is no skin {index}"), BROKEN));
    };
    let place = format!("{place}, skin {index}");
    let select: Vec<u32> = (0..skin.joints.len() as u32).collect();
    let bind = match skin.inverse_bind_matrices {
        None => vec![Mat4::IDENTITY.to_cols_array(); select.len()],
        Some(accessor) => asset.floats::<16>(accessor, &select, Integers::AsSaid, &place)?,
    };
    let mut common: Option<DMat4> = None;
    for (&joint, bind) in skin.joints.iter().zip(&bind) {
        let Some(world_from_joint) = worlds.get(joint).copied().flatten() else {
            let what = format!("its joint {joint} is not a node of the scene");
            return Err(asset.fault(place, what, BROKEN));
        };
        let matrix = world_from_joint * Mat4::from_cols_array(bind).as_dmat4();
        let first = *common.get_or_insert(matrix);
        let largest = first
            .to_cols_array()
            .iter()
            .fold(0.0f64, |a, x| a.max(x.abs()));
        if !first.abs_diff_eq(matrix, SAME_POSE * largest) {
            let what =
                "the mesh is bent by bones; pleach reads skinned meshes only in their bind pose";
            let help = "apply the armature before the export (Blender: apply the Armature modifier), or export in rest position";
            return Err(asset.fault(place, what, help));
        }
    }
    match common {
        Some(matrix) if matrix.is_finite() => {
            warnings.say(
                "a skinned mesh is read in its bind pose; bones are not kept",
                &place,
            );
            Ok(matrix)
        }
        _ => Err(asset.fault(
            place,
            "the skin has no joints, or their matrices are not finite",
            BROKEN,
        )),
    }
}
