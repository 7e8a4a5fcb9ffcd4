//! One variant of one tree: what its bake cost, and how near its levels are.

use std::path::Path;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::Asked;
use super::flip::flip;
use super::variants::Variant;
use crate::error::{Error, Result};
use crate::pipeline::{Request, bake};
use crate::report::schema::{Bake, Report};
use crate::watch::{Clock, Quiet, Watch};

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
    /// FLIP (0: no difference), mean over levels, each at its own size, from a few views.
    pub flip: f64,
    /// Covered area over the original's of the level that is farthest from 1.
    pub area_ratio: f64,
    /// Whether no other run is both faster and nearer (in the mean F1).
    pub on_front: bool,
    /// The figures of every level, and where the time went.
    pub report: Report,
}

impl Run {
    /// What runs are compared by, seconds: processor time, since other work on the machine does not
    /// change it; wall-clock time where the system does not tell that.
    pub fn cost(&self) -> f64 {
        match self.cpu_seconds > 0.0 {
            true => self.cpu_seconds,
            false => self.seconds,
        }
    }
}

/// Bakes a variant of `input` into a folder under `scratch`, which is removed again.
pub fn run(
    (input, asked): (&Path, &Asked),
    variant: &Variant,
    scratch: &Path,
    watch: &dyn Watch,
) -> Result<Run> {
    let output = scratch.join(variant.name.replace([' ', ','], "_"));
    let request = Request {
        input: input.into(),
        output: output.clone(),
        wanted: asked.wanted.clone(),
        recipe: variant.recipe.clone(),
        scene: asked.scene.clone(),
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
    let flip = flip(input, &output, &baked.report, watch)?;
    std::fs::remove_dir_all(&output).map_err(|e| Error::io(&output, "remove", e))?;
    let peak_bytes = stages.iter().map(|s| s.peak_bytes).max();
    let mut run = Run {
        name: variant.name.clone(),
        seconds,
        cpu_seconds: stages.iter().map(|s| s.cpu_seconds).sum(),
        peak_bytes: peak_bytes.unwrap_or(0),
        package_bytes,
        flip,
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
pub fn mark_front(runs: &mut [Run]) {
    let points: Vec<(f64, f64)> = runs.iter().map(|r| (r.cost(), -r.f1_mean)).collect();
    for (i, run) in runs.iter_mut().enumerate() {
        let (time, error) = points[i];
        run.on_front = !points
            .iter()
            .any(|&(t, e)| t <= time && e <= error && (t < time || e < error));
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

    #[test]
    fn the_front_is_one_of_processor_time_where_that_is_known() {
        let mut runs = [run(10.0, 0.95), run(5.0, 0.94)];
        (runs[0].cpu_seconds, runs[1].cpu_seconds) = (6.0, 9.0);
        mark_front(&mut runs);
        assert_eq!(runs.map(|r| r.on_front), [true, false]);
    }
}
