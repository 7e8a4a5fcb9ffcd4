//! Any wood at all: level sets of the geodesic distance from the base.
//!
//! Verroust and Lazarus, "Extracting skeletal curves from 3D scattered data", The Visual Computer
//! 16, 2000. The surface is cut into bands of equal distance along the surface ([`bands`]); each
//! connected piece of a band is a node ([`pieces`](super::pieces)). Where a band falls into several
//! pieces the wood forks, and one of them goes on as the same chain ([`chains`]).

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
