//! Orthographic projection of a group of elements on its card: supersampled, z-buffered.
//!
//! Each texel gets the share of its sub-samples that the group covers (alpha tested as the
//! original's material says) and the mean of what is seen there, from the front of the card.

use std::ops::Range;

use glam::{Vec2, Vec3};

use super::chart::Chart;
use crate::botany::model::{Image, Model, TextureRef, Wrap};
use crate::space::texture::{cutoff, linear, nearest};

/// What one texel of a card shows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Texel {
    /// Covered share, 0 to 1.
    pub coverage: f32,
    /// Mean linear colour of the covered part.
    pub color: Vec3,
    /// Mean normal of the covered part in the card's frame (tangent, bitangent, normal).
    pub normal: Vec3,
    /// Mean occlusion, roughness, metalness of the covered part.
    pub orm: Vec3,
}

/// A chart's texels, row by row.
#[derive(Clone, Debug, Default)]
pub struct Projection {
    /// `size[0] * size[1]` texels of the chart.
    pub texels: Vec<Texel>,
}

/// One sub-sample: the depth along the card's normal and what was hit there.
#[derive(Clone, Copy)]
struct Hit {
    depth: f32,
    triangle: u32,
    /// Barycentric weights of corners 1 and 2.
    weights: Vec2,
}

const NOTHING: Hit = Hit {
    depth: f32::MIN,
    triangle: u32::MAX,
    weights: Vec2::ZERO,
};

/// Sub-samples that are drawn at a time, about: of a large card all together are many times its texels, and these stay in the
/// nearest caches.
const AT_ONCE: u32 = 1 << 16;

/// Projects `triangles` on the card of `chart` with `samples` x `samples` sub-samples a texel.
pub fn project(
    model: &Model,
    triangles: impl Iterator<Item = u32>,
    chart: &Chart,
    samples: u32,
) -> Projection {
    let [w, h] = chart.size;
    let width = w * samples;
    let triangles: Vec<Drawn> = triangles
        .filter_map(|t| Drawn::new(model, t, chart, samples))
        .collect();
    let band = (AT_ONCE / (width * samples).max(1)).max(1);
    let mut hits = Vec::new();
    let mut texels = Vec::with_capacity((w * h) as usize);
    for first in (0..h).step_by(band as usize) {
        let texel_rows = first..(first + band).min(h);
        let rows = texel_rows.start * samples..texel_rows.end * samples;
        hits.clear();
        hits.resize((width * (rows.end - rows.start)) as usize, NOTHING);
        for triangle in &triangles {
            triangle.draw(model, width, rows.clone(), &mut hits);
        }
        for y in 0..texel_rows.end - texel_rows.start {
            for x in 0..w {
                let rows = (y * samples..(y + 1) * samples).map(|r| {
                    let from = (r * width + x * samples) as usize;
                    &hits[from..from + samples as usize]
                });
                texels.push(resolve(model, chart, rows.flatten(), samples * samples));
            }
        }
    }
    Projection { texels }
}

/// A triangle on the card's grid of sub-samples.
struct Drawn {
    triangle: u32,
    /// Its corners there.
    corners: [Vec2; 3],
    /// Their depths along the card's normal.
    depths: [f32; 3],
    /// The rows that it reaches; they may go on below the card's last.
    rows: Range<u32>,
}

impl Drawn {
    /// `None`: seen edge-on.
    fn new(model: &Model, t: u32, chart: &Chart, samples: u32) -> Option<Self> {
        let corners = model.corners(t);
        let p = corners.map(|c| chart.texel(c) * samples as f32);
        if (p[1] - p[0]).perp_dot(p[2] - p[0]).abs() < 1e-12 {
            return None;
        }
        let behind = behind(model, t, corners, chart);
        let (low, high) = (p[0].min(p[1]).min(p[2]), p[0].max(p[1]).max(p[2]));
        Some(Self {
            triangle: t,
            corners: p,
            depths: corners.map(|c| (c - chart.origin).dot(chart.normal) - behind),
            rows: low.y.max(0.0) as u32..high.y.ceil().max(0.0) as u32,
        })
    }

    /// Draws those of its rows that are asked for, each of which has `width` sub-samples.
    fn draw(&self, model: &Model, width: u32, rows: Range<u32>, hits: &mut [Hit]) {
        let asked = self.rows.start.max(rows.start)..self.rows.end.min(rows.end);
        if asked.is_empty() {
            return;
        }
        let [p, q, r] = self.corners;
        let (side, other) = (q - p, r - p);
        let double_area = side.perp_dot(other);
        let alpha = AlphaTest::of(model, self.triangle);
        // Barycentric weights of corners 1 and 2: what they gain from a sample to the next.
        let right = Vec2::new(other.y, -side.y) / double_area;
        let down = Vec2::new(-other.x, side.x) / double_area;
        let low = p.min(q).min(r).max(Vec2::ZERO).x as u32;
        let high = (p.max(q).max(r).x.ceil().max(0.0) as u32).min(width);
        let [a, b, c] = self.depths;
        for y in asked {
            let first = Vec2::new(0.5 - p.x, y as f32 + 0.5 - p.y);
            let row = right * first.x + down * first.y;
            let [from, to] = inside(row, right, [low, high]);
            for x in from..to {
                let weights = row + right * x as f32;
                if weights.min_element() < 0.0 || weights.element_sum() > 1.0 {
                    continue;
                }
                let depth = a + weights.dot(Vec2::new(b - a, c - a));
                let hit = &mut hits[((y - rows.start) * width + x) as usize];
                if depth > hit.depth && alpha.passes(weights) {
                    *hit = Hit {
                        depth,
                        triangle: self.triangle,
                        weights,
                    };
                }
            }
        }
    }
}

/// How far a triangle steps back, normalised units: the back of a sheet of which only the front is drawn
/// shows nothing where another sheet lies in its place, as two sheets make a leaf of two colours.
const BACK_STEP: f32 = 1e-5;

fn behind(model: &Model, t: u32, [a, b, c]: [Vec3; 3], chart: &Chart) -> f32 {
    let turned = || (b - a).cross(c - a).dot(chart.normal) < 0.0;
    match model.material_of(t).double_sided {
        false if turned() => BACK_STEP,
        _ => 0.0,
    }
}

/// The samples of a row that may be inside a triangle, one more on each side than there are: where
/// both weights and what they leave for corner 0 are not negative.
fn inside(row: Vec2, right: Vec2, [from, to]: [u32; 2]) -> [u32; 2] {
    let (mut low, mut high) = (from as f32, to as f32);
    let third = (1.0 - row.element_sum(), -right.element_sum());
    for (value, slope) in [(row.x, right.x), (row.y, right.y), third] {
        let crossing = -value / slope;
        if slope > 0.0 {
            low = low.max(crossing - 1.0);
        } else if slope < 0.0 {
            high = high.min(crossing + 2.0);
        } else if value < 0.0 {
            return [0, 0];
        }
    }
    // Not a number where a sliver divides by almost nothing: then all are tried.
    let first = if low > from as f32 { low as u32 } else { from };
    let last = if high < to as f32 {
        high.max(0.0) as u32
    } else {
        to
    };
    [first.min(to), last.min(to)]
}

/// The alpha test of a triangle, by the nearest texel.
pub struct AlphaTest<'a> {
    /// `None`: everything passes or nothing does, by `least`.
    image: Option<(&'a Image, [Wrap; 2])>,
    uv: Vec2,
    /// Change of the texture coordinate with the weights of corners 1 and 2.
    along: [Vec2; 2],
    /// Least alpha of a texel that passes, 0 to 255.
    least: f32,
}

impl<'a> AlphaTest<'a> {
    /// That of triangle `t`.
    pub fn of(model: &'a Model, t: u32) -> Self {
        let material = model.material_of(t);
        let factor = material.base_color_factor[3];
        // Compared as `alpha / 255 * factor >= cutoff`.
        let least = match cutoff(material) {
            cutoff if cutoff <= 0.0 => f32::MIN,
            cutoff => cutoff * 255.0 / factor.max(1e-9),
        };
        let texture = material.base_color.filter(|_| least > 0.0);
        let [a, b, c] = match texture {
            Some(texture) => {
                let uvs = &model.uvs[usize::from(texture.uv_set)];
                model.triangles[t as usize].map(|i| uvs[i as usize])
            }
            None => [Vec2::ZERO; 3],
        };
        Self {
            image: texture.map(|t| (&model.images[t.image as usize], t.wrap)),
            uv: a,
            along: [b - a, c - a],
            least,
        }
    }

    /// Whether the triangle is there at the point with these weights of corners 1 and 2.
    pub fn passes(&self, weights: Vec2) -> bool {
        let alpha = self.image.map_or(255, |(image, wrap)| {
            let uv = self.uv + self.along[0] * weights.x + self.along[1] * weights.y;
            nearest(image, wrap, uv)[3]
        });
        f32::from(alpha) >= self.least
    }
}

fn mix2(values: &[Vec2], corners: [u32; 3], b: f32, c: f32) -> Vec2 {
    let [v0, v1, v2] = corners.map(|i| values[i as usize]);
    v0 + (v1 - v0) * b + (v2 - v0) * c
}

fn resolve<'a>(
    model: &Model,
    chart: &Chart,
    hits: impl Iterator<Item = &'a Hit>,
    all: u32,
) -> Texel {
    let mut sum = Texel::default();
    let mut covered = 0u32;
    // Neighbouring samples of one triangle: its colour varies, its normal hardly does.
    let mut run: Option<Run> = None;
    for hit in hits.filter(|h| h.triangle != u32::MAX) {
        sum.color += color(model, hit);
        covered += 1;
        match &mut run {
            Some(run) if run.triangle == hit.triangle => run.add(hit),
            _ => {
                let done = run.replace(Run::of(hit));
                done.into_iter()
                    .for_each(|r| r.shade(model, chart, &mut sum));
            }
        }
    }
    run.into_iter()
        .for_each(|r| r.shade(model, chart, &mut sum));
    if covered == 0 {
        return sum;
    }
    let n = covered as f32;
    Texel {
        coverage: n / all as f32,
        color: sum.color / n,
        normal: sum.normal.normalize_or(Vec3::Z),
        orm: sum.orm / n,
    }
}

/// Samples of one triangle within a texel.
struct Run {
    triangle: u32,
    /// Sum of their weights.
    weights: Vec2,
    count: f32,
}

impl Run {
    fn of(hit: &Hit) -> Self {
        Self {
            triangle: hit.triangle,
            weights: hit.weights,
            count: 1.0,
        }
    }

    fn add(&mut self, hit: &Hit) {
        self.weights += hit.weights;
        self.count += 1.0;
    }

    /// Adds normal, occlusion, roughness and metalness in their middle, once for each sample.
    fn shade(&self, model: &Model, chart: &Chart, sum: &mut Texel) {
        let weights = self.weights / self.count;
        sum.normal += card_normal(model, chart, self.triangle, weights.x, weights.y) * self.count;
        sum.orm += orm(model, self.triangle, weights) * self.count;
    }
}

fn sample(model: &Model, texture: TextureRef, t: u32, weights: Vec2) -> [u8; 4] {
    let uvs = &model.uvs[usize::from(texture.uv_set)];
    let uv = mix2(uvs, model.triangles[t as usize], weights.x, weights.y);
    nearest(&model.images[texture.image as usize], texture.wrap, uv)
}

/// Linear base colour at a sample.
fn color(model: &Model, hit: &Hit) -> Vec3 {
    let t = hit.triangle;
    let material = model.material_of(t);
    let factor = material.base_color_factor;
    let mut color = Vec3::new(factor[0], factor[1], factor[2]);
    if let Some(texture) = material.base_color {
        let texel = sample(model, texture, t, hit.weights);
        color *= Vec3::new(linear(texel[0]), linear(texel[1]), linear(texel[2]));
    }
    if !model.colors.is_empty() {
        let corner = |i: u32| Vec3::from_slice(&model.colors[i as usize][..3]);
        let [c0, c1, c2] = model.triangles[t as usize].map(corner);
        color *= c0 + (c1 - c0) * hit.weights.x + (c2 - c0) * hit.weights.y;
    }
    color
}

/// Occlusion, roughness and metalness.
fn orm(model: &Model, t: u32, weights: Vec2) -> Vec3 {
    let material = model.material_of(t);
    let mut orm = Vec3::new(1.0, material.roughness_factor, material.metallic_factor);
    if let Some(texture) = material.metallic_roughness {
        let texel = sample(model, texture, t, weights);
        orm.y *= f32::from(texel[1]) / 255.0;
        orm.z *= f32::from(texel[2]) / 255.0;
    }
    if let Some(texture) = material.occlusion {
        let red = f32::from(sample(model, texture, t, weights)[0]) / 255.0;
        orm.x = 1.0 + material.occlusion_strength * (red - 1.0);
    }
    orm
}

/// The shading normal in the card's frame, turned to the side from which the card is seen.
fn card_normal(model: &Model, chart: &Chart, t: u32, b: f32, c: f32) -> Vec3 {
    let corners = model.triangles[t as usize];
    let [n0, n1, n2] = corners.map(|i| model.normals[i as usize]);
    let [p0, p1, p2] = model.corners(t);
    let face = (p1 - p0).cross(p2 - p0);
    let mut normal = (n0 + (n1 - n0) * b + (n2 - n0) * c).normalize_or(face.normalize_or(Vec3::Y));
    if face.dot(chart.normal) < 0.0 {
        normal = -normal;
    }
    let bitangent = chart.normal.cross(chart.tangent);
    Vec3::new(
        normal.dot(chart.tangent),
        normal.dot(bitangent),
        normal.dot(chart.normal).max(0.1),
    )
    .normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sides::tests::leaf;

    #[test]
    fn a_card_that_is_drawn_some_rows_at_a_time_has_no_seams() {
        let (model, group) = leaf(false);
        let chart = Chart::new(&group.card, 300.0, 0.0);
        let [width, height] = chart.size;
        assert!(width * height * 16 > 8 * AT_ONCE);
        let drawn = project(&model, group.triangles.iter().copied(), &chart, 4);
        let rows = drawn.texels.chunks(width as usize);
        let rows: Vec<f32> = rows
            .map(|row| row.iter().map(|texel| texel.coverage).sum())
            .collect();
        // A right triangle with legs of 300 texels: each row has one more than the next, or one less.
        let area: f32 = rows.iter().sum();
        assert!((area - 45_000.0).abs() < 50.0, "{area}");
        let steps = rows.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        let uneven = steps.filter(|step| (step - 1.0).abs() > 0.26).count();
        assert!(uneven <= 2, "{uneven} of {} rows", rows.len());
    }
}
