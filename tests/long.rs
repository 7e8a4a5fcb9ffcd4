//! Many bakes in one process: what one tree takes, the next one gets.

use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use glam::Vec3;
use pleach::pipeline::{Request, Wanted, bake};
use pleach::recipe::{Preset, Recipe};
use pleach::scene::Scene;
use pleach::space::glb::GlbBuilder;
use pleach::watch::Unwatched;
use serde_json::json;

/// One test at a time: memory is that of the whole process.
fn alone() -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    ONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Resident bytes of this process; `None` where the system doesn't tell.
fn resident() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmRSS:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}

/// A trunk of one quadrilateral under 30 to 60 leaves; another tree for each seed.
fn tree(seed: u64) -> Vec<u8> {
    let mut state = seed * 2 + 1;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 40) as f32 / (1u64 << 24) as f32 - 0.5
    };
    let mut some = |scale: f32| Vec3::new(next(), next(), next()) * scale;
    let mut points = vec![Vec3::ZERO, Vec3::X * 0.1, Vec3::new(0.1, 1.0, 0.0), Vec3::Y];
    for _ in 0..30 + seed % 31 {
        let (center, u, v) = (some(1.5) + Vec3::Y * 1.5, some(0.4), some(0.4));
        points.extend([center - u, center - v, center + u, center + v]);
    }
    let quads = 0..points.len() as u32 / 4;
    let triangles: Vec<[u32; 3]> = quads
        .flat_map(|q| [[4 * q, 4 * q + 1, 4 * q + 2], [4 * q, 4 * q + 2, 4 * q + 3]])
        .collect();
    let mut glb = GlbBuilder::default();
    let position = glb.positions(&points);
    let indices = glb.indices(&triangles, points.len());
    let primitive = json!({ "attributes": { "POSITION": position }, "indices": indices });
    glb.finish(json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }], "meshes": [{ "primitives": [primitive] }],
    }))
}

/// As little work as a bake can be.
fn request(input: &Path, output: &Path) -> Request {
    Request {
        input: input.to_path_buf(),
        output: output.to_path_buf(),
        recipe: Recipe {
            training_views: 4,
            refine_rounds: 1,
            ..Recipe::preset(Preset::Draft)
        },
        scene: Scene {
            screen_height_px: 256,
            heights_px: vec![32.0, 16.0],
            ..Scene::default()
        },
        wanted: Wanted::Levels(2),
        accept: true,
        ..Request::default()
    }
}

/// Bakes `count` small trees, no two alike; returns what was resident after each.
fn bakes(count: u64) -> Vec<u64> {
    let home = tempfile::tempdir().unwrap();
    let input = home.path().join("tree.glb");
    let one = |seed: u64| {
        std::fs::write(&input, tree(seed)).unwrap();
        let output = home.path().join(format!("{seed}"));
        let baked = bake(&request(&input, &output), &Unwatched).unwrap();
        assert_eq!(baked.report.levels.len(), 2);
        std::fs::remove_dir_all(&output).unwrap();
        resident().unwrap_or(0)
    };
    (0..count).map(one).collect()
}

/// Bytes in use after `warm` bakes and at the end; the largest of some, because one bake is larger than another.
fn before_and_after(resident: &[u64], warm: usize) -> [u64; 2] {
    let most = |part: &[u64]| part.iter().copied().max().unwrap_or(0);
    let [start, end] = [
        most(&resident[..warm]),
        most(&resident[resident.len() - 7..]),
    ];
    println!(
        "{} bakes: {:.1} MB after {warm}, {:.1} MB at the end",
        resident.len(),
        start as f64 / 1e6,
        end as f64 / 1e6
    );
    [start, end]
}

/// What the allocator keeps varies by so much, in bytes, whatever is done.
const SLACK: u64 = 4_000_000;

#[test]
fn memory_does_not_grow_from_tree_to_tree() {
    let _alone = alone();
    match resident() {
        Some(_) => {
            let [start, end] = before_and_after(&bakes(20), 12);
            assert!(end < start + SLACK, "{start} {end}");
        }
        None => println!("skipped: this system does not tell a process's memory"),
    }
}

/// `cargo test --release --test long -- --ignored --nocapture`
#[test]
#[ignore = "takes minutes"]
fn a_thousand_trees_need_the_memory_of_a_hundred() {
    let _alone = alone();
    assert!(
        resident().is_some(),
        "this system does not tell a process's memory"
    );
    let [start, end] = before_and_after(&bakes(1000), 100);
    assert!(end < start + SLACK, "{start} {end}");
}

/// Bakes `count` spoiled files; returns how many became packages.
fn spoiled(count: u64) -> u64 {
    let home = tempfile::tempdir().unwrap();
    let good = tree(5);
    let json = u32::from_le_bytes(good[12..16].try_into().unwrap()) as usize;
    let mut baked = 0;
    for seed in 0..count {
        let mut state = seed * 2 + 1;
        let mut below = |n: usize| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as usize % n
        };
        let mut bytes = good.clone();
        // Mostly numbers of the geometry: what is broken in the document seldom gets past the loader.
        for _ in 0..1 + below(6) {
            let start = if below(8) == 0 { 20 } else { 28 + json };
            let at = start + below(bytes.len() - start);
            bytes[at] = [0, 0xff, 0x7f, 0x80, bytes[at] ^ (1 << below(8))][below(5)];
        }
        let (input, output) = (home.path().join("tree.glb"), home.path().join("out"));
        std::fs::write(&input, bytes).unwrap();
        match bake(&request(&input, &output), &Unwatched) {
            Ok(done) => {
                baked += 1;
                let files = done.files.iter().map(|file| output.join(file));
                assert!(files.clone().count() > 3 && files.into_iter().all(|f| f.is_file()));
                std::fs::remove_dir_all(&output).unwrap();
            }
            Err(error) => {
                assert_eq!(error.exit_code(), 2, "seed {seed}: {error}");
                assert!(!output.exists(), "seed {seed}");
            }
        }
    }
    baked
}

#[test]
fn spoiled_files_become_packages_or_errors() {
    let _alone = alone();
    let baked = spoiled(25);
    assert!((1..25).contains(&baked), "{baked}");
}

/// `cargo test --release --test long -- --ignored --nocapture`
#[test]
#[ignore = "takes minutes"]
fn many_spoiled_files_become_packages_or_errors() {
    let _alone = alone();
    println!("{} of 1500 spoiled files became packages", spoiled(1500));
}

#[test]
fn ten_bakes_are_one() {
    let _alone = alone();
    let home = tempfile::tempdir().unwrap();
    let input = home.path().join("tree.glb");
    std::fs::write(&input, tree(3)).unwrap();
    let package = |round: usize| {
        let output = home.path().join("out");
        let pool = pleach::threads::pool([1, 2, 8][round % 3]).unwrap();
        let done = pool
            .install(|| bake(&request(&input, &output), &Unwatched))
            .unwrap();
        let files = done.files.iter();
        let all: Vec<Vec<u8>> = files
            .map(|f| std::fs::read(output.join(f)).unwrap())
            .collect();
        std::fs::remove_dir_all(&output).unwrap();
        all
    };
    let first = package(0);
    for round in 1..10 {
        assert!(package(round) == first, "round {round}");
    }
}
