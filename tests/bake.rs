//! `pleach bake` as its users meet it: files, exit codes, messages.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use glam::Vec3;
use pleach::botany::load::{load, load_base_colors};
use pleach::export::manifest::Manifest;
use pleach::report::schema::Report;
use pleach::space::glb::GlbBuilder;
use serde_json::{Value, json};

/// A trunk of eight sides and a crown of `leaves` quads, as other tools write it.
fn small_tree(file: &Path, leaves: u32) {
    tree_in_parts(file, leaves, 1);
}

/// As [`small_tree`], the crown in so many primitives of one material.
fn tree_in_parts(file: &Path, leaves: u32, parts: usize) {
    let mut glb = GlbBuilder::default();
    let (mut wood, mut wood_triangles) = (Vec::new(), Vec::new());
    for ring in 0..6u32 {
        for side in 0..8u32 {
            let angle = side as f32 * std::f32::consts::FRAC_PI_4;
            let radius = 0.25 - 0.03 * ring as f32;
            wood.push(Vec3::new(
                angle.cos() * radius,
                ring as f32 * 0.8,
                angle.sin() * radius,
            ));
            if ring > 0 {
                let [a, b] = [side, (side + 1) % 8].map(|s| (ring - 1) * 8 + s);
                wood_triangles.extend([[a, a + 8, b], [b, a + 8, b + 8]]);
            }
        }
    }
    let (mut crown, mut crown_triangles) = (Vec::new(), Vec::new());
    let random = |i: u32, k: u32| ((i * 7919 + k * 104_729) as f32 * 0.618_034).fract() - 0.5;
    for i in 0..leaves {
        let center = Vec3::new(
            random(i, 1) * 4.0,
            4.0 + random(i, 2) * 4.0,
            random(i, 3) * 4.0,
        );
        let u = Vec3::new(random(i, 4), random(i, 5), random(i, 6)).normalize_or(Vec3::X) * 0.2;
        let v = u
            .cross(Vec3::new(random(i, 7), random(i, 8), random(i, 9)))
            .normalize_or(Vec3::Y)
            * 0.2;
        let at = crown.len() as u32;
        crown.extend([
            center - u - v,
            center + u - v,
            center + u + v,
            center - u + v,
        ]);
        crown_triangles.extend([[at, at + 1, at + 2], [at, at + 2, at + 3]]);
    }
    let mut primitive = |points: &[Vec3], triangles: &[[u32; 3]], material: u32| {
        let position = glb.positions(points);
        let indices = glb.indices(triangles, points.len());
        json!({ "attributes": { "POSITION": position }, "indices": indices, "material": material })
    };
    let mut primitives = vec![primitive(&wood, &wood_triangles, 0)];
    let of_part = 2 * (leaves as usize).div_ceil(parts);
    let crowns = crown_triangles.chunks(of_part);
    primitives.extend(crowns.map(|part| primitive(&crown, part, 1)));
    let color = |name: &str, rgb: [f32; 3], sided: bool| {
        let [r, g, b] = rgb;
        json!({ "name": name, "doubleSided": sided, "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0] } })
    };
    let root = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }], "meshes": [{ "primitives": primitives }],
        "materials": [color("bark", [0.3, 0.2, 0.1], false), color("leaf", [0.1, 0.4, 0.1], true)],
    });
    std::fs::write(file, glb.finish(root)).unwrap();
}

fn pleach(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pleach"))
        .args(arguments)
        .output()
        .unwrap()
}

/// Runs `bake` on a small tree in a folder of its own.
struct Place {
    home: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let home = tempfile::tempdir().unwrap();
        small_tree(&home.path().join("tree.glb"), 300);
        // Small on the screen, so that measuring is quick.
        std::fs::write(home.path().join("small.ron"), "(first_height_px: 64)").unwrap();
        Self { home }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.home.path().join(name)
    }

    fn bake(&self, output: &str, more: &[&str]) -> Output {
        let (input, output) = (self.path("tree.glb"), self.path(output));
        let mut all = vec![
            "bake",
            input.to_str().unwrap(),
            "-o",
            output.to_str().unwrap(),
        ];
        all.extend(["--preset", "draft", "--accept"]);
        let scene = self.path("small.ron");
        if !more.contains(&"--scene") {
            all.extend(["--scene", scene.to_str().unwrap()]);
        }
        all.extend(more);
        pleach(&all)
    }

    fn code(&self, output: &str, more: &[&str]) -> i32 {
        let done = self.bake(output, more);
        let code = done.status.code().unwrap();
        if code != 0 {
            let message = String::from_utf8(done.stderr).unwrap();
            assert!(message.starts_with("error: "), "{message}");
        }
        code
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn glb_json(file: &Path) -> Value {
    let bytes = std::fs::read(file).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

#[test]
fn the_report_tells_what_level_0_costs_as_it_is_written() {
    let place = Place::new();
    tree_in_parts(&place.path("tree.glb"), 300, 4);
    assert_eq!(place.code("out", &[]), 0);
    let report = std::fs::read(place.path("out/report.json")).unwrap();
    let original = serde_json::from_slice::<Report>(&report).unwrap().original;
    let original = original.unwrap();
    let file = place.path("out").join(&original.file);
    let bytes = std::fs::metadata(&file).unwrap().len();
    assert_eq!(original.file_bytes, bytes);
    let written = gltf::Gltf::open(file).unwrap();
    let calls: usize = written.meshes().map(|m| m.primitives().count()).sum();
    // Of five in the source.
    assert_eq!((original.draw_calls, calls), (2, 2));
}

#[test]
fn a_package_is_complete_and_says_what_it_holds() {
    let place = Place::new();
    let done = place.bake("out/tree", &["--triangles", "50%,24", "--json"]);
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let folder = place.path("out/tree");
    let all = [
        "report.json",
        "tree.glb",
        "tree.pleach.ron",
        "tree_LOD0.glb",
        "tree_LOD1.glb",
        "tree_LOD2.glb",
    ];
    assert_eq!(names(&folder), all);
    assert_eq!(
        names(&place.path("out")),
        ["tree"],
        "nothing is left beside the package"
    );

    let original = load(&place.path("tree.glb")).unwrap();
    let level_0 = load(&folder.join("tree_LOD0.glb")).unwrap();
    assert_eq!(level_0.triangles.len(), original.triangles.len());
    assert!((level_0.frame.radius - original.frame.radius).abs() < 1e-5);

    // The report on disk is the one that was printed, but for what differs from run to run.
    let text = std::fs::read_to_string(folder.join("report.json")).unwrap();
    let report: Report = serde_json::from_str(&text).unwrap();
    let printed: Report = serde_json::from_slice(&done.stdout).unwrap();
    assert!(report.bake.is_none() && printed.bake.as_ref().unwrap().seconds > 0.0);
    assert_eq!(report.levels, printed.levels);
    for level in &report.levels {
        let model = load(&folder.join(&level.file)).unwrap();
        assert_eq!(level.triangles, model.triangles.len() as u64);
        let base = load_base_colors(&folder.join(&level.file)).unwrap();
        assert_eq!(base.materials, model.materials);
        let is_base = |i| {
            base.materials
                .iter()
                .any(|m| m.base_color.is_some_and(|t| t.image == i))
        };
        for (i, (all, some)) in (0..).zip(model.images.iter().zip(&base.images)) {
            assert_eq!(
                (&some.name, some.width, some.height),
                (&all.name, all.width, all.height)
            );
            let texels: &[u8] = if is_base(i) { &all.rgba } else { &[] };
            assert!(**some.rgba == *texels && !all.rgba.is_empty());
        }
        assert!(level.sizes[0].views.len() >= 16);
        assert!(level.sizes[0].views.iter().any(|v| v.view == "top"));
    }
    assert!(report.levels[1].triangles <= 24);

    let manifest = folder.join("tree.pleach.ron");
    let text = std::fs::read_to_string(&manifest).unwrap();
    let manifest = Manifest::from_ron(&text, &manifest).unwrap();
    let mut files = manifest.files.clone();
    files.sort();
    assert_eq!(files, all);
    assert_eq!(manifest.provenance.input, "tree.glb");
    for (level, row) in manifest.levels[1..].iter().zip(&report.levels) {
        assert_eq!((level.triangles, &level.file), (row.triangles, &row.file));
        assert!(level.range.distance_m > 0.0 && level.error_m > 0.0);
        assert!(
            level
                .cards
                .iter()
                .all(|c| c.corners.len() >= 3 && c.quality <= c.area_m2 * 1.001)
        );
    }
}

/// The crate `gltf` validates what it opens, and reads buffers by code that is not ours.
#[test]
fn every_level_is_read_by_the_gltf_crate() {
    let place = Place::new();
    assert_eq!(place.code("out", &["--levels", "2"]), 0);
    let out = place.path("out");
    let text = std::fs::read_to_string(out.join("report.json")).unwrap();
    let report: Report = serde_json::from_str(&text).unwrap();
    assert_eq!(report.levels.len(), 2);
    for level in &report.levels {
        let file = gltf::Gltf::open(out.join(&level.file)).unwrap();
        let mut triangles = 0;
        for primitive in file.meshes().flat_map(|m| m.primitives()) {
            let reader = primitive.reader(|_| file.blob.as_deref());
            let points: Vec<_> = reader.read_positions().unwrap().collect();
            assert_eq!(reader.read_normals().unwrap().count(), points.len());
            let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
            assert!(indices.iter().all(|&i| (i as usize) < points.len()));
            triangles += indices.len() as u64 / 3;
        }
        assert!(triangles > 0);
        assert_eq!(triangles, level.triangles, "{}", level.file);
    }
}

#[test]
fn all_levels_are_wired_in_one_file() {
    let place = Place::new();
    assert_eq!(place.code("out", &["--levels", "3"]), 0);
    let gltf = glb_json(&place.path("out/tree.glb"));
    assert_eq!(gltf["scenes"][0]["nodes"], json!([0]));
    assert_eq!(
        gltf["nodes"][0]["extensions"]["MSFT_lod"]["ids"],
        json!([1, 2, 3])
    );
    assert_eq!(gltf["extensionsUsed"], json!(["MSFT_lod"]));
    assert!(gltf.get("extensionsRequired").is_none());
    let coverage = gltf["nodes"][0]["extras"]["MSFT_screencoverage"]
        .as_array()
        .unwrap();
    assert_eq!((coverage.len(), &coverage[3]), (4, &json!(0.0)));
    assert!(coverage.windows(2).all(|w| w[0].as_f64() > w[1].as_f64()));
    for (level, node) in gltf["nodes"].as_array().unwrap().iter().enumerate() {
        assert_eq!(node["extras"]["level"], json!(level));
        assert!(node["extras"]["tree_height_m"].as_f64().unwrap() > 5.0);
    }
    let alone = glb_json(&place.path("out/tree_LOD1.glb"));
    assert!(alone.get("extensionsUsed").is_none());
    assert_eq!(alone["nodes"][0]["extras"], gltf["nodes"][1]["extras"]);
    // Doubling distances, stated for the scene's screen.
    let distance = |i: usize| gltf["nodes"][i]["extras"]["distance_m"].as_f64().unwrap();
    assert!((distance(2) / distance(1) - 2.0).abs() < 1e-9);
}

#[test]
fn runs_and_threads_do_not_change_a_byte() {
    let place = Place::new();
    for (output, threads) in [("a", "1"), ("b", "2"), ("c", "2"), ("d", "8")] {
        assert_eq!(
            place.code(output, &["--triangles", "40%,24", "--threads", threads]),
            0
        );
    }
    for name in names(&place.path("a")) {
        let read = |folder: &str| std::fs::read(place.path(folder).join(&name)).unwrap();
        assert!(
            read("a") == read("b"),
            "{name} differs between one thread and two"
        );
        assert!(read("b") == read("c"), "{name} differs between two runs");
        assert!(read("a") == read("d"), "{name} differs with eight threads");
    }
}

#[test]
fn foreign_folders_are_left_alone_and_own_packages_replaced() {
    let place = Place::new();
    std::fs::create_dir(place.path("out")).unwrap();
    std::fs::write(place.path("out/thesis.txt"), "years of work").unwrap();
    assert_eq!(place.code("out", &["--levels", "1"]), 2);
    assert_eq!(names(&place.path("out")), ["thesis.txt"]);
    assert_eq!(place.code("out", &["--levels", "2", "--force"]), 0);
    assert_eq!(place.code("out", &["--levels", "1"]), 0, "now it is ours");
    let left = [
        "report.json",
        "thesis.txt",
        "tree.glb",
        "tree.pleach.ron",
        "tree_LOD0.glb",
        "tree_LOD1.glb",
    ];
    assert_eq!(names(&place.path("out")), left);
    assert_eq!(names(place.home.path()), ["out", "small.ron", "tree.glb"]);
}

#[test]
fn wrong_input_is_exit_code_two_and_leaves_nothing() {
    let place = Place::new();
    let write = |name: &str, text: &str| {
        std::fs::write(place.path(name), text).unwrap();
        place.path(name).to_str().unwrap().to_string()
    };
    let key = write("key.ron", "(sample: 3)");
    let range = write("range.ron", "(fov_deg: 500)");
    let before = names(place.home.path());
    let cases: [&[&str]; 12] = [
        &["--triangles", "many"],
        &["--triangles", "0%"],
        &["--triangles", "101%"],
        &["--triangles", "0"],
        &["--triangles", "10,20"],
        &["--max-error", "-1"],
        &["--levels", "0"],
        &["--levels", "2", "--triangles", "5"],
        &["--preset", "finest"],
        &["--recipe", &key],
        &["--scene", &range],
        &["--scene", "no-such-file.ron"],
    ];
    for case in cases {
        assert_eq!(place.code("out", case), 2, "{case:?}");
        assert_eq!(names(place.home.path()), before, "{case:?}");
    }
    let missing = pleach(&[
        "bake",
        "no-such-tree.glb",
        "-o",
        place.path("out").to_str().unwrap(),
    ]);
    assert_eq!(missing.status.code(), Some(2));
    let nothing = pleach(&["bake"]);
    assert_eq!(nothing.status.code(), Some(2));
    assert_eq!(names(place.home.path()), before);
}

#[test]
fn messages_name_the_place_and_the_way_out() {
    let place = Place::new();
    std::fs::write(place.path("r.ron"), "(\n  sample: 3,\n)").unwrap();
    let done = place.bake("out", &["--recipe", place.path("r.ron").to_str().unwrap()]);
    let message = String::from_utf8(done.stderr).unwrap();
    for part in [
        "r.ron",
        "line 2",
        "\"sample\"",
        "did you mean \"samples\"",
        "help:",
    ] {
        assert!(message.contains(part), "{part} is not in: {message}");
    }
    assert!(done.stdout.is_empty());
}

#[test]
fn a_place_that_cannot_be_written_is_said_before_the_work() {
    let place = Place::new();
    std::fs::write(place.path("file"), "").unwrap();
    assert_eq!(place.code("file/out", &[]), 2);
    assert_eq!(place.code("file", &[]), 2);
    // Not even root can write here.
    if Path::new("/proc/self").exists() {
        let input = place.path("tree.glb");
        let done = pleach(&["bake", input.to_str().unwrap(), "-o", "/proc/pleach/out"]);
        assert_eq!(done.status.code(), Some(2));
    }
}

#[test]
fn an_error_that_may_be_larger_needs_fewer_triangles() {
    let place = Place::new();
    let triangles = |output: &str, pixels: &str| {
        let more = ["--triangles", "50%", "--max-error", pixels];
        assert_eq!(place.code(output, &more), 0);
        let text = std::fs::read_to_string(place.path(output).join("report.json")).unwrap();
        serde_json::from_str::<Report>(&text).unwrap().levels[0].triangles
    };
    let (near, far) = (triangles("a", "0.02"), triangles("b", "20"));
    assert!(far < near, "{far} for 20 pixels, {near} for a fiftieth");
}

#[test]
fn the_adaptive_loop_is_a_choice_of_the_recipe() {
    let place = Place::new();
    let recipe = |name: &str, text: &str| {
        std::fs::write(place.path(name), text).unwrap();
        let file = place.path(name);
        let more = ["--triangles", "20%", "--recipe", file.to_str().unwrap()];
        assert_eq!(place.code(&format!("{name}.out"), &more), 0);
        let folder = place.path(&format!("{name}.out"));
        let report = std::fs::read_to_string(folder.join("report.json")).unwrap();
        let report: Report = serde_json::from_str(&report).unwrap();
        let level = std::fs::read(folder.join("tree_LOD1.glb")).unwrap();
        (report.levels[0].clone(), level)
    };
    let (cut, cut_file) = recipe("cut.ron", "(method: OptimalCut)");
    let (crossed, crossed_file) = recipe(
        "crossed.ron",
        "(method: AdaptiveLoop, billboards: [Cross], tolerance: 0.05)",
    );
    assert_ne!(cut_file, crossed_file);
    for level in [cut, crossed] {
        // A fifth of 680 triangles.
        assert!((10..=136).contains(&level.triangles), "{level:?}");
        let size = &level.sizes[0];
        assert!(size.f1.mean > 0.75, "F1 {}", size.f1.mean);
        assert!((size.area_ratio.mean - 1.0).abs() < 0.05, "{size:?}");
    }
    let (quads, _) = recipe("quads.ron", "(method: CrossedQuads)");
    assert_eq!(quads.triangles, 64);
    std::fs::write(place.path("wrong.ron"), "(method: Adaptive)").unwrap();
    let wrong = place.path("wrong.ron");
    assert_eq!(place.code("w", &["--recipe", wrong.to_str().unwrap()]), 2);
}

/// 400 hanging blades, square to the horizon and the thinner seen from above: a weeping crown
/// whose every plane is upright.
fn curtains(file: &Path) {
    let mut glb = GlbBuilder::default();
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..400u32 {
        let turn = i as f32 * 2.399_963;
        let reach = 2.0 * ((i as f32 + 0.5) / 400.0).sqrt();
        let middle = Vec3::new(
            turn.cos() * reach,
            3.0 + (i % 7) as f32 * 0.2,
            turn.sin() * reach,
        );
        let side = Vec3::new((turn * 3.0).cos(), 0.0, (turn * 3.0).sin()) * 0.12;
        let lean = Vec3::new(side.z, 0.0, -side.x) * 0.6;
        let (low, high) = (middle - Vec3::Y * 0.5 + lean, middle + Vec3::Y * 0.5 - lean);
        let at = points.len() as u32;
        points.extend([low - side, low + side, high + side, high - side]);
        triangles.extend([[at, at + 1, at + 2], [at, at + 2, at + 3]]);
    }
    let (position, indices) = (
        glb.positions(&points),
        glb.indices(&triangles, points.len()),
    );
    let root = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }], "meshes": [{ "primitives": [{
            "attributes": { "POSITION": position }, "indices": indices, "material": 0 }] }],
        "materials": [{ "name": "leaf", "doubleSided": true }],
    });
    std::fs::write(file, glb.finish(root)).unwrap();
}

#[test]
fn a_weeping_tree_does_not_vanish_from_above() {
    let place = Place::new();
    curtains(&place.path("tree.glb"));
    assert_eq!(place.code("out", &["--triangles", "10%"]), 0);
    let report = std::fs::read_to_string(place.path("out/report.json")).unwrap();
    let report: Report = serde_json::from_str(&report).unwrap();
    let views = &report.levels[0].sizes[0].views;
    let top = views.iter().find(|v| v.view == "top").unwrap();
    assert!(top.area_ratio > 0.85, "{top:?}");
    assert!(report.levels[0].triangles <= 80);
}

#[test]
fn pipes_are_quiet() {
    let place = Place::new();
    let done = place.bake("out", &["--levels", "1", "--quiet"]);
    assert!(done.status.success() && done.stdout.is_empty() && done.stderr.is_empty());
    let done = place.bake("out", &["--levels", "1"]);
    let errors = String::from_utf8(done.stderr).unwrap();
    assert!(
        !errors.contains('\u{1b}') && !errors.contains("load"),
        "{errors}"
    );
    assert!(
        String::from_utf8(done.stdout)
            .unwrap()
            .contains("tree_LOD1.glb")
    );
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_what_was_there() {
    let place = Place::new();
    small_tree(&place.path("tree.glb"), 30_000);
    let mut child = Command::new(env!("CARGO_BIN_EXE_pleach"))
        .args(["bake", place.path("tree.glb").to_str().unwrap(), "-o"])
        .arg(place.path("out"))
        .stderr(std::process::Stdio::null())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    // The folder beside the output shows that the bake has begun.
    let begun = || names(place.home.path()).len() > 2;
    for _ in 0..2000 {
        if begun() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    // The shell's own kill: a bare system has no other.
    let stop = format!("kill -INT {}", child.id());
    assert!(
        Command::new("sh")
            .args(["-c", &stop])
            .status()
            .unwrap()
            .success()
    );
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(names(place.home.path()), ["small.ron", "tree.glb"]);
}

#[test]
fn limits_of_the_recipe_end_a_bake_and_are_named() {
    let home = tempfile::tempdir().unwrap();
    let path = |name: &str| home.path().join(name).to_string_lossy().into_owned();
    let (tree, recipe, output) = (path("tree.glb"), path("r.ron"), path("out"));
    small_tree(Path::new(&tree), 50);
    let refused = |input: &str, text: &str| {
        std::fs::write(&recipe, text).unwrap();
        let out = pleach(&["bake", input, "-o", &output, "--recipe", &recipe]);
        assert_eq!(out.status.code(), Some(2), "{text}");
        assert!(!Path::new(&output).exists());
        String::from_utf8(out.stderr).unwrap()
    };
    let said = refused(&tree, "(limits: (triangles: 20))");
    assert!(said.contains("limit of 20 triangles"), "{said}");
    assert!(
        said.contains("raise triangles in the recipe's limits"),
        "{said}"
    );
    let said = refused(&tree, "(limits: (bytes: 100))");
    assert!(
        said.contains("raise bytes in the recipe's limits"),
        "{said}"
    );
    let said = refused(&tree, "(limits: (pixel: 100))");
    assert!(said.contains("did you mean \"pixels\""), "{said}");
    let said = refused("assets/oak.glb", "(most_seconds: 1)");
    assert!(said.contains("longer than 1 seconds"), "{said}");
}

/// Shelves: level squares above and beside each other, which no upright card shows.
fn shelves(file: &Path) {
    let mut glb = GlbBuilder::default();
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..9u32 {
        let at = points.len() as u32;
        let middle = Vec3::new((i % 3) as f32 * 1.2, i as f32 * 0.4, (i / 3) as f32 * 1.2);
        let corners = [[-0.5, -0.5], [-0.5, 0.5], [0.5, 0.5], [0.5, -0.5]];
        points.extend(corners.map(|[x, z]| middle + Vec3::new(x, 0.0, z)));
        triangles.extend([[at, at + 1, at + 2], [at, at + 2, at + 3]]);
    }
    let primitive = json!({
        "attributes": { "POSITION": glb.positions(&points) },
        "indices": glb.indices(&triangles, points.len()), "material": 0,
    });
    let bytes = glb.finish(json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }], "meshes": [{ "primitives": [primitive] }],
        "materials": [{ "name": "leaves", "doubleSided": true }],
    }));
    std::fs::write(file, bytes).unwrap();
}

#[test]
fn a_bad_bake_is_refused_with_its_figures_beside_the_package() {
    let home = tempfile::tempdir().unwrap();
    let path = |name: &str| home.path().join(name).to_string_lossy().into_owned();
    let (tree, recipe, output) = (path("shelves.glb"), path("r.ron"), path("out"));
    shelves(Path::new(&tree));
    std::fs::write(&recipe, "(method: CrossedQuads)").unwrap();
    let args = [
        "bake",
        &tree,
        "-o",
        &output,
        "--triangles",
        "4",
        "--recipe",
        &recipe,
    ];
    let refused = pleach(&args);
    assert_eq!(refused.status.code(), Some(3));
    let said = String::from_utf8(refused.stderr).unwrap();
    for part in [
        "bake refused: level 1",
        "covered area is",
        "view",
        "texel_density",
        "--accept",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert!(!Path::new(&output).exists());
    let beside = path("out.refused.json");
    assert!(said.contains(&beside), "{said}");
    let report: Report = serde_json::from_slice(&std::fs::read(&beside).unwrap()).unwrap();
    let area = report.levels[0].sizes[0].area_ratio.mean;
    assert!(!(0.8..=1.25).contains(&area), "{area}");
    // What is accepted is a package, and the report on what was refused goes.
    let accepted = pleach(&[&args[..], &["--accept"]].concat());
    assert!(accepted.status.success());
    assert!(
        String::from_utf8(accepted.stderr)
            .unwrap()
            .contains("covered area is")
    );
    assert!(Path::new(&output).join("report.json").is_file() && !Path::new(&beside).exists());
}

/// Its file has most of the trunk's nodes at the thin end, so that the trunk's mean node is a twig; it was drawn as a ribbon
/// that vanished from one side, and the bake refused.
#[test]
fn a_quantised_oak_keeps_its_trunk() {
    let folder = std::env::var("PLEACH_TREES")
        .unwrap_or_else(|_| concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/trees").to_owned());
    let path = Path::new(&folder).join("gt_oak_quantized.glb");
    if !path.exists() {
        return println!("skipped: {} is not there", path.display());
    }
    let home = tempfile::tempdir().unwrap();
    let out = home.path().join("oak");
    let [from, to] = [&path, &out].map(|p| p.to_str().unwrap());
    let done = pleach(&["bake", from, "-o", to, "--preset", "draft"]);
    let said = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(0), "{said}");
    assert!(out.join("gt_oak_quantized_LOD4.glb").exists());
}
