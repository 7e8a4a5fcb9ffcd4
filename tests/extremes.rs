//! Trees at the ends of the range: what nobody would call a tree still becomes a package.

use std::path::Path;
use std::process::Command;

use glam::Vec3;
use pleach::report::schema::Report;
use pleach::space::glb::GlbBuilder;
use serde_json::json;

/// Positions and triangles of one material.
type Part = (Vec<Vec3>, Vec<[u32; 3]>);

fn random(i: u32, k: u32) -> f32 {
    ((i * 7919 + k * 104_729) as f32 * 0.618_034).fract() - 0.5
}

/// Square leaves of an edge around `center`, spanned by two axes each.
fn leaves(count: u32, edge: f32, center: impl Fn(u32) -> Vec3, flat: bool) -> Part {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..count {
        let some = |k| Vec3::new(random(i, k), random(i, k + 1), random(i, k + 2));
        let (u, v) = match flat {
            true => (Vec3::X, Vec3::Y),
            false => (some(4).normalize_or(Vec3::X), some(7).normalize_or(Vec3::Y)),
        };
        let (u, v) = (u * edge / 2.0, v * edge / 2.0);
        let (c, at) = (center(i), points.len() as u32);
        points.extend([c - u - v, c + u - v, c + u + v, c - u + v]);
        triangles.extend([[at, at + 1, at + 2], [at, at + 2, at + 3]]);
    }
    (points, triangles)
}

/// Rings of eight corners along `path`, each in the plane of `axes`; joined to a ring if `closed`.
fn tube(path: &[(Vec3, [Vec3; 2])], closed: bool) -> Part {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for (center, [a, b]) in path {
        points.extend((0..8).map(|s| {
            let angle = s as f32 * std::f32::consts::FRAC_PI_4;
            *center + (*a * angle.cos() + *b * angle.sin()) * 0.15
        }));
    }
    let rings = path.len() as u32;
    for ring in 0..if closed { rings } else { rings - 1 } {
        for side in 0..8 {
            let next = (ring + 1) % rings;
            let [a, b] = [side, (side + 1) % 8].map(|s| ring * 8 + s);
            let [c, d] = [side, (side + 1) % 8].map(|s| next * 8 + s);
            triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    (points, triangles)
}

fn trunk() -> Part {
    let ring = |i: u8| (Vec3::Y * 0.5 * f32::from(i), [Vec3::Z, Vec3::X]);
    tube(&(0..8).map(ring).collect::<Vec<_>>(), false)
}

fn ring() -> Part {
    let at = |i: u8| {
        let angle = f32::from(i) / 24.0 * std::f32::consts::TAU;
        let out = Vec3::new(angle.cos(), angle.sin(), 0.0);
        (Vec3::Y * 2.5 + out * 2.0, [out, Vec3::Z])
    };
    tube(&(0..24).map(at).collect::<Vec<_>>(), true)
}

fn ball(i: u32) -> Vec3 {
    Vec3::new(random(i, 1), random(i, 2) + 1.4, random(i, 3)) * 2.5
}

fn write(file: &Path, parts: &[(&str, Part)]) {
    let mut glb = GlbBuilder::default();
    let primitives: Vec<_> = parts
        .iter()
        .enumerate()
        .map(|(i, (_, (points, triangles)))| {
            let position = glb.positions(points);
            let indices = glb.indices(triangles, points.len());
            json!({ "attributes": { "POSITION": position }, "indices": indices, "material": i })
        })
        .collect();
    let materials: Vec<_> = parts
        .iter()
        .map(|(name, _)| json!({ "name": name, "doubleSided": true }))
        .collect();
    let root = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }], "meshes": [{ "primitives": primitives }],
        "materials": materials,
    });
    std::fs::write(file, glb.finish(root)).unwrap();
}

/// Bakes two levels for a small screen, and reads the report.
fn bake(parts: &[(&str, Part)], more: &[&str]) -> Report {
    let home = tempfile::tempdir().unwrap();
    write(&home.path().join("t.glb"), parts);
    std::fs::write(home.path().join("s.ron"), "(first_height_px: 64)").unwrap();
    let done = Command::new(env!("CARGO_BIN_EXE_pleach"))
        .args(["bake", "t.glb", "-o", "out", "--preset", "draft", "--json"])
        .args(["--scene", "s.ron"])
        .args(more)
        .current_dir(home.path())
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.success(), "{message}");
    assert!(home.path().join("out/t_LOD1.glb").is_file());
    serde_json::from_slice(&done.stdout).unwrap()
}

/// Mean F1 of each level at its own size.
fn f1(report: &Report) -> Vec<f64> {
    report.levels.iter().map(|l| l.sizes[0].f1.mean).collect()
}

#[test]
fn one_leaf_and_two_are_their_own_levels() {
    for count in [1, 2] {
        let report = bake(&[("leaf", leaves(count, 0.2, ball, false))], &[]);
        for level in &report.levels {
            assert_eq!(level.triangles, 2 * u64::from(count));
        }
        let nearest = &report.levels[0].sizes[0];
        assert!((nearest.area_ratio.worst - 1.0).abs() < 0.02);
    }
}

#[test]
fn leaves_in_a_plane_on_a_line_and_far_from_their_trunk_are_baked() {
    let plane = |i| Vec3::new(random(i, 1) * 2.0, random(i, 2) * 2.0, 0.0);
    let line = |i: u32| Vec3::Y * 0.01 * i as f32;
    let ground = |i| Vec3::new(random(i, 1) * 16.0, 0.01, random(i, 2) * 16.0);
    let cases = [
        ("plane", vec![("leaf", leaves(200, 0.2, plane, true))]),
        ("line", vec![("leaf", leaves(200, 0.4, line, false))]),
        (
            "ground",
            vec![("bark", trunk()), ("leaf", leaves(100, 0.2, ground, false))],
        ),
    ];
    for (name, parts) in cases {
        let report = bake(&parts, &["--triangles", "20%,24"]);
        let f1 = f1(&report);
        assert!(f1.len() == 2 && f1[0] > 0.7, "{name}: {f1:?}");
    }
}

#[test]
fn wood_or_foliage_alone_and_a_ring_of_wood_are_baked() {
    let cases = [
        ("trunk", vec![("bark", trunk())]),
        ("foliage", vec![("leaf", leaves(300, 0.3, ball, false))]),
        (
            "ring",
            vec![("bark", ring()), ("leaf", leaves(100, 0.2, ball, false))],
        ),
    ];
    for (name, parts) in cases {
        let report = bake(&parts, &["--triangles", "50%,24"]);
        let f1 = f1(&report);
        assert!(f1.len() == 2 && f1[0] > 0.8, "{name}: {f1:?}");
    }
}

#[test]
fn slivers_are_baked_and_a_budget_beyond_the_tree_is_the_tree() {
    let mut slivers = (Vec::new(), Vec::new());
    for i in 0..200u32 {
        let y = i as f32 * 0.01;
        slivers
            .0
            .extend([Vec3::new(0.0, y, 0.0), Vec3::new(1.0, y, 0.0)]);
        slivers.0.push(Vec3::new(0.5, y + 1e-5, 0.0));
        slivers.1.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let report = bake(
        &[("bark", trunk()), ("leaf", slivers)],
        &["--triangles", "24"],
    );
    assert!(report.levels[0].triangles <= 24);
    let parts = [("bark", trunk()), ("leaf", leaves(50, 0.3, ball, false))];
    let report = bake(&parts, &["--triangles", "9000,100%,24"]);
    let triangles: Vec<u64> = report.levels.iter().map(|l| l.triangles).collect();
    assert_eq!(triangles[..2], [112 + 100; 2]);
    assert!((report.levels[0].sizes[0].area_ratio.worst - 1.0).abs() < 0.01);
}

#[test]
fn leaves_in_one_point_are_one_and_a_tree_that_is_there_twice_is_one_tree() {
    let point = |_| Vec3::Y;
    let report = bake(
        &[("leaf", leaves(300, 1.0, point, true))],
        &["--triangles", "24"],
    );
    assert_eq!(report.original.unwrap().triangles, 2);
    let tree = || vec![("bark", trunk()), ("leaf", leaves(100, 0.3, ball, false))];
    let (once, mut twice) = (tree(), tree());
    for (part, (_, again)) in twice.iter_mut().zip(tree()) {
        let base = part.1.0.len() as u32;
        part.1.0.extend(again.0);
        part.1.1.extend(again.1.iter().map(|t| t.map(|i| i + base)));
    }
    let [once, twice] = [once, twice].map(|parts| bake(&parts, &["--triangles", "20%,24"]));
    let triangles = |r: &Report| r.original.as_ref().unwrap().triangles;
    assert_eq!(triangles(&twice), triangles(&once));
    assert_eq!(f1(&twice), f1(&once));
}

/// One closed skin with bumps, around as many degrees as a globe has.
fn blob() -> Part {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    let (rings, sides) = (48u32, 96u32);
    for i in 0..=rings {
        let down = std::f32::consts::PI * i as f32 / rings as f32;
        for j in 0..sides {
            let round = std::f32::consts::TAU * j as f32 / sides as f32;
            let out = Vec3::new(
                down.sin() * round.cos(),
                down.cos(),
                down.sin() * round.sin(),
            );
            let bump = 1.0 + 0.25 * (5.0 * round).sin() * (4.0 * down).sin();
            points.push(out * bump + Vec3::Y * 1.5);
        }
    }
    for i in 0..rings {
        for j in 0..sides {
            let [a, b] = [j, (j + 1) % sides].map(|j| i * sides + j);
            triangles.extend([[a, b, a + sides], [b, b + sides, a + sides]]);
        }
    }
    (points, triangles)
}

/// A spring whose windings touch, and a figure of eight.
fn knots() -> Part {
    let spring = |i: u8| {
        let angle = f32::from(i) * 0.3;
        let out = Vec3::new(angle.cos(), 0.0, angle.sin());
        (
            out * 0.8 + Vec3::Y * 0.28 * angle / std::f32::consts::TAU,
            [out, Vec3::Y],
        )
    };
    let eight = |i: u8| {
        let angle = f32::from(i) / 48.0 * std::f32::consts::TAU;
        let at = Vec3::new(angle.sin(), 2.5 + (2.0 * angle).sin() * 0.6, 0.0);
        let along = Vec3::new(angle.cos(), 1.2 * (2.0 * angle).cos(), 0.0).normalize();
        (at, [along.cross(Vec3::Z), Vec3::Z])
    };
    let mut all = tube(&(0..120).map(spring).collect::<Vec<_>>(), false);
    let (points, triangles) = tube(&(0..48).map(eight).collect::<Vec<_>>(), true);
    let base = all.0.len() as u32;
    all.0.extend(points);
    all.1
        .extend(triangles.iter().map(|t| t.map(|corner| corner + base)));
    all
}

#[test]
fn one_welded_skin_and_branches_that_touch_themselves_are_baked() {
    let cases = [
        ("blob", vec![("tree", blob())]),
        (
            "knots",
            vec![("bark", knots()), ("leaf", leaves(100, 0.2, ball, false))],
        ),
    ];
    for (name, parts) in cases {
        let report = bake(&parts, &["--triangles", "20%,24"]);
        let f1 = f1(&report);
        assert!(f1.len() == 2 && f1[0] > 0.9, "{name}: {f1:?}");
    }
}

#[test]
fn budgets_too_small_for_any_tree_and_endless_distances_say_what_is_possible() {
    let home = tempfile::tempdir().unwrap();
    write(&home.path().join("t.glb"), &[("bark", trunk())]);
    std::fs::write(home.path().join("inf.ron"), "(nearest_m: inf)").unwrap();
    std::fs::write(home.path().join("nan.ron"), "(farthest_m: NaN)").unwrap();
    let cases = [
        (["--triangles", "0"], "too few"),
        (["--triangles", "1"], "too few"),
        (["--triangles", "2"], "too few"),
        (["--scene", "inf.ron"], "nearest_m is inf"),
        (["--scene", "nan.ron"], "farthest_m is NaN"),
    ];
    for (arguments, word) in cases {
        let done = Command::new(env!("CARGO_BIN_EXE_pleach"))
            .args(["bake", "t.glb", "-o", "out", "--preset", "draft"])
            .args(arguments)
            .current_dir(home.path())
            .output()
            .unwrap();
        let message = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{message}");
        assert!(message.contains(word), "{message}");
        assert!(message.contains("help:"), "{message}");
        assert!(!home.path().join("out").exists());
    }
}

/// `cargo test --release --test extremes -- --ignored`
#[test]
#[ignore = "takes minutes"]
fn a_million_separate_triangles_are_baked() {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..1_000_000u32 {
        let center = ball(i);
        let some = |k| Vec3::new(random(i, k), random(i, k + 1), random(i, k + 2)) * 0.04;
        points.extend([4, 7, 10].map(|k| center + some(k)));
        triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    let parts = [("bark", trunk()), ("leaf", (points, triangles))];
    let report = bake(&parts, &["--triangles", "1%,24"]);
    let f1 = f1(&report);
    assert!(f1.len() == 2 && f1[0] > 0.9, "{f1:?}");
}

/// One leaf under a texture of so many texels a side, opaque in the middle.
fn textured(file: &Path, side: u32) {
    let mut png = std::io::Cursor::new(Vec::new());
    image::GrayAlphaImage::from_fn(side, side, |x, y| {
        let inside = |at: u32| side < 3 || (at > side / 4 && at < side - side / 4);
        image::LumaA([90, if inside(x) && inside(y) { 255 } else { 0 }])
    })
    .write_to(&mut png, image::ImageFormat::Png)
    .unwrap();
    let (points, triangles) = leaves(60, 0.4, ball, false);
    let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
    let uvs: Vec<glam::Vec2> = (0..points.len()).map(|i| corners[i % 4].into()).collect();
    let mut glb = GlbBuilder::default();
    let attributes = json!({ "POSITION": glb.positions(&points), "TEXCOORD_0": glb.vec2(&uvs) });
    let indices = glb.indices(&triangles, points.len());
    let view = glb.view(png.get_ref(), None);
    let material = json!({
        "name": "leaf", "doubleSided": true, "alphaMode": "MASK",
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } },
    });
    let root = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }], "materials": [material], "textures": [{ "source": 0 }],
        "meshes": [{ "primitives": [{ "attributes": attributes, "indices": indices, "material": 0 }] }],
        "images": [{ "bufferView": view, "mimeType": "image/png" }],
    });
    std::fs::write(file, glb.finish(root)).unwrap();
}

/// F1 of the levels of a tree under a texture of so many texels a side.
fn under_texture(side: u32) -> Vec<f64> {
    let home = tempfile::tempdir().unwrap();
    textured(&home.path().join("t.glb"), side);
    std::fs::write(home.path().join("s.ron"), "(first_height_px: 64)").unwrap();
    let done = Command::new(env!("CARGO_BIN_EXE_pleach"))
        .args(["bake", "t.glb", "-o", "out", "--preset", "draft", "--json"])
        .args(["--scene", "s.ron", "--triangles", "60,24"])
        .current_dir(home.path())
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.success(), "{message}");
    let report: Report = serde_json::from_slice(&done.stdout).unwrap();
    f1(&report)
}

#[test]
fn a_texture_of_one_texel_is_a_colour() {
    let f1 = under_texture(1);
    assert!(f1.len() == 2 && f1[0] > 0.9, "{f1:?}");
}

/// `cargo test --release --test extremes -- --ignored`
#[test]
#[ignore = "takes a gigabyte"]
fn a_texture_of_16384_texels_a_side_is_baked() {
    let f1 = under_texture(16_384);
    assert!(f1.len() == 2 && f1[0] > 0.9, "{f1:?}");
}
