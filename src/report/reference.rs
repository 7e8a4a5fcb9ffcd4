//! The original's pictures, kept to compare levels with.

use rayon::prelude::*;

use super::drawable::Drawable;
use super::schema::{Figure, SizeFigures, ViewFigures};
use super::silhouette::{Agreement, agreement, ratio};
use crate::botany::Model;
use crate::botany::model::Frame;
use crate::space::raster::{
    Camera, Coverage, Placement, Sampling, Scene, coverage, coverage_multisampled,
};
use crate::space::view::View;

/// An original at one size on the screen, drawn once from every view with 4 x 4 samples a pixel.
#[derive(Debug)]
pub struct Reference {
    height_px: u32,
    frame: Frame,
    pictures: Vec<Picture>,
    /// Mean F1 of the original moved by half a pixel.
    shifted_f1: f64,
}

#[derive(Debug)]
struct Picture {
    view: View,
    camera: Camera,
    original: Coverage,
}

/// Half a pixel in samples of [`Sampling::REFERENCE`].
const HALF_PIXEL: i32 = Sampling::REFERENCE.side as i32 / 2;

/// The least error by which shift ratios divide: a tree too coarse to notice half a pixel.
const LEAST_SHIFT_ERROR: f64 = 1e-4;

impl Reference {
    /// Draws the original; its extent along y takes `height_px` pixels.
    pub fn new(original: &Model, views: &[View], height_px: u32) -> Self {
        Self::of(&Drawable::silhouette(original), original, views, height_px)
    }

    /// As [`Reference::new`], for a model that is ready to be drawn (at several sizes).
    pub fn of(drawable: &Drawable, original: &Model, views: &[View], height_px: u32) -> Self {
        let height = original.height();
        let scene = drawable.scene();
        let drawn: Vec<(Picture, f64)> = views
            .par_iter()
            .map(|view| {
                let camera = view.camera(height, height_px);
                let mask = coverage(&scene, &camera, Sampling::REFERENCE);
                let original = mask.coverage();
                // Half a pixel is two samples: the moved picture needs no second drawing.
                let moved = [(HALF_PIXEL, 0), (0, HALF_PIXEL)]
                    .map(|(x, y)| agreement(&original, &mask.coverage_shifted(x, y)).f1());
                let picture = Picture {
                    view: view.clone(),
                    camera,
                    original,
                };
                (picture, 0.5 * (moved[0] + moved[1]))
            })
            .collect();
        let shifted_f1 = drawn.iter().map(|d| d.1).sum::<f64>() / drawn.len().max(1) as f64;
        Self {
            height_px,
            frame: original.frame,
            pictures: drawn.into_iter().map(|d| d.0).collect(),
            shifted_f1,
        }
    }

    /// Height of the tree in pixels.
    pub fn height_px(&self) -> u32 {
        self.height_px
    }

    /// Mean F1 of the original moved by half a pixel, to the right and down (mean of the two):
    /// the floor that shift ratios are measured by.
    pub fn shifted_f1(&self) -> f64 {
        self.shifted_f1
    }

    /// `(1 - f1) / (1 - shifted_f1)`.
    pub fn shift_ratio(&self, f1: f64) -> f64 {
        (1.0 - f1) / (1.0 - self.shifted_f1).max(LEAST_SHIFT_ERROR)
    }

    /// Compares a level that was read from its own file.
    pub fn compare(&self, level: &Model, sampling: Sampling) -> SizeFigures {
        self.compare_drawable(&Drawable::silhouette(level), sampling)
    }

    /// As [`Reference::compare`], for a model that is ready to be drawn.
    pub fn compare_drawable(&self, level: &Drawable, sampling: Sampling) -> SizeFigures {
        self.compare_scene(&level.scene(), level.placement_in(self.frame), sampling)
    }

    /// Compares anything that can be drawn; `placement` puts it into the original's normalised space.
    pub fn compare_scene(
        &self,
        scene: &Scene,
        placement: Placement,
        sampling: Sampling,
    ) -> SizeFigures {
        self.compare_pictures(|camera| {
            coverage(scene, &camera.placed(placement), sampling).coverage()
        })
    }

    /// Compares a level as an engine draws it by default: mips by derivative, alpha test, four
    /// samples a pixel for edges and one for materials.
    pub fn compare_client(&self, level: &Drawable) -> SizeFigures {
        let (scene, placement) = (level.scene(), level.placement_in(self.frame));
        self.compare_pictures(|camera| coverage_multisampled(&scene, &camera.placed(placement)))
    }

    fn compare_pictures(&self, draw: impl Fn(&Camera) -> Coverage + Sync) -> SizeFigures {
        let figures = |picture: &Picture| picture.figures(&draw(&picture.camera));
        self.summary(self.pictures.par_iter().map(figures).collect())
    }

    fn summary(&self, views: Vec<ViewFigures>) -> SizeFigures {
        let over =
            |value: fn(&ViewFigures) -> f64| views.iter().map(move |v| (v.view.as_str(), value(v)));
        let f1 = Figure::least(over(|v| v.f1));
        SizeFigures {
            height_px: self.height_px,
            shift_ratio: self.shift_ratio(f1.mean),
            f1,
            precision: Figure::least(over(|v| v.precision)),
            recall: Figure::least(over(|v| v.recall)),
            area_ratio: Figure::ratio(over(|v| v.area_ratio)),
            half_area_ratio: Figure::ratio(over(|v| v.half_area_ratio)),
            client: None,
            views,
        }
    }
}

impl Picture {
    fn figures(&self, level: &Coverage) -> ViewFigures {
        let found: Agreement = agreement(&self.original, level);
        ViewFigures {
            view: self.view.name.clone(),
            f1: found.f1(),
            precision: found.precision(),
            recall: found.recall(),
            area_ratio: ratio(level.area(), self.original.area()),
            half_area_ratio: found.pixel_ratio(),
        }
    }
}
