//! `bake --page`: one file beside the package that shows what was baked and how.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

use pleach::botany::grow::{Options, Species, grow};

fn bake(home: &Path, output: &str, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_pleach"))
        .args(["bake", "tree.glb", "-o", output, "--preset", "draft"])
        .args(["--levels", "2", "--scene", "small.ron", "--accept"])
        .args(more)
        .current_dir(home)
        .output()
        .unwrap()
}

/// A folder with a small palm and a scene for it.
fn palm() -> tempfile::TempDir {
    let home = tempfile::tempdir().unwrap();
    let options = Options {
        leaves: Some(200),
        ..Options::default()
    };
    let grown = grow(&Species::named("palm").unwrap(), &options).unwrap();
    std::fs::write(home.path().join("tree.glb"), grown.glb).unwrap();
    std::fs::write(home.path().join("small.ron"), "(first_height_px: 64)").unwrap();
    home
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap());
    entries
        .map(|e| {
            (
                e.file_name().into_string().unwrap(),
                std::fs::read(e.path()).unwrap(),
            )
        })
        .collect()
}

#[test]
fn the_page_shows_cuts_skeleton_time_and_bytes_and_leaves_the_package_as_it_is() {
    let home = palm();
    let plain = bake(home.path(), "plain", &[]);
    assert!(plain.status.success());
    let done = bake(home.path(), "shown", &["--page"]);
    let told = String::from_utf8(done.stdout).unwrap();
    assert!(
        done.status.success() && told.contains("shown.report.html"),
        "{told}"
    );
    assert_eq!(
        files(&home.path().join("plain")),
        files(&home.path().join("shown"))
    );
    assert!(!home.path().join("plain.report.html").exists());

    let page = std::fs::read_to_string(home.path().join("shown.report.html")).unwrap();
    for text in [
        "How they were made",
        "Every budget&#39;s best cut",
        "What was recognised: skeleton",
        "Where the time went",
        "Where the bytes went",
        "tree_LOD2.glb",
        "Difference seen (FLIP)",
    ] {
        let plain = text.replace("&#39;", "'");
        assert!(page.contains(text) || page.contains(&plain), "{text}");
    }
    // Many cuts to choose from, and both levels among the marks.
    assert!(page.matches("best cut: ").count() > 10);
    assert_eq!(page.matches("<title>level: ").count(), 2);
    // It asks for nothing that it doesn't hold.
    assert!(!page.contains("src=\"http") && !page.contains("href=\"http"));
}

#[test]
fn evaluating_a_package_shows_the_cuts_it_was_chosen_from_and_another_tools_level_has_none() {
    let home = palm();
    assert!(bake(home.path(), "out", &[]).status.success());
    let evaluate = |level: &str, folder: &str| {
        let done = Command::new(env!("CARGO_BIN_EXE_pleach"))
            .args(["evaluate", "tree.glb", level, "-o", folder])
            .args(["--height", "32", "--views", "3", "--elevations", "0"])
            .current_dir(home.path())
            .output()
            .unwrap();
        assert!(done.status.success());
        std::fs::read_to_string(home.path().join(folder).join("report.html")).unwrap()
    };
    let ours = evaluate("out/tree_LOD1.glb", "ours");
    assert!(ours.matches("best cut: ").count() > 10);
    assert_eq!(ours.matches("<title>level: ").count(), 1);
    let theirs = evaluate("tree.glb", "theirs");
    assert!(!theirs.contains("best cut"));
    for page in [ours, theirs] {
        for text in ["Recognised: skeleton", "Where the time went", "recognise"] {
            assert!(page.contains(text), "{text}");
        }
    }
}

#[test]
fn a_bake_that_fails_leaves_no_page() {
    let home = tempfile::tempdir().unwrap();
    std::fs::write(home.path().join("tree.glb"), "no tree").unwrap();
    std::fs::write(home.path().join("small.ron"), "(first_height_px: 64)").unwrap();
    let done = bake(home.path(), "out", &["--page"]);
    assert_eq!(done.status.code(), Some(2));
    assert_eq!(files(home.path()).len(), 2);
    // A batch has no page, and says so before it bakes.
    let done = bake(home.path(), "out", &["--page", "--batch"]);
    assert_eq!(done.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&done.stderr).contains("--page shows one tree"));
    assert_eq!(files(home.path()).len(), 2);
}
