//! Orthographic projection of a group of elements on its card: supersampled, z-buffered.
//!
//! Each texel gets the share of its sub-samples that the group covers (alpha tested as the
//! original's material says) and the mean of what is seen there, from the front of the card.

use glam::{Vec2, Vec3};

use super::chart::Chart;
use crate::botany::model::{Material, Model};
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

/// Projects `triangles` on the card of `chart` with `samples` x `samples` sub-samples a texel.
pub fn project(
    model: &Model,
    triangles: impl Iterator<Item = u32>,
    chart: &Chart,
    samples: u32,
) -> Projection {
    let [w, h] = chart.size;
    let (sw, sh) = (w * samples, h * samples);
    let mut hits = vec![NOTHING; (sw * sh) as usize];
    for t in triangles {
        draw(model, t, chart, samples as f32, [sw, sh], &mut hits);
    }
    let mut texels = Vec::with_capacity((w * h) as usize);
    for y in 0..h {
        for x in 0..w {
            let rows = (y * samples..(y + 1) * samples).map(|r| {
                let from = (r * sw + x * samples) as usize;
                &hits[from..from + samples as usize]
            });
            texels.push(resolve(model, chart, rows.flatten(), samples * samples));
        }
    }
    Projection { texels }
}

fn draw(model: &Model, t: u32, chart: &Chart, samples: f32, [sw, sh]: [u32; 2], hits: &mut [Hit]) {
    let corners = model.corners(t);
    let p = corners.map(|c| chart.texel(c) * samples);
    let depth = corners.map(|c| (c - chart.origin).dot(chart.normal));
    let double_area = (p[1] - p[0]).perp_dot(p[2] - p[0]);
    if double_area.abs() < 1e-12 {
        return;
    }
    let material = model.material_of(t);
    let cutoff = cutoff(material);
    let low = p[0].min(p[1]).min(p[2]).max(Vec2::ZERO);
    let high = p[0].max(p[1]).max(p[2]);
    let x_end = (high.x.ceil().max(0.0) as u32).min(sw);
    let y_end = (high.y.ceil().max(0.0) as u32).min(sh);
    for y in low.y as u32..y_end {
        for x in low.x as u32..x_end {
            let q = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - p[0];
            let b = q.perp_dot(p[2] - p[0]) / double_area;
            let c = (p[1] - p[0]).perp_dot(q) / double_area;
            if b < 0.0 || c < 0.0 || b + c > 1.0 {
                continue;
            }
            let d = depth[0] + b * (depth[1] - depth[0]) + c * (depth[2] - depth[0]);
            let hit = &mut hits[(y * sw + x) as usize];
            if d > hit.depth && alpha(model, material, t, b, c) >= cutoff {
                *hit = Hit {
                    depth: d,
                    triangle: t,
                    weights: Vec2::new(b, c),
                };
            }
        }
    }
}

fn mix2(values: &[Vec2], corners: [u32; 3], b: f32, c: f32) -> Vec2 {
    let [v0, v1, v2] = corners.map(|i| values[i as usize]);
    v0 + (v1 - v0) * b + (v2 - v0) * c
}

fn alpha(model: &Model, material: &Material, t: u32, b: f32, c: f32) -> f32 {
    let Some(texture) = material.base_color else {
        return 1.0;
    };
    let uv = mix2(
        &model.uvs[texture.uv_set as usize],
        model.triangles[t as usize],
        b,
        c,
    );
    let texel = nearest(&model.images[texture.image as usize], texture.wrap, uv);
    f32::from(texel[3]) / 255.0 * material.base_color_factor[3]
}

fn resolve<'a>(
    model: &Model,
    chart: &Chart,
    hits: impl Iterator<Item = &'a Hit>,
    all: u32,
) -> Texel {
    let mut sum = Texel::default();
    let mut covered = 0u32;
    for hit in hits.filter(|h| h.triangle != u32::MAX) {
        let seen = shade(model, chart, hit);
        sum.color += seen.color;
        sum.normal += seen.normal;
        sum.orm += seen.orm;
        covered += 1;
    }
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

fn shade(model: &Model, chart: &Chart, hit: &Hit) -> Texel {
    let t = hit.triangle;
    let corners = model.triangles[t as usize];
    let (b, c) = (hit.weights.x, hit.weights.y);
    let material = model.material_of(t);
    let sample = |texture: crate::botany::model::TextureRef| {
        let uv = mix2(&model.uvs[texture.uv_set as usize], corners, b, c);
        nearest(&model.images[texture.image as usize], texture.wrap, uv)
    };
    let factor = material.base_color_factor;
    let mut color = Vec3::new(factor[0], factor[1], factor[2]);
    if let Some(texture) = material.base_color {
        let texel = sample(texture);
        color *= Vec3::new(linear(texel[0]), linear(texel[1]), linear(texel[2]));
    }
    if !model.colors.is_empty() {
        let [c0, c1, c2] = corners.map(|i| Vec3::from_slice(&model.colors[i as usize][..3]));
        color *= c0 + (c1 - c0) * b + (c2 - c0) * c;
    }
    let mut orm = Vec3::new(1.0, material.roughness_factor, material.metallic_factor);
    if let Some(texture) = material.metallic_roughness {
        let texel = sample(texture);
        orm.y *= f32::from(texel[1]) / 255.0;
        orm.z *= f32::from(texel[2]) / 255.0;
    }
    if let Some(texture) = material.occlusion {
        let red = f32::from(sample(texture)[0]) / 255.0;
        orm.x = 1.0 + material.occlusion_strength * (red - 1.0);
    }
    Texel {
        coverage: 1.0,
        color,
        normal: card_normal(model, chart, t, b, c),
        orm,
    }
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
