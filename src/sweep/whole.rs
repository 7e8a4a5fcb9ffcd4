//! What a sweep of several trees comes to: each variant against the base, mean over trees.

use serde::{Deserialize, Serialize};

use super::Sweep;
use super::advice::TIE;
use super::variants::{BASE, PRESETS};

/// All trees together.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Whole {
    /// Names of the input files.
    pub inputs: Vec<String>,
    /// Every variant, in the order in which they ran.
    pub variants: Vec<OverTrees>,
    /// What to make of it, in one sentence.
    pub advice: String,
}

/// One variant, means over trees.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OverTrees {
    /// "draft", "samples 2".
    pub name: String,
    /// Processor time over that of the base.
    pub time_ratio: f64,
    /// Peak memory over that of the base.
    pub peak_ratio: f64,
    /// Bytes of the package over those of the base.
    pub package_ratio: f64,
    /// Bytes of the levels' textures over those of the base.
    pub texture_ratio: f64,
    /// Mean F1.
    pub f1_mean: f64,
    /// Mean F1 less that of the base.
    pub f1_difference: f64,
    /// The same for the tree that loses most (or gains least).
    pub f1_difference_least: f64,
    /// F1 of the worst view of any level, least of all trees.
    pub f1_worst: f64,
    /// FLIP less that of the base.
    pub flip_difference: f64,
    /// Covered area over the original's of the level of any tree that is farthest from 1.
    pub area_ratio: f64,
    /// Whether no other variant is both faster and nearer (in the mean F1).
    pub on_front: bool,
}

/// Puts the sweeps of several trees, all of the same variants, together.
pub fn whole(sweeps: &[Sweep]) -> Whole {
    let names = sweeps.first().map_or(Vec::new(), |s| {
        s.runs.iter().map(|r| r.name.clone()).collect()
    });
    let mut variants: Vec<OverTrees> = (0..names.len()).map(|i| over_trees(sweeps, i)).collect();
    let points: Vec<(f64, f64)> = variants
        .iter()
        .map(|v| (v.time_ratio, -v.f1_mean))
        .collect();
    for (variant, &(time, error)) in variants.iter_mut().zip(&points) {
        let better = |&(t, e): &(f64, f64)| t <= time && e <= error && (t < time || e < error);
        variant.on_front = !points.iter().any(better);
    }
    Whole {
        inputs: sweeps.iter().map(|s| s.input.clone()).collect(),
        advice: advice(&variants, sweeps.len()),
        variants,
    }
}

/// The run of this number, mean over trees; the first run of each is the base's.
fn over_trees(sweeps: &[Sweep], number: usize) -> OverTrees {
    let pairs = || {
        sweeps
            .iter()
            .filter_map(move |s| Some((s.runs.get(number)?, s.runs.first()?)))
    };
    let count = pairs().count().max(1) as f64;
    let mut out = OverTrees {
        name: pairs()
            .next()
            .map_or(String::new(), |(r, _)| r.name.clone()),
        f1_difference_least: f64::MAX,
        f1_worst: 1.0,
        area_ratio: 1.0,
        ..OverTrees::default()
    };
    let ratio = |of: u64, base: u64| of as f64 / base.max(1) as f64;
    let from_one = |a: f64| a.max(1.0 / a.max(1e-9));
    for (run, base) in pairs() {
        let difference = run.f1_mean - base.f1_mean;
        out.time_ratio += run.cost() / base.cost().max(1e-9) / count;
        out.peak_ratio += ratio(run.peak_bytes, base.peak_bytes) / count;
        out.package_ratio += ratio(run.package_bytes, base.package_bytes) / count;
        out.texture_ratio += ratio(run.texture_bytes, base.texture_bytes) / count;
        out.f1_mean += run.f1_mean / count;
        out.f1_difference += difference / count;
        out.f1_difference_least = out.f1_difference_least.min(difference);
        out.f1_worst = out.f1_worst.min(run.f1_worst);
        out.flip_difference += (run.flip - base.flip) / count;
        if from_one(run.area_ratio) > from_one(out.area_ratio) {
            out.area_ratio = run.area_ratio;
        }
    }
    out
}

/// The presets against the base, and the knob that saves most for a tie on every tree.
fn advice(variants: &[OverTrees], trees: usize) -> String {
    let is_preset = |v: &&OverTrees| PRESETS.contains(&v.name.as_str());
    let presets = variants.iter().filter(|v| is_preset(v) && v.name != BASE);
    let mut parts: Vec<String> = presets.map(against_base).collect();
    let alone = variants.iter().filter(|v| !is_preset(v));
    let free = alone.filter(|v| v.f1_difference_least > -TIE && v.time_ratio < 0.95);
    if let Some(v) = free.min_by(|a, b| a.time_ratio.total_cmp(&b.time_ratio)) {
        parts.push(format!(
            "{} alone saves most for a tie on every tree ({:.2} of the time, F1 {:+.3})",
            v.name, v.time_ratio, v.f1_difference
        ));
    } else if variants.iter().any(|v| !is_preset(&v)) {
        parts.push(format!(
            "no knob alone is faster than {BASE} at a tie on every tree"
        ));
    }
    match parts.is_empty() {
        true => String::new(),
        false => format!("Over {trees} trees {}.", parts.join("; ")),
    }
}

/// "draft takes 0.76 of the time of balanced and loses 0.002 F1"
fn against_base(v: &OverTrees) -> String {
    let verb = if v.f1_difference < 0.0 {
        "loses"
    } else {
        "gains"
    };
    format!(
        "{} takes {:.2} of the time of {BASE} and {verb} {:.3} F1 ({:+.3} at worst)",
        v.name,
        v.time_ratio,
        v.f1_difference.abs(),
        v.f1_difference_least
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::Run;

    fn sweep(input: &str, runs: [(&str, f64, f64); 3]) -> Sweep {
        let run = |(name, seconds, f1): (&str, f64, f64)| Run {
            name: name.into(),
            seconds,
            f1_mean: f1,
            f1_worst: f1 - 0.1,
            flip: 0.5 * (1.0 - f1),
            package_bytes: 1000,
            area_ratio: 1.0 + 0.1 * (1.0 - f1),
            ..Run::default()
        };
        Sweep {
            input: input.into(),
            runs: runs.map(run).to_vec(),
            ..Sweep::default()
        }
    }

    #[test]
    fn means_over_trees_worked_by_hand() {
        // On the second tree, which takes ten times as long, draft loses more.
        let found = whole(&[
            sweep(
                "a",
                [
                    ("balanced", 10.0, 0.96),
                    ("draft", 5.0, 0.95),
                    ("samples 1", 8.0, 0.96),
                ],
            ),
            sweep(
                "b",
                [
                    ("balanced", 100.0, 0.90),
                    ("draft", 70.0, 0.86),
                    ("samples 1", 70.0, 0.898),
                ],
            ),
        ]);
        let draft = &found.variants[1];
        assert!((draft.time_ratio - 0.6).abs() < 1e-12);
        assert!((draft.f1_difference + 0.025).abs() < 1e-12);
        assert!((draft.f1_difference_least + 0.04).abs() < 1e-12);
        assert!((draft.flip_difference - 0.0125).abs() < 1e-12);
        assert!((draft.f1_worst - 0.76).abs() < 1e-12 && (draft.area_ratio - 1.014).abs() < 1e-12);
        assert_eq!(draft.package_ratio, 1.0);
        assert!(found.variants.iter().all(|v| v.on_front));
        assert_eq!(
            found.advice,
            "Over 2 trees draft takes 0.60 of the time of balanced and loses 0.025 F1 (-0.040 at worst); \
             samples 1 alone saves most for a tie on every tree (0.75 of the time, F1 -0.001)."
        );
    }
}
