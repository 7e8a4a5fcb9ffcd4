//! `pleach bake` with many trees: a package for each, and what became of them.

use std::time::Instant;

use serde::Serialize;

use super::out::{print, say};
use super::progress::Bars;
use crate::batch::{Batch, Done, Outcome, bake_all};
use crate::error::{Error, Result};
use crate::report::schema::Report;

/// What `--json` prints of a batch.
#[derive(Serialize)]
struct Summary<'a> {
    trees: Vec<Row<'a>>,
    /// Wall-clock time of all, seconds.
    seconds: f64,
}

#[derive(Serialize)]
struct Row<'a> {
    input: String,
    output: String,
    /// "baked", "unchanged" or "failed".
    state: &'static str,
    seconds: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    exit_code: Option<u8>,
    warnings: &'a [String],
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<&'a Report>,
}

/// Bakes all trees, says what became of each, and ends with the error of the one that is worst.
pub fn run(batch: &Batch, quiet: bool, json: bool) -> Result<()> {
    let started = Instant::now();
    let bars = Bars::new(quiet);
    let outcomes = bake_all(batch, &bars);
    bars.finish();
    let outcomes = outcomes?;
    for (input, line) in outcomes.iter().filter(|_| !quiet).flat_map(warnings) {
        say(format_args!("warning: {input}: {line}"));
    }
    let seconds = started.elapsed().as_secs_f64();
    if json {
        let summary = Summary {
            trees: outcomes.iter().map(row).collect(),
            seconds,
        };
        let text = serde_json::to_string_pretty(&summary).map_err(|e| Error::Internal {
            step: "report",
            what: e.to_string(),
        })?;
        print(&(text + "\n"))?;
    } else if !quiet {
        print(&table(&outcomes, seconds))?;
    }
    failed(outcomes)
}

fn warnings(outcome: &Outcome) -> Vec<(std::path::Display<'_>, &String)> {
    let lines = match &outcome.done {
        Done::Baked(baked) => baked.warnings.as_slice(),
        _ => &[],
    };
    let named = lines.iter().map(|line| (outcome.input.display(), line));
    named.collect()
}

fn row(outcome: &Outcome) -> Row<'_> {
    let mut row = Row {
        input: outcome.input.display().to_string(),
        output: outcome.output.display().to_string(),
        state: state(outcome),
        seconds: outcome.seconds,
        error: None,
        exit_code: None,
        warnings: &[],
        report: None,
    };
    match &outcome.done {
        Done::Baked(baked) => {
            row.warnings = &baked.warnings;
            row.report = Some(&baked.report);
        }
        Done::Failed(error) => {
            row.error = Some(error.to_string());
            row.exit_code = Some(error.exit_code());
        }
        Done::Unchanged => {}
    }
    row
}

fn state(outcome: &Outcome) -> &'static str {
    match outcome.done {
        Done::Baked(_) => "baked",
        Done::Unchanged => "unchanged",
        Done::Failed(_) => "failed",
    }
}

fn table(outcomes: &[Outcome], seconds: f64) -> String {
    let name = |o: &Outcome| {
        o.input
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let width = outcomes.iter().map(|o| name(o).chars().count()).max();
    let width = width.unwrap_or(0).clamp(4, 60);
    let mut out = format!(
        "{:<width$}  {:<9}{:>8}{:>11}{:>8}{:>8}{:>9}\n",
        "tree", "state", "seconds", "triangles", "levels", "F1 to", "worst E"
    );
    for outcome in outcomes {
        let head = format!(
            "{:<width$}  {:<9}{:>8.1}",
            name(outcome),
            state(outcome),
            outcome.seconds
        );
        out += head.trim_end();
        match &outcome.done {
            Done::Baked(baked) => out += &figures(&baked.report),
            Done::Failed(error) => out += &format!("  {}", first_line(&error.to_string())),
            Done::Unchanged => {}
        }
        out += "\n";
    }
    let count = |wanted| outcomes.iter().filter(|o| state(o) == wanted).count();
    out + &format!(
        "\n{} baked, {} unchanged, {} failed after {seconds:.1} s.\n",
        count("baked"),
        count("unchanged"),
        count("failed")
    )
}

/// Triangles of the original, number of levels, least mean F1 and largest shift ratio.
fn figures(report: &Report) -> String {
    let triangles = report.original.as_ref().map_or(0, |o| o.triangles);
    let sizes = report.levels.iter().filter_map(|l| l.sizes.first());
    let f1 = sizes.clone().map(|s| s.f1.mean).fold(1.0, f64::min);
    let e = sizes.map(|s| s.shift_ratio).fold(0.0, f64::max);
    format!("{triangles:>11}{:>8}{f1:>8.3}{e:>9.2}", report.levels.len())
}

fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or_default()
}

/// The error that the batch ends with: a fault of ours before the user's, and that before a
/// refused bake.
fn failed(outcomes: Vec<Outcome>) -> Result<()> {
    let all = outcomes.len();
    let mut errors: Vec<(String, Error)> = Vec::new();
    for outcome in outcomes {
        if let Done::Failed(error) = outcome.done {
            errors.push((outcome.input.display().to_string(), error));
        }
    }
    let Some(code) = errors.iter().map(|e| e.1.exit_code()).min() else {
        return Ok(());
    };
    let lines: Vec<String> = errors
        .iter()
        .map(|(input, e)| format!("{input}: {e}"))
        .collect();
    Err(Error::Batch {
        what: format!(
            "{} of {all} trees failed; the others are done\n  {}",
            errors.len(),
            lines.join("\n  ")
        ),
        code,
    })
}
