//! The original's silhouettes at one size, kept to compare levels with.

use rayon::prelude::*;

use super::drawable::Drawable;
use super::outline::{self, Outline};
use super::schema::SizeFigures;
use super::silhouette::moved_f1;
use super::stage::sampling;
use crate::botany::Model;
use crate::botany::model::Frame;
use crate::space::raster::{Camera, Coverage, coverage, coverage_multisampled};
use crate::space::view::{Lens, View};

/// An original at one size on the screen, drawn once from every view, supersampled.
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

impl Reference {
    /// Draws the original; its extent along y takes `height_px` pixels where its middle is, seen
    /// through the usual lens.
    pub fn new(original: &Model, views: &[View], height_px: u32) -> Self {
        let drawable = Drawable::silhouette(original);
        Self::of(&drawable, original, views, Lens::default(), height_px)
    }

    /// As [`Reference::new`], for a model that is ready to be drawn, through any lens.
    pub fn of(
        drawable: &Drawable,
        original: &Model,
        views: &[View],
        lens: Lens,
        height_px: u32,
    ) -> Self {
        let (scene, height) = (drawable.scene(), original.height());
        let drawn = views.par_iter().map(|view| {
            let camera = view.camera_through(lens, height, height_px);
            let mask = coverage(&scene, &camera, sampling(height_px));
            let original = mask.coverage();
            let moved = moved_f1(&mask, &original.fraction);
            let view = view.clone();
            let picture = Picture {
                view,
                camera,
                original,
            };
            (picture, moved)
        });
        let (pictures, moved): (Vec<Picture>, Vec<f64>) = drawn.unzip();
        Self {
            height_px,
            frame: original.frame,
            pictures,
            shifted_f1: moved.iter().map(|f1| f1 / views.len() as f64).sum(),
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
        outline::shift_ratio(f1, self.shifted_f1)
    }

    /// Compares a level that was read from its own file, drawn as the original was.
    pub fn compare(&self, level: &Model) -> SizeFigures {
        self.compare_drawable(&Drawable::silhouette(level))
    }

    /// As [`Reference::compare`], for a model that is ready to be drawn.
    pub fn compare_drawable(&self, level: &Drawable) -> SizeFigures {
        let (scene, placement) = (level.scene(), level.placement_in(self.frame));
        let sampling = sampling(self.height_px);
        self.compare_pictures(|picture| {
            coverage(&scene, &picture.camera.placed(placement), sampling).coverage()
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

    /// Compares what `draw` shows through each picture's camera: what no scene can hold, such as an
    /// impostor whose shader looks where the eye is.
    pub fn compare_drawn(&self, draw: impl Fn(&Camera) -> Coverage + Sync) -> SizeFigures {
        self.compare_pictures(|picture| draw(&picture.camera))
    }

    fn compare_pictures(&self, draw: impl Fn(&Picture) -> Coverage + Sync) -> SizeFigures {
        let outline = |picture: &Picture| {
            let level = draw(picture);
            let original = &picture.original.fraction;
            Outline::new(&picture.view.name, original, &level.fraction)
        };
        let outlines: Vec<Outline> = self.pictures.par_iter().map(outline).collect();
        outline::summary(self.height_px, self.shifted_f1, &outlines)
    }
}
