//! How long a bake takes, where the time goes, and how near that is to the least it could take.
//!
//! `cargo bench --bench bake` prints a table of stages for a tree of 500,000 triangles and its
//! ratio to the limit (load it, draw every triangle once into 2048 x 2048, encode the same
//! textures), the time of the default evaluation of its levels, also as a ratio to the bake's, then
//! times bakes of 10k, 100k and 1M leaves with divan.
//! `PLEACH_BENCH_TREE=file.glb` takes another tree for the table.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use pleach::botany::grow::{Options, Species, grow};
use pleach::botany::load::load;
use pleach::export::png::encode_images;
use pleach::export::surface::scene_of_model;
use pleach::pipeline::{Baked, Limit, Request, Wanted, bake};
use pleach::report::Drawable;
use pleach::space::raster::{Camera, Mips, Sampling, draw};
use pleach::watch::{Clock, Unwatched, Watch};

const TRIANGLES: u64 = 500_000;

fn main() {
    stages();
    divan::main();
}

/// A species' tree with so many leaves, in a file of its own.
fn grown(folder: &Path, leaves: u32) -> PathBuf {
    let species = Species::named("oak").expect("a built-in species");
    let options = Options {
        leaves: Some(leaves),
        ..Options::default()
    };
    let grown = grow(&species, &options).expect("an oak");
    let file = folder.join(format!("oak_{leaves}.glb"));
    std::fs::write(&file, grown.glb).expect("a written file");
    file
}

fn four_levels(input: &Path, output: PathBuf, watch: &dyn Watch) -> Baked {
    let share = |s| Limit::Share(s);
    let request = Request {
        input: input.into(),
        output,
        wanted: Wanted::Limits(vec![share(0.1), share(0.03), share(0.01), Limit::Count(24)]),
        force: true,
        accept: true,
        ..Request::default()
    };
    bake(&request, watch).expect("a bake")
}

fn stages() {
    let folder = tempfile::tempdir().expect("a folder");
    let input = match std::env::var_os("PLEACH_BENCH_TREE") {
        Some(file) => file.into(),
        None => {
            // About ten triangles a leaf, wood included: the share is found, not assumed.
            let few = load(&grown(folder.path(), 20_000))
                .expect("an oak")
                .triangles
                .len() as u64;
            grown(folder.path(), (20_000 * TRIANGLES / few) as u32)
        }
    };
    let clock = Clock::new(Unwatched);
    let start = Instant::now();
    let output = folder.path().join("package");
    let baked = four_levels(&input, output.clone(), &clock);
    let all = start.elapsed().as_secs_f64();
    let rows = clock.finish();
    let limit = limit(&input, &output, &baked);
    println!("\nstage            seconds     cpu  share  peak MB");
    for row in rows {
        println!(
            "{:16} {:7.2} {:7.2}  {:3.0} %  {:7.0}",
            row.name,
            row.seconds,
            row.cpu_seconds,
            100.0 * row.seconds / all,
            row.peak_bytes as f64 / 1e6
        );
    }
    println!("{:16} {all:7.2}", "bake");
    for (name, seconds) in &limit {
        println!("limit: {name:9} {seconds:7.2}");
    }
    let least: f64 = limit.iter().map(|l| l.1).sum();
    println!("bake over limit  {:7.2}", all / least);
    let evaluation = evaluation(&input, &output, &baked);
    println!("evaluation       {evaluation:7.2}");
    println!("over the bake    {:7.2}\n", evaluation / all);
}

/// Seconds that the default evaluation of the baked levels takes, page and pictures included.
fn evaluation(input: &Path, output: &Path, baked: &Baked) -> f64 {
    let levels = baked.report.levels.iter().map(|l| output.join(&l.file));
    let start = Instant::now();
    let done = Command::new(env!("CARGO_BIN_EXE_pleach"))
        .arg("evaluate")
        .arg(input)
        .args(levels)
        .arg("-o")
        .arg(output.with_extension("evaluated"))
        .output()
        .expect("the command");
    assert!(done.status.success());
    start.elapsed().as_secs_f64()
}

/// What any such bake has to do at least, timed in this run.
fn limit(input: &Path, output: &Path, baked: &Baked) -> [(&'static str, f64); 3] {
    let timed = |start: Instant| start.elapsed().as_secs_f64();
    let start = Instant::now();
    let model = load(input).expect("the input");
    let loading = timed(start);
    let start = Instant::now();
    let camera = Camera::orthographic(
        -glam::Vec3::Z,
        glam::Vec3::Y,
        glam::Vec3::ZERO,
        1024.0,
        2048,
        2048,
    );
    let sampling = Sampling {
        side: 1,
        mips: Mips::Base,
    };
    let items = draw(&Drawable::shaded(&model).scene(), &camera, sampling);
    assert!(
        items
            .triangle
            .iter()
            .any(|&t| t != pleach::space::raster::EMPTY)
    );
    let drawing = timed(start);
    let levels: Vec<_> = baked.files.iter().filter(|f| f.contains("_LOD")).collect();
    let scenes: Vec<_> = levels
        .iter()
        .map(|f| load(&output.join(f)).expect("a level"))
        .map(|m| scene_of_model(&m, 0..m.triangles.len() as u32))
        .collect();
    let start = Instant::now();
    for scene in &scenes {
        assert!(!encode_images(scene).expect("images").is_empty());
    }
    [
        ("load", loading),
        ("draw", drawing),
        ("encode", timed(start)),
    ]
}

/// Time over leaves: ten times as many should take ten times as long.
#[divan::bench(args = [10_000, 100_000, 1_000_000], sample_count = 1, sample_size = 1)]
fn leaves(bencher: divan::Bencher, leaves: u32) {
    let folder = tempfile::tempdir().expect("a folder");
    let input = grown(folder.path(), leaves);
    let output = folder.path().join("package");
    bencher
        .counter(divan::counter::ItemsCount::new(leaves))
        .bench_local(|| four_levels(&input, output.clone(), &Unwatched));
}
