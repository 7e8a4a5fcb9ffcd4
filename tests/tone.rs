//! Colours of levels, as a client draws them: in the mean those of the original.

#[path = "support/tree.rs"]
mod tree;

use std::path::Path;

use glam::Vec3;
use pleach::botany::load::load;
use pleach::pipeline::{Limit, Request, Wanted, bake};
use pleach::recipe::Recipe;
use pleach::report::{Settings, evaluate};
use pleach::scene::Scene;
use pleach::space::view::Lens;
use pleach::watch::Unwatched;

use tree::write_tree;

/// Height of the tree in pixels where the level starts.
const HEIGHT_PX: u32 = 64;

/// The same where its tile takes over: at half as many texels.
const TILE_PX: u32 = 31;

/// A white trunk, and dark leaves so small and sparse that few texels of a card are full of them.
fn birch(file: &Path) {
    let random =
        |i: u32, k: u32| (f64::from(i * 7 + k) * f64::from(k * k + 2).sqrt()).fract() as f32 - 0.5;
    let (mut crown, mut leaves) = (Vec::new(), Vec::new());
    for i in 0..3000 {
        let center = Vec3::new(
            random(i, 1) * 5.0,
            4.5 + random(i, 2) * 6.0,
            random(i, 3) * 5.0,
        );
        let u = Vec3::new(random(i, 4), random(i, 5), random(i, 6)).normalize_or(Vec3::X);
        let v = u.any_orthonormal_vector() * 0.045;
        let at = crown.len() as u32;
        crown.extend(
            [-u * 0.045 - v, u * 0.045 - v, u * 0.045 + v, v - u * 0.045].map(|p| p + center),
        );
        for [a, b, c] in [[at, at + 1, at + 2], [at, at + 2, at + 3]] {
            leaves.extend([[a, b, c], [a, c, b]]);
        }
    }
    let white = [0.8, 0.8, 0.8, 1.0];
    write_tree(
        file,
        white,
        &crown,
        &[("leaf", [0.02, 0.2, 0.01, 1.0], leaves)],
    );
}

#[test]
fn a_white_birch_with_sparse_leaves_turns_no_whiter_in_levels_and_tiles() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("tree.glb");
    birch(&input);
    let request = Request {
        input: input.clone(),
        output: folder.path().join("package"),
        wanted: Wanted::Limits(vec![Limit::Count(24)]),
        recipe: Recipe {
            hierarchy: true,
            ..Recipe::draft()
        },
        scene: Scene {
            heights_px: vec![HEIGHT_PX.into()],
            ..Scene::default()
        },
        accept: true,
        ..Request::default()
    };
    bake(&request, &Unwatched).unwrap();
    let written =
        ["tree_LOD1.glb", "tree_tile_0.glb"].map(|file| folder.path().join("package").join(file));
    let original = load(&input).unwrap();
    let [level, tile] = written.map(|file| load(&file).unwrap());
    let settings = Settings {
        // The original as fine as nobody sees it: no leaf falls between pixels.
        heights_px: vec![16 * HEIGHT_PX, TILE_PX, HEIGHT_PX],
        client: true,
        // From nearer a lens would see more of the crown than of the trunk.
        lens: Lens::Parallel,
        elevations_deg: vec![-15.0, 0.0, 30.0],
        views: 33,
        ..Settings::default()
    };
    let report = evaluate(
        (&original, "tree"),
        &[(&level, "level"), (&tile, "tile")],
        &settings,
    );
    let color = |sizes: &[pleach::report::schema::SizeFigures], height_px: u32| {
        let size = sizes.iter().find(|s| s.height_px == height_px).unwrap();
        size.client.as_ref().unwrap().base_color_linear.unwrap()
    };
    let wanted = color(&report.original.unwrap().sizes, 16 * HEIGHT_PX);
    // White and green, neither alone.
    assert!(wanted[0] > 0.05 && wanted[0] < 0.5, "{wanted:?}");
    for (row, height_px) in report.levels.iter().zip([HEIGHT_PX, TILE_PX]) {
        for (wanted, found) in wanted.into_iter().zip(color(&row.sizes, height_px)) {
            assert!(
                (found / wanted - 1.0).abs() < 0.08,
                "{}: {found} beside {wanted}",
                row.file
            );
        }
    }
}
