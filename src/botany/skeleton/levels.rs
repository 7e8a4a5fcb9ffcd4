//! Any wood at all: level sets of the geodesic distance from the base.
//!
//! Verroust and Lazarus, "Extracting skeletal curves from 3D scattered data", The Visual Computer
//! 16, 2000. The surface is cut into bands of equal distance along the surface (`bands.rs`); each
//! connected piece of a band is a node (`pieces.rs`). Where a band falls into several
//! pieces the wood forks, and one of them goes on as the same chain (`chains.rs`).

use super::base::{base, distances, ring_of};
use super::mesh::PartMesh;
use super::{LocalChain, PartSkeleton, bands, chains, pieces};

/// The chains of a part; the first one starts at the base.
pub fn trace(mesh: &PartMesh) -> PartSkeleton {
    let sources = base(mesh);
    let distance = distances(mesh, &sources);
    if distance.iter().all(|&d| d <= 0.0) {
        return one_node(mesh);
    }
    let bands = bands::cut(mesh, &distance);
    let pieces = pieces::describe(mesh, &distance, &bands);
    chains::grow(mesh, &bands, &pieces, ring_of(mesh, &sources))
}

fn one_node(mesh: &PartMesh) -> PartSkeleton {
    PartSkeleton {
        chains: vec![LocalChain {
            nodes: vec![super::tube::ring_node(&mesh.points)],
            parent: None,
        }],
        node_of_triangle: vec![(0, 0); mesh.triangles.len()],
        by_segment: false,
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::botany::part::Parts;

    /// Square tubes that share rims.
    #[derive(Default)]
    struct Skin {
        points: Vec<Vec3>,
        triangles: Vec<[u32; 3]>,
    }

    impl Skin {
        fn ring(&mut self, center: Vec3, axes: [Vec3; 2], radius: f32) -> [u32; 4] {
            [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)].map(|(a, b)| {
                self.points
                    .push(center + (axes[0] * a + axes[1] * b) * radius);
                self.points.len() as u32 - 1
            })
        }

        /// Goes on from a rim over rings; the wall after ring `hole` (0: the rim) is left open on its
        /// last side, and the rim of that hole returned.
        fn tube(
            &mut self,
            rim: [u32; 4],
            rings: &[(Vec3, f32)],
            axes: [Vec3; 2],
            hole: usize,
        ) -> [u32; 4] {
            let (mut below, mut out) = (rim, rim);
            for (i, &(center, radius)) in rings.iter().enumerate() {
                let above = self.ring(center, axes, radius);
                for (a, b) in [(0, 1), (1, 2), (2, 3), (3, 0)] {
                    if i == hole && a == 3 {
                        out = [below[3], below[0], above[0], above[3]];
                        continue;
                    }
                    self.triangles.push([below[a], below[b], above[b]]);
                    self.triangles.push([below[a], above[b], above[a]]);
                }
                below = above;
            }
            out
        }

        fn trace(&self) -> PartSkeleton {
            let parts = Parts {
                points: self.points.clone(),
                welded: self.triangles.clone(),
                duplicate: vec![false; self.triangles.len()],
                ..Parts::default()
            };
            let all: Vec<u32> = (0..self.triangles.len() as u32).collect();
            super::trace(&PartMesh::new(&parts, &all))
        }
    }

    /// A trunk of long faces, a twig a tenth as thick, and on it one that is shorter than half of all
    /// edges: each is cut at its own scale.
    #[test]
    fn a_twig_shorter_than_the_trunks_faces_has_its_chain_and_parent() {
        let mut skin = Skin::default();
        let axes = [Vec3::X, Vec3::Z];
        let foot = skin.ring(Vec3::ZERO, axes, 0.2);
        let trunk: Vec<(Vec3, f32)> = (1..=4).map(|i| (Vec3::Y * i as f32, 0.2)).collect();
        let rim = skin.tube(foot, &trunk, axes, 2);
        let twig = [0.5, 1.0, 1.05, 1.5].map(|x: f32| (Vec3::new(x, 2.5, 0.0), 0.02));
        let rim = skin.tube(rim, &twig, [Vec3::NEG_Y, Vec3::NEG_Z], 2);
        let small = [-0.06, -0.2].map(|z: f32| (Vec3::new(1.025, 2.5, z), 0.01));
        skin.tube(rim, &small, [Vec3::NEG_X, Vec3::Y], usize::MAX);

        let found = skin.trace();
        let parents: Vec<Option<u32>> = (found.chains.iter())
            .map(|c| c.parent.map(|p| p.0))
            .collect();
        assert_eq!(parents, [None, Some(0), Some(1)]);
        let tip = |c: usize| found.chains[c].nodes[found.chains[c].nodes.len() - 1].0;
        assert!(tip(0).abs_diff_eq(Vec3::Y * 4.0, 0.05), "{}", tip(0));
        assert!(
            tip(1).abs_diff_eq(Vec3::new(1.5, 2.5, 0.0), 0.02),
            "{}",
            tip(1)
        );
        assert!(
            tip(2).abs_diff_eq(Vec3::new(1.025, 2.5, -0.2), 0.02),
            "{}",
            tip(2)
        );
    }

    /// What stands on a skin by one point only hangs there, and is not lost.
    #[test]
    fn branches_that_touch_in_a_point_stay_together() {
        let mut skin = Skin::default();
        let axes = [Vec3::X, Vec3::Z];
        let foot = skin.ring(Vec3::ZERO, axes, 0.1);
        let trunk: Vec<(Vec3, f32)> = (1..=6).map(|i| (Vec3::Y * 0.5 * i as f32, 0.1)).collect();
        skin.tube(foot, &trunk, axes, usize::MAX);
        // A cone whose apex is a corner of the third ring.
        let apex = foot[0] + 12;
        let twig = [0.3, 0.6, 0.9].map(|x: f32| (Vec3::new(x, 1.5, 0.1), 0.03));
        skin.tube([apex; 4], &twig, [Vec3::NEG_Y, Vec3::NEG_Z], usize::MAX);
        skin.triangles
            .retain(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
        let found = skin.trace();
        assert_eq!(found.chains.len(), 2);
        let nodes = &found.chains[1].nodes;
        assert!(nodes[nodes.len() - 1].0.x > 0.85, "{nodes:?}");
    }
}
