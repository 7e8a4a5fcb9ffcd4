//! How a bake came to its levels: cuts to choose from, what was recognised, time and bytes.

use maud::{Markup, PreEscaped, html};

use super::embed::data_uri;
use super::plot::{Plot, Series, mark};
use super::tables::{bytes, count, table};
use crate::detail::optimal_cut::Candidate;
use crate::report::cuts::Cuts;
use crate::report::schema::Bake;

/// A picture of what was recognised.
#[derive(Clone, Debug, Default)]
pub struct Recognised {
    /// "skeleton".
    pub name: String,
    /// PNG.
    pub png: Vec<u8>,
}

/// What is behind the figures of a page.
#[derive(Clone, Copy)]
pub struct Made<'a> {
    /// "How they were made".
    pub title: &'a str,
    /// Pictures of what was recognised in the original.
    pub recognised: &'a [Recognised],
    /// Time and memory of the command.
    pub took: &'a Bake,
    /// The files and their bytes.
    pub files: &'a [(String, u64)],
}

/// Sections on how the levels were made; `cuts` where they are known.
pub fn sections(made: Made, cuts: Option<&Cuts>) -> Markup {
    html! {
        section id="making" aria-labelledby="making-title" {
            h2 id="making-title" { (made.title) }
            @if let Some(cuts) = cuts { (diagram(cuts)) }
            @for picture in made.recognised {
                figure {
                    img class="wide" src=(data_uri(&picture.png)) alt={ "What was recognised: " (picture.name) ", from the front and from the right" };
                    figcaption { "Recognised: " (picture.name) "." }
                }
            }
            (time(made.took))
            (files(made.files))
        }
    }
}

fn diagram(cuts: &Cuts) -> Markup {
    let series = |name: &str, of: &[Candidate]| Series {
        name: name.into(),
        points: of
            .iter()
            .map(|c| {
                let what = format!("{name}: {} triangles, {:.4} m", c.triangles, c.error_m);
                (c.triangles as f64, c.error_m, what)
            })
            .collect(),
    };
    let all = [
        series("best cut", &cuts.best),
        series("level", &cuts.levels),
    ];
    let plot = Plot {
        description: "Error in metres against the number of triangles: the best cut for every budget, and the levels that were baked",
        x_label: "triangles",
        y_label: "error, m",
        log_x: true,
        f1_curves: false,
        lines: true,
        series: &all,
    };
    html! {
        div class="plots" {
            figure {
                h3 { "Every budget's best cut" }
                (PreEscaped(plot.svg()))
                figcaption class="key" {
                    @for (i, series) in all.iter().enumerate() {
                        span class={ "s" (i) } {
                            svg viewBox="0 0 14 14" aria-hidden="true" { path class="mark" d=(mark(i, 7.0, 7.0)) {} }
                            (series.name)
                        }
                    }
                }
            }
        }
        p { "Root mean square distance of what is drawn from the original. Levels lie below the cuts that they began as: after the cut leaves move to nearer cards. A billboard of the whole tree is no such cut: its planes are chosen for the silhouettes." }
    }
}

fn time(took: &Bake) -> Markup {
    let all = took.seconds.max(1e-9);
    table(
        "Where the time went",
        &["stage", "seconds", "share", "processor, s", "memory"],
        html! {
            @for stage in &took.stages {
                tr {
                    th scope="row" { (stage.name) }
                    td { (format!("{:.2}", stage.seconds)) }
                    td { (format!("{:.0} %", 100.0 * stage.seconds / all)) }
                    td { (format!("{:.2}", stage.cpu_seconds)) }
                    td { (bytes(stage.peak_bytes)) }
                }
            }
            tr {
                th scope="row" { "all" }
                td { (format!("{:.2}", took.seconds)) }
                td { "100 %" }
                td {}
                td { (took.peak_bytes.map(bytes).unwrap_or_default()) }
            }
        },
    )
}

fn files(files: &[(String, u64)]) -> Markup {
    let all: u64 = files.iter().map(|(_, bytes)| bytes).sum();
    table(
        "Where the bytes went",
        &["file", "size", "bytes"],
        html! {
            @for (file, size) in files {
                tr { th scope="row" { (file) } td { (bytes(*size)) } td { (count(*size)) } }
            }
            tr { th scope="row" { "all" } td { (bytes(all)) } td { (count(all)) } }
        },
    )
}
