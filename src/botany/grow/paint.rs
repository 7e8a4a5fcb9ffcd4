//! Paints the foliage texture: a sprig of leaves, transparent around them.

use glam::Vec2;
use tiny_skia::{
    Color, FillRule, GradientStop, LineCap, LinearGradient, Mask, Paint, Path, PathBuilder, Pixmap,
    Point, SpreadMode, Stroke, Transform,
};

use super::outline::{Placed, Sprig, edges, half_width};
use super::rng::{Rng, sin_cos};
use super::species::{LeafKind, Outline};

/// Texels along a card.
const LENGTH: u32 = 512;

/// An 8-bit image, rows from the top.
pub(super) struct Painted {
    pub width: u32,
    pub height: u32,
    /// Bytes a texel: 3 or 4.
    pub channels: u8,
    pub texels: Vec<u8>,
}

impl Painted {
    /// The image as PNG.
    pub fn png(&self) -> Result<Vec<u8>, png::EncodingError> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(if self.channels == 4 {
            png::ColorType::Rgba
        } else {
            png::ColorType::Rgb
        });
        encoder.set_compression(png::Compression::Balanced);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.texels)?;
        writer.finish()?;
        Ok(bytes)
    }
}

/// The painter's view of a sprig.
struct Canvas<'a> {
    pixmap: Pixmap,
    sprig: &'a Sprig,
    kind: &'a LeafKind,
}

/// Paints a sprig; colour goes on under transparent texels.
pub(super) fn paint_sprig(sprig: &Sprig, kind: &LeafKind) -> Option<Painted> {
    let size = sprig.high - sprig.low;
    let mut width = LENGTH;
    while width > 32 && (width / 2) as f32 >= 0.7 * LENGTH as f32 * size.x / size.y {
        width /= 2;
    }
    let mut canvas = Canvas {
        pixmap: Pixmap::new(width, LENGTH)?,
        sprig,
        kind,
    };
    canvas.stalk();
    for leaf in &sprig.leaves {
        canvas.leaf(leaf);
    }
    Some(finish(&canvas.pixmap, kind))
}

impl Canvas<'_> {
    /// From the sprig's plane to texels.
    fn pixel(&self, p: Vec2) -> Point {
        let q = (p - self.sprig.low) / (self.sprig.high - self.sprig.low);
        Point::from_xy(
            q.x * self.pixmap.width() as f32,
            (1.0 - q.y) * self.pixmap.height() as f32,
        )
    }

    fn line(&mut self, points: &[Vec2], width: f32, color: Color) {
        let mut path = PathBuilder::new();
        for (i, &p) in points.iter().enumerate() {
            let p = self.pixel(p);
            if i == 0 {
                path.move_to(p.x, p.y)
            } else {
                path.line_to(p.x, p.y)
            }
        }
        let Some(path) = path.finish() else { return };
        let stroke = Stroke {
            width: width * self.pixmap.height() as f32,
            line_cap: LineCap::Round,
            ..Stroke::default()
        };
        self.pixmap
            .stroke_path(&path, &solid(color), &stroke, Transform::identity(), None);
    }

    fn stalk(&mut self) {
        let color = shade(self.kind.color, [0.95, 0.75, 0.6], 0.0);
        if self.sprig.stalk > 0.0 {
            self.line(
                &[Vec2::ZERO, Vec2::new(0.0, self.sprig.stalk)],
                0.016,
                color,
            );
        }
    }

    fn leaf(&mut self, leaf: &Placed) {
        let length = leaf.axis.length();
        let vary = 1.0 + 0.5 * self.kind.color_variation * leaf.tint;
        // Young leaves are yellower, shaded ones bluer.
        let tint = [
            vary * (1.0 + 0.35 * self.kind.color_variation * leaf.tint),
            vary,
            vary * (1.0 - 0.3 * self.kind.color_variation * leaf.tint),
        ];
        let Some(path) = self.outline(leaf) else {
            return;
        };
        let base = self.pixel(leaf.base);
        let tip = self.pixel(leaf.base + leaf.axis);
        let mut paint = Paint {
            anti_alias: true,
            ..Paint::default()
        };
        let stops = [(0.0, 0.78), (0.45, 1.0), (1.0, 1.12)].map(|(at, gain)| {
            GradientStop::new(at, shade(self.kind.color, tint.map(|t| t * gain), 0.0))
        });
        if let Some(gradient) = LinearGradient::new(
            base,
            tip,
            stops.to_vec(),
            SpreadMode::Pad,
            Transform::identity(),
        ) {
            paint.shader = gradient;
        }
        self.pixmap.fill_path(
            &path,
            &paint,
            FillRule::Winding,
            Transform::identity(),
            None,
        );
        if self.kind.outline == Outline::Needle {
            return;
        }
        self.halves(leaf, &path, tint);
        self.veins(leaf, tint, length);
    }

    /// Outline of a leaf, closed.
    fn outline(&self, leaf: &Placed) -> Option<Path> {
        let samples = 48;
        let side =
            |i: u32, s: usize| leaf.map(edges(self.sprig.outline, i as f32 / samples as f32)[s]);
        let mut path = PathBuilder::new();
        for i in 0..=samples {
            let p = self.pixel(side(i, 0));
            if i == 0 {
                path.move_to(p.x, p.y)
            } else {
                path.line_to(p.x, p.y)
            }
        }
        for i in (0..=samples).rev() {
            let p = self.pixel(side(i, 1));
            path.line_to(p.x, p.y);
        }
        path.close();
        path.finish()
    }

    /// One half of the blade lies in shade: it is folded along the midrib.
    fn halves(&mut self, leaf: &Placed, path: &Path, tint: [f32; 3]) {
        let (w, h) = (self.pixmap.width(), self.pixmap.height());
        let Some(mut mask) = Mask::new(w, h) else {
            return;
        };
        mask.fill_path(path, FillRule::Winding, true, Transform::identity());
        let corners = [(0.0, -0.1), (0.0, 1.2), (0.7, 1.2), (0.7, -0.1)];
        let mut half = PathBuilder::new();
        for (i, (x, y)) in corners.into_iter().enumerate() {
            let p = self.pixel(leaf.map(Vec2::new(x, y)));
            if i == 0 {
                half.move_to(p.x, p.y)
            } else {
                half.line_to(p.x, p.y)
            }
        }
        half.close();
        let Some(half) = half.finish() else { return };
        let mut color = shade(self.kind.color, tint.map(|t| 0.72 * t), 0.0);
        color.set_alpha(0.45);
        self.pixmap.fill_path(
            &half,
            &solid(color),
            FillRule::Winding,
            Transform::identity(),
            Some(&mask),
        );
    }

    fn veins(&mut self, leaf: &Placed, tint: [f32; 3], length: f32) {
        let mut color = shade(self.kind.color, tint.map(|t| 1.25 * t), 0.06);
        color.set_alpha(0.75);
        self.line(
            &[leaf.base, leaf.map(Vec2::new(0.0, 0.93))],
            0.011 * length,
            color,
        );
        color.set_alpha(0.4);
        if half_width(self.sprig.outline, 0.5) < 0.1 {
            return;
        }
        for i in 1..7 {
            let t = i as f32 / 7.5;
            for side in [-1.0, 1.0] {
                let reach = 0.8 * half_width(self.sprig.outline, t + 0.06);
                let end = Vec2::new(side * reach, t + 0.75 * reach);
                let start = leaf.map(Vec2::new(0.0, t - 0.03));
                self.line(&[start, leaf.map(end)], 0.006 * length, color);
            }
        }
    }
}

fn solid(color: Color) -> Paint<'static> {
    let mut paint = Paint {
        anti_alias: true,
        ..Paint::default()
    };
    paint.set_color(color);
    paint
}

/// A colour, each channel multiplied and then raised.
fn shade(color: [f32; 3], gain: [f32; 3], lift: f32) -> Color {
    let c = |i: usize| (color[i] * gain[i] + lift).clamp(0.0, 1.0);
    Color::from_rgba(c(0), c(1), c(2), 1.0).unwrap_or(Color::BLACK)
}

/// Straight alpha, a little grain, and the leaf's mean colour where nothing was painted: filters
/// then find no black to mix in.
fn finish(pixmap: &Pixmap, kind: &LeafKind) -> Painted {
    let mut rng = Rng::new(11, 0);
    let mut sum = [0u64; 3];
    let mut opaque = 0u64;
    for p in pixmap.pixels().iter().filter(|p| p.alpha() == 255) {
        sum = [
            sum[0] + u64::from(p.red()),
            sum[1] + u64::from(p.green()),
            sum[2] + u64::from(p.blue()),
        ];
        opaque += 1;
    }
    let mean = sum.map(|s| (s / opaque.max(1)) as u8);
    let mut texels = Vec::with_capacity(pixmap.pixels().len() * 4);
    for p in pixmap.pixels() {
        if p.alpha() < 8 {
            texels.extend_from_slice(&[mean[0], mean[1], mean[2], 0]);
            continue;
        }
        let c = p.demultiply();
        let grain = (6.0 * rng.sway() * (0.3 + kind.color_variation)) as i16;
        let speck = |x: u8| (i16::from(x) + grain).clamp(0, 255) as u8;
        texels.extend_from_slice(&[speck(c.red()), speck(c.green()), speck(c.blue()), c.alpha()]);
    }
    Painted {
        width: pixmap.width(),
        height: pixmap.height(),
        channels: 4,
        texels,
    }
}

/// A wave for hand-made relief: -1 to 1.
pub(super) fn wave(turns: f32) -> f32 {
    sin_cos(360.0 * (turns - turns.floor())).0
}
