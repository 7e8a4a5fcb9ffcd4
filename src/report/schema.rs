//! The figures as JSON: `report.json`, `evaluate --json` and `sweep --json` share this schema.
//!
//! Keys are snake case and carry their unit. Figures are over views of the tree at a size on the
//! screen; see [`Reference`](super::Reference) for how they are measured.

use serde::{Deserialize, Serialize};

/// Everything that was measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The original, drawn as an engine draws it: what the levels replace.
    pub original: Option<Level>,
    /// The levels, nearest first.
    pub levels: Vec<Level>,
    /// What the sharing of self-similar sub-trees saves and costs; absent where nothing was baked.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub sharing: Option<Sharing>,
    /// What the bake itself took: in the output of `bake --json` alone. It is absent from
    /// `report.json`, because a package is the same byte for byte on every run.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub bake: Option<Bake>,
}

/// One level of detail.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// Number of the level; 0 is the nearest.
    pub level: u32,
    /// The file that was measured, without its folder.
    pub file: String,
    /// Triangles that are not degenerate.
    pub triangles: u64,
    /// Draw calls of an engine that does not batch.
    pub draw_calls: u64,
    /// Bytes of all textures on the GPU: uncompressed RGBA with all mips.
    pub texture_bytes: u64,
    /// Bytes of the file and what it refers to.
    pub file_bytes: u64,
    /// Distance from which the level is shown, metres: where the tree has the level's own height
    /// (or, where none is known, the first size asked for) on a 1080-line screen with a vertical
    /// field of view of 60 degrees; 0 for the original.
    pub distance_m: f64,
    /// Fragments shaded (before alpha test, back faces culled) for each covered sample, mean over views.
    pub overdraw: f64,
    /// Figures by size on the screen.
    pub sizes: Vec<SizeFigures>,
}

/// How a level compares with the supersampled original at one size on the screen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SizeFigures {
    /// Height of the tree in pixels.
    pub height_px: u32,
    /// Harmonic mean of precision and recall of the silhouettes at half coverage.
    pub f1: Figure,
    /// `(1 - F1) / (1 - F1 of the original moved by half a pixel)`, means over views; 1 is "as
    /// near as the tree itself, half a pixel off", and compares trees where F1 does not.
    pub shift_ratio: f64,
    /// Share of the level's pixels that the original has.
    pub precision: Figure,
    /// Share of the original's pixels that the level has.
    pub recall: Figure,
    /// Covered area of the level over that of the original, from coverage fractions.
    pub area_ratio: Figure,
    /// The same from pixels that are at least half covered.
    pub half_area_ratio: Figure,
    /// The level as an engine draws it (box mips, alpha test, fourfold multisampling) against
    /// the same supersampled original; only where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub client: Option<Box<SizeFigures>>,
    /// The views, one by one.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub views: Vec<ViewFigures>,
}

/// A figure over views.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Mean over views.
    pub mean: f64,
    /// The worst view's value: the least; for ratios, the one farthest from 1 by factor.
    pub worst: f64,
    /// The worst view's name.
    pub worst_view: String,
}

/// One view of a level.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ViewFigures {
    /// The view's name.
    pub view: String,
    /// Harmonic mean of precision and recall.
    pub f1: f64,
    /// Share of the level's pixels that the original has.
    pub precision: f64,
    /// Share of the original's pixels that the level has.
    pub recall: f64,
    /// Covered area over the original's.
    pub area_ratio: f64,
    /// Half-covered pixels over the original's.
    pub half_area_ratio: f64,
}

/// What sharing of self-similar sub-trees saves and costs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sharing {
    /// Texture bytes of all levels with sharing.
    pub texture_bytes_with: u64,
    /// Texture bytes of all levels without.
    pub texture_bytes_without: u64,
    /// Mean F1 with sharing.
    pub f1_with: f64,
    /// Mean F1 without.
    pub f1_without: f64,
}

/// What a bake took.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bake {
    /// Wall-clock time, seconds.
    pub seconds: f64,
    /// Peak resident memory, bytes; null where the system does not tell.
    pub peak_bytes: Option<u64>,
    /// Where the time went: stages and their parts, in the order in which each began first.
    #[serde(default)]
    pub stages: Vec<Stage>,
}

/// What one stage of a bake took.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    /// What was done.
    pub name: String,
    /// Wall-clock time, seconds.
    pub seconds: f64,
    /// Processor time of all threads, seconds; 0 where the system does not tell.
    pub cpu_seconds: f64,
    /// Largest resident memory of the process meanwhile, bytes; 0 where the system does not tell.
    pub peak_bytes: u64,
}

impl Figure {
    /// Mean and least of named values; zero where there are none.
    pub fn least<'a>(values: impl Iterator<Item = (&'a str, f64)>) -> Self {
        Self::by(values, |value| value)
    }

    /// Mean of named ratios, and the one farthest from 1 by factor.
    pub fn ratio<'a>(values: impl Iterator<Item = (&'a str, f64)>) -> Self {
        Self::by(values, |value| value.min(1.0 / value))
    }

    /// `goodness` grows with how good a value is; of equals the first view is named.
    fn by<'a>(values: impl Iterator<Item = (&'a str, f64)>, goodness: impl Fn(f64) -> f64) -> Self {
        let (mut sum, mut count) = (0.0, 0u32);
        let mut worst: Option<(&str, f64)> = None;
        for (view, value) in values {
            sum += value;
            count += 1;
            if worst.is_none_or(|(_, w)| goodness(value) < goodness(w)) {
                worst = Some((view, value));
            }
        }
        let (view, worst) = worst.unwrap_or_default();
        Self {
            mean: sum / count.max(1) as f64,
            worst,
            worst_view: view.into(),
        }
    }
}
