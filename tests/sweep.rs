//! `pleach sweep` as its users meet it.

use std::path::Path;
use std::process::{Command, Output};

use pleach::botany::grow::{Options, Species, grow};
use pleach::sweep::{Sweep, Whole};

fn palm(file: &Path, leaves: u32) {
    let options = Options {
        leaves: Some(leaves),
        ..Options::default()
    };
    let grown = grow(&Species::named("palm").unwrap(), &options).unwrap();
    std::fs::write(file, grown.glb).unwrap();
}

fn sweep(home: &Path, more: &[&str]) -> Output {
    palm(&home.join("tree.glb"), 1000);
    std::fs::write(home.join("small.ron"), "(first_height_px: 48)").unwrap();
    Command::new(env!("CARGO_BIN_EXE_pleach"))
        .args(["sweep", "tree.glb", "-o", "out", "--triangles", "10%,24"])
        .args(["--scene", "small.ron"])
        .args(more)
        .current_dir(home)
        .output()
        .unwrap()
}

#[test]
fn a_sweep_measures_every_variant_and_says_what_it_means() {
    let home = tempfile::tempdir().unwrap();
    let done = sweep(home.path(), &["--only", "draft,samples 1"]);
    let table = String::from_utf8(done.stdout).unwrap();
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let read = |name: &str| std::fs::read_to_string(home.path().join("out").join(name)).unwrap();
    let found: Sweep = serde_json::from_str(&read("sweep.json")).unwrap();
    let names: Vec<&str> = found.runs.iter().map(|r| r.name.as_str()).collect();
    assert_eq!(names, ["balanced", "draft", "samples 1"]);
    for run in &found.runs {
        assert!(run.seconds > 0.0 && run.package_bytes > 10_000 && run.texture_bytes > 10_000);
        assert!(run.f1_mean > 0.5 && run.f1_worst <= run.f1_mean && run.f1_mean < 1.0);
        assert!(run.flip > 0.0 && run.flip < 0.5, "FLIP {}", run.flip);
        assert!((run.area_ratio - 1.0).abs() < 0.2);
        assert_eq!(run.report.levels.len(), 2);
        let stages = &run.report.bake.as_ref().unwrap().stages;
        assert!(stages.iter().any(|s| s.name == "measure"));
    }
    assert!(found.runs.iter().any(|r| r.on_front) && found.repeat_ratio > 0.0);
    // Other recipes make other packages, or nothing was swept.
    assert_ne!(found.runs[0].f1_mean, found.runs[1].f1_mean);
    assert_ne!(found.runs[0].f1_mean, found.runs[2].f1_mean);
    assert!(
        found.advice[0].starts_with("draft is "),
        "{:?}",
        found.advice
    );
    assert!(table.contains(&found.advice[0]), "{table}");
    let csv = read("sweep.csv");
    assert_eq!(csv.lines().count(), 4);
    assert!(
        csv.starts_with("name,") && csv.contains(",flip,area_ratio,"),
        "{csv}"
    );
    let columns = |line: &str| line.split(',').count();
    assert!(
        csv.lines()
            .all(|l| columns(l) == columns(csv.lines().next().unwrap()))
    );
    let svg = read("sweep.svg");
    assert_eq!(svg.matches("<circle").count(), 3);
    let left: Vec<_> = std::fs::read_dir(home.path().join("out"))
        .unwrap()
        .collect();
    assert_eq!(left.len(), 3, "{left:?}");
}

#[test]
fn wrong_input_leaves_nothing() {
    let home = tempfile::tempdir().unwrap();
    let done = sweep(home.path(), &["--only", "drafts"]);
    assert_eq!(done.status.code(), Some(2));
    let message = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(
        message.contains("no variant \"drafts\"") && message.contains("samples 2"),
        "{message}"
    );
    assert!(!home.path().join("out").exists());
}

#[test]
fn several_trees_have_a_table_each_and_one_of_their_means() {
    let home = tempfile::tempdir().unwrap();
    palm(&home.path().join("young.glb"), 300);
    let done = sweep(home.path(), &["young.glb", "--only", "draft"]);
    assert!(
        done.status.success(),
        "{}",
        String::from_utf8_lossy(&done.stderr)
    );
    let read = |name: &str| std::fs::read_to_string(home.path().join("out").join(name)).unwrap();
    let each = ["tree", "young"].map(|name| -> Sweep {
        assert!(read(&format!("{name}/sweep.svg")).contains("<circle"));
        serde_json::from_str(&read(&format!("{name}/sweep.json"))).unwrap()
    });
    let whole: Whole = serde_json::from_str(&read("sweep.json")).unwrap();
    assert_eq!(whole.inputs, ["tree.glb", "young.glb"]);
    let [base, draft] = &whole.variants[..] else {
        panic!("{} variants", whole.variants.len());
    };
    assert_eq!((base.time_ratio, base.f1_difference), (1.0, 0.0));
    let of_tree = |s: &Sweep| s.runs[1].f1_mean - s.runs[0].f1_mean;
    let mean = (of_tree(&each[0]) + of_tree(&each[1])) / 2.0;
    assert!((draft.f1_difference - mean).abs() < 1e-12);
    assert_eq!(read("sweep.csv").lines().count(), 3);
    let table = String::from_utf8(done.stdout).unwrap();
    assert!(
        whole.advice.starts_with("Over 2 trees draft takes "),
        "{}",
        whole.advice
    );
    assert!(table.contains(&whole.advice), "{table}");
}

#[test]
fn trees_that_would_share_a_folder_are_refused() {
    let home = tempfile::tempdir().unwrap();
    let done = sweep(home.path(), &["elsewhere/tree.glb"]);
    assert_eq!(done.status.code(), Some(2));
    let message = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(message.contains("one folder"), "{message}");
    assert!(!home.path().join("out").exists());
}
