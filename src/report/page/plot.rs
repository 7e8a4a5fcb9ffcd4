//! Diagrams as SVG in the page: precision against recall, error against triangles.
//!
//! Colours come from the page's style (`var(--...)`), so that they follow light and dark.

use std::fmt::Write;

/// Points of one kind, joined by a line where it says so.
pub struct Series {
    /// What they have in common: "256 px".
    pub name: String,
    /// x, y and what the point is.
    pub points: Vec<(f64, f64, String)>,
}

/// What a diagram shows.
pub struct Plot<'a> {
    /// Read out instead of the picture.
    pub description: &'a str,
    /// Below the x axis.
    pub x_label: &'a str,
    /// Beside the y axis.
    pub y_label: &'a str,
    /// Whether x is logarithmic.
    pub log_x: bool,
    /// Whether curves of equal F1 are drawn (x is recall, y is precision).
    pub f1_curves: bool,
    /// Whether the points of a series are joined.
    pub lines: bool,
    /// The data.
    pub series: &'a [Series],
}

const WIDTH: f64 = 480.0;
const HEIGHT: f64 = 360.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 48.0;
/// Marks of the series, told apart by shape as well as by colour.
const SHAPES: usize = 5;

/// An axis: which part of the numbers it shows.
struct Axis {
    low: f64,
    high: f64,
    log: bool,
}

impl Axis {
    fn around(values: impl Iterator<Item = f64>, log: bool, bounds: [f64; 2]) -> Self {
        let (mut low, mut high) = (f64::MAX, f64::MIN);
        for value in values {
            (low, high) = (low.min(value), high.max(value));
        }
        if low > high {
            (low, high) = (bounds[0], bounds[1]);
        }
        let (low, high) = if log {
            (low.max(1.0) / 1.5, high.max(1.0) * 1.5)
        } else {
            let margin = ((high - low) * 0.08).max(0.01);
            (
                (low - margin).max(bounds[0]),
                (high + margin).min(bounds[1]),
            )
        };
        Self { low, high, log }
    }

    /// 0 at the low end, 1 at the high one.
    fn share(&self, value: f64) -> f64 {
        if self.log {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// Round numbers within the axis.
    fn ticks(&self) -> Vec<f64> {
        if self.log {
            let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
            let all: Vec<f64> = decades
                .flat_map(|d| [1.0, 2.0, 5.0].map(|m| m * 10f64.powi(d)))
                .filter(|v| (self.low..=self.high).contains(v))
                .collect();
            let tens: Vec<f64> = all
                .iter()
                .copied()
                .filter(|v| v.log10().fract() == 0.0)
                .collect();
            return if tens.len() >= 3 { tens } else { all };
        }
        let rough = (self.high - self.low) / 5.0;
        let ten = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0]
            .map(|m| m * ten)
            .into_iter()
            .find(|s| *s >= rough)
            .unwrap_or(rough);
        let first = (self.low / step).ceil() as i64;
        let last = (self.high / step).floor() as i64;
        (first..=last).map(|i| i as f64 * step).collect()
    }
}

impl Plot<'_> {
    /// The diagram as an `<svg>` element.
    pub fn svg(&self) -> String {
        let points = || self.series.iter().flat_map(|s| &s.points);
        let x = Axis::around(points().map(|p| p.0), self.log_x, [0.0, f64::MAX]);
        let most = if self.f1_curves { 1.0 } else { f64::MAX };
        let x = if self.f1_curves {
            Axis {
                high: x.high.min(1.0),
                ..x
            }
        } else {
            x
        };
        let y = Axis::around(points().map(|p| p.1), false, [0.0, most]);
        let at_x = |v: f64| LEFT + x.share(v) * (WIDTH - LEFT - RIGHT);
        let at_y = |v: f64| HEIGHT - BOTTOM - y.share(v) * (HEIGHT - TOP - BOTTOM);
        let mut out = format!(
            "<svg class=\"plot\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\">",
            escape(self.description)
        );
        for tick in x.ticks() {
            let px = at_x(tick);
            let _ = write!(
                out,
                "<path class=\"grid\" d=\"M{px:.1} {TOP}V{:.1}\"/><text class=\"x\" x=\"{px:.1}\" y=\"{:.1}\">{}</text>",
                HEIGHT - BOTTOM,
                HEIGHT - BOTTOM + 16.0,
                number(tick)
            );
        }
        for tick in y.ticks() {
            let py = at_y(tick);
            let _ = write!(
                out,
                "<path class=\"grid\" d=\"M{LEFT} {py:.1}H{:.1}\"/><text class=\"y\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                WIDTH - RIGHT,
                LEFT - 6.0,
                py + 4.0,
                number(tick)
            );
        }
        if self.f1_curves {
            self.curves(&mut out, &x, &y, &at_x, &at_y);
        }
        for (index, series) in self.series.iter().enumerate() {
            let _ = write!(out, "<g class=\"series s{}\">", index % SHAPES);
            if self.lines && series.points.len() > 1 {
                let path: Vec<String> = series
                    .points
                    .iter()
                    .map(|p| format!("{:.1} {:.1}", at_x(p.0), at_y(p.1)))
                    .collect();
                let _ = write!(out, "<path class=\"line\" d=\"M{}\"/>", path.join("L"));
            }
            for (px, py, what) in &series.points {
                let _ = write!(
                    out,
                    "<path class=\"mark\" d=\"{}\"><title>{}</title></path>",
                    mark(index % SHAPES, at_x(*px), at_y(*py)),
                    escape(what)
                );
            }
            out += "</g>";
        }
        let _ = write!(
            out,
            "<text class=\"x\" x=\"{:.1}\" y=\"{:.1}\">{}</text><text class=\"x\" transform=\"translate(14 {:.1}) rotate(-90)\">{}</text></svg>",
            LEFT + (WIDTH - LEFT - RIGHT) / 2.0,
            HEIGHT - 10.0,
            escape(self.x_label),
            TOP + (HEIGHT - TOP - BOTTOM) / 2.0,
            escape(self.y_label)
        );
        out
    }

    /// Where precision and recall give the same F1: `y = F x / (2 x - F)`.
    fn curves(
        &self,
        out: &mut String,
        x: &Axis,
        y: &Axis,
        at_x: &dyn Fn(f64) -> f64,
        at_y: &dyn Fn(f64) -> f64,
    ) {
        for tenths in 2..20 {
            let f1 = f64::from(tenths) / 20.0;
            let curve: Vec<(f64, f64)> = (0..=100)
                .map(|i| x.low + (x.high - x.low) * f64::from(i) / 100.0)
                .filter(|r| 2.0 * r > f1)
                .map(|r| (r, f1 * r / (2.0 * r - f1)))
                .filter(|(_, p)| (y.low..=y.high).contains(p))
                .collect();
            let (Some(first), true) = (curve.first(), curve.len() > 4) else {
                continue;
            };
            let path: Vec<String> = curve
                .iter()
                .map(|(r, p)| format!("{:.1} {:.1}", at_x(*r), at_y(*p)))
                .collect();
            let _ = write!(
                out,
                "<path class=\"curve\" d=\"M{}\"/><text class=\"curve\" x=\"{:.1}\" y=\"{:.1}\">F1 {f1:.2}</text>",
                path.join("L"),
                at_x(first.0) + 3.0,
                at_y(first.1) + 12.0
            );
        }
    }
}

/// The mark of a series at a place: disc, square, diamond, triangle, cross.
pub fn mark(shape: usize, x: f64, y: f64) -> String {
    let r = 4.5;
    let (l, t, w, d) = (x - r, y - r, 2.0 * r, 1.3 * r);
    match shape {
        0 => format!("M{l:.1} {y:.1}a{r} {r} 0 1 0 {w} 0a{r} {r} 0 1 0 -{w} 0z"),
        1 => format!("M{l:.1} {t:.1}h{w}v{w}h-{w}z"),
        2 => format!("M{x:.1} {:.1}l{d} {d}l-{d} {d}l-{d} -{d}z", y - d),
        3 => format!("M{x:.1} {:.1}l{d} {w}h-{:.1}z", y - r, 2.0 * d),
        _ => format!(
            "M{l:.1} {t:.1}l3 0l1.5 3l1.5 -3l3 0l-3 4.5l3 4.5l-3 0l-1.5 -3l-1.5 3l-3 0l3 -4.5z"
        ),
    }
}

/// A tick's number, short.
fn number(value: f64) -> String {
    match value {
        v if v >= 1e6 => format!("{}M", v / 1e6),
        v if v >= 1e3 => format!("{}k", v / 1e3),
        v if v >= 10.0 || v == 0.0 => format!("{v:.0}"),
        v => {
            let text = format!("{v:.3}");
            text.trim_end_matches('0').trim_end_matches('.').into()
        }
    }
}

/// Text that may stand in an element or an attribute.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let axis = |low, high, log| Axis { low, high, log };
        assert_eq!(axis(0.0, 1.0, false).ticks().len(), 6);
        assert_eq!(
            axis(16.0, 72_000.0, true).ticks(),
            [100.0, 1000.0, 10_000.0]
        );
        assert_eq!(axis(100.0, 900.0, true).ticks(), [100.0, 200.0, 500.0]);
        assert_eq!(
            ["10k", "0.95", "500", "0"],
            [1e4, 0.95, 500.0, 0.0]
                .map(number)
                .each_ref()
                .map(|s| s.as_str())
        );
    }

    #[test]
    fn names_are_escaped_and_every_point_has_one() {
        let series = [Series {
            name: "256 px".into(),
            points: vec![(24.0, 0.1, "a<b>.glb".into()), (480.0, 0.05, "c".into())],
        }];
        let plot = Plot {
            description: "error & triangles",
            x_label: "triangles",
            y_label: "1 - F1",
            log_x: true,
            f1_curves: false,
            lines: true,
            series: &series,
        };
        let svg = plot.svg();
        assert!(
            svg.contains("<title>a&lt;b&gt;.glb</title>") && svg.contains("error &amp; triangles")
        );
        assert_eq!(svg.matches("class=\"mark\"").count(), 2);
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }
}
