//! The original's pictures, kept to compare levels with.

use rayon::prelude::*;

use super::drawable::Drawable;
use super::schema::{Figure, SizeFigures, ViewFigures};
use super::silhouette::{Agreement, agreement, ratio};
use crate::botany::Model;
use crate::botany::model::Frame;
use crate::space::raster::{
    Camera, Coverage, Mask, Placement, Sampling, Scene, coverage, coverage_multisampled,
};
use crate::space::view::View;

/// An original at one size on the screen, drawn once from every view with at least 4 x 4 samples a
/// pixel.
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

/// Pictures are drawn for sizes down to this many halvings.
const MOST_HALVINGS: u32 = 5;

/// Share of the mean covered area under which a view of the original is edge-on (a flat hedge from
/// its side, an open trunk from above): a ratio of areas is nothing there, so both are topped up.
const EDGE_ON: f64 = 0.05;

/// The least error by which shift ratios divide: a tree too coarse to notice half a pixel.
const LEAST_SHIFT_ERROR: f64 = 1e-4;

impl Reference {
    /// Draws the original; its extent along y takes `height_px` pixels.
    pub fn new(original: &Model, views: &[View], height_px: u32) -> Self {
        Self::of(&Drawable::silhouette(original), original, views, height_px)
    }

    /// As [`Reference::new`], for a model that is ready to be drawn (at several sizes).
    pub fn of(drawable: &Drawable, original: &Model, views: &[View], height_px: u32) -> Self {
        Self::halved(drawable, original, views, height_px, &[0]).remove(0)
    }

    /// One reference for each of `heights_px` (largest first), in that order. Sizes that are halves
    /// of each other are drawn once, at the largest: the samples of four of its pixels are more
    /// samples for one of the next size.
    pub fn each(
        drawable: &Drawable,
        original: &Model,
        views: &[View],
        heights_px: &[u32],
    ) -> Vec<Self> {
        let mut out = Self::chains(drawable, original, views, heights_px)
            .into_iter()
            .flatten()
            .collect::<Vec<_>>();
        out.sort_by_key(|r| heights_px.iter().position(|&px| px == r.height_px));
        out
    }

    /// As [`Reference::each`], grouped by what was drawn once.
    pub fn chains(
        drawable: &Drawable,
        original: &Model,
        views: &[View],
        heights_px: &[u32],
    ) -> Vec<Vec<Self>> {
        let mut out: Vec<Vec<Self>> = Vec::new();
        for &height_px in heights_px {
            if out.iter().flatten().any(|r| r.height_px == height_px) {
                continue;
            }
            let halvings = |&px: &u32| {
                let times = (height_px / px.max(1)).checked_ilog2()?;
                (px << times == height_px && times <= MOST_HALVINGS).then_some(times)
            };
            let times: Vec<u32> = heights_px.iter().filter_map(halvings).collect();
            out.push(Self::halved(drawable, original, views, height_px, &times));
        }
        out
    }

    /// References at `height_px` halved so many `times`.
    fn halved(
        drawable: &Drawable,
        original: &Model,
        views: &[View],
        height_px: u32,
        times: &[u32],
    ) -> Vec<Self> {
        let height = original.height();
        let scene = drawable.scene();
        let most = times.iter().max().map_or(0, |&t| t);
        let drawn: Vec<Vec<(Picture, f64)>> = views
            .par_iter()
            .map(|view| {
                let camera = view.camera_in_steps(height, height_px, 1 << most);
                let mut mask = coverage(&scene, &camera, Sampling::REFERENCE);
                let size = [mask.width, mask.height];
                let mut at = |&times: &u32| {
                    [mask.width, mask.height] = size.map(|s| s >> times);
                    mask.side = Sampling::REFERENCE.side << times;
                    Picture::of(view, camera, &mask, times)
                };
                times.iter().map(&mut at).collect()
            })
            .collect();
        let mut out: Vec<Self> = times
            .iter()
            .map(|&times| Self {
                height_px: height_px >> times,
                frame: original.frame,
                pictures: Vec::with_capacity(views.len()),
                shifted_f1: 0.0,
            })
            .collect();
        for pictures in drawn {
            for (reference, (picture, f1)) in out.iter_mut().zip(pictures) {
                reference.pictures.push(picture);
                reference.shifted_f1 += f1 / views.len() as f64;
            }
        }
        out
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
        self.compare_pictures(|picture| {
            coverage(scene, &picture.camera.placed(placement), sampling).coverage()
        })
    }

    /// Compares a level as an engine draws it by default: mips by derivative, alpha test, four
    /// samples a pixel for edges and one for materials.
    pub fn compare_client(&self, level: &Drawable) -> SizeFigures {
        let (scene, placement) = (level.scene(), level.placement_in(self.frame));
        self.compare_pictures(|picture| {
            coverage_multisampled(&scene, &picture.camera.placed(placement))
        })
    }

    /// The original compared with itself.
    pub fn compare_itself(&self) -> SizeFigures {
        self.compare_pictures(|picture| picture.original.clone())
    }

    /// Compares a level with every size of one of [`Reference::chains`]. It is drawn once, at the
    /// largest, as the original was: a level that equals it has no error at any size.
    pub fn compare_chain(chain: &[Self], level: &Drawable) -> Vec<SizeFigures> {
        let Some(top) = chain.first() else {
            return Vec::new();
        };
        let (scene, placement) = (level.scene(), level.placement_in(top.frame));
        let least: Vec<f64> = chain.iter().map(Self::least_area).collect();
        let views: Vec<Vec<ViewFigures>> = (0..top.pictures.len())
            .into_par_iter()
            .map(|view| {
                let camera = top.pictures[view].camera.placed(placement);
                let mut mask = coverage(&scene, &camera, Sampling::REFERENCE);
                let mut at = |(reference, least): (&Self, &f64)| {
                    let picture = &reference.pictures[view];
                    mask.side = Sampling::REFERENCE.side * (camera.width / picture.camera.width);
                    [mask.width, mask.height] = [picture.camera.width, picture.camera.height];
                    picture.figures(&mask.coverage(), *least)
                };
                chain.iter().zip(&least).map(&mut at).collect()
            })
            .collect();
        let mut columns: Vec<_> = views.into_iter().map(Vec::into_iter).collect();
        let of_size = |reference: &Self| {
            reference.summary(columns.iter_mut().filter_map(Iterator::next).collect())
        };
        chain.iter().map(of_size).collect()
    }

    /// Pixels that both areas are topped up to in views that are edge-on.
    fn least_area(&self) -> f64 {
        let all: f64 = self.pictures.iter().map(|p| p.original.area()).sum();
        EDGE_ON * all / self.pictures.len().max(1) as f64
    }

    fn compare_pictures(&self, draw: impl Fn(&Picture) -> Coverage + Sync) -> SizeFigures {
        let least = self.least_area();
        let figures = |picture: &Picture| picture.figures(&draw(picture), least);
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
            base_color_linear: None,
            appearance: None,
            views,
        }
    }
}

impl Picture {
    /// The picture that `mask` shows, at `camera` halved so many `times`, and the F1 of the mask
    /// moved by half a pixel.
    fn of(view: &View, camera: Camera, mask: &Mask, times: u32) -> (Self, f64) {
        let original = mask.coverage();
        // Half a pixel is a number of samples: the moved picture needs no second drawing.
        let half = mask.side as i32 / 2;
        let moved = [(half, 0), (0, half)]
            .map(|(x, y)| agreement(&original, &mask.coverage_shifted(x, y)).f1());
        let camera = Camera {
            width: mask.width,
            height: mask.height,
            pixels: camera.pixels / (1u32 << times) as f32,
            ..camera
        };
        let picture = Self {
            view: view.clone(),
            camera,
            original,
        };
        (picture, 0.5 * (moved[0] + moved[1]))
    }

    fn figures(&self, level: &Coverage, least: f64) -> ViewFigures {
        let more = (least - self.original.area()).max(0.0);
        let found: Agreement = agreement(&self.original, level);
        ViewFigures {
            view: self.view.name.clone(),
            f1: found.f1(),
            precision: found.precision(),
            recall: found.recall(),
            area_ratio: ratio(level.area() + more, self.original.area() + more),
            half_area_ratio: found.pixel_ratio(),
        }
    }
}
