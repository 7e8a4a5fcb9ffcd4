//! A triangle that a drawing may show.

use super::camera::Corner;
use super::fragment::Fragment;
use super::pane::{Pane, may_hit, reach};
use super::triangle::Triangle;
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

/// The first and last column, and row, of a pane in which a triangle may hit a sample at one of
/// `places` of a pixel, if there are any.
#[inline]
pub(super) fn may_reach<const N: usize>(
    scene: &Scene,
    corners: &[Corner],
    id: u32,
    pane: &Pane,
    places: [[i32; 2]; N],
) -> Option<[[i32; 2]; 2]> {
    let at = scene.geometry.triangles[id as usize].map(|i| corners[i as usize]);
    // With one sample a pixel the reach itself tells.
    (N == 1 || may_hit(&at, places))
        .then(|| reach(&at, pane, places))
        .flatten()
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
