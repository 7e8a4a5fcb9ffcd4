//! What cards look like: the pictures that windows are compared by.

use glam::{Vec2, Vec3};

use super::cards::{Cards, Of};
use super::fitted::{Fitted, Seen};
use crate::export::chart::{Chart, Shape};
use crate::space::hull;

/// A card as it should look: points on it and what is there.
#[derive(Clone, Debug)]
pub struct Look {
    /// Middle of the card.
    pub center: Vec3,
    /// The card's axes: its tangent, and the normal times it.
    pub axes: [Vec3; 2],
    /// Its corners along these axes, in texels of the new page, from the middle.
    pub outline: Vec<Vec2>,
    /// Points inside of it, likewise, and what is there.
    pub points: Vec<(Vec2, Seen)>,
}

impl Look {
    /// That of a fitted card, sampled once for each texel at `density` texels a normalised unit.
    pub fn new(fitted: Fitted, chart: &Chart, density: f32) -> Self {
        let axes = [chart.tangent, chart.normal.cross(chart.tangent)];
        let center = chart.corners.iter().sum::<Vec3>() / chart.corners.len() as f32;
        let flat = |p: Vec3| Vec2::from(axes.map(|axis| (p - center).dot(axis))) * density;
        let outline: Vec<Vec2> = chart.corners.iter().map(|&c| flat(c)).collect();
        let low = outline.iter().fold(Vec2::MAX, |m, &c| m.min(c));
        let high = outline.iter().fold(Vec2::MIN, |m, &c| m.max(c));
        let [w, h] = (high - low)
            .to_array()
            .map(|side| side.ceil().max(1.0) as u32);
        let all = (0..w * h).map(|i| low + Vec2::new((i % w) as f32 + 0.5, (i / w) as f32 + 0.5));
        let point = |q: Vec2| {
            let place = center + (axes[0] * q.x + axes[1] * q.y) / density;
            (q, fitted.at(chart, place))
        };
        let mut points: Vec<(Vec2, Seen)> = all
            .filter(|&q| hull::holds(&outline, q, 0.0))
            .map(point)
            .collect();
        if points.is_empty() {
            // Narrower than a texel.
            points.push(point(Vec2::ZERO));
        }
        Self {
            center,
            axes,
            outline,
            points,
        }
    }

    /// Mean squared difference of an empty card from it; above 0.
    pub fn of_empty(&self) -> f32 {
        let all = self
            .points
            .iter()
            .map(|(_, seen)| seen.difference(Seen::default()));
        (all.sum::<f32>() / self.points.len() as f32).max(1e-6)
    }
}

/// A page of kept tiles, on which windows are searched.
#[derive(Clone, Debug)]
pub struct Page {
    /// Width and height in texels.
    pub size: [u32; 2],
    /// What its texels should show.
    pub texels: Vec<Seen>,
    /// Those that belong to a card.
    pub owned: Vec<u32>,
}

impl Page {
    /// The tiles of `kept` charts, which are those of the cards `own`.
    pub(super) fn new(trees: &[Cards], own: &[Of], kept: &[Chart], size: [u32; 2]) -> Self {
        let mut texels = vec![Seen::default(); (size[0] * size[1]) as usize];
        let mut owned = Vec::new();
        for (of, chart) in own.iter().zip(kept) {
            let (fitted, before) = (of.fitted(trees), of.before(trees));
            for (y, &length) in (0..).zip(&chart.row_lengths()) {
                for x in 0..length {
                    let point = chart.point(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                    let [ax, ay] = chart.in_atlas(x, y);
                    let at = ay * size[0] + ax;
                    texels[at as usize] = fitted.at(before, point);
                    owned.push(at);
                }
            }
        }
        Self {
            size,
            texels,
            owned,
        }
    }
}

/// Makes texel y point to the left of texel x, and the tangent along x on the page: pieces of such
/// tiles may be shown by cards that lie elsewhere, and their normals still hold.
pub fn upright(mut chart: Chart) -> Chart {
    let axes = [chart.tangent, chart.normal.cross(chart.tangent)];
    let [x, y] = [chart.to_x, chart.to_y].map(|to| Vec2::from(axes.map(|axis| to.dot(axis))));
    if x.perp_dot(y) < 0.0 {
        std::mem::swap(&mut chart.to_x, &mut chart.to_y);
        chart.base = Vec2::new(chart.base.y, chart.base.x);
        chart.size.reverse();
        debug_assert!(!matches!(chart.shape, Shape::Mask(_)));
        let along = chart.normal.cross(chart.to_y).normalize_or(chart.tangent);
        chart.tangent = along * along.dot(chart.to_x).signum();
    }
    chart
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::card::Card;

    #[test]
    fn upright_tiles_show_the_same_with_normals_along_the_page() {
        let outlines = [
            [(0.0, 0.0), (2.0, 0.0), (0.0, 1.0)],
            [(0.0, 0.0), (1.0, 0.0), (0.0, 2.0)],
            [(0.0, 0.0), (1.0, 0.3), (0.2, 1.0)],
        ];
        for outline in outlines {
            let card = Card {
                origin: Vec3::ONE,
                u: Vec3::Y,
                v: Vec3::Z,
                outline: outline.map(Vec2::from).to_vec(),
            };
            let before = Chart::new(&card, 10.0, 1.0);
            let chart = upright(before.clone());
            let right = chart.texel(Vec3::ONE + chart.tangent) - chart.texel(Vec3::ONE);
            assert!(right.x > 1.0 && right.y.abs() < 1e-4, "{right}");
            let up = chart.normal.cross(chart.tangent);
            assert!(chart.texel(Vec3::ONE + up).y > chart.texel(Vec3::ONE).y);
            assert_eq!(
                (chart.normal, &chart.corners),
                (before.normal, &before.corners)
            );
            let areas = [&before, &chart].map(|c| c.size[0] * c.size[1]);
            assert_eq!(areas[0], areas[1]);
            for &corner in &chart.corners {
                let texel = chart.texel(corner);
                let [x, y] = [texel.x as u32, texel.y as u32];
                assert!(chart.owns(x, y), "{texel} of {:?}", chart.size);
            }
        }
    }
}
