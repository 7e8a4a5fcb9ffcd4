//! How long a bake takes, where the time goes, and how near that is to the least it could take.
//!
//! `cargo bench --bench bake` prints a table of stages for a tree of 500,000 triangles and its
//! ratio to the limit (load it, draw every triangle once into 2048 x 2048, encode the same
//! textures), then times bakes of 10k, 100k and 1M leaves with divan.
//! `PLEACH_BENCH_TREE=file.glb` takes another tree for the table.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use pleach::botany::grow::{Options, Species, grow};
use pleach::botany::load::load;
use pleach::export::gltf::encode_images;
use pleach::export::surface::scene_of_model;
use pleach::pipeline::{Baked, Limit, Request, Wanted, bake};
use pleach::report::Drawable;
use pleach::space::raster::{Camera, Mips, Sampling, draw};
use pleach::watch::{Unwatched, Watch};

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

/// Time and memory of every stage and part, in order of their first appearance.
struct Clock(Mutex<Times>);

struct Row {
    name: String,
    time: Duration,
    /// Largest memory of the process while it ran, bytes; 0 where the system doesn't say.
    peak: u64,
}

/// The process's largest memory since the last call, bytes (Linux).
fn peak_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok());
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    kilobytes.unwrap_or(0) * 1024
}

struct Times {
    rows: Vec<Row>,
    since: Instant,
    current: usize,
}

impl Clock {
    fn new() -> Self {
        Self(Mutex::new(Times {
            rows: vec![Row {
                name: "start".into(),
                time: Duration::ZERO,
                peak: 0,
            }],
            since: Instant::now(),
            current: 0,
        }))
    }

    fn enter(&self, name: &str) {
        let mut times = self.0.lock().expect("one thread begins stages");
        let current = times.current;
        let spent = times.since.elapsed();
        times.rows[current].time += spent;
        times.rows[current].peak = times.rows[current].peak.max(peak_memory());
        times.since = Instant::now();
        let known = times.rows.iter().position(|r| r.name == name);
        times.current = known.unwrap_or(times.rows.len());
        if known.is_none() {
            times.rows.push(Row {
                name: name.into(),
                time: Duration::ZERO,
                peak: 0,
            });
        }
    }
}

impl Watch for Clock {
    fn stage(&self, name: &str, _: u64) {
        self.enter(name);
    }

    fn part(&self, name: &str) {
        self.enter(&format!("  {name}"));
    }
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
    let clock = Clock::new();
    let start = Instant::now();
    let output = folder.path().join("package");
    let baked = four_levels(&input, output.clone(), &clock);
    let all = start.elapsed().as_secs_f64();
    clock.enter("end");
    let limit = limit(&input, &output, &baked);
    println!("\nstage            seconds  share  peak MB");
    for row in &clock.0.lock().expect("the bake is over").rows {
        let seconds = row.time.as_secs_f64();
        if seconds > 0.0 {
            println!(
                "{:16} {seconds:7.2}  {:3.0} %  {:7.0}",
                row.name,
                100.0 * seconds / all,
                row.peak as f64 / 1e6
            );
        }
    }
    println!("{:16} {all:7.2}", "bake");
    for (name, seconds) in &limit {
        println!("limit: {name:9} {seconds:7.2}");
    }
    let least: f64 = limit.iter().map(|l| l.1).sum();
    println!("bake over limit  {:7.2}\n", all / least);
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
