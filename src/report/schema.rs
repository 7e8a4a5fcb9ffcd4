//! The figures as JSON: `report.json`, `evaluate --json` and `sweep --json` share this schema.
//!
//! Keys are snake case and carry their unit. Figures are over views of the tree at a size on the
//! screen; see [`Reference`](super::Reference) for how they are measured.

use serde::{Deserialize, Serialize};

use super::cuts::Cuts;

/// Everything that was measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// How far apart neighbouring positions of the original's file are where its numbers are coarsest, metres: no
    /// length below it means anything.
    #[serde(default)]
    pub position_step_m: f64,
    /// Focal length of the camera in pixels: the tree is looked at from where its height takes so
    /// many pixels, `focal_px * height_m / height_px` metres from its middle (flat trees through a
    /// longer lens from 1.5 radii). Absent where lines of sight are parallel.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub focal_px: Option<f64>,
    /// The original: what the levels replace. Of a bake it has no sizes.
    pub original: Option<Level>,
    /// The levels, nearest first.
    pub levels: Vec<Level>,
    /// What sharing of texels between cards saves and costs; absent where nothing was baked.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub sharing: Option<Sharing>,
    /// Level 0 as prototypes and copies; absent where that was not asked for or no leaf repeats.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub instancing: Option<Instancing>,
    /// The hierarchy of sub-trees; absent where it was not asked for.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub hierarchy: Option<Hierarchy>,
    /// The cuts that the levels were chosen from; absent where that is not known.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub cuts: Option<Cuts>,
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
    /// (or, where none is known, the first size asked for) through the report's lens; 0 for the
    /// original.
    pub distance_m: f64,
    /// Fragments shaded (before alpha test, back faces culled) for each covered sample, mean over views.
    pub overdraw: f64,
    /// Figures by size on the screen.
    pub sizes: Vec<SizeFigures>,
    /// What the eye sees as a pop: this level against the next one, where the next one takes over;
    /// absent for the last level, the original, and where colours were not measured.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub jump_to_next: Option<Jump>,
    /// What moves from frame to frame as the camera orbits, at the level's own height; absent for
    /// the original and where colours were not measured.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub orbit: Option<Orbit>,
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
    /// Covered area of the level over that of the original, from coverage fractions. Where a view
    /// shows the original edge-on, both are topped up to a twentieth of its mean area.
    pub area_ratio: Figure,
    /// The same from pixels that are at least half covered.
    pub half_area_ratio: Figure,
    /// The level as an engine draws it (box mips, alpha test, fourfold multisampling) against
    /// the same supersampled original; only where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub client: Option<Box<SizeFigures>>,
    /// Mean linear RGB of the base colour, without light, of what an engine draws; only in `client`
    /// of an evaluation.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub base_color_linear: Option<[f64; 3]>,
    /// What few samples cost by themselves, without mips; only in `client` of an evaluation.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub sampled: Vec<Sampled>,
    /// Colours, distances and normals against the original's; absent where they were not measured
    /// (in the report of a bake).
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub appearance: Option<Box<Appearance>>,
    /// The views, one by one.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub views: Vec<ViewFigures>,
}

/// A level drawn with as few samples as an engine takes, all of them with the finest texels, against the
/// supersampled original. An engine takes four of a triangle's edges and one of its alpha: what F1 falls to with
/// four and with one is the share of its loss that no alpha and no mips are to blame for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sampled {
    /// Samples of a pixel: 4 (2 x 2) or 1.
    pub samples: u32,
    /// Harmonic mean of precision and recall of the silhouettes at half coverage.
    pub f1: Figure,
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
    /// Standard deviation over views.
    #[serde(default)]
    pub deviation: f64,
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

/// How a level looks beside the original: lit by sky and sun, before a ground of half of white's
/// light, with 16 samples a pixel, of which four neighbours that show one triangle are lit as one; where the tree is under 128 pixels high coverage has more, 512 lines
/// of samples. Means of FLIP, SSIM and PSNR are over the pixels that either one touches: an empty
/// surrounding is no merit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Appearance {
    /// Harmonic mean of both below: `2 sum(min(a, b)) / (sum(a) + sum(b))` over the coverage `a` of
    /// the original's and `b` of the level's pixels, 0 to 1.
    pub soft_f1: Figure,
    /// `sum(min(a, b)) / sum(b)`.
    pub soft_precision: Figure,
    /// `sum(min(a, b)) / sum(a)`.
    pub soft_recall: Figure,
    /// Pixels that differ by more than 8 of 255 in a channel of sRGB over those that the original
    /// touches (Lee, section IV.A); above 1 where the level reaches far outside.
    pub incorrect_share_8: Figure,
    /// As above, more than 32 of 255.
    pub incorrect_share_32: Figure,
    /// Structural similarity of greys in windows of 11 pixels (Wang et al. 2004), up to 1.
    pub ssim: Figure,
    /// Peak signal-to-noise ratio of sRGB, decibel; 100 where nothing differs.
    pub psnr_db: Figure,
    /// FLIP (Andersson et al. 2020) at 67 pixels a degree, 0 (no difference) to 1.
    pub flip: Figure,
    /// Distance of the mean colours of what is covered, in CIE L*a*b* (delta E 1976): 2 is just
    /// visible side by side.
    pub color_shift_delta_e: Figure,
    /// Mean difference of distances along the line of sight where both cover half a pixel, in tree
    /// heights; null where there is no such pixel in any view.
    pub depth_error: Option<Figure>,
    /// Mean angle between normals there, degrees.
    pub normal_error_deg: Option<Figure>,
    /// The views, one by one.
    pub views: Vec<ViewAppearance>,
}

/// One view of [`Appearance`]; the same keys.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub struct ViewAppearance {
    pub view: String,
    pub soft_f1: f64,
    pub soft_precision: f64,
    pub soft_recall: f64,
    pub incorrect_share_8: f64,
    pub incorrect_share_32: f64,
    pub ssim: f64,
    pub psnr_db: f64,
    pub flip: f64,
    pub color_shift_delta_e: f64,
    pub depth_error: Option<f64>,
    pub normal_error_deg: Option<f64>,
}

/// A level against the next one at the same size on the screen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Jump {
    /// Height of the tree in pixels where the next level takes over.
    pub height_px: u32,
    /// F1 of the two silhouettes at half coverage.
    pub f1: Figure,
    /// Covered area of the next level over that of this one.
    pub area_ratio: Figure,
    /// The next level against this one.
    pub appearance: Appearance,
}

/// How much changes while the camera orbits by a small angle, from the level views (elevation 0).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Orbit {
    /// Height of the tree in pixels.
    pub height_px: u32,
    /// Angle of the orbit, degrees.
    pub step_deg: f64,
    /// The level from one frame to the next.
    pub level: Change,
    /// The original, at the same size: what there is to see without any level.
    pub original: Change,
}

/// The difference of two frames of one model.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// As in [`Appearance`].
    pub flip: Figure,
    /// As in [`Appearance`].
    pub incorrect_share_32: Figure,
    /// As in [`Appearance`].
    pub psnr_db: Figure,
}

/// What sharing of texels between cards that look alike saves and costs, over all levels but level 0; with
/// and without are the same where the recipe asks for none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sharing {
    /// Texture bytes of these levels with sharing.
    pub texture_bytes_with: u64,
    /// Texture bytes without.
    pub texture_bytes_without: u64,
    /// Mean of their F1 where they start, supersampled, with sharing.
    pub f1_with: f64,
    /// Mean F1 without.
    pub f1_without: f64,
    /// The levels, nearest first.
    pub levels: Vec<SharedLevel>,
}

/// What sharing does to one level.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SharedLevel {
    /// Number of the level.
    pub level: u32,
    /// Cards with texels of their own.
    pub tiles: u64,
    /// Cards that show a piece of these.
    pub copies: u64,
    /// Tiles that others show a piece of: each is a class of cards that look alike.
    #[serde(default)]
    pub classes: u64,
    /// Largest squared difference (opacity and colour) of a copy from what it should look like, over that of an empty
    /// card; at most the recipe's `copy_tolerance`.
    #[serde(default)]
    pub farthest_copy: f64,
    /// Texels along a line over those that the level has without sharing; 1 where nothing is shared.
    pub density: f64,
    /// Whether its page is smaller than without sharing; otherwise only its maps of light are.
    #[serde(default)]
    pub smaller_page: bool,
    /// Bytes of all its textures with sharing.
    pub texture_bytes_with: u64,
    /// Bytes without.
    pub texture_bytes_without: u64,
    /// F1 where it starts, supersampled, mean over views, with sharing.
    pub f1_with: f64,
    /// F1 without.
    pub f1_without: f64,
}

/// Level 0 as prototypes of leaves and their places.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Instancing {
    /// The file, without its folder.
    pub file: String,
    /// Leaves of the tree.
    pub leaves: u64,
    /// Leaves that others are copies of.
    pub prototypes: u64,
    /// Placed copies, prototypes included.
    pub copies: u64,
    /// Triangles that no copy stands for: wood, and leaves that are like no other.
    pub plain_triangles: u64,
    /// Whether copies are instances by EXT_mesh_gpu_instancing, not nodes.
    pub extension: bool,
    /// Largest distance of a corner from where the original has it, over its leaf's radius.
    pub largest_deviation: f64,
    /// Bytes of the file.
    pub file_bytes: u64,
    /// Bytes of level 0 with every leaf written out.
    pub plain_file_bytes: u64,
}

/// The hierarchy of sub-trees as files.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Hierarchy {
    /// The GLB with all tiles, without its folder.
    pub file: String,
    /// The tileset (3D Tiles 1.1).
    pub tileset: String,
    /// Sub-trees that a cut may use, and what lies between them.
    pub tiles: u64,
    /// Tiles that are geometry when opened.
    pub tips: u64,
    /// Triangles of all billboards together, wood in them included.
    pub billboard_triangles: u64,
    /// Width and height of the page that billboards share, texels.
    pub atlas: [u32; 2],
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

    /// Mean and most of named values.
    pub fn most<'a>(values: impl Iterator<Item = (&'a str, f64)>) -> Self {
        Self::by(values, |value| -value)
    }

    /// `goodness` grows with how good a value is; of equals the first view is named.
    fn by<'a>(values: impl Iterator<Item = (&'a str, f64)>, goodness: impl Fn(f64) -> f64) -> Self {
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0u32);
        let mut worst: Option<(&str, f64)> = None;
        for (view, value) in values {
            sum += value;
            squares += value * value;
            count += 1;
            if worst.is_none_or(|(_, w)| goodness(value) < goodness(w)) {
                worst = Some((view, value));
            }
        }
        let (view, worst) = worst.unwrap_or_default();
        let mean = sum / count.max(1) as f64;
        let variance = squares / count.max(1) as f64 - mean * mean;
        Self {
            mean,
            worst,
            worst_view: view.into(),
            // Equal values leave a rounding error, not a spread.
            deviation: if variance > 1e-15 {
                variance.sqrt()
            } else {
                0.0
            },
        }
    }
}

impl Appearance {
    /// Means and worst views of single views.
    pub fn over(views: Vec<ViewAppearance>) -> Self {
        let of = |value: fn(&ViewAppearance) -> f64| {
            views.iter().map(move |v| (v.view.as_str(), value(v)))
        };
        let inside = |value: fn(&ViewAppearance) -> Option<f64>| {
            let found: Vec<_> = views
                .iter()
                .filter_map(|v| Some((v.view.as_str(), value(v)?)))
                .collect();
            (!found.is_empty()).then(|| Figure::most(found.into_iter()))
        };
        Self {
            soft_f1: Figure::least(of(|v| v.soft_f1)),
            soft_precision: Figure::least(of(|v| v.soft_precision)),
            soft_recall: Figure::least(of(|v| v.soft_recall)),
            incorrect_share_8: Figure::most(of(|v| v.incorrect_share_8)),
            incorrect_share_32: Figure::most(of(|v| v.incorrect_share_32)),
            ssim: Figure::least(of(|v| v.ssim)),
            psnr_db: Figure::least(of(|v| v.psnr_db)),
            flip: Figure::most(of(|v| v.flip)),
            color_shift_delta_e: Figure::most(of(|v| v.color_shift_delta_e)),
            depth_error: inside(|v| v.depth_error),
            normal_error_deg: inside(|v| v.normal_error_deg),
            views,
        }
    }
}

impl Change {
    /// Means and worst views of single views.
    pub fn over(views: &[ViewAppearance]) -> Self {
        let of = |value: fn(&ViewAppearance) -> f64| {
            views.iter().map(move |v| (v.view.as_str(), value(v)))
        };
        Self {
            flip: Figure::most(of(|v| v.flip)),
            incorrect_share_32: Figure::most(of(|v| v.incorrect_share_32)),
            psnr_db: Figure::least(of(|v| v.psnr_db)),
        }
    }
}
