//! A triangle that a drawing may show.

use super::camera::Corner;
use super::fragment::Fragment;
use super::triangle::{Triangle, may_hit};
use super::{Material, Sampling, Scene};

/// What drawing needs of one triangle.
pub(super) struct Seen<'s> {
    pub corners: [Corner; 3],
    pub material: &'s Material,
    pub triangle: Triangle,
    indices: &'s [u32; 3],
}

/// A triangle, unless it turns its culled back to the eye or is empty; `corners` are the scene's
/// positions, projected.
#[inline]
pub(super) fn seen<'s>(scene: &'s Scene<'s>, corners: &[Corner], id: u32) -> Option<Seen<'s>> {
    let indices = &scene.geometry.triangles[id as usize];
    let at: [Corner; 3] = indices.map(|i| corners[i as usize]);
    let material = scene.material(id as usize);
    Some(Seen {
        corners: at,
        material,
        triangle: Triangle::new(at, material.double_sided)?,
        indices,
    })
}

/// The triangles that may hit a sample at one of `places` and are seen, in order.
pub(super) fn hitting<'s, const N: usize>(
    scene: &'s Scene<'s>,
    corners: &'s [Corner],
    places: [[i32; 2]; N],
) -> impl Iterator<Item = Seen<'s>> {
    let all = (0..).zip(scene.geometry.triangles);
    all.filter_map(move |(id, indices)| {
        let at = indices.map(|i| corners[i as usize]);
        match may_hit(&at, places) {
            true => seen(scene, corners, id),
            false => None,
        }
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
