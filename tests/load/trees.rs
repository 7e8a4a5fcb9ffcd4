//! Loads the sample trees that other software made; skipped where they are not there.

use std::path::PathBuf;

use pleach::botany::load::load;

fn trees() -> Option<PathBuf> {
    let folder = std::env::var_os("PLEACH_TREES").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/trees")),
        PathBuf::from,
    );
    if !folder.is_dir() {
        println!("skipped: no sample trees at {}", folder.display());
        return None;
    }
    Some(folder)
}

/// File, triangles shown (the trees' README counts the maples' leaf, two triangles, once: 75,586).
const TREES: &[(&str, usize)] = &[
    ("sap_birch_6142", 203_228),
    ("sap_aspen_hex", 90_420),
    ("sap_aspen_107k", 600_474),
    ("sap_aspen_cm_far", 78_314),
    ("sap_callistemon_hex", 48_408),
    ("sap_small_pine_rect", 157_438),
    ("sap_palm_pinnate", 22_480),
    ("sap_palm_fan", 12_304),
    ("sap_weeping_willow_rect", 154_200),
    ("sap_winter_birch_bare", 191_328),
    ("sap_maple_nodes_instanced", 77_180),
    ("gt_maple_gpu_instancing", 77_180),
    ("gp_maple_gpu_instancing", 77_180),
    ("mtree_oak_polyleaf", 687_850),
    ("ez_oak_medium", 13_806),
    ("ez_pine_medium", 19_872),
    ("gt_oak_quantized", 13_806),
    ("hel_pistachio", 98_848),
];

#[test]
fn sample_trees_load_with_the_known_triangle_counts() {
    let Some(folder) = trees() else { return };
    for &(name, triangles) in TREES {
        let clock = std::time::Instant::now();
        let model = load(&folder.join(format!("{name}.glb"))).unwrap();
        println!(
            "{name}: {} of {triangles} triangles, {} vertices, {} objects, {} materials, {:?}, radius {:.3}, {:.0?}",
            model.triangles.len(),
            model.positions.len(),
            model.objects.len(),
            model.materials.len(),
            model.images,
            model.frame.radius,
            clock.elapsed(),
        );
        model.warnings.iter().for_each(|w| println!("    {w}"));
        let dropped = triangles - model.triangles.len();
        assert!(
            dropped * 50 <= triangles,
            "{name}: {dropped} triangles dropped"
        );
        assert_eq!(dropped > 0, !model.warnings.is_empty(), "{name}");
    }
}
