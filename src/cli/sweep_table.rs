//! Sweeps as the terminal shows them.

use crate::sweep::{Run, Sweep, Whole};

/// One line a run, the fastest first; a star for those on the front. `time`: processor time of all
/// threads over that of the base.
pub fn table(found: &Sweep) -> String {
    let mut out = format!(
        "{:<31}{:>9}{:>7}{:>9}{:>9}{:>9}{:>8}{:>8}{:>7}{:>8}{:>7}  front\n",
        "variant",
        "seconds",
        "time",
        "peak MB",
        "disk MB",
        "tex MB",
        "F1",
        "worst",
        "E",
        "FLIP",
        "area"
    );
    let mib = |bytes: u64| bytes as f64 / 1_048_576.0;
    let base = found.runs.first().map_or(1.0, Run::cost).max(1e-9);
    let mut runs: Vec<_> = found.runs.iter().collect();
    runs.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    for run in runs {
        let line = format!(
            "{:<31}{:>9.1}{:>7.2}{:>9.0}{:>9.1}{:>9.1}{:>8.4}{:>8.4}{:>7.2}{:>8.4}{:>7.3}  {}",
            run.name,
            run.seconds,
            run.cost() / base,
            mib(run.peak_bytes),
            mib(run.package_bytes),
            mib(run.texture_bytes),
            run.f1_mean,
            run.f1_worst,
            run.shift_ratio,
            run.flip,
            run.area_ratio,
            star(run.on_front)
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

/// One line a variant, the fastest first: means over all trees, as ratios to the base or differences
/// from it; `least`: the difference of F1 on the tree that loses most.
pub fn table_of_all(found: &Whole) -> String {
    let mut out = format!(
        "Means over {} trees\n{:<31}{:>7}{:>7}{:>7}{:>7}{:>8}{:>9}{:>9}{:>8}{:>9}{:>7}  front\n",
        found.inputs.len(),
        "variant",
        "time",
        "peak",
        "disk",
        "tex",
        "F1",
        "F1 -base",
        "least",
        "worst",
        "FLIP -b.",
        "area"
    );
    let mut variants: Vec<_> = found.variants.iter().collect();
    variants.sort_by(|a, b| a.time_ratio.total_cmp(&b.time_ratio));
    for v in variants {
        let line = format!(
            "{:<31}{:>7.2}{:>7.2}{:>7.2}{:>7.2}{:>8.4}{:>+9.4}{:>+9.4}{:>8.4}{:>+9.4}{:>7.3}  {}",
            v.name,
            v.time_ratio,
            v.peak_ratio,
            v.package_ratio,
            v.texture_ratio,
            v.f1_mean,
            v.f1_difference,
            v.f1_difference_least,
            v.f1_worst,
            v.flip_difference,
            v.area_ratio,
            star(v.on_front)
        );
        out += line.trim_end();
        out += "\n";
    }
    out + &format!("\n{}\n", found.advice)
}

fn star(on_front: bool) -> &'static str {
    match on_front {
        true => "*",
        false => "",
    }
}
