//! The triangles of a scene that a drawing may show.

use super::camera::Corner;
use super::fragment::Fragment;
use super::triangle::Triangle;
use super::{Material, Sampling, Scene};

/// What drawing needs of one triangle.
pub(super) struct Seen<'s> {
    /// Its number in the scene.
    pub id: usize,
    pub corners: [Corner; 3],
    pub material: &'s Material,
    pub triangle: Triangle,
    indices: &'s [u32; 3],
}

/// The triangles that may hit a sample at one of `places` and face the eye, in order; `corners` are
/// the scene's positions, projected.
pub(super) fn seen<'s, const N: usize>(
    scene: &'s Scene<'s>,
    corners: &'s [Corner],
    places: [[i32; 2]; N],
) -> impl Iterator<Item = Seen<'s>> {
    let all = scene.geometry.triangles.iter().enumerate();
    all.filter_map(move |(id, indices)| {
        let at: [Corner; 3] = indices.map(|i| corners[i as usize]);
        if !Triangle::may_hit(&at, places) {
            return None;
        }
        let material = scene.material(id);
        Some(Seen {
            id,
            corners: at,
            material,
            triangle: Triangle::new(at, material.double_sided)?,
            indices,
        })
    })
}

impl<'s> Seen<'s> {
    /// What its texture gives. Most leaves of a far tree hit no sample: made on first use.
    pub fn fragment(&self, scene: &Scene<'s>, sampling: Sampling) -> Fragment<'s> {
        let (corners, triangle) = (&self.corners, &self.triangle);
        Fragment::new(
            scene,
            self.material,
            self.indices,
            corners,
            triangle,
            sampling,
        )
    }
}
