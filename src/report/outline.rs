//! A level's silhouette beside the original's, view by view, and what all views say together.

use super::schema::{Figure, SizeFigures, ViewFigures};
use super::silhouette::{Agreement, agreement_of, ratio};

/// Share of the mean covered area under which a view of the original is edge-on (a flat hedge from
/// its side, an open trunk from above): a ratio of areas is nothing there, so both are topped up.
const EDGE_ON: f64 = 0.05;

/// The least error by which shift ratios divide: a tree too coarse to notice half a pixel.
const LEAST_SHIFT_ERROR: f64 = 1e-4;

/// One view of a level beside the original.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// The view's name.
    view: String,
    /// Where the silhouettes agree.
    found: Agreement,
    /// Covered area of the original and of the level, pixels.
    area: [f64; 2],
}

impl Outline {
    /// Of the covered share of every pixel.
    pub fn new(view: &str, original: &[f32], level: &[f32]) -> Self {
        let area = |fraction: &[f32]| fraction.iter().map(|&c| f64::from(c)).sum();
        Self {
            view: view.into(),
            found: agreement_of(original, level),
            area: [area(original), area(level)],
        }
    }

    /// The view's name.
    pub fn view(&self) -> &str {
        &self.view
    }

    /// F1 of the silhouettes.
    pub fn f1(&self) -> f64 {
        self.found.f1()
    }

    /// Covered area of the level over the original's.
    pub fn area_ratio(&self) -> f64 {
        ratio(self.area[1], self.area[0])
    }

    fn figures(&self, least: f64) -> ViewFigures {
        let [original, level] = self.area;
        let more = (least - original).max(0.0);
        ViewFigures {
            view: self.view.clone(),
            f1: self.found.f1(),
            precision: self.found.precision(),
            recall: self.found.recall(),
            area_ratio: ratio(level + more, original + more),
            half_area_ratio: self.found.pixel_ratio(),
        }
    }
}

/// `(1 - f1) / (1 - shifted_f1)`.
pub fn shift_ratio(f1: f64, shifted_f1: f64) -> f64 {
    (1.0 - f1) / (1.0 - shifted_f1).max(LEAST_SHIFT_ERROR)
}

/// Figures over all views at a height in pixels; `shifted_f1` is the original's own, moved by half
/// a pixel.
pub fn summary(height_px: u32, shifted_f1: f64, outlines: &[Outline]) -> SizeFigures {
    // Pixels that both areas are topped up to in views that are edge-on.
    let all: f64 = outlines.iter().map(|o| o.area[0]).sum();
    let least = EDGE_ON * all / outlines.len().max(1) as f64;
    let views: Vec<ViewFigures> = outlines.iter().map(|o| o.figures(least)).collect();
    let over =
        |value: fn(&ViewFigures) -> f64| views.iter().map(move |v| (v.view.as_str(), value(v)));
    let f1 = Figure::least(over(|v| v.f1));
    SizeFigures {
        height_px,
        shift_ratio: shift_ratio(f1.mean, shifted_f1),
        f1,
        precision: Figure::least(over(|v| v.precision)),
        recall: Figure::least(over(|v| v.recall)),
        area_ratio: Figure::ratio(over(|v| v.area_ratio)),
        half_area_ratio: Figure::ratio(over(|v| v.half_area_ratio)),
        client: None,
        base_color_linear: None,
        sampled: Vec::new(),
        appearance: None,
        views,
    }
}
