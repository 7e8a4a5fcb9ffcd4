//! `plan.ron`: what stands in a scene, and how the camera goes through it.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::knobs::{Knobs, Range};
use crate::scene::Scene;

/// What is planned. Read from RON; keys that are left out keep the default. Paths are relative to
/// the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Spec {
    /// Screen and field of view; its `nearest_m` and `farthest_m` hold beside what the camera's path
    /// says.
    pub scene: Scene,
    /// The kinds of trees; at least one.
    pub species: Vec<Species>,
    /// Side of the square around the origin that trees without places are strewn over, metres, 1 to
    /// 100,000; default 300.
    pub region_m: f64,
    /// Points that the camera passes, with as many frames between each two; metres, y up. Default: a
    /// walk across the region at a height of 1.7 m.
    pub camera: Vec<Key>,
    /// Frames of the path, 1 to 100,000; default 120.
    pub frames: u32,
    /// Levels beside the original, 1 to 12; default 4.
    pub levels: u8,
    /// Triangles that the worst frame may draw; default 0: no limit. Where the levels draw more, all
    /// of them are moved nearer.
    pub triangles_per_frame: u64,
    /// Levels take no more triangles than this error needs where they start, pixels, up to 1000; default 0: as many as
    /// they may. What that saves is known once they are baked.
    pub max_error_px: f64,
    /// Whether levels are fitted for all directions, not only for those from which the path shows them; default false.
    pub from_all_sides: bool,
}

/// One kind of tree.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Species {
    /// The tree: .glb or .gltf.
    pub input: PathBuf,
    /// Trees that are strewn over the region, where no places are given.
    pub count: u32,
    /// A file of places: a line a tree, "x, y, z", "x, y, z, scale" or "x, y, z, scale, turn", metres and degrees around
    /// y (without it a tree may be turned any way); a head line and lines that begin with # are passed over. Or a .glb or .gltf: each node with a mesh, and each instance of
    /// EXT_mesh_gpu_instancing, is a tree; what the mesh is does not matter.
    pub places: Option<PathBuf>,
    /// The atlas that its levels share with those of other species that name it: all of them are baked into one package
    /// of this name. Default: none.
    pub atlas: String,
}

/// A point of the camera's path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Key {
    /// The eye, metres.
    pub eye: [f32; 3],
    /// What it looks at, metres.
    pub target: [f32; 3],
}

impl Default for Spec {
    fn default() -> Self {
        Self {
            scene: Scene::default(),
            species: Vec::new(),
            region_m: 300.0,
            camera: Vec::new(),
            frames: 120,
            levels: 4,
            triangles_per_frame: 0,
            max_error_px: 0.0,
            from_all_sides: false,
        }
    }
}

impl Knobs for Spec {
    const KIND: &'static str = "plan";

    fn ranges(&self) -> Vec<Range> {
        let mut out = vec![
            Range::of("region_m", self.region_m, 1.0, 100_000.0),
            Range::of("frames", self.frames, 1.0, 100_000.0),
            Range::of("levels", self.levels, 1.0, 12.0),
            Range::of("max_error_px", self.max_error_px, 0.0, 1000.0),
        ];
        out.extend(self.scene.ranges());
        let counts = self.species.iter().map(|s| f64::from(s.count));
        out.extend(counts.map(|count| Range::of("count", count, 0.0, 1e7)));
        let points = self.camera.iter().flat_map(|k| [k.eye, k.target]);
        out.extend(points.flatten().map(|v| Range::of("camera", v, -1e9, 1e9)));
        out
    }
}
