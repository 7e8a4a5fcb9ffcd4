//! A tree whose colours and leaves a test chooses.

use std::path::Path;

use glam::Vec3;
use pleach::space::glb::GlbBuilder;
use serde_json::json;

/// Bark as most trees have it, linear RGBA.
#[allow(dead_code, reason = "not every test wants it")]
pub const BARK: [f32; 4] = [0.3, 0.2, 0.1, 1.0];

/// Name, colour and triangles of leaves that are drawn from their front alone; colours are linear RGBA.
pub type Sheet = (&'static str, [f32; 4], Vec<[u32; 3]>);

/// A trunk 5 m high, of this linear RGBA, with a crown.
pub fn write_tree(file: &Path, bark_color: [f32; 4], crown: &[Vec3], sheets: &[Sheet]) {
    let mut glb = GlbBuilder::default();
    let (mut wood, mut bark) = (Vec::new(), Vec::new());
    for ring in 0..6u32 {
        for side in 0..8u32 {
            let angle = side as f32 * std::f32::consts::FRAC_PI_4;
            wood.push(Vec3::new(angle.cos() * 0.2, ring as f32, angle.sin() * 0.2));
            if ring > 0 {
                let [a, b] = [side, (side + 1) % 8].map(|s| (ring - 1) * 8 + s);
                bark.extend([[a, a + 8, b], [b, a + 8, b + 8]]);
            }
        }
    }
    let mut primitive = |points: &[Vec3], triangles: &[[u32; 3]], material: u32| {
        let position = glb.positions(points);
        let indices = glb.indices(triangles, points.len());
        json!({ "attributes": { "POSITION": position }, "indices": indices, "material": material })
    };
    let mut primitives = vec![primitive(&wood, &bark, 0)];
    let color = |name: &str, rgba: [f32; 4]| json!({ "name": name, "pbrMetallicRoughness": { "baseColorFactor": rgba } });
    let mut materials = vec![color("bark", bark_color)];
    for (name, rgba, triangles) in sheets {
        primitives.push(primitive(crown, triangles, materials.len() as u32));
        materials.push(color(name, *rgba));
    }
    let root = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }], "meshes": [{ "primitives": primitives }], "materials": materials,
    });
    std::fs::write(file, glb.finish(root)).unwrap();
}
