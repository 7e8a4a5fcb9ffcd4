//! The diagram of a sweep: error over time, the Pareto front joined by a line (SVG).

use super::{Run, Sweep};

const WIDTH: f64 = 900.0;
const HEIGHT: f64 = 560.0;
/// Room for axes: left, top, right, bottom.
const MARGIN: [f64; 4] = [70.0, 40.0, 230.0, 60.0];
/// From line to line of names.
const LINE: f64 = 13.0;
/// Names that are no farther apart cover each other: less than a line, or a name moved down by one, rounded, would still
/// be too near and be moved to the same place for ever.
const TOUCHING: f64 = 12.5;
/// Parts of an axis between its numbers.
const STEPS: u32 = 5;

/// Positions on the diagram.
struct Axes {
    seconds: [f64; 2],
    error: [f64; 2],
}

impl Axes {
    fn of(runs: &[Run]) -> Self {
        let range = |value: fn(&Run) -> f64| {
            let low = runs.iter().map(value).fold(f64::MAX, f64::min);
            let high = runs.iter().map(value).fold(f64::MIN, f64::max);
            let room = 0.08 * (high - low).max(1e-6);
            [(low - room).max(0.0), high + room]
        };
        Self {
            seconds: range(Run::cost),
            error: range(|r| 1.0 - r.f1_mean),
        }
    }

    fn x(&self, seconds: f64) -> f64 {
        let [low, high] = self.seconds;
        MARGIN[0] + (seconds - low) / (high - low) * (WIDTH - MARGIN[0] - MARGIN[2])
    }

    fn y(&self, error: f64) -> f64 {
        let [low, high] = self.error;
        HEIGHT - MARGIN[3] - (error - low) / (high - low) * (HEIGHT - MARGIN[1] - MARGIN[3])
    }
}

/// The diagram as a file of its own; colours follow the reader's choice of light or dark.
pub fn plot(sweep: &Sweep) -> String {
    let axes = Axes::of(&sweep.runs);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-labelledby=\"t d\">\n\
         <title id=\"t\">Error over time: {}</title>\n\
         <desc id=\"d\">{}</desc>\n\
         <style>svg{{background:#fff;color:#222;font:13px sans-serif}}text{{fill:currentColor}}\
         .a{{stroke:currentColor;stroke-opacity:.25}}.f{{fill:none;stroke:#1a7f37;stroke-width:2}}\
         .p{{fill:#888}}.p.f{{fill:#1a7f37;stroke:none}}\
         @media(prefers-color-scheme:dark){{svg{{background:#161616;color:#ddd}}.f{{stroke:#4ac26b}}.p.f{{fill:#4ac26b}}}}</style>\n",
        escape(&sweep.input),
        escape(&sweep.advice.join(" "))
    );
    for i in 0..=STEPS {
        let part = f64::from(i) / f64::from(STEPS);
        let at = |[low, high]: [f64; 2]| low + (high - low) * part;
        let (seconds, error) = (at(axes.seconds), at(axes.error));
        let (x, y) = (axes.x(seconds), axes.y(error));
        let (left, right) = (MARGIN[0], WIDTH - MARGIN[2]);
        let (top, bottom) = (MARGIN[1], HEIGHT - MARGIN[3]);
        out += &format!(
            "<path class=\"a\" d=\"M{x:.1} {top}V{bottom}M{left} {y:.1}H{right}\"/>\
             <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{seconds:.1}</text>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{error:.4}</text>\n",
            bottom + 18.0,
            left - 8.0,
            y + 4.0
        );
    }
    out += &format!(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">seconds of processor time, all threads</text><text x=\"8\" y=\"22\">1 - F1, mean over levels</text>\n",
        WIDTH - MARGIN[2],
        HEIGHT - MARGIN[3] + 36.0
    );
    out += &front(&axes, &sweep.runs);
    for (run, label_y) in sweep.runs.iter().zip(label_heights(&axes, &sweep.runs)) {
        let (x, y) = (axes.x(run.cost()), axes.y(1.0 - run.f1_mean));
        let class = if run.on_front { "p f" } else { "p" };
        out += &format!(
            "<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\"/><text x=\"{:.1}\" y=\"{:.1}\">{}</text>\n",
            x + 7.0,
            label_y + 4.0,
            escape(&run.name)
        );
    }
    out + "</svg>\n"
}

/// Where names stand so that none covers another: moved down past those they would touch.
fn label_heights(axes: &Axes, runs: &[Run]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..runs.len()).collect();
    let y = |i: usize| axes.y(1.0 - runs[i].f1_mean);
    order.sort_by(|&a, &b| y(a).total_cmp(&y(b)));
    // Left end, right end (about seven units a letter) and height of every name so far.
    let mut placed: Vec<[f64; 3]> = Vec::new();
    let mut out = vec![0.0; runs.len()];
    for i in order {
        let left = axes.x(runs[i].cost());
        let right = left + 14.0 + 7.0 * runs[i].name.len() as f64;
        let mut at = y(i);
        while let Some(other) = placed
            .iter()
            .find(|p| p[0] < right && left < p[1] && (p[2] - at).abs() < TOUCHING)
        {
            at = other[2] + LINE;
        }
        placed.push([left, right, at]);
        out[i] = at;
    }
    out
}

fn front(axes: &Axes, runs: &[Run]) -> String {
    let mut front: Vec<&Run> = runs.iter().filter(|r| r.on_front).collect();
    front.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    let points: Vec<String> = front
        .iter()
        .map(|r| format!("{:.1},{:.1}", axes.x(r.cost()), axes.y(1.0 - r.f1_mean)))
        .collect();
    format!("<polyline class=\"f\" points=\"{}\"/>\n", points.join(" "))
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_at_any_height_stand_below_each_other() {
        let axes = Axes {
            seconds: [0.0, 1.0],
            error: [0.0, 1.0],
        };
        // Heights of all parts of a pixel: 138 of these, and a line below them, are less than a line apart when rounded.
        for i in 0..=9973 {
            let run = Run {
                name: "balanced".into(),
                f1_mean: f64::from(i) / 9973.0,
                ..Run::default()
            };
            let found = label_heights(&axes, &[run.clone(), run.clone(), run]);
            for k in 1..3 {
                let apart = found[k] - found[k - 1];
                assert!((apart - LINE).abs() < 1e-9, "{i}: {found:?}");
            }
        }
    }
}
