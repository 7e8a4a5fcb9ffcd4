//! `pleach bake` with many trees, as its users meet it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::SystemTime;

use pleach::botany::grow::{Options, Species, grow};
use serde_json::Value;

/// A folder with small trees and a scene in which they are small.
struct Place {
    home: tempfile::TempDir,
}

impl Place {
    fn new(trees: &[(&str, &str)]) -> Self {
        let place = Self {
            home: tempfile::tempdir().unwrap(),
        };
        for (i, (name, species)) in trees.iter().enumerate() {
            place.grow(name, species, i as u64);
        }
        std::fs::write(place.path("small.ron"), "(first_height_px: 48)").unwrap();
        place
    }

    fn grow(&self, name: &str, species: &str, seed: u64) {
        let options = Options {
            leaves: Some(300),
            seed,
            ..Options::default()
        };
        let grown = grow(&Species::named(species).unwrap(), &options).unwrap();
        std::fs::write(self.path(name), grown.glb).unwrap();
    }

    fn path(&self, name: &str) -> PathBuf {
        self.home.path().join(name)
    }

    fn bake(&self, inputs: &[&str], more: &[&str]) -> Output {
        let inputs = inputs.iter().map(|i| self.path(i));
        Command::new(env!("CARGO_BIN_EXE_pleach"))
            .arg("bake")
            .args(inputs)
            .arg("-o")
            .arg(self.path("out"))
            .args(["--preset", "draft", "--levels", "2", "--accept", "--scene"])
            .arg(self.path("small.ron"))
            .args(more)
            .output()
            .unwrap()
    }

    /// Exit code and state of each tree.
    fn states(&self, inputs: &[&str], more: &[&str]) -> (i32, Vec<String>) {
        let done = self.bake(inputs, &[&["--json"], more].concat());
        let code = done.status.code().unwrap();
        let summary: Value = serde_json::from_slice(&done.stdout)
            .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&done.stderr)));
        let trees = summary["trees"].as_array().unwrap();
        let state = |tree: &Value| tree["state"].as_str().unwrap().to_owned();
        (code, trees.iter().map(state).collect())
    }
}

/// When a file was written last, and its bytes.
fn stamp(file: &Path) -> (SystemTime, Vec<u8>) {
    let time = std::fs::metadata(file).unwrap().modified().unwrap();
    (time, std::fs::read(file).unwrap())
}

#[test]
fn every_tree_gets_its_package_and_only_what_changed_is_baked_again() {
    let trees = [("a.glb", "oak"), ("b.glb", "willow"), ("c.glb", "palm")];
    let place = Place::new(&trees);
    let inputs = trees.map(|t| t.0);
    let all = |state: &str| vec![state.to_owned(); 3];
    assert_eq!(place.states(&inputs, &[]), (0, all("baked")));
    let files = ["a", "b", "c"].map(|n| place.path(&format!("out/{n}/{n}.pleach.ron")));
    let first = files.each_ref().map(|f| stamp(f));

    assert_eq!(place.states(&inputs, &[]), (0, all("unchanged")));
    // Memory and threads change no package.
    std::fs::write(place.path("r.ron"), "(memory_mib: 900)").unwrap();
    let recipe = place.path("r.ron");
    let more = ["--threads", "1", "--recipe", recipe.to_str().unwrap()];
    assert_eq!(place.states(&inputs, &more), (0, all("unchanged")));
    assert_eq!(files.each_ref().map(|f| stamp(f)), first);

    // Another input, another level, a lost file: those trees and no other.
    place.grow("b.glb", "willow", 77);
    std::fs::remove_file(place.path("out/c/c_LOD1.glb")).unwrap();
    let (code, states) = place.states(&inputs, &[]);
    assert_eq!(
        (code, states.join(" ")),
        (0, "unchanged baked baked".into())
    );
    assert_eq!(stamp(&files[0]), first[0]);
    assert_ne!(stamp(&files[1]).1, first[1].1);
    assert_eq!(stamp(&files[2]).1, first[2].1);
    for more in [&["--max-error", "9"][..], &["--rebake", "--max-error", "9"]] {
        let one = place.states(&["c.glb"], &[&["--batch"], more].concat());
        assert_eq!(one, (0, vec!["baked".to_owned()]));
    }
}

#[test]
fn a_batch_makes_what_single_bakes_make() {
    let place = Place::new(&[("a.glb", "oak"), ("b.glb", "spruce")]);
    assert_eq!(place.states(&["a.glb", "b.glb"], &[]).0, 0);
    let other = Place::new(&[("b.glb", "oak"), ("a.glb", "oak")]);
    std::fs::copy(place.path("a.glb"), other.path("a.glb")).unwrap();
    assert!(other.bake(&["a.glb"], &[]).status.success());
    for name in [
        "a_LOD0.glb",
        "a_LOD1.glb",
        "a_LOD2.glb",
        "a.glb",
        "report.json",
    ] {
        let single = std::fs::read(other.path("out").join(name)).unwrap();
        let of_batch = std::fs::read(place.path("out/a").join(name)).unwrap();
        assert!(single == of_batch, "{name}");
    }
}

#[test]
fn a_tree_that_fails_stops_no_other_and_is_named() {
    let place = Place::new(&[("a.glb", "oak"), ("z.glb", "palm")]);
    std::fs::write(place.path("broken.glb"), b"glTF\x02\0\0\0").unwrap();
    let inputs = ["a.glb", "broken.glb", "missing.glb", "z.glb"];
    let (code, states) = place.states(&inputs, &[]);
    assert_eq!(
        (code, states.join(" ")),
        (2, "baked failed failed baked".into())
    );
    assert!(place.path("out/z/z.pleach.ron").is_file());
    assert!(!place.path("out/broken").exists() && !place.path("out/missing").exists());
    let done = place.bake(&inputs, &[]);
    let (table, error) = (
        String::from_utf8_lossy(&done.stdout).into_owned(),
        String::from_utf8_lossy(&done.stderr).into_owned(),
    );
    assert!(table.contains("0 baked, 2 unchanged, 2 failed"), "{table}");
    assert!(error.contains("2 of 4 trees failed"), "{error}");
    assert!(
        error.contains("broken.glb") && error.contains("missing.glb"),
        "{error}"
    );
}

#[test]
fn two_trees_of_one_name_are_refused_before_any_work() {
    let place = Place::new(&[("a.glb", "oak")]);
    std::fs::create_dir(place.path("other")).unwrap();
    std::fs::copy(place.path("a.glb"), place.path("other/A.glb")).unwrap();
    let done = place.bake(&["a.glb", "other/A.glb"], &[]);
    assert_eq!(done.status.code(), Some(2));
    let error = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(error.contains("would both be baked into"), "{error}");
    assert!(!place.path("out").exists());
}

#[test]
fn a_change_in_a_file_that_the_input_refers_to_is_a_change() {
    let place = Place::new(&[("a.glb", "oak")]);
    let glb = std::fs::read(place.path("a.glb")).unwrap();
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let mut json: Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    json["buffers"][0]["uri"] = "a.bin".into();
    let write = |bytes: &[u8]| std::fs::write(place.path("a.bin"), bytes).unwrap();
    let mut chunk = glb[20 + length + 8..].to_vec();
    write(&chunk);
    std::fs::write(place.path("a.gltf"), json.to_string()).unwrap();
    let state = |wanted: &str| {
        let found = place.states(&["a.gltf"], &["--batch"]);
        assert_eq!(found, (0, vec![wanted.to_owned()]));
    };
    state("baked");
    state("unchanged");
    // Room after the last view: the tree is the same, the file is not.
    chunk.extend([0; 4]);
    write(&chunk);
    state("baked");
}
