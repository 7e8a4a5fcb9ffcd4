//! `pleach sweep`: what speed costs in accuracy, on the user's own tree.

use std::path::{Path, PathBuf};

use super::bake::limit;
use super::out::print;
use super::progress::{Bars, catch_ctrl_c};
use super::scene::scene;
use crate::error::{Error, Result};
use crate::pipeline::{Limit, Wanted};
use crate::sweep::{Asked, Sweep, plot, sweep};
use crate::threads::pool;

/// Measure speed against accuracy: every preset, and each knob alone.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// The tree: .glb or .gltf.
    input: PathBuf,
    /// Folder for sweep.json, sweep.csv and sweep.svg.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// One level for each: a count ("5000") or a share of the original ("10%"), wood included.
    #[arg(long, value_delimiter = ',', value_name = "N|%", value_parser = limit, default_value = "10%,3%,1%,24")]
    triangles: Vec<Limit>,
    /// Screen, field of view and distances: hero, game, landscape, map, or a file (RON).
    #[arg(long, value_name = "NAME|FILE.ron")]
    scene: Option<PathBuf>,
    /// Only these variants beside the balanced preset, for example "draft,best,samples 2".
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    only: Vec<String>,
    /// Threads; 0: one for each core.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    /// No progress, no table.
    #[arg(long)]
    quiet: bool,
    /// Print sweep.json instead of a table.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let asked = Asked {
        input: args.input.clone(),
        wanted: Wanted::Limits(args.triangles.clone()),
        scene: scene(args.scene.as_deref())?,
        only: args.only.clone(),
    };
    catch_ctrl_c()?;
    std::fs::create_dir_all(&args.output).map_err(|e| Error::io(&args.output, "create", e))?;
    let pool = pool(args.threads.into())?;
    let scratch = args.output.join(format!(".sweep-{}", std::process::id()));
    let bars = Bars::new(args.quiet);
    let found = pool.install(|| sweep(&asked, &scratch, &bars));
    bars.finish();
    // Each run removed its package; the folder is left where one failed.
    let _ = std::fs::remove_dir_all(&scratch);
    if found.is_err() {
        // Nothing half-written: the folder goes if it was made for this, or was empty.
        let _ = std::fs::remove_dir(&args.output);
    }
    let found = found?;
    let json = serde_json::to_string_pretty(&found).map_err(|e| Error::Internal {
        step: "report",
        what: e.to_string(),
    })? + "\n";
    write(&args.output, "sweep.json", &json)?;
    write(&args.output, "sweep.csv", &found.csv())?;
    write(&args.output, "sweep.svg", &plot(&found))?;
    match (args.json, args.quiet) {
        (true, _) => print(&json),
        (false, true) => Ok(()),
        (false, false) => print(&table(&found)),
    }
}

fn write(folder: &Path, name: &str, text: &str) -> Result<()> {
    let file = folder.join(name);
    std::fs::write(&file, text).map_err(|e| Error::io(&file, "write", e))
}

/// One line a run, the fastest first; a star for those on the front. `ratio` and `cpu`: time, and
/// processor time of all threads, over those of the base.
fn table(found: &Sweep) -> String {
    let mut out = format!(
        "{:<20}{:>9}{:>7}{:>7}{:>9}{:>9}{:>9}{:>8}{:>8}{:>7}{:>7}  front\n",
        "variant",
        "seconds",
        "ratio",
        "cpu",
        "peak MB",
        "disk MB",
        "tex MB",
        "F1",
        "worst",
        "E",
        "area"
    );
    let mib = |bytes: u64| bytes as f64 / 1_048_576.0;
    let base = found.runs.first().map_or(1.0, |r| r.seconds);
    let base_cpu = found.runs.first().map_or(1.0, |r| r.cpu_seconds);
    let mut runs: Vec<_> = found.runs.iter().collect();
    runs.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    for run in runs {
        let line = format!(
            "{:<20}{:>9.1}{:>7.2}{:>7.2}{:>9.0}{:>9.1}{:>9.1}{:>8.4}{:>8.4}{:>7.2}{:>7.3}  {}",
            run.name,
            run.seconds,
            run.seconds / base.max(1e-9),
            run.cpu_seconds / base_cpu.max(1e-9),
            mib(run.peak_bytes),
            mib(run.package_bytes),
            mib(run.texture_bytes),
            run.f1_mean,
            run.f1_worst,
            run.shift_ratio,
            run.area_ratio,
            if run.on_front { "*" } else { "" }
        );
        out += line.trim_end();
        out += "\n";
    }
    out += &format!(
        "\nThe base took {:.2} times as long when it was baked again at the end.\n",
        found.repeat_ratio
    );
    for sentence in &found.advice {
        out += &format!("{sentence}\n");
    }
    out
}
