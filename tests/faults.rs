//! What happens to a package when a bake is killed, disturbed or starved.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Name and bytes of every file.
type Files = BTreeMap<String, Vec<u8>>;

fn files(folder: &Path) -> Files {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Files::new();
    };
    entries
        .map(|e| e.unwrap().path())
        .map(|f| {
            (
                f.file_name().unwrap().to_string_lossy().into_owned(),
                std::fs::read(&f).unwrap(),
            )
        })
        .collect()
}

/// A small tree in a folder of its own.
fn home() -> (tempfile::TempDir, PathBuf) {
    let home = tempfile::tempdir().unwrap();
    let tree = home.path().join("tree.glb");
    let grown = Command::new(env!("CARGO_BIN_EXE_pleach"))
        .args(["grow", "palm", "--leaves", "40", "-o"])
        .arg(&tree)
        .stdout(Stdio::null())
        .status()
        .unwrap();
    assert!(grown.success());
    // As little work as a bake can be.
    std::fs::write(
        tree.with_extension("recipe"),
        "(training_views: 4, refine_rounds: 1)",
    )
    .unwrap();
    std::fs::write(
        tree.with_extension("scene"),
        "(screen_height_px: 256, heights_px: [64, 32])",
    )
    .unwrap();
    (home, tree)
}

fn start(tree: &Path, output: &Path, triangles: &str) -> Child {
    let home = output.parent().unwrap();
    Command::new(env!("CARGO_BIN_EXE_pleach"))
        .args([
            "bake",
            "--preset",
            "draft",
            "--accept",
            "--quiet",
            "--triangles",
            triangles,
            "-o",
        ])
        .args([output, tree])
        .arg("--recipe")
        .arg(home.join("tree.recipe"))
        .arg("--scene")
        .arg(home.join("tree.scene"))
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// What is in a folder beside `known`.
fn strangers(folder: &Path, known: &[&str]) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    entries
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| !known.contains(&name.as_str()))
        .collect()
}

const KNOWN: [&str; 7] = [
    "tree.glb",
    "tree.skeleton.ron",
    "tree.recipe",
    "tree.scene",
    "a",
    "b",
    "out",
];

/// The two packages that the tests bake, and how long one takes.
fn packages(home: &Path, tree: &Path) -> ([Files; 2], Duration) {
    let started = Instant::now();
    let both = [("a", "300"), ("b", "200,24")].map(|(name, triangles)| {
        let folder = home.join(name);
        assert!(start(tree, &folder, triangles).wait().unwrap().success());
        files(&folder)
    });
    assert!(both[0].len() >= 5 && both[0] != both[1]);
    (both, started.elapsed() / 2)
}

#[test]
fn killed_at_any_moment_the_old_package_is_whole_or_the_new_one() {
    let (home, tree) = home();
    let (both, takes) = packages(home.path(), &tree);
    let output = home.path().join("out");
    assert!(start(&tree, &output, "300").wait().unwrap().success());
    let mut kept = [0, 0];
    for kill in 0..50u32 {
        let triangles = ["200,24", "300"][kill as usize % 2];
        let mut child = start(&tree, &output, triangles);
        // Late moments more often than early ones: that is when files are written and moved.
        let part = (f64::from(kill) * 0.618_034).fract().sqrt();
        std::thread::sleep(takes.mul_f64(1.1 * part));
        child.kill().unwrap();
        child.wait().unwrap();
        let found = files(&output);
        match both.iter().position(|package| *package == found) {
            Some(which) => kept[which] += 1,
            None => panic!("kill {kill} left {:?}", found.keys()),
        }
    }
    assert!(kept[0] + kept[1] == 50);
    assert!(start(&tree, &output, "200,24").wait().unwrap().success());
    assert!(files(&output) == both[1]);
    if cfg!(target_os = "linux") {
        assert_eq!(
            strangers(home.path(), &KNOWN),
            [""; 0],
            "drafts of the dead are cleared"
        );
    }
}

#[test]
fn two_bakes_into_one_folder_leave_one_of_their_packages_whole() {
    let (home, tree) = home();
    let (both, _) = packages(home.path(), &tree);
    let output = home.path().join("out");
    for round in 0..4 {
        let mut at_once = [
            start(&tree, &output, "300"),
            start(&tree, &output, "200,24"),
        ];
        let ended = at_once.each_mut().map(|c| c.wait().unwrap().success());
        assert!(ended.contains(&true), "round {round}");
        assert!(both.contains(&files(&output)), "round {round}");
    }
    assert_eq!(strangers(home.path(), &KNOWN), [""; 0]);
}

#[cfg(unix)]
#[test]
fn a_limit_of_file_sizes_leaves_the_old_package() {
    let (home, tree) = home();
    let (both, _) = packages(home.path(), &tree);
    let output = home.path().join("a");
    // Blocks of 512 bytes: too few for any level.
    let script = "ulimit -f 8; exec \"$@\"";
    let status = Command::new("sh")
        .args([
            "-c",
            script,
            "sh",
            env!("CARGO_BIN_EXE_pleach"),
            "bake",
            "--quiet",
            "-o",
        ])
        .args([&output, &tree])
        .stderr(Stdio::null())
        .status()
        .unwrap();
    assert!(!status.success());
    assert!(files(&output) == both[0]);
}

/// Needs a Linux that lets users mount in a namespace of their own; says so where it doesn't.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_the_old_package_and_names_the_file() {
    let (home, tree) = home();
    let (both, _) = packages(home.path(), &tree);
    let bytes: usize = both[0].values().map(Vec::len).sum();
    // Room for the old package and half of another.
    let script = "mkdir disk && mount -t tmpfs -o size=$1 none disk || exit 99
        cp -r a disk/out || exit 98
        \"$2\" bake --preset draft --accept --quiet --triangles 200,24 -o disk/out tree.glb \\
            --recipe tree.recipe --scene tree.scene 2> message
        echo $? > code; ls disk > left; cp -r disk/out after";
    let done = Command::new("unshare")
        .args([
            "--user",
            "--map-root-user",
            "--mount",
            "sh",
            "-c",
            script,
            "sh",
        ])
        .arg((bytes * 3 / 2).to_string())
        .arg(env!("CARGO_BIN_EXE_pleach"))
        .current_dir(home.path())
        .output();
    match done {
        Ok(done) if done.status.success() => (),
        other => return println!("skipped: no file system of one's own here: {other:?}"),
    }
    let read = |name: &str| std::fs::read_to_string(home.path().join(name)).unwrap();
    let message = read("message");
    assert_eq!(read("code").trim(), "2", "{message}");
    assert!(message.contains("No space left"), "{message}");
    assert!(message.contains("help:"), "{message}");
    assert_eq!(read("left").trim(), "out", "nothing half-written is left");
    assert!(files(&home.path().join("after")) == both[0]);
}

#[test]
fn names_with_spaces_quotes_and_other_letters_are_names() {
    let (home, tree) = home();
    for name in [
        "two words",
        "a 'quoted' one",
        "naïve-树",
        "100%25",
        "-dash",
        &"x".repeat(220),
    ] {
        let input = home.path().join(format!("{name}.glb"));
        std::fs::copy(&tree, &input).unwrap();
        let output = home.path().join(format!("of {name}"));
        assert!(
            start(&input, &output, "300").wait().unwrap().success(),
            "{name}"
        );
        let found = files(&output);
        assert!(
            found.contains_key(&format!("{name}_LOD1.glb")),
            "{:?}",
            found.keys()
        );
    }
    // What no file system takes is said before the work.
    let long = home.path().join("x".repeat(240) + ".glb");
    std::fs::copy(&tree, &long).unwrap();
    let done = Command::new(env!("CARGO_BIN_EXE_pleach"))
        .args([
            Path::new("bake"),
            &long,
            Path::new("-o"),
            &home.path().join("never"),
        ])
        .output()
        .unwrap();
    let message = String::from_utf8(done.stderr).unwrap();
    assert_eq!(done.status.code(), Some(2), "{message}");
    assert!(message.contains("rename it") && !home.path().join("never").exists());
}

#[test]
fn a_reader_that_goes_away_is_no_fault() {
    let (home, tree) = home();
    let (tree, again) = (tree.to_str().unwrap(), home.path().join("again.glb"));
    let again = again.to_str().unwrap();
    let commands: [&[&str]; 5] = [
        &["inspect", tree],
        &["inspect", tree, "--json"],
        &["grow", "palm", "--leaves", "40", "-o", again],
        &["grow", "palm", "--leaves", "40", "-o", again, "--json"],
        &["evaluate", tree, tree, "--height", "32", "--views", "4"],
    ];
    for command in commands {
        let mut child = Command::new(env!("CARGO_BIN_EXE_pleach"))
            .args(command)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let done = child.wait_with_output().unwrap();
        let message = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(0), "{command:?}: {message}");
        assert!(!message.contains("panicked"), "{message}");
    }
    // Where not even errors can be written, the exit code still tells.
    let mut child = Command::new(env!("CARGO_BIN_EXE_pleach"))
        .args(["inspect", "no such file.glb"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stderr.take());
    assert_eq!(child.wait().unwrap().code(), Some(2));
}

#[test]
fn an_input_that_changes_while_it_is_read_is_one_of_its_versions_or_an_error() {
    use std::sync::atomic::{AtomicBool, Ordering};
    /// Ends the writer also where an assertion fails, instead of leaving the test waiting for it.
    struct Over<'a>(&'a AtomicBool);
    impl Drop for Over<'_> {
        fn drop(&mut self) {
            self.0.store(true, Ordering::Relaxed);
        }
    }
    let (home, tree) = home();
    let one = std::fs::read(&tree).unwrap();
    let grown = Command::new(env!("CARGO_BIN_EXE_pleach"))
        .args(["grow", "palm", "--leaves", "30", "--seed", "7", "-q", "-o"])
        .arg(&tree)
        .status()
        .unwrap();
    assert!(grown.success());
    let versions = [one, std::fs::read(&tree).unwrap()];
    assert!(versions[0] != versions[1]);
    let over = AtomicBool::new(false);
    let mut baked = 0;
    std::thread::scope(|scope| {
        scope.spawn(|| {
            // In place: cut off, half-written or whole when it is read.
            for (round, version) in versions.iter().cycle().enumerate() {
                if over.load(Ordering::Relaxed) {
                    return;
                }
                let (start, end) = version.split_at(version.len() / 2);
                let mut file = std::fs::File::create(&tree).unwrap();
                std::io::Write::write_all(&mut file, start).unwrap();
                std::thread::yield_now();
                std::io::Write::write_all(&mut file, end).unwrap();
                // Sometimes long enough for a reader to be sure.
                let pause_ms = if round % 8 == 7 { 100 } else { 2 };
                std::thread::sleep(Duration::from_millis(pause_ms));
            }
        });
        let _over = Over(&over);
        for round in 0..8 {
            let output = home.path().join(format!("out{round}"));
            let code = start(&tree, &output, "300").wait().unwrap().code();
            match code {
                Some(0) => {
                    baked += 1;
                    let read = |name: &str| std::fs::read(output.join(name)).unwrap();
                    assert!(!read("tree_LOD1.glb").is_empty());
                    let manifest = String::from_utf8(read("tree.pleach.ron")).unwrap();
                    let whole = versions.iter().any(|version| {
                        let sum = pleach::space::sha256::sha256(version);
                        manifest.contains(&sum)
                    });
                    assert!(whole, "round {round}: neither version");
                }
                Some(2) => assert!(!output.exists(), "round {round}"),
                other => panic!("round {round}: {other:?}"),
            }
        }
    });
    println!("{baked} of 8 were read whole");
    // Once nobody writes any more, it is a tree like any other.
    std::fs::write(&tree, &versions[0]).unwrap();
    let output = home.path().join("after");
    assert!(start(&tree, &output, "300").wait().unwrap().success());
    assert!(output.join("tree_LOD1.glb").is_file());
}
