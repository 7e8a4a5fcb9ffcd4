//! The page's tables.

use maud::{Markup, html};

use crate::report::schema::{Figure, Level, Report, SizeFigures};

/// Costs, distances and silhouettes: a row for each level and size.
pub fn levels(report: &Report) -> Markup {
    let whole = report.original.as_ref().map_or(0, |o| o.triangles);
    table(
        "Costs and silhouettes, means over all views; under F1 its worst view. E is the error 1 - F1 over that of the \
         original moved by half a pixel.",
        &[
            "file",
            "triangles",
            "of the original",
            "draw calls",
            "textures",
            "file size",
            "overdraw",
            "from, m",
            "height, px",
            "F1",
            "worst F1",
            "E",
            "precision",
            "recall",
            "area",
            "area spread",
        ],
        html! {
            @if let Some(original) = &report.original {
                tr { (costs(original, whole, 1)) td colspan="8" {} }
            }
            @for level in &report.levels {
                @for (i, size) in level.sizes.iter().enumerate() {
                    tr {
                        @if i == 0 { (costs(level, whole, level.sizes.len())) }
                        td { (size.height_px) }
                        td { (figure(&size.f1, 3)) }
                        td { (format!("{:.3}", size.f1.worst)) small { (size.f1.worst_view) } }
                        td { (format!("{:.2}", size.shift_ratio)) }
                        td { (figure(&size.precision, 3)) }
                        td { (figure(&size.recall, 3)) }
                        td { (figure(&size.area_ratio, 3)) }
                        td { (format!("{:.3}", size.area_ratio.deviation)) }
                    }
                }
            }
        },
    )
}

fn costs(level: &Level, whole: u64, rows: usize) -> Markup {
    let share = 100.0 * level.triangles as f64 / whole.max(1) as f64;
    html! {
        th scope="rowgroup" rowspan=(rows) { (level.file) }
        td rowspan=(rows) { (count(level.triangles)) }
        td rowspan=(rows) { (format!("{share:.2} %")) }
        td rowspan=(rows) { (level.draw_calls) }
        td rowspan=(rows) { (bytes(level.texture_bytes)) }
        td rowspan=(rows) { (bytes(level.file_bytes)) }
        td rowspan=(rows) { (format!("{:.1}", level.overdraw)) }
        td rowspan=(rows) { (format!("{:.1}", level.distance_m)) }
    }
}

/// What silhouettes hide.
pub fn appearance(report: &Report) -> Markup {
    let looks = |level: &Level| {
        level
            .sizes
            .iter()
            .filter(|s| s.appearance.is_some())
            .count()
    };
    if report.levels.iter().all(|l| looks(l) == 0) {
        return html! {};
    }
    table(
        "Colour, depth and normals against the original, means over all views; wrong pixels are those off by more than \
         8 or 32 of 255, as a share of the original's.",
        &[
            "file",
            "height, px",
            "soft F1",
            "wrong by 8",
            "wrong by 32",
            "SSIM",
            "PSNR, dB",
            "FLIP",
            "worst FLIP",
            "colour, ΔE",
            "depth, heights",
            "normals, °",
        ],
        html! {
            @for level in &report.levels {
                @for (i, size) in level.sizes.iter().filter(|s| s.appearance.is_some()).enumerate() {
                    tr {
                        @if i == 0 { th scope="rowgroup" rowspan=(looks(level)) { (level.file) } }
                        (look(size))
                    }
                }
            }
        },
    )
}

fn look(size: &SizeFigures) -> Markup {
    let inside = |f: &Option<Figure>, digits| f.as_ref().map_or("-".into(), |f| figure(f, digits));
    html! {
        @if let Some(look) = &size.appearance {
            td { (size.height_px) }
            td { (figure(&look.soft_f1, 3)) }
            td { (percent(&look.incorrect_share_8)) }
            td { (percent(&look.incorrect_share_32)) }
            td { (figure(&look.ssim, 3)) }
            td { (figure(&look.psnr_db, 1)) }
            td { (figure(&look.flip, 3)) }
            td { (format!("{:.3}", look.flip.worst)) small { (look.flip.worst_view) } }
            td { (figure(&look.color_shift_delta_e, 2)) }
            td { (inside(&look.depth_error, 3)) }
            td { (inside(&look.normal_error_deg, 1)) }
        }
    }
}

/// Jumps to the next level and from frame to frame.
pub fn changes(report: &Report) -> Markup {
    if report
        .levels
        .iter()
        .all(|l| l.orbit.is_none() && l.jump_to_next.is_none())
    {
        return html! {};
    }
    table(
        "What changes: the jump to the next level where that takes over, and one frame to the next while the camera \
         turns by one degree, beside the original's own.",
        &[
            "file",
            "jump at, px",
            "F1",
            "area",
            "FLIP",
            "turn at, px",
            "FLIP of the turn",
            "FLIP of the original's turn",
        ],
        html! {
            @for level in &report.levels {
                tr {
                    th scope="row" { (level.file) }
                    @match &level.jump_to_next {
                        Some(jump) => {
                            td { (jump.height_px) }
                            td { (figure(&jump.f1, 3)) }
                            td { (figure(&jump.area_ratio, 3)) }
                            td { (figure(&jump.appearance.flip, 3)) }
                        }
                        None => { td colspan="4" { "last level" } }
                    }
                    @if let Some(orbit) = &level.orbit {
                        td { (orbit.height_px) }
                        td { (figure(&orbit.level.flip, 3)) }
                        td { (figure(&orbit.original.flip, 3)) }
                    }
                }
            }
        },
    )
}

/// A table that scrolls by itself where it is too wide; reachable by keyboard.
pub fn table(caption: &str, heads: &[&str], body: Markup) -> Markup {
    html! {
        div class="scroll" tabindex="0" role="region" aria-label=(caption.split_once(['.', ',']).map_or(caption, |c| c.0)) {
            table {
                caption { span { (caption) } }
                thead { tr { @for head in heads { th scope="col" { (head) } } } }
                tbody { (body) }
            }
        }
    }
}

fn figure(figure: &Figure, digits: usize) -> String {
    format!("{:.digits$}", figure.mean)
}

fn percent(figure: &Figure) -> String {
    format!("{:.1} %", 100.0 * figure.mean)
}

/// "48,109".
pub fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// "1.5 MiB".
pub fn bytes(value: u64) -> String {
    match value {
        0..1024 => format!("{value} B"),
        1024..1_048_576 => format!("{:.0} KiB", value as f64 / 1024.0),
        _ => format!("{:.1} MiB", value as f64 / 1_048_576.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_grouped() {
        assert_eq!(
            [7, 999, 1000, 48_109, 1_234_567].map(count),
            ["7", "999", "1,000", "48,109", "1,234,567"]
        );
    }
}
