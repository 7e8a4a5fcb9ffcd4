//! `pleach plan` as its users meet it, and bakes that leave out what no camera sees.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Mutex;

use pleach::botany::load::load;
use pleach::export::manifest::Manifest;
use pleach::pipeline::{Request, Wanted, bake};
use pleach::recipe::Recipe;
use pleach::scene::Scene;
use pleach::watch::Watch;
use serde_json::Value;

fn pleach(args: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_pleach");
    Command::new(program).args(args).output().unwrap()
}

fn oak() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/oak.glb")
}

/// A plan of one oak, in a folder of its own.
struct Home(tempfile::TempDir);

impl Home {
    fn new(places: &str, rest: &str) -> Self {
        let home = tempfile::tempdir().unwrap();
        std::fs::write(home.path().join("places.csv"), places).unwrap();
        let input = oak().to_string_lossy().replace('\\', "/");
        let text = format!("(species: [(input: \"{input}\", places: \"places.csv\")], {rest})");
        std::fs::write(home.path().join("plan.ron"), text).unwrap();
        Self(home)
    }

    fn file(&self, name: &str) -> String {
        self.0.path().join(name).to_string_lossy().into_owned()
    }

    fn plan(&self, more: &[&str]) -> Value {
        let plan = self.file("plan.ron");
        let out = pleach(&[&["plan", &plan, "--json", "--quiet"], more].concat());
        let said = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.success(), "{said}");
        serde_json::from_slice(&out.stdout).unwrap()
    }
}

const STANDING: &str = "camera: [(eye: (0, 2, 0), target: (0, 2, -1))], frames: 3,";

fn needed(answer: &Value) -> Vec<bool> {
    let levels = answer["species"][0]["levels"].as_array().unwrap();
    levels
        .iter()
        .map(|l| l["needed"].as_bool().unwrap())
        .collect()
}

#[test]
fn what_the_camera_sees_says_which_levels_are_needed_and_what_they_cost() {
    // The oak is 12 m high: levels start at about 22, 44, 88 and 175 m. One stands behind the eye.
    let home = Home::new("0,0,-60\n0,0,-100\n3,0,-110\n0,0,50\n", STANDING);
    let answer = home.plan(&[]);
    assert_eq!(needed(&answer), [false, false, true, true, false]);
    assert_eq!(
        (answer["trees"].as_u64(), answer["frames"].as_u64()),
        (Some(4), Some(3))
    );
    let levels = &answer["species"][0]["levels"];
    assert_eq!(levels[3]["shown"]["worst"], 2);
    let drawn =
        levels[2]["triangles"].as_u64().unwrap() + 2 * levels[3]["triangles"].as_u64().unwrap();
    assert_eq!(answer["triangles"]["worst"], drawn);
    assert_eq!(answer["triangles_original"]["worst"], 3 * 48_109);
    assert_eq!(answer["moved_nearer"], 1.0);
    assert!(answer.get("budget_met").is_none());
    let near = answer["species"][0]["nearest_m"].as_f64().unwrap();
    assert!((55.0..65.0).contains(&near), "{near}");
}

#[test]
fn a_larger_tree_counts_as_nearer() {
    let home = Home::new("0,0,-100,3\n", STANDING);
    assert_eq!(needed(&home.plan(&[])), [false, true, false, false, false]);
}

#[test]
fn maps_of_light_that_the_recipe_wants_coarser_are_expected_smaller() {
    let home = Home::new("0,0,-60\n0,0,-100\n", STANDING);
    std::fs::write(home.file("recipe.ron"), "(light_map_halvings: Some(2))").unwrap();
    let recipe = home.file("recipe.ron");
    let (full, coarse) = (home.plan(&[]), home.plan(&["--recipe", &recipe]));
    let bytes = |answer: &Value| answer["texture_bytes"].as_f64().unwrap();
    // One map in full, two with a sixteenth of the texels.
    let share = bytes(&coarse) / bytes(&full);
    assert!((share - 1.125 / 3.0).abs() < 1e-6, "{share}");
}

#[test]
fn a_budget_moves_all_levels_nearer_and_no_further_than_it_has_to() {
    let places = "0,0,-30\n4,0,-32\n-5,0,-50\n";
    let answer = Home::new(places, STANDING).plan(&[]);
    let free = answer["triangles"]["worst"].as_u64().unwrap();
    let budget = free / 2;
    let home = Home::new(places, &format!("{STANDING} triangles_per_frame: {budget}"));
    let answer = home.plan(&[]);
    let (worst, nearer) = (
        answer["triangles"]["worst"].as_u64().unwrap(),
        answer["moved_nearer"].as_f64().unwrap(),
    );
    assert!(
        worst <= budget && nearer > 1.0 && nearer < 3.0,
        "{worst} {nearer}"
    );
    assert_eq!(answer["budget_met"], true);
    let home = Home::new(places, &format!("{STANDING} triangles_per_frame: 20"));
    assert_eq!(home.plan(&[])["budget_met"], false);
}

#[test]
fn a_tree_that_is_never_seen_needs_nothing_and_is_not_baked() {
    let home = Home::new("0,0,80\n", STANDING);
    let out = home.file("out");
    let answer = home.plan(&["--bake", "-o", &out]);
    assert_eq!(needed(&answer), [false; 5]);
    assert!(answer["species"][0]["nearest_m"].is_null());
    assert_eq!(answer["texture_bytes"], 0);
    assert!(Path::new(&out).join("plan.json").is_file());
    assert!(!Path::new(&out).join("oak").exists());
}

#[test]
fn just_what_is_needed_is_baked_and_only_once() {
    let home = Home::new("0,0,-120\n9,0,-130\n", STANDING);
    let out = home.file("out");
    let args = ["--bake", "-o", &out, "--preset", "draft"];
    let answer = home.plan(&args);
    let folder = Path::new(&out).join("oak");
    let file = folder.join("oak.pleach.ron");
    let text = std::fs::read_to_string(&file).unwrap();
    let manifest = Manifest::from_ron(&text, &file).unwrap();
    let triangles: Vec<u64> = manifest.levels.iter().map(|l| l.triangles).collect();
    assert_eq!(
        triangles.len(),
        2,
        "the original and one level: {triangles:?}"
    );
    assert_eq!(answer["species"][0]["levels"][3]["triangles"], triangles[1]);
    assert_eq!(answer["texture_bytes_estimated"], false);
    let disk: u64 = std::fs::read_dir(&folder)
        .unwrap()
        .map(|e| e.unwrap().metadata().unwrap().len())
        .sum();
    assert_eq!(answer["disk_bytes"], disk);
    let before = std::fs::metadata(&file).unwrap().modified().unwrap();
    assert_eq!(home.plan(&args), answer);
    assert_eq!(
        std::fs::metadata(&file).unwrap().modified().unwrap(),
        before
    );
}

/// Remembers how many steps each stage announced.
#[derive(Default)]
struct Work(Mutex<Vec<(String, u64)>>);

impl Watch for Work {
    fn stage(&self, name: &str, steps: u64) {
        self.0.lock().unwrap().push((name.into(), steps));
    }
    fn part(&self, name: &str) {
        self.0.lock().unwrap().push((name.into(), 1));
    }
}

impl Work {
    fn of(&self, name: &str) -> u64 {
        let told = self.0.lock().unwrap();
        told.iter()
            .filter(|(n, _)| n == name)
            .map(|(_, steps)| steps)
            .sum()
    }
}

#[test]
fn a_scene_that_comes_no_nearer_does_no_work_for_near_levels() {
    let home = tempfile::tempdir().unwrap();
    let work = Work::default();
    let request = Request {
        input: oak(),
        output: home.path().join("oak"),
        recipe: Recipe::draft(),
        scene: Scene {
            nearest_m: 200.0,
            ..Scene::default()
        },
        ..Request::default()
    };
    let baked = bake(&request, &work).unwrap();
    assert_eq!(baked.report.levels.len(), 1);
    assert_eq!(baked.report.levels[0].triangles, 24);
    // One level is cut, projected and measured; level 0, which would have been seen until 184 m, is not written.
    assert_eq!(work.of("bake levels"), 2);
    assert_eq!(work.of("project"), 1);
    assert_eq!(work.of("measure"), 1);
    let read = |file: &str| std::fs::read(request.output.join(file));
    assert!(read("oak_LOD0.glb").is_err());
    let text = String::from_utf8(read("oak.pleach.ron").unwrap()).unwrap();
    let manifest = Manifest::from_ron(&text, Path::new("oak.pleach.ron")).unwrap();
    assert_eq!(
        (manifest.levels.len(), manifest.levels[0].file.as_str()),
        (2, "")
    );
    assert!(manifest.files.iter().all(|f| read(f).is_ok()));
    assert_eq!(manifest.files.len(), 4);
    // All levels in one: level 1 alone, and less than the original's positions take.
    let all = load(&request.output.join("oak.glb")).unwrap();
    assert_eq!(all.triangles.len(), 24);
    assert!(read("oak.glb").unwrap().len() < 400_000);
    assert_eq!(baked.report.original.unwrap().file, "oak.glb");
}

#[test]
fn a_scene_that_sees_level_1_fade_in_has_level_0() {
    let home = tempfile::tempdir().unwrap();
    let files = |nearest_m: f64| {
        let request = Request {
            input: oak(),
            output: home.path().join(nearest_m.to_string()),
            recipe: Recipe::draft(),
            scene: Scene {
                nearest_m,
                heights_px: vec![64.0],
                fade: 1.2,
                ..Scene::default()
            },
            wanted: Wanted::Levels(1),
            accept: true,
            ..Request::default()
        };
        bake(&request, &Work::default()).unwrap();
        let file = request.output.join("oak.pleach.ron");
        let manifest = Manifest::from_ron(&std::fs::read_to_string(&file).unwrap(), &file).unwrap();
        (manifest.files, manifest.levels[1].range.fade_m)
    };
    let (all, [from, to]) = files(0.0);
    assert!(all[0] == "oak_LOD0.glb" && from < to);
    assert_eq!(files(0.5 * (from + to)).0[0], "oak_LOD0.glb");
    assert_eq!(files(1.01 * to).0[0], "oak_LOD1.glb");
}

#[test]
fn a_dense_forest_hides_trees_and_a_row_beside_the_eye_none() {
    // 12 m high and 6 m apart, ten rows deep and twenty wide.
    let dense: String = (0..200)
        .map(|i| format!("{},0,{}\n", 6 * (i % 20) - 57, -20 - 6 * (i / 20)))
        .collect();
    let answer = Home::new(&dense, STANDING).plan(&[]);
    let number = |answer: &Value, key: &str| answer[key]["mean"].as_f64().unwrap();
    let hidden = number(&answer, "hidden_trees");
    assert!(hidden > 20.0 && hidden < 180.0, "{hidden}");
    let [all, unhidden] = ["triangles", "triangles_unhidden"].map(|key| number(&answer, key));
    assert!(
        unhidden > 0.0 && unhidden < 0.9 * all,
        "{unhidden} of {all}"
    );
    let row = "-20,0,-40\n0,0,-40\n20,0,-40\n";
    let answer = Home::new(row, STANDING).plan(&[]);
    assert_eq!(number(&answer, "hidden_trees"), 0.0);
    let [all, unhidden] = ["triangles", "triangles_unhidden"].map(|key| number(&answer, key));
    assert!(
        unhidden <= all && unhidden > 0.3 * all,
        "{unhidden} of {all}"
    );
}

#[test]
fn nothing_but_the_original_is_baked_where_nothing_else_is_seen() {
    let home = tempfile::tempdir().unwrap();
    let request = Request {
        input: oak(),
        output: home.path().join("oak"),
        recipe: Recipe::draft(),
        scene: Scene {
            farthest_m: 10.0,
            ..Scene::default()
        },
        ..Request::default()
    };
    let baked = bake(&request, &Work::default()).unwrap();
    assert!(baked.report.levels.is_empty());
    assert!(request.output.join("oak_LOD0.glb").is_file());
}

#[test]
fn wrong_plans_are_refused_by_key_and_file() {
    let home = tempfile::tempdir().unwrap();
    let file = home.path().join("plan.ron");
    let refused = |text: &str| {
        std::fs::write(&file, text).unwrap();
        let out = pleach(&["plan", &file.to_string_lossy()]);
        assert_eq!(out.status.code(), Some(2), "{text}");
        String::from_utf8(out.stderr).unwrap()
    };
    assert!(refused("()").contains("no species"));
    assert!(refused("(specis: [])").contains("did you mean \"species\""));
    assert!(refused("(species: [(input: \"t.glb\")])").contains("where it stands"));
    assert!(refused("(species: [(input: \"t.glb\", count: 1)])").contains("t.glb"));
    assert!(refused("(species: [(input: \"t.glb\", count: 1, places: \"p\")])").contains("both"));
    let twice = "(input: \"t.glb\", count: 1)";
    assert!(refused(&format!("(species: [{twice}, {twice}])")).contains("two species named t"));
    assert!(refused("(region_m: 0)").contains("region_m"));
    assert!(refused("(scene: (nearest_m: 50, farthest_m: 20))").contains("farthest_m"));
}
