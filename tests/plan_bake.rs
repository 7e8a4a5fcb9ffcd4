//! What `pleach plan` says of directions, maps and atlases, and what it bakes of that.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use pleach::botany::grow::{Options, Species, grow};
use pleach::export::manifest::Manifest;
use serde_json::Value;

/// A plan and its trees in a folder of their own.
struct Home(tempfile::TempDir);

impl Home {
    /// Trees by name, kind and seed, of few leaves.
    fn new(trees: &[(&str, &str, u64)]) -> Self {
        let home = Self(tempfile::tempdir().unwrap());
        for (name, kind, seed) in trees {
            let options = Options {
                leaves: Some(60),
                seed: *seed,
                ..Options::default()
            };
            let grown = grow(&Species::named(kind).unwrap(), &options).unwrap();
            std::fs::write(home.path(&format!("{name}.glb")), grown.glb).unwrap();
        }
        home
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, text: &str, more: &[&str]) -> Output {
        std::fs::write(self.path("plan.ron"), text).unwrap();
        let program = Command::new(env!("CARGO_BIN_EXE_pleach"))
            .args(["plan", "plan.ron", "--json"])
            .args(more)
            .current_dir(self.0.path())
            .output();
        program.unwrap()
    }

    fn plan(&self, text: &str, more: &[&str]) -> Value {
        let out = self.run(text, more);
        let said = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.success(), "{said}");
        serde_json::from_slice(&out.stdout).unwrap()
    }
}

fn scene_of(file: &Path) -> pleach::scene::Scene {
    let text = std::fs::read_to_string(file).unwrap();
    Manifest::from_ron(&text, file).unwrap().scene
}

const STANDING: &str = "camera: [(eye: (0, 2, 0), target: (0, 2, -1))], frames: 3,";

#[test]
fn a_row_that_is_only_seen_from_the_road_is_baked_for_that_side() {
    let home = Home::new(&[("oak", "oak", 1)]);
    let plan = |places: &str, rest: &str| {
        std::fs::write(home.path("row.csv"), places).unwrap();
        let text = format!(
            "(species: [(input: \"oak.glb\", places: \"row.csv\")], levels: 2, {STANDING} {rest})"
        );
        home.plan(&text, &[])["species"][0].clone()
    };
    // Two trees whose own z looks at the eye; the same, turned by a right angle.
    let facing = plan("-9,0,-150,1,0\n9,0,-150,1,0\n", "");
    let turned = plan("-9,0,-150,1,90\n9,0,-150,1,90\n", "");
    let [from, to] = [0, 1].map(|i| facing["azimuths_deg"][i].as_f64().unwrap());
    assert!((335.0..355.0).contains(&from) && (365.0..385.0).contains(&to));
    let arc = [0, 1].map(|i| turned["azimuths_deg"][i].as_f64().unwrap());
    assert_eq!(arc, [from - 90.0, to - 90.0]);
    let both = facing["both_sides"].as_f64().unwrap();
    assert!((both - (to - from) / 180.0).abs() < 0.03, "{both}");
    // Who does not say how trees are turned sees all sides of them.
    let any = plan("-9,0,-150\n9,0,-150,1\n", "");
    assert_eq!(any["azimuths_deg"], serde_json::json!([0.0, 360.0]));
    assert_eq!(any["both_sides"], 1.0);
    assert_eq!(any["elevations_deg"], facing["elevations_deg"]);

    std::fs::write(home.path("row.csv"), "-9,0,-150,1,0\n9,0,-150,1,0\n").unwrap();
    let bake = |rest: &str, out: &str| {
        let text = format!(
            "(species: [(input: \"oak.glb\", places: \"row.csv\")], levels: 2, {STANDING} {rest})"
        );
        let more = ["--bake", "-o", out, "--preset", "draft", "--accept"];
        home.plan(&text, &more);
        scene_of(&home.path(out).join("oak/oak.pleach.ron"))
    };
    let scene = bake("", "front");
    assert_eq!(scene.azimuths_deg.map(f64::from), [from, to]);
    assert!(scene.elevations_deg[1] < 45.0);
    let whole = bake("from_all_sides: true", "whole");
    assert!(whole.sector().is_whole());
    // With an error that may be, levels take no more triangles than that needs.
    std::fs::write(home.path("row.csv"), "0,0,-30\n").unwrap();
    let triangles = |out: &str| {
        let report = std::fs::read(home.path(out).join("oak/report.json")).unwrap();
        let report: Value = serde_json::from_slice(&report).unwrap();
        report["levels"][0]["triangles"].as_u64().unwrap()
    };
    bake("", "fine");
    bake("max_error_px: 30", "coarse");
    let [fine, coarse] = ["fine", "coarse"].map(triangles);
    assert!(coarse < fine / 2, "{coarse} {fine}");
}

#[test]
fn maps_and_bytes_follow_light_and_texture_format() {
    let home = Home::new(&[("oak", "oak", 1)]);
    let plan = |scene: &str| {
        let text = format!("(species: [(input: \"oak.glb\", count: 9)], scene: ({scene}))");
        let answer = home.plan(&text, &[]);
        let level = answer["species"][0]["levels"][1].clone();
        let maps = answer["species"][0]["maps"].as_array().unwrap().len();
        let bytes = level["texture_bytes"].as_u64().unwrap();
        // 512 pixels for the height of the tree.
        let texels = level["texels_per_m"].as_f64().unwrap();
        let height = answer["species"][0]["height_m"].as_f64().unwrap();
        assert!((texels * height - 512.0).abs() < 1e-6);
        assert!(answer["disk_bytes"].as_u64().unwrap() > 100_000);
        (maps, bytes, answer["engine"].clone())
    };
    let (maps, bytes, engine) = plan("");
    assert_eq!((maps, engine["takes"].as_str()), (3, Some("SingleFiles")));
    let (maps, unlit, _) = plan("lit: false");
    assert_eq!((maps, unlit), (1, bytes / 3));
    let (_, packed, engine) = plan("texture_format: Bc7, engine: Bevy");
    assert_eq!(packed, bytes / 4);
    assert_eq!(engine["makes_mips"], false);
    assert_eq!(engine["draws_instances"], false);
}

#[test]
fn species_of_one_paint_can_share_an_atlas_and_do_where_the_plan_says_so() {
    let home = Home::new(&[("ash", "oak", 1), ("elm", "oak", 2), ("fir", "spruce", 3)]);
    let text = |atlas: &str| {
        let one = |name: &str, atlas: &str| {
            format!("(input: \"{name}.glb\", count: 5, atlas: \"{atlas}\"),")
        };
        let all = one("ash", atlas) + &one("elm", atlas) + &one("fir", "");
        format!("(species: [{all}], levels: 2, scene: (nearest_m: 60), {STANDING})")
    };
    let bake = |atlas: &str, out: &str| {
        let more = ["--bake", "-o", out, "--preset", "draft", "--accept"];
        home.plan(&text(atlas), &more)
    };
    let apart = bake("", "apart");
    let with = |i: usize| apart["species"][i]["can_share_with"].clone();
    assert_eq!(with(0), serde_json::json!(["elm"]));
    assert_eq!(with(1), serde_json::json!(["ash"]));
    assert_eq!(with(2), serde_json::json!([]));

    let together = bake("oaks", "together");
    let folder = home.path("together");
    assert!(folder.join("fir/fir.glb").is_file());
    assert!(!folder.join("ash").exists());
    for file in ["oaks.glb", "ash_LOD1.glb", "elm_LOD1.glb", "elm.pleach.ron"] {
        assert!(folder.join("oaks").join(file).is_file(), "{file}");
    }
    let bytes = |answer: &Value, i: usize, level: usize| {
        let level = &answer["species"][i]["levels"][level];
        assert_eq!(level["needed"], true);
        level["texture_bytes"].as_u64().unwrap()
    };
    // The page is counted once, with the first of those that share it.
    assert!(bytes(&together, 1, 2) < bytes(&together, 0, 2));
    assert_eq!(bytes(&together, 2, 2), bytes(&apart, 2, 2));
    let all = |answer: &Value| answer["texture_bytes"].as_u64().unwrap();
    assert!(all(&together) < all(&apart));
    let files = folder.join("oaks").read_dir().unwrap();
    let disk: u64 = files.map(|e| e.unwrap().metadata().unwrap().len()).sum();
    assert!(together["disk_bytes"].as_u64().unwrap() > disk);

    // The second time nothing is baked, and the answer is the same.
    let manifest = folder.join("oaks/elm.pleach.ron");
    let written = || std::fs::metadata(&manifest).unwrap().modified().unwrap();
    let before = written();
    assert_eq!(bake("oaks", "together"), together);
    assert_eq!(written(), before);

    let refused = |atlas: &str| {
        let out = home.run(&text(atlas), &["--bake", "-o", "no", "--preset", "draft"]);
        assert_eq!(out.status.code(), Some(2));
        String::from_utf8(out.stderr).unwrap()
    };
    assert!(refused("Fir").contains("name of its own"));
    assert!(refused("../oaks").contains("name of its own"));
}
