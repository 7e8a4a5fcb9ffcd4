//! How much of every sub-tree is seen, counted beforehand from directions over the sphere (ours).
//!
//! An item buffer of the whole tree tells how many pixels each sub-tree shows; drawn alone at the same
//! scale it shows how many it has. The share of the two is what the others leave of it.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::botany::tree::Tree;
use crate::detail::optimal_distance::own_triangles;
use crate::error::Result;
use crate::report::Drawable;
use crate::runtime::{Measured, Measuring};
use crate::space::raster::{Camera, EMPTY, Geometry, Mips, Sampling, Scene, draw};
use crate::watch::{Watch, begin, step};

/// Directions along an edge of the octahedral map: 25 in all.
const SIDE: u32 = 5;
/// Pixels of the bounding sphere's diameter in an item buffer.
const DIAMETER_PX: f32 = 256.0;
/// One sample a pixel, from the full texture.
const ONCE: Sampling = Sampling {
    side: 1,
    mips: Mips::Base,
};

/// Share of each sub-tree's own pixels (its own silhouette, drawn alone) that the whole tree shows, 0 to 1, from 25
/// directions.
///
/// # Errors
/// [`crate::Error::Interrupted`].
pub fn measure_subtrees(tree: &Tree, watch: &dyn Watch) -> Result<Measured> {
    let drawable = Drawable::silhouette(&tree.model);
    let walk = Walk::new(tree, &drawable);
    let mut measuring = Measuring::new(tree.subtrees.len(), SIDE);
    let directions = measuring.directions();
    begin(watch, "visibility", directions.len() as u64)?;
    let shares: Result<Vec<Vec<f32>>> = directions
        .par_iter()
        .map(|&to_eye| {
            let shares = walk.shares(tree, &drawable.scene(), to_eye);
            step(watch)?;
            Ok(shares)
        })
        .collect();
    for (texel, shares) in shares?.iter().enumerate() {
        measuring.set(texel, shares);
    }
    Ok(measuring.finish())
}

/// The triangles in the order of a walk over the sub-trees, so that each sub-tree is a range of them. Each has
/// corners of its own, so that a sub-tree is drawn without touching those of the others.
#[derive(Default)]
struct Walk {
    positions: Vec<Vec3>,
    uvs: [Vec<Vec2>; 2],
    colors: Vec<[f32; 4]>,
    triangles: Vec<[u32; 3]>,
    materials: Vec<u32>,
    /// For each triangle the sub-tree that it grows on.
    owner: Vec<u32>,
    /// For each sub-tree its triangles and those of all that it carries.
    ranges: Vec<std::ops::Range<usize>>,
}

impl Walk {
    fn new(tree: &Tree, drawable: &Drawable) -> Self {
        let own = own_triangles(tree);
        let mut out = Self {
            ranges: vec![0..0; tree.subtrees.len()],
            ..Self::default()
        };
        // `None` closes the sub-tree that was opened last.
        let (mut stack, mut open) = (vec![Some(0u32)], Vec::new());
        while let Some(next) = stack.pop() {
            let Some(subtree) = next else {
                let closed: u32 = open.pop().unwrap_or_default();
                out.ranges[closed as usize].end = out.triangles.len();
                continue;
            };
            open.push(subtree);
            stack.push(None);
            out.ranges[subtree as usize].start = out.triangles.len();
            for &t in &own[subtree as usize] {
                out.push(&drawable.scene().geometry, t as usize);
                out.owner.push(subtree);
            }
            let children = &tree.subtrees[subtree as usize].children;
            stack.extend(children.iter().map(|&c| Some(c)));
        }
        out
    }

    fn push(&mut self, all: &Geometry, triangle: usize) {
        let corner = self.positions.len() as u32;
        self.triangles.push([corner, corner + 1, corner + 2]);
        self.materials.push(all.triangle_material[triangle]);
        for i in all.triangles[triangle].map(|i| i as usize) {
            self.positions.push(all.positions[i]);
            self.colors.extend(all.colors.get(i));
            for (list, uvs) in self.uvs.iter_mut().zip(all.uvs) {
                list.extend(uvs.get(i));
            }
        }
    }

    fn scene<'a>(&'a self, all: &Scene<'a>, range: std::ops::Range<usize>) -> Scene<'a> {
        let corners = 3 * range.start..3 * range.end;
        Scene {
            geometry: Geometry {
                positions: &self.positions[corners.clone()],
                normals: &[],
                uvs: [0, 1].map(|set| self.uvs[set].get(corners.clone()).unwrap_or(&[])),
                colors: self.colors.get(corners).unwrap_or(&[]),
                triangles: &self.triangles[..range.len()],
                triangle_material: &self.materials[range],
            },
            materials: all.materials,
            textures: all.textures,
        }
    }

    /// The share of each sub-tree, seen from one direction.
    fn shares(&self, tree: &Tree, all: &Scene, to_eye: Vec3) -> Vec<f32> {
        let scale = DIAMETER_PX / 2.0;
        let up = if to_eye.y.abs() > 0.99 {
            Vec3::X
        } else {
            Vec3::Y
        };
        let camera = |center: Vec3, radius: f32| {
            let side = (2.0 * radius * scale).ceil() as u32 + 2;
            Camera::orthographic(-to_eye, up, center, scale, side, side)
        };
        let whole = self.scene(all, 0..self.triangles.len());
        let items = draw(&whole, &camera(Vec3::ZERO, 1.0), ONCE);
        let mut shown = vec![0u32; tree.subtrees.len()];
        for &t in items.triangle.iter().filter(|&&t| t != EMPTY) {
            shown[self.owner[t as usize] as usize] += 1;
        }
        for i in (1..shown.len()).rev() {
            if let Some(parent) = tree.subtrees[i].parent {
                shown[parent as usize] += shown[i];
            }
        }
        let share = |(subtree, &shown): (usize, &u32)| {
            let (center, radius) = tree.subtrees[subtree].sphere;
            let alone = self.scene(all, self.ranges[subtree].clone());
            let items = draw(&alone, &camera(center, radius), ONCE);
            let alone = items.triangle.iter().filter(|&&t| t != EMPTY).count();
            match alone {
                // Too small to be measured: nothing says that it is hidden.
                0 => 1.0,
                pixels => (shown as f32 / pixels as f32).min(1.0),
            }
        };
        shown.iter().enumerate().map(share).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::botany::grow::{Options, Species, grow};
    use crate::botany::load::{Limits, load_slice};
    use crate::botany::recognise::{RecogniseOptions, recognise};
    use crate::watch::Unwatched;

    #[test]
    fn the_whole_tree_is_seen_and_its_inside_less() {
        let options = Options {
            leaves: Some(1500),
            ..Options::default()
        };
        let grown = grow(&Species::named("oak").unwrap(), &options).unwrap();
        let limits = Limits::default();
        let model = load_slice(&grown.glb, std::path::Path::new("oak.glb"), &limits).unwrap();
        let tree = recognise(model, &RecogniseOptions::default()).unwrap();
        let measured = measure_subtrees(&tree, &Unwatched).unwrap();
        let directions = Measuring::new(0, 3).directions();
        let mean = |item: usize| {
            let all = directions.iter().map(|&d| measured.at(item, d));
            all.sum::<f32>() / directions.len() as f32
        };
        assert!((mean(0) - 1.0).abs() < 0.01, "{}", mean(0));
        let means: Vec<f32> = (1..tree.subtrees.len()).map(mean).collect();
        assert!(means.len() > 20);
        let least = means.iter().copied().fold(1.0, f32::min);
        assert!(least < 0.7, "something is behind something: {least}");
        // A branch hides less of itself from the side on which it grows.
        let mut sides = [0.0f32; 2];
        for (i, subtree) in tree.subtrees.iter().enumerate().skip(1) {
            let (center, radius) = subtree.sphere;
            let outward = Vec3::new(center.x, 0.0, center.z);
            if subtree.order == 1 && outward.length() > radius * 0.5 {
                sides[0] += measured.at(i, outward.normalize());
                sides[1] += measured.at(i, -outward.normalize());
            }
        }
        assert!(sides[0] > 1.1 * sides[1], "{sides:?}");
    }
}
