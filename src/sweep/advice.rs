//! What a sweep's figures mean, in sentences.

use super::Run;
use super::variants::{BASE, PRESETS};

/// Differences of F1 under this count as ties.
pub const TIE: f64 = 0.003;

/// Presets against the base, and the single knob that buys most time for nothing.
pub fn advice(runs: &[Run]) -> Vec<String> {
    let Some(base) = runs.iter().find(|r| r.name == BASE) else {
        return Vec::new();
    };
    let is_preset = |r: &&Run| PRESETS.contains(&r.name.as_str());
    let presets = runs.iter().filter(|r| is_preset(r) && r.name != BASE);
    let mut out: Vec<String> = presets.map(|run| compare(run, base)).collect();
    let alone = runs.iter().filter(|r| !is_preset(r));
    let free = alone.clone().filter(|r| base.f1_mean - r.f1_mean < TIE);
    let fastest = free.min_by(|a, b| a.cost().total_cmp(&b.cost()));
    out.extend(match fastest {
        Some(run) if run.cost() < 0.95 * base.cost() => Some(format!(
            "Of the knobs, {} alone saves most time for a tie in F1: {}.",
            run.name,
            change(run, base)
        )),
        _ => Some(format!(
            "No knob alone is faster than {BASE} at a tie in F1."
        )),
    });
    let nearest = alone.max_by(|a, b| a.f1_mean.total_cmp(&b.f1_mean));
    out.extend(
        nearest
            .filter(|r| r.f1_mean > base.f1_mean + TIE)
            .map(|run| {
                format!(
                    "Of the knobs, {} alone gains most: {}.",
                    run.name,
                    change(run, base)
                )
            }),
    );
    out
}

/// "draft is 2.0 times faster than balanced and loses 0.010 F1 at 128 pixels."
fn compare(run: &Run, base: &Run) -> String {
    let ratio = base.cost() / run.cost().max(1e-9);
    let speed = match ratio >= 1.0 {
        true => format!("{ratio:.1} times faster than"),
        false => format!("{:.1} times slower than", 1.0 / ratio),
    };
    let sizes = |run: &Run| {
        let first = run.report.levels.iter().filter_map(|l| l.sizes.first());
        first.map(|s| (s.height_px, s.f1.mean)).collect::<Vec<_>>()
    };
    // The size at which the two differ most.
    let differences = sizes(run).into_iter().zip(sizes(base));
    let most = differences
        .map(|((px, f1), (_, of_base))| (px, f1 - of_base))
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let (px, gain) = most.unwrap_or((0, 0.0));
    let verb = if gain < 0.0 { "loses" } else { "gains" };
    format!(
        "{} is {speed} {} and {verb} {:.3} F1 at {px} pixels, {:.3} in the mean.",
        run.name,
        base.name,
        gain.abs(),
        (run.f1_mean - base.f1_mean).abs()
    )
}

fn change(run: &Run, base: &Run) -> String {
    format!(
        "{:.2} of the time, F1 {:+.3}",
        run.cost() / base.cost().max(1e-9),
        run.f1_mean - base.f1_mean
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::schema::{Figure, Level, Report, SizeFigures};

    fn run(name: &str, seconds: f64, f1: [f64; 2]) -> Run {
        let level = |height_px, mean| Level {
            sizes: vec![SizeFigures {
                height_px,
                f1: Figure {
                    mean,
                    ..Figure::default()
                },
                ..SizeFigures::default()
            }],
            ..Level::default()
        };
        Run {
            name: name.into(),
            seconds,
            f1_mean: (f1[0] + f1[1]) / 2.0,
            report: Report {
                levels: vec![level(256, f1[0]), level(128, f1[1])],
                ..Report::default()
            },
            ..Run::default()
        }
    }

    #[test]
    fn sentences_worked_by_hand() {
        let runs = [
            run("balanced", 12.0, [0.95, 0.94]),
            run("draft", 2.0, [0.948, 0.93]),
            run("samples 2", 9.0, [0.949, 0.939]),
            run("samples 1", 6.0, [0.93, 0.92]),
            run("texel_density 2", 24.0, [0.96, 0.95]),
        ];
        assert_eq!(
            advice(&runs),
            [
                "draft is 6.0 times faster than balanced and loses 0.010 F1 at 128 pixels, 0.006 in the mean.",
                "Of the knobs, samples 2 alone saves most time for a tie in F1: 0.75 of the time, F1 -0.001.",
                "Of the knobs, texel_density 2 alone gains most: 2.00 of the time, F1 +0.010.",
            ]
        );
    }
}
