//! `report.html`: one file with figures, diagrams and pictures, which opens without a network.
//!
//! The page states what the files on disk look like: it draws them anew. It holds style, script
//! and pictures itself and asks for nothing else.

mod embed;
mod making;
mod picture;
mod plot;
mod sharing;
mod tables;

use maud::{DOCTYPE, Markup, PreEscaped, html};
use rayon::prelude::*;

use self::embed::data_uri;
pub use self::making::{Made, Recognised};
use self::picture::{AGREEMENT, Pair, flip_color, page as atlas_page, pair};
use self::plot::{Plot, Series, mark};
pub use self::sharing::Sheet;
use super::schema::{Level, Report};
use crate::Result;
use crate::botany::Model;
use crate::space::view::{Lens, View};

const STYLE: &str = include_str!("style.css");
const SCRIPT: &str = include_str!("script.js");

/// What the page is made of.
pub struct Content<'a> {
    /// The figures.
    pub report: &'a Report,
    /// The original.
    pub original: &'a Model,
    /// The levels of the report, in its order, with the pixels of their images.
    pub levels: &'a [&'a Model],
    /// The views that the figures are of.
    pub views: &'a [View],
    /// Through what.
    pub lens: Lens,
    /// Tiles and their copies of levels that share texels.
    pub sheets: &'a [Sheet],
    /// What is behind the figures.
    pub made: Option<Made<'a>>,
}

/// Trees up to this height in pixels are shown enlarged, too.
const ENLARGED_PX: u32 = 256;

/// Height of the tree in pixels where a report states none.
const USUAL_PX: u32 = 256;

impl Content<'_> {
    /// The size that a level is shown at: where it starts, or else the largest one measured.
    fn height_px(level: &Level) -> u32 {
        let start = level.orbit.as_ref().map(|o| o.height_px);
        start
            .or(level.sizes.first().map(|s| s.height_px))
            .unwrap_or(USUAL_PX)
    }

    /// A view from the side, and the one that a level is worst in.
    fn shown(&self, level: &Level) -> Vec<&View> {
        let height_px = Self::height_px(level);
        let size = level.sizes.iter().find(|s| s.height_px == height_px);
        let worst = size.map(|s| s.f1.worst_view.as_str());
        let mut views: Vec<&View> = self.views.first().into_iter().collect();
        if let Some(view) = self.views.iter().find(|v| Some(v.name.as_str()) == worst)
            && views.iter().all(|v| v.name != view.name)
        {
            views.push(view);
        }
        views
    }

    /// The page.
    ///
    /// # Errors
    /// [`crate::Error::Internal`] if a picture can't be encoded.
    pub fn html(&self) -> Result<String> {
        let name = &self.original.name;
        let sections: Vec<Markup> = self
            .report
            .levels
            .iter()
            .zip(self.levels)
            .map(|(row, model)| self.section(row, model))
            .collect::<Result<_>>()?;
        let levels = self.report.levels.len();
        let shared = self.report.sharing.as_ref();
        let shared = shared.filter(|shared| sharing::any(shared));
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    link rel="icon" href="data:,";
                    title { "Levels of " (name) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    main {
                        h1 { "Levels of " (name) }
                        p { (self.summary()) }
                        nav aria-label="Contents" {
                            ul {
                                li { a href="#levels" { "Figures" } }
                                li { a href="#diagrams" { "Diagrams" } }
                                @if let Some(made) = self.made {
                                    li { a href="#making" { (made.title) } }
                                }
                                @if shared.is_some() {
                                    li { a href="#sharing" { "Shared texels" } }
                                }
                                @for level in &self.report.levels {
                                    li { a href={ "#level-" (level.level) } { "Level " (level.level) } }
                                }
                            }
                        }
                        section id="levels" aria-labelledby="levels-title" {
                            h2 id="levels-title" { (levels) @if levels == 1 { " level" } @else { " levels" } }
                            (tables::levels(self.report))
                            (tables::appearance(self.report))
                            (tables::changes(self.report))
                        }
                        (self.diagrams())
                        @if let Some(made) = self.made { (making::sections(made, self.report.cuts.as_ref())) }
                        @if let Some(shared) = shared { (sharing::section(shared, self.sheets)) }
                        @for section in &sections { (section) }
                        p class="quiet" {
                            "Made by pleach " (env!("CARGO_PKG_VERSION"))
                            ". Drawn with 16 samples a pixel (four neighbours that show one triangle are lit as one), lit by sky and sun, before a ground of half of white's light."
                        }
                    }
                    script { (PreEscaped(SCRIPT)) }
                }
            }
        };
        Ok(page.into_string())
    }

    fn summary(&self) -> String {
        let Some(original) = &self.report.original else {
            return String::new();
        };
        format!(
            "The original, {}, has {} triangles in {} draw calls, {} of textures on the GPU and a file of {}.",
            original.file,
            tables::count(original.triangles),
            original.draw_calls,
            tables::bytes(original.texture_bytes),
            tables::bytes(original.file_bytes)
        )
    }

    /// One level: pictures from its views, and its images.
    fn section(&self, row: &Level, model: &Model) -> Result<Markup> {
        let height_px = Self::height_px(row);
        let shown = self.shown(row);
        let pairs: Vec<Pair> = shown
            .par_iter()
            .map(|view| pair(self.original, model, view, (self.lens, height_px)))
            .collect::<Result<_>>()?;
        let title = format!("level-{}", row.level);
        Ok(html! {
            section id=(title) aria-labelledby={ (title) "-title" } {
                h2 id={ (title) "-title" } { "Level " (row.level) ": " (row.file) }
                p {
                    (tables::count(row.triangles)) " triangles, " (row.draw_calls) " draw calls, "
                    (tables::bytes(row.texture_bytes)) " of textures, a file of " (tables::bytes(row.file_bytes))
                    "; shown from " (format!("{:.1}", row.distance_m)) " m on, where the tree is " (height_px)
                    " pixels high."
                }
                @for (i, pair) in pairs.iter().enumerate() {
                    (views_of(row, pair, height_px, i > 0))
                }
                (atlas(row, model)?)
            }
        })
    }

    fn diagrams(&self) -> Markup {
        let mut heights: Vec<u32> = self
            .report
            .levels
            .iter()
            .flat_map(|l| l.sizes.iter().map(|s| s.height_px))
            .collect();
        heights.sort_unstable_by(|a, b| b.cmp(a));
        heights.dedup();
        let of =
            |height_px: u32, point: &dyn Fn(&Level, &super::schema::SizeFigures) -> (f64, f64)| {
                let points = self.report.levels.iter().filter_map(|level| {
                    let size = level.sizes.iter().find(|s| s.height_px == height_px)?;
                    let (x, y) = point(level, size);
                    let what = format!(
                        "{}, {} triangles, at {height_px} px: {x:.3}, {y:.3}",
                        level.file, level.triangles
                    );
                    Some((x, y, what))
                });
                Series {
                    name: format!("{height_px} px"),
                    points: points.collect(),
                }
            };
        let all =
            |point: &dyn Fn(&Level, &super::schema::SizeFigures) -> (f64, f64)| -> Vec<Series> {
                heights.iter().map(|&h| of(h, point)).collect()
            };
        let accuracy = all(&|_, s| (s.recall.mean, s.precision.mean));
        let silhouette = all(&|l, s| (l.triangles as f64, 1.0 - s.f1.mean));
        let seen = all(&|l, s| {
            let flip = s.appearance.as_ref().map_or(f64::NAN, |a| a.flip.mean);
            (l.triangles as f64, flip)
        });
        let has_flip = seen.iter().flat_map(|s| &s.points).all(|p| p.1.is_finite());
        let key = html! {
            figcaption class="key" {
                @for (i, series) in accuracy.iter().enumerate() {
                    span class={ "s" (i % 5) } {
                        svg viewBox="0 0 14 14" aria-hidden="true" { path class="mark" d=(mark(i % 5, 7.0, 7.0)) {} }
                        (series.name)
                    }
                }
            }
        };
        let plot = |title: &str, plot: Plot| {
            html! {
                figure { h3 { (title) } (PreEscaped(plot.svg())) (key) }
            }
        };
        html! {
            section id="diagrams" aria-labelledby="diagrams-title" {
                h2 id="diagrams-title" { "Diagrams" }
                p { "All levels at all sizes on the screen (heights of the tree in pixels). The tables above hold the numbers." }
                div class="plots" {
                    (plot("Precision and recall", Plot {
                        description: "Precision against recall of the silhouettes, a point for each level and size; curves of equal F1",
                        x_label: "recall", y_label: "precision", log_x: false, f1_curves: true, lines: false,
                        series: &accuracy,
                    }))
                    (plot("Error of the silhouette against triangles", Plot {
                        description: "One minus F1 against the number of triangles, a line for each size",
                        x_label: "triangles", y_label: "1 - F1", log_x: true, f1_curves: false, lines: true,
                        series: &silhouette,
                    }))
                    @if has_flip {
                        (plot("Difference seen (FLIP) against triangles", Plot {
                            description: "FLIP against the number of triangles, a line for each size",
                            x_label: "triangles", y_label: "FLIP", log_x: true, f1_curves: false, lines: true,
                            series: &seen,
                        }))
                    }
                }
            }
        }
    }
}

/// One view of a level: both pictures under a slider, as large as they are shown and enlarged; the
/// two maps.
fn views_of(row: &Level, pair: &Pair, height_px: u32, worst: bool) -> Markup {
    let which = if worst { ", the worst one" } else { "" };
    let [both, missing, extra] = pair.counts.map(tables::count);
    let level = format!("level {}", row.level);
    // Too large to stand beside others without being made smaller.
    let large = height_px > ENLARGED_PX;
    let stack = |class: &str| {
        html! {
            div class={ "frame pair " (class) } {
                (image(&pair.original, pair, &format!("Original, {}", pair.view)))
                (image_of(&pair.level, pair, &format!("Level {}, {}", row.level, pair.view), "level"))
            }
        }
    };
    html! {
        section class="view" {
            h3 { "View " (pair.view) (which) }
            label class="slider" {
                span { "Original" }
                input type="range" min="0" max="100" value="50"
                    aria-label={ "Border between the original on the left and " (level) " on the right, view " (pair.view) };
                span { (level) }
            }
            div class="pictures" {
                figure class=[large.then_some("large")] {
                    (stack("own"))
                    figcaption { "As it is shown: the tree is " (height_px) " pixels high." }
                }
                @if !large {
                    figure {
                        (stack(""))
                        figcaption { "Enlarged." }
                    }
                }
                figure {
                    div class="frame paper" { (image(&pair.agreement, pair, &format!(
                        "Map of the silhouettes: {both} pixels of both, {missing} of the original alone, {extra} of the level alone"
                    ))) }
                    figcaption class="key" {
                        (swatch(AGREEMENT[1], &format!("both, {both}")))
                        (swatch(AGREEMENT[2], &format!("missing, {missing}")))
                        (swatch(AGREEMENT[3], &format!("too much, {extra}")))
                    }
                }
                figure {
                    div class="frame" { (image(&pair.flip, pair, "Map of FLIP: the lighter, the larger the difference")) }
                    figcaption class="key" {
                        span { "FLIP 0" i class="bar" style=(flip_bar()) {} "1" }
                    }
                }
            }
        }
    }
}

fn swatch([r, g, b]: [u8; 3], text: &str) -> Markup {
    html! { span { i style={ "background:rgb(" (r) "," (g) "," (b) ")" } {} (text) } }
}

fn flip_bar() -> String {
    let stops: Vec<String> = (0..=8)
        .map(|i| {
            let [r, g, b] = flip_color(i as f32 / 8.0);
            format!("rgb({r},{g},{b})")
        })
        .collect();
    format!("background:linear-gradient(90deg,{})", stops.join(","))
}

fn image(png: &[u8], pair: &Pair, alt: &str) -> Markup {
    image_of(png, pair, alt, "")
}

fn image_of(png: &[u8], pair: &Pair, alt: &str, class: &str) -> Markup {
    html! {
        img class=[(!class.is_empty()).then_some(class)] src=(data_uri(png))
            width=(pair.width) height=(pair.height) alt=(alt);
    }
}

/// The images of a level's file.
fn atlas(row: &Level, model: &Model) -> Result<Markup> {
    let pages: Vec<_> = model
        .images
        .par_iter()
        .map(|image| Ok(atlas_page(image)?.map(|page| (image, page))))
        .collect::<Result<Vec<_>>>()?;
    let pages: Vec<_> = pages.into_iter().flatten().collect();
    Ok(html! {
        @if !pages.is_empty() {
            h3 { "Images of " (row.file) }
            div class="atlas" {
                @for (image, (png, width, height)) in &pages {
                    figure {
                        img src=(data_uri(png)) width=(width) height=(height)
                            alt={ "Image " (image.name) " of level " (row.level) };
                        figcaption { (image.name) ", " (image.width) " x " (image.height) " texels" }
                    }
                }
            }
        }
    })
}
