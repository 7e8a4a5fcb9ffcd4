//! Paints bark: a relief that tiles, then colour by height and a normal map by slope.

use super::paint::{Painted, wave};
use super::rng::Rng;
use super::species::{Bark, Pattern};

/// Texels along each side.
const SIZE: u32 = 512;

/// Height of the relief at a slope of one, in texels.
const RELIEF: f32 = 14.0;

/// Colour and normal map of a bark.
pub(super) fn paint_bark(bark: &Bark) -> [Painted; 2] {
    let height = relief(bark.pattern);
    let broad = Noise::new(5, 3, 3);
    let fine = Noise::new(6, 64, 64);
    let mut color = Vec::with_capacity((SIZE * SIZE * 3) as usize);
    let mut normal = Vec::with_capacity(color.capacity());
    for y in 0..SIZE {
        for x in 0..SIZE {
            let (u, v) = (x as f32 / SIZE as f32, y as f32 / SIZE as f32);
            let h = height[(y * SIZE + x) as usize];
            let light = 1.0 + 0.16 * (broad.at(u, v) - 0.5) + 0.14 * (fine.at(u, v) - 0.5);
            for i in 0..3 {
                let mix = bark.deep[i] + (bark.color[i] - bark.deep[i]) * h;
                color.push((255.0 * (mix * light).clamp(0.0, 1.0)).round() as u8);
            }
            let at = |x: u32, y: u32| height[((y % SIZE) * SIZE + x % SIZE) as usize];
            let dx = at(x + 1, y) - at(x + SIZE - 1, y);
            let dy = at(x, y + 1) - at(x, y + SIZE - 1);
            // glTF: green points up, rows go down.
            let n = glam::Vec3::new(-dx, dy, 2.0 / RELIEF).normalize();
            normal.extend(n.to_array().map(|c| (127.5 + 127.5 * c).round() as u8));
        }
    }
    [color, normal].map(|texels| Painted {
        width: SIZE,
        height: SIZE,
        channels: 3,
        texels,
    })
}

/// The relief, 0 (deep) to 1 (high), row by row.
fn relief(pattern: Pattern) -> Vec<f32> {
    let warp = Noise::new(1, 4, 6);
    let ridge = Noise::new(2, 22, 4);
    let break_up = Noise::new(3, 16, 18);
    let grain = Noise::new(4, 48, 40);
    let plates = Noise::new(8, 9, 14);
    let marks = Noise::new(9, 5, 44);
    let mut out = Vec::with_capacity((SIZE * SIZE) as usize);
    for y in 0..SIZE {
        for x in 0..SIZE {
            let (u, v) = (x as f32 / SIZE as f32, y as f32 / SIZE as f32);
            let w = 0.10 * (warp.at(u, v) - 0.5);
            let g = grain.at(u, v);
            let h = match pattern {
                Pattern::Furrowed => {
                    // Noise passes one half along lines: there the furrows run, long and upright,
                    // and cross cracks break the ridges into plates.
                    let furrow = (2.0 * ridge.at(u + w, v + 0.3 * w) - 1.0).abs();
                    let crack = (2.0 * break_up.at(u + 0.5 * w, v + w) - 1.0).abs();
                    let plate =
                        smooth(furrow, 0.02, 0.38) * (0.55 + 0.45 * smooth(crack, 0.0, 0.2));
                    plate * (0.75 + 0.25 * g)
                }
                Pattern::Scaly => {
                    let edge = (2.0 * plates.at(u + w, v) - 1.0).abs();
                    let edge = edge.min((2.0 * break_up.at(u, v + w) - 1.0).abs() * 1.6);
                    smooth(edge, 0.02, 0.3) * (0.75 + 0.25 * g)
                }
                Pattern::Papery => {
                    let mark = smooth(marks.at(u, v + 0.2 * w), 0.74, 0.84);
                    let scar = smooth(plates.at(u + w, v + w), 0.82, 0.92);
                    (1.0 - mark.max(scar)) * (0.9 + 0.1 * g)
                }
                Pattern::Ringed => {
                    let ring = 0.5 + 0.5 * wave(7.0 * v + 0.6 * w);
                    smooth(ring, 0.05, 0.45) * (0.7 + 0.3 * break_up.at(u, v)) * (0.8 + 0.2 * g)
                }
            };
            out.push(h.clamp(0.0, 1.0));
        }
    }
    out
}

/// Hermite step from `low` to `high`.
fn smooth(x: f32, low: f32, high: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Value noise that tiles, two octaves; 0 to 1.
struct Noise {
    columns: u32,
    rows: u32,
    values: Vec<f32>,
    finer: Vec<f32>,
}

impl Noise {
    fn new(stream: u64, columns: u32, rows: u32) -> Self {
        let mut rng = Rng::new(97, stream);
        let mut fill = |n: u32| (0..n).map(|_| rng.unit()).collect();
        Self {
            columns,
            rows,
            values: fill(columns * rows),
            finer: fill(4 * columns * rows),
        }
    }

    fn at(&self, u: f32, v: f32) -> f32 {
        let coarse = lattice(&self.values, self.columns, self.rows, u, v);
        let fine = lattice(&self.finer, 2 * self.columns, 2 * self.rows, u, v);
        0.68 * coarse + 0.32 * fine
    }
}

/// Smoothly interpolated lattice values.
fn lattice(values: &[f32], columns: u32, rows: u32, u: f32, v: f32) -> f32 {
    let (x, y) = (
        u.rem_euclid(1.0) * columns as f32,
        v.rem_euclid(1.0) * rows as f32,
    );
    let (i, j) = (x as u32, y as u32);
    let at = |i: u32, j: u32| values[((j % rows) * columns + i % columns) as usize];
    let (s, t) = (
        smooth(x - i as f32, 0.0, 1.0),
        smooth(y - j as f32, 0.0, 1.0),
    );
    let top = at(i, j) + (at(i + 1, j) - at(i, j)) * s;
    let bottom = at(i, j + 1) + (at(i + 1, j + 1) - at(i, j + 1)) * s;
    top + (bottom - top) * t
}
