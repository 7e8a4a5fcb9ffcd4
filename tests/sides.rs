//! Leaves with pale undersides: cards whose sides differ visibly show each side's own colours. Leaves with one side: so have
//! cards.

#[path = "support/tree.rs"]
mod tree;

use std::path::Path;

use glam::Vec3;
use pleach::botany::load::load;
use pleach::botany::model::Image;
use pleach::export::manifest::{Level, Manifest};
use pleach::pipeline::{Limit, Request, Wanted, bake};
use pleach::recipe::Recipe;
use pleach::report::schema::Report;
use pleach::report::{Settings, evaluate};
use pleach::scene::Scene;
use pleach::watch::Unwatched;

use tree::{BARK, write_tree};

/// Triangles of the level.
const BUDGET: u64 = 200;

/// A trunk, and leaves that lie nearly level: green above, red below, each side a sheet of its own.
fn two_toned(file: &Path) {
    let random = |i: u32, k: u32| ((i * 7919 + k * 104_729) as f32 * 0.618_034).fract() - 0.5;
    let (mut crown, mut above, mut below) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..300 {
        let center = Vec3::new(
            random(i, 1) * 4.0,
            4.0 + random(i, 2) * 4.0,
            random(i, 3) * 4.0,
        );
        let u = Vec3::new(random(i, 4), 0.2 * random(i, 5), random(i, 6)).normalize_or(Vec3::X);
        let v = Vec3::Y.cross(u).normalize_or(Vec3::X) * 0.2;
        let u = u * 0.2;
        let at = crown.len() as u32;
        crown.extend([
            center - u - v,
            center - u + v,
            center + u + v,
            center + u - v,
        ]);
        for [a, b, c] in [[at, at + 2, at + 1], [at, at + 3, at + 2]] {
            above.push([a, b, c]);
            below.push([a, c, b]);
        }
    }
    if (crown[above[0][1] as usize] - crown[above[0][0] as usize])
        .cross(crown[above[0][2] as usize] - crown[above[0][0] as usize])
        .y
        < 0.0
    {
        std::mem::swap(&mut above, &mut below);
    }
    let sheets = [
        ("leaf", [0.0, 0.5, 0.0, 1.0], above),
        ("underside", [0.5, 0.0, 0.0, 1.0], below),
    ];
    write_tree(file, BARK, &crown, &sheets);
}

/// The level's cards and the page that they show.
fn baked(folder: &Path, second_sides: bool) -> (Level, Image) {
    baked_for(folder, second_sides, Scene::default())
}

fn baked_for(folder: &Path, second_sides: bool, scene: Scene) -> (Level, Image) {
    let input = folder.join("tree.glb");
    two_toned(&input);
    let output = folder.join("package");
    let request = Request {
        input,
        output: output.clone(),
        wanted: Wanted::Limits(vec![Limit::Count(BUDGET)]),
        recipe: Recipe {
            second_sides,
            // Rectangles, so that a card's texels are all that its rectangle holds.
            triangular_cards: false,
            ..Recipe::draft()
        },
        scene,
        force: true,
        accept: true,
        ..Request::default()
    };
    bake(&request, &Unwatched).unwrap();
    let manifest = std::fs::read_to_string(output.join("tree.pleach.ron")).unwrap();
    let manifest = Manifest::from_ron(&manifest, Path::new("tree.pleach.ron")).unwrap();
    let model = load(&output.join("tree_LOD1.glb")).unwrap();
    let page = model.images.iter().find(|i| i.name.contains("base_color"));
    (manifest.levels[1].clone(), page.unwrap().clone())
}

/// Mean red and green of the opaque texels of a rectangle.
fn red_and_green(page: &Image, [left, top, width, height]: [u32; 4]) -> Option<[f64; 2]> {
    let texels =
        (top..top + height).flat_map(|y| (left..left + width).map(move |x| y * page.width + x));
    let opaque: Vec<&[u8]> = texels
        .map(|at| &page.rgba[at as usize * 4..][..4])
        .filter(|t| t[3] >= 128)
        .collect();
    let mean = |channel: usize| {
        opaque.iter().map(|t| f64::from(t[channel])).sum::<f64>() / opaque.len() as f64
    };
    (!opaque.is_empty()).then(|| [mean(0), mean(1)])
}

fn looks_up(corners: &[[f32; 3]]) -> f32 {
    let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(corners[i]));
    (b - a).cross(c - a).normalize().y
}

#[test]
fn a_card_is_green_from_above_and_red_from_below() {
    let folder = tempfile::tempdir().unwrap();
    let (level, page) = baked(folder.path(), true);
    assert!(level.triangles <= BUDGET, "{}", level.triangles);
    let mut seen = 0;
    for card in &level.cards {
        let up = looks_up(&card.corners);
        let (Some(back), true) = (card.back, up.abs() > 0.8) else {
            continue;
        };
        let sides = [card.atlas, back].map(|rectangle| red_and_green(&page, rectangle));
        let [Some([red, green]), Some([back_red, back_green])] = sides else {
            continue;
        };
        // The front is what the card's normal looks to.
        assert_eq!(
            green > red,
            up > 0.0,
            "front {red:.0} {green:.0}, up {up:.2}"
        );
        assert_eq!(
            back_green > back_red,
            up < 0.0,
            "back {back_red:.0} {back_green:.0}, up {up:.2}"
        );
        seen += 1;
    }
    assert!(
        seen * 2 > level.cards.len(),
        "{seen} of {}",
        level.cards.len()
    );
}

#[test]
fn second_sides_make_no_crown_larger() {
    let folder = tempfile::tempdir().unwrap();
    let area = |second_sides: bool| {
        // From so far that a quarter of a pixel, by which sides stand apart, is much of a leaf.
        let scene = Scene {
            first_height_px: 96.0,
            ..Scene::default()
        };
        baked_for(folder.path(), second_sides, scene);
        let report = std::fs::read_to_string(folder.path().join("package/report.json")).unwrap();
        let report: Report = serde_json::from_str(&report).unwrap();
        report.levels[0].sizes[0].area_ratio.mean
    };
    let [sided, plain] = [area(true), area(false)];
    assert!((sided - plain).abs() < 0.015, "{sided} beside {plain}");
}

#[test]
fn without_second_sides_cards_have_one_texture_and_are_more() {
    let folder = tempfile::tempdir().unwrap();
    let (level, _) = baked(folder.path(), false);
    assert!(level.cards.iter().all(|card| card.back.is_none()));
    let (sided, _) = baked(folder.path(), true);
    assert!(level.cards.len() > sided.cards.len());
}

#[test]
fn a_side_that_the_scene_never_shows_gets_no_texels() {
    let folder = tempfile::tempdir().unwrap();
    for (elevations_deg, is_green) in [([35.0, 90.0], true), ([-90.0, -35.0], false)] {
        let scene = Scene {
            elevations_deg,
            ..Scene::default()
        };
        let (level, page) = baked_for(folder.path(), true, scene);
        let mut seen = 0;
        for card in &level.cards {
            let up = looks_up(&card.corners);
            if up.abs() < 0.8 {
                continue;
            }
            assert!(card.back.is_none());
            // The front of such a card is the side that the camera sees.
            assert_eq!(up > 0.0, is_green);
            let [red, green] = red_and_green(&page, card.atlas).unwrap();
            assert_eq!(green > red, is_green, "{red:.0} {green:.0}");
            seen += 1;
        }
        assert!(
            seen * 2 > level.cards.len(),
            "{seen} of {}",
            level.cards.len()
        );
    }
}

/// Leaves that stand upright and face +z, at most 45 degrees off, with one side or, in two layers, with two.
fn facing_z(file: &Path, layers: bool) {
    let random = |i: u32, k: u32| ((i * 7919 + k * 104_729) as f32 * 0.618_034).fract() - 0.5;
    let (mut crown, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..300 {
        let center = Vec3::new(random(i, 1), random(i, 2), random(i, 3)) * 4.0 + Vec3::Y * 6.0;
        let facing = Vec3::new(random(i, 4), random(i, 5), 0.7).normalize();
        let u = Vec3::Y.cross(facing).normalize() * 0.2;
        let v = facing.cross(u);
        let at = crown.len() as u32;
        crown.extend([
            center - u - v,
            center + u - v,
            center + u + v,
            center - u + v,
        ]);
        for [a, b, c] in [[at, at + 1, at + 2], [at, at + 2, at + 3]] {
            triangles.push([a, b, c]);
            triangles.extend(layers.then_some([a, c, b]));
        }
    }
    write_tree(
        file,
        BARK,
        &crown,
        &[("leaf", [0.0, 0.5, 0.0, 1.0], triangles)],
    );
}

/// The level of such a tree, beside the original.
fn level_of(folder: &Path, layers: bool) -> [pleach::botany::Model; 2] {
    let input = folder.join("tree.glb");
    facing_z(&input, layers);
    let request = Request {
        input: input.clone(),
        output: folder.join("package"),
        wanted: Wanted::Limits(vec![Limit::Count(BUDGET)]),
        recipe: Recipe::draft(),
        ..Request::default()
    };
    bake(&request, &Unwatched).unwrap();
    [input, folder.join("package/tree_LOD1.glb")].map(|file| load(&file).unwrap())
}

/// Whether a model's leaves or cards are drawn from both sides.
fn is_double_sided(model: &pleach::botany::Model) -> bool {
    let leafy = model.materials.iter().find(|m| m.name != "bark");
    leafy.unwrap().double_sided
}

#[test]
fn leaves_with_one_side_are_seen_from_that_side_alone() {
    let folder = tempfile::tempdir().unwrap();
    let [original, level] = level_of(folder.path(), false);
    assert!(level.triangles.len() as u64 <= BUDGET);
    assert!(!is_double_sided(&original) && !is_double_sided(&level));
    let settings = Settings {
        heights_px: vec![128],
        elevations_deg: vec![0.0],
        views: 5,
        ..Settings::default()
    };
    let report = evaluate((&original, "tree"), &[(&level, "level")], &settings);
    let views = &report.levels[0].sizes[0].views;
    let of = |name: &str| views.iter().find(|v| v.view == name).unwrap();
    // From the front the crown, from behind the trunk alone.
    for (name, least) in [
        ("azimuth 0 elevation 0", 0.75),
        ("azimuth 180 elevation 0", 0.9),
    ] {
        let view = of(name);
        assert!(view.f1 > least, "{view:?}");
        assert!((0.85..1.15).contains(&view.area_ratio), "{view:?}");
    }
}

#[test]
fn two_layers_of_leaves_are_seen_from_both_sides() {
    let folder = tempfile::tempdir().unwrap();
    let [original, level] = level_of(folder.path(), true);
    assert!(!is_double_sided(&original) && is_double_sided(&level));
}
