//! Which cards need a texture for each side.
//!
//! One texture serves both sides of most cards: the crown behind it looks like the crown before it. Where
//! leaves have pale undersides, or flowers only look out of the crown, the sides differ, and the
//! card is drawn twice, a hair apart: each side hides the other. (Deng bakes a texture for each side of every
//! billboard.)

use glam::Vec3;
use rayon::prelude::*;

use super::chart::Chart;
use super::foliage::CardGroup;
use super::project::{Texel, project};
use crate::botany::model::Model;
use crate::space::lab::lab;

/// Difference of the mean colours of two sides, CIE delta E 1976, from which it is seen: 2 is just
/// visible side by side, and the two sides of a card never are.
pub const VISIBLE_DELTA_E: f32 = 8.0;

/// Texels along the longest edge of a card where its mean colours are taken.
const SIDE: f32 = 24.0;

/// For each card how far the mean colours of its sides are apart, CIE delta E 1976.
pub fn differences(model: &Model, groups: &[&CardGroup]) -> Vec<f32> {
    let of_card = |group: &&CardGroup| difference(model, group);
    groups.par_iter().map(of_card).collect()
}

fn difference(model: &Model, group: &CardGroup) -> f32 {
    let corners: Vec<Vec3> = group.card.corners().collect();
    let next = corners.iter().cycle().skip(1);
    let edges = corners.iter().zip(next).map(|(a, b)| a.distance(*b));
    let longest = edges.fold(0.0, f32::max);
    if !(longest > 0.0 && longest.is_finite()) {
        return 0.0;
    }
    let front = Chart::rectangle(&group.card, SIDE / longest, 0.0);
    let seen = [front.back(), front].map(|chart| {
        let triangles = group.triangles.iter().copied();
        mean_color(&project(model, triangles, &chart, 1).texels)
    });
    match seen {
        [Some(back), Some(front)] => {
            let [back, front] = [back, front].map(|c| Vec3::from(lab(c.to_array())));
            back.distance(front)
        }
        // Too thin for any sample.
        _ => 0.0,
    }
}

/// Mean linear colour of what is covered.
fn mean_color(texels: &[Texel]) -> Option<Vec3> {
    let covered: f32 = texels.iter().map(|t| t.coverage).sum();
    let sum: Vec3 = texels.iter().map(|t| t.color * t.coverage).sum();
    (covered > 0.0).then(|| sum / covered)
}

#[cfg(test)]
pub(crate) mod tests {
    use glam::Vec2;

    use super::*;
    use crate::botany::model::{Material, Object};
    use crate::cloud::card::Card;
    use crate::export::atlas::Layout;
    use crate::export::foliage::{BakeOptions, Foliage};
    use crate::recipe::Packer;

    /// A right triangle: red in front, and green behind where `backs` says so, else the same sheet from
    /// both sides.
    pub(crate) fn leaf(backs: bool) -> (Model, CardGroup) {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let material = |color: [f32; 4]| Material {
            base_color_factor: color,
            double_sided: !backs,
            ..Material::default()
        };
        let model = Model {
            positions: corners.to_vec(),
            normals: vec![Vec3::Z; 3],
            uvs: [vec![Vec2::ZERO; 3], Vec::new()],
            triangles: [[0, 2, 1], [0, 1, 2]][usize::from(!backs)..].to_vec(),
            triangle_object: [1, 0][usize::from(!backs)..].to_vec(),
            objects: vec![
                Object::default(),
                Object {
                    material: 1,
                    ..Object::default()
                },
            ],
            materials: vec![
                material([1.0, 0.0, 0.0, 1.0]),
                material([0.0, 1.0, 0.0, 1.0]),
            ],
            ..Model::default()
        };
        let card = Card {
            origin: Vec3::ZERO,
            u: Vec3::X,
            v: Vec3::Y,
            outline: vec![Vec2::ZERO, Vec2::X, Vec2::Y],
        };
        let triangles = (0..model.triangles.len() as u32).collect();
        (model, CardGroup { card, triangles })
    }

    #[test]
    fn a_leaf_with_a_green_back_differs_and_one_sheet_does_not() {
        let (model, group) = leaf(true);
        // Red and green of sRGB are 170 apart.
        let found = differences(&model, &[&group])[0];
        assert!((found - 170.6).abs() < 1.0, "{found}");
        let (model, group) = leaf(false);
        assert_eq!(differences(&model, &[&group]), [0.0]);
    }

    #[test]
    fn a_point_without_extent_has_no_sides() {
        let (model, mut group) = leaf(true);
        group.card.outline = vec![Vec2::ZERO; 3];
        assert_eq!(differences(&model, &[&group]), [0.0]);
    }

    #[test]
    fn each_side_hides_the_other_and_both_have_one_outline() {
        let (model, group) = leaf(true);
        let options = BakeOptions {
            layout: Layout {
                density: 40.0,
                pad: 1.0,
                packer: Packer::Rectangles,
            },
            samples: 2,
        };
        let mut foliage = Foliage::bake(&model, &[group], &[0], options);
        foliage.threshold(0.5, 30);
        foliage.add_backs(0.01);
        let [front, back] = &foliage.charts[..] else {
            panic!("{} charts", foliage.charts.len());
        };
        assert!(front.corners.iter().all(|c| (c.z - 0.005).abs() < 1e-6));
        assert!(back.corners.iter().all(|c| (c.z + 0.005).abs() < 1e-6));
        let at = |chart: &Chart, p: Vec3| {
            let [x, y] = chart.atlas_point(p).to_array().map(|t| t as usize);
            let texel = y * foliage.size[0] as usize + x;
            (foliage.texels.color(texel), foliage.alpha[texel])
        };
        for i in 0..40 {
            for j in 0..40 {
                let p = (Vec3::X * i as f32 + Vec3::Y * j as f32) / 40.0 + Vec3::splat(1.0 / 80.0);
                if p.x + p.y > 1.0 {
                    continue;
                }
                let ((red, a), (green, b)) = (at(front, p), at(back, p));
                assert_eq!(a, b, "{p}");
                if a == 255 {
                    assert!(red.x > 0.99 && red.y < 0.01, "{p}: {red}");
                    assert!(green.y > 0.99 && green.x < 0.01, "{p}: {green}");
                }
            }
        }
        // Counter-clockwise, seen from the side that they show.
        for chart in [front, back] {
            let [a, b, c] = [0, 1, 2].map(|i| chart.corners[i]);
            assert!((b - a).cross(c - a).dot(chart.normal) > 0.0);
        }
    }
}
