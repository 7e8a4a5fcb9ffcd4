//! Speed against accuracy: one tree baked by every preset, and by each knob alone.
//!
//! Runs follow one another in one process with the same threads, so that their times compare; the
//! base is baked first and once more at the end, and the difference of the two says how far times
//! can be trusted. Figures are those of the packages' own reports, each level at its own size.

mod advice;
mod plot;
mod variants;

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::pipeline::{Request, Wanted, bake};
use crate::recipe::Recipe;
use crate::report::schema::{Bake, Report};
use crate::scene::Scene;
use crate::watch::{Clock, Quiet, Watch};
pub use advice::advice;
pub use plot::plot;
pub use variants::{BASE, Variant, variants};

/// What to sweep.
#[derive(Clone, Debug, Default)]
pub struct Asked {
    /// The tree.
    pub input: PathBuf,
    /// Which levels.
    pub wanted: Wanted,
    /// The screen.
    pub scene: Scene,
    /// Names of the variants to try beside the base; empty: all.
    pub only: Vec<String>,
}

/// Everything that a sweep found.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Sweep {
    /// Name of the input file.
    pub input: String,
    /// Every variant, in the order in which they ran.
    pub runs: Vec<Run>,
    /// Time of the base's second run over that of its first: how far times can be trusted.
    pub repeat_ratio: f64,
    /// What to make of it, a sentence each.
    pub advice: Vec<String>,
}

/// One variant and what it cost and gave.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Run {
    /// "draft", "samples 2".
    pub name: String,
    /// Wall-clock time of the whole bake, its report included, seconds.
    pub seconds: f64,
    /// Processor time of all threads, seconds; 0 where the system does not tell.
    pub cpu_seconds: f64,
    /// Peak resident memory, bytes; 0 where the system does not tell.
    pub peak_bytes: u64,
    /// Bytes of all files of the package.
    pub package_bytes: u64,
    /// Bytes of all levels' textures with mips, as a GPU holds them (without the original's).
    pub texture_bytes: u64,
    /// Triangles of all levels together (without the original's).
    pub triangles: u64,
    /// Mean F1, mean over levels, each at its own size.
    pub f1_mean: f64,
    /// F1 of the worst view of any level.
    pub f1_worst: f64,
    /// Shift ratio, mean over levels.
    pub shift_ratio: f64,
    /// Covered area over the original's of the level that is farthest from 1.
    pub area_ratio: f64,
    /// Whether no other run is both faster and nearer (in the mean F1).
    pub on_front: bool,
    /// The figures of every level, and where the time went.
    pub report: Report,
}

/// Bakes every variant into a folder under `scratch`, which is removed after each.
///
/// # Errors
/// [`Error::Usage`] where a variant is unknown, those of a bake, and [`Error::Interrupted`]. Levels out of their band are accepted.
pub fn sweep(request: &Asked, scratch: &Path, watch: &dyn Watch) -> Result<Sweep> {
    let mut all = chosen(&request.only)?;
    let again = Variant {
        name: format!("{BASE}, again"),
        recipe: Recipe::balanced(),
    };
    all.push(again);
    watch.stage("variants", all.len() as u64);
    let mut runs = Vec::with_capacity(all.len());
    for variant in &all {
        watch.part(&variant.name);
        runs.push(run(request, variant, scratch, watch)?);
        watch.step();
    }
    let again = runs.pop().map_or(0.0, |r| r.seconds);
    let first = runs.first().map_or(0.0, |r| r.seconds);
    mark_front(&mut runs);
    let name = request.input.file_name().unwrap_or_default();
    Ok(Sweep {
        input: name.to_string_lossy().into_owned(),
        advice: advice(&runs),
        runs,
        repeat_ratio: again / first.max(1e-9),
    })
}

/// The base and the variants that were asked for.
fn chosen(only: &[String]) -> Result<Vec<Variant>> {
    let all = variants();
    let names: Vec<&str> = all.iter().map(|v| v.name.as_str()).collect();
    if let Some(unknown) = only.iter().find(|name| !names.contains(&name.as_str())) {
        return Err(Error::usage(
            format!("there is no variant {unknown:?}"),
            format!("the variants are: {}", names.join(", ")),
        ));
    }
    let wanted = |v: &Variant| only.is_empty() || v.name == BASE || only.contains(&v.name);
    Ok(all.into_iter().filter(wanted).collect())
}

fn run(request: &Asked, variant: &Variant, scratch: &Path, watch: &dyn Watch) -> Result<Run> {
    let output = scratch.join(variant.name.replace([' ', ','], "_"));
    let request = Request {
        input: request.input.clone(),
        output: output.clone(),
        wanted: request.wanted.clone(),
        recipe: variant.recipe.clone(),
        scene: request.scene.clone(),
        force: true,
        accept: true,
        ..Request::default()
    };
    let started = Instant::now();
    let clock = Clock::new(Quiet(watch));
    let baked = bake(&request, &clock)?;
    let seconds = started.elapsed().as_secs_f64();
    let stages = clock.finish();
    let size = |name: &String| std::fs::metadata(output.join(name)).map_or(0, |m| m.len());
    let package_bytes = baked.files.iter().map(size).sum();
    std::fs::remove_dir_all(&output).map_err(|e| Error::io(&output, "remove", e))?;
    let peak_bytes = stages.iter().map(|s| s.peak_bytes).max();
    let mut run = Run {
        name: variant.name.clone(),
        seconds,
        cpu_seconds: stages.iter().map(|s| s.cpu_seconds).sum(),
        peak_bytes: peak_bytes.unwrap_or(0),
        package_bytes,
        ..figures(&baked.report)
    };
    run.report = Report {
        bake: Some(Bake {
            seconds,
            peak_bytes: peak_bytes.filter(|&b| b > 0),
            stages,
        }),
        ..baked.report
    };
    Ok(run)
}

/// What the levels of a report have in common.
fn figures(report: &Report) -> Run {
    let sizes = || report.levels.iter().filter_map(|l| l.sizes.first());
    let count = sizes().count().max(1) as f64;
    let from_one = |a: f64| a.max(1.0 / a.max(1e-9));
    let areas = sizes().map(|s| s.area_ratio.mean);
    Run {
        triangles: report.levels.iter().map(|l| l.triangles).sum(),
        texture_bytes: report.levels.iter().map(|l| l.texture_bytes).sum(),
        f1_mean: sizes().map(|s| s.f1.mean).sum::<f64>() / count,
        f1_worst: sizes().map(|s| s.f1.worst).fold(1.0, f64::min),
        shift_ratio: sizes().map(|s| s.shift_ratio).sum::<f64>() / count,
        area_ratio: areas
            .max_by(|a, b| from_one(*a).total_cmp(&from_one(*b)))
            .unwrap_or(1.0),
        ..Run::default()
    }
}

/// Pareto: a run is on the front where none is at least as good in both and better in one.
fn mark_front(runs: &mut [Run]) {
    let points: Vec<(f64, f64)> = runs.iter().map(|r| (r.seconds, -r.f1_mean)).collect();
    for (i, run) in runs.iter_mut().enumerate() {
        let (time, error) = points[i];
        run.on_front = !points
            .iter()
            .any(|&(t, e)| t <= time && e <= error && (t < time || e < error));
    }
}

impl Sweep {
    /// One line a run, for spreadsheets.
    pub fn csv(&self) -> String {
        let mut out = String::from(
            "name,seconds,cpu_seconds,peak_bytes,package_bytes,texture_bytes,triangles,f1_mean,f1_worst,shift_ratio,area_ratio,on_front\n",
        );
        for r in &self.runs {
            out += &format!(
                "{},{:.3},{:.2},{},{},{},{},{:.5},{:.5},{:.4},{:.5},{}\n",
                r.name,
                r.seconds,
                r.cpu_seconds,
                r.peak_bytes,
                r.package_bytes,
                r.texture_bytes,
                r.triangles,
                r.f1_mean,
                r.f1_worst,
                r.shift_ratio,
                r.area_ratio,
                r.on_front
            );
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(seconds: f64, f1_mean: f64) -> Run {
        Run {
            seconds,
            f1_mean,
            ..Run::default()
        }
    }

    #[test]
    fn the_front_holds_what_nothing_beats() {
        let mut runs = [
            run(10.0, 0.95),
            run(5.0, 0.94),
            run(7.0, 0.93),
            run(12.0, 0.95),
            run(20.0, 0.96),
        ];
        mark_front(&mut runs);
        let front: Vec<bool> = runs.iter().map(|r| r.on_front).collect();
        assert_eq!(front, [true, true, false, false, true]);
    }
}
