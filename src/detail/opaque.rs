//! What of each foliage triangle is opaque: its share, and the outline that a card must hold.
//!
//! Leaf cards are mostly empty. A card that is trimmed to what is opaque wastes fewer texels and
//! draws fewer fragments. Triangles with the same texture coordinates share one answer.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use crate::botany::model::{AlphaMode, Model};
use crate::botany::tree::{Organ, Tree};
use crate::space::hull::convex_hull;
use crate::space::texture::{cutoff, nearest};

/// Samples along a triangle's edge.
const STEPS: usize = 16;

/// Least opaque share: a leaf whose samples all miss still has its place.
const LEAST_SHARE: f32 = 0.02;

/// Opaque share and outline of triangles.
pub struct Opaque {
    kind: Vec<u32>,
    kinds: Vec<Kind>,
}

/// Triangles that show the same part of the same texture.
#[derive(Clone, Debug, PartialEq)]
struct Kind {
    share: f32,
    /// Convex outline of the opaque part in barycentric weights of corners 1 and 2.
    outline: Vec<Vec2>,
}

impl Opaque {
    /// Samples the base colour's alpha of every foliage triangle.
    pub fn of(tree: &Tree) -> Self {
        let model = &tree.model;
        let whole = Kind {
            share: 1.0,
            outline: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
        };
        let mut kinds = vec![whole];
        // Only looked up, never iterated: its order reaches no output.
        let mut known: HashMap<(u32, [u32; 6]), u32> = HashMap::new();
        let kind = (0..model.triangles.len() as u32)
            .map(|t| {
                let object = model.triangle_object[t as usize] as usize;
                let material = model.objects[object].material;
                let m = &model.materials[material as usize];
                let texture = match m.base_color {
                    Some(texture)
                        if m.alpha_mode != AlphaMode::Opaque
                            && tree.organ[t as usize] == Organ::Foliage =>
                    {
                        texture
                    }
                    _ => return 0,
                };
                let uvs = &model.uvs[texture.uv_set as usize];
                let corners = model.triangles[t as usize].map(|i| uvs[i as usize]);
                let [a, b, c] = corners;
                let bits = [a.x, a.y, b.x, b.y, c.x, c.y].map(f32::to_bits);
                *known.entry((material, bits)).or_insert_with(|| {
                    let image = &model.images[texture.image as usize];
                    let opaque = |uv: Vec2| {
                        let alpha = f32::from(nearest(image, texture.wrap, uv)[3]) / 255.0;
                        alpha * m.base_color_factor[3] >= cutoff(m)
                    };
                    kinds.push(sample(corners, opaque));
                    kinds.len() as u32 - 1
                })
            })
            .collect();
        Self { kind, kinds }
    }

    /// Opaque share of a triangle's surface, above 0 to 1.
    pub fn share(&self, triangle: u32) -> f32 {
        self.kinds[self.kind[triangle as usize] as usize].share
    }

    /// Corners of a convex outline that holds the triangle's opaque part.
    pub fn outline<'a>(&'a self, model: &Model, triangle: u32) -> impl Iterator<Item = Vec3> + 'a {
        let [a, b, c] = model.corners(triangle);
        let kind = &self.kinds[self.kind[triangle as usize] as usize];
        kind.outline
            .iter()
            .map(move |w| a + (b - a) * w.x + (c - a) * w.y)
    }
}

fn sample(uv: [Vec2; 3], opaque: impl Fn(Vec2) -> bool) -> Kind {
    let step = 1.0 / STEPS as f32;
    let (mut hits, mut all, mut points) = (0u32, 0u32, Vec::new());
    for i in 0..STEPS {
        for j in 0..STEPS - i {
            let w = (Vec2::new(i as f32, j as f32) + 1.0 / 3.0) * step;
            all += 1;
            if opaque(uv[0] + (uv[1] - uv[0]) * w.x + (uv[2] - uv[0]) * w.y) {
                hits += 1;
                // The sample stands for its cell: all its corners are inside.
                for d in [
                    Vec2::new(-1.0, -1.0),
                    Vec2::new(2.0, -1.0),
                    Vec2::new(-1.0, 2.0),
                ] {
                    let p = (w + d / 3.0 * step).max(Vec2::ZERO);
                    let over = (p.x + p.y - 1.0).max(0.0) / 2.0;
                    points.push((p - over).max(Vec2::ZERO));
                }
            }
        }
    }
    if hits == 0 {
        points = vec![Vec2::ZERO, Vec2::X, Vec2::Y];
    }
    Kind {
        share: (hits as f32 / all as f32).max(LEAST_SHARE),
        outline: convex_hull(points),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The left half (u < 0.5) of a right triangle is three quarters of its area.
    #[test]
    fn half_a_texture_gives_its_share_and_outline() {
        let kind = sample([Vec2::ZERO, Vec2::X, Vec2::Y], |uv| uv.x < 0.5);
        assert!((kind.share - 0.75).abs() < 0.03, "{}", kind.share);
        let widest = kind.outline.iter().fold(0.0f32, |m, p| m.max(p.x));
        assert!((widest - 0.5).abs() < 1.5 / STEPS as f32, "{widest}");
    }

    #[test]
    fn an_empty_texture_keeps_the_whole_triangle() {
        let kind = sample([Vec2::ZERO, Vec2::X, Vec2::Y], |_| false);
        assert_eq!((kind.share, kind.outline.len()), (LEAST_SHARE, 3));
    }
}
