//! What texels show that several cards share: the mean of all of them.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::cards::{Cards, all_of};
use crate::export::chart::{Chart, Shape};
use crate::export::foliage::{CardGroup, Foliage};
use crate::export::project::{Texel, project};
use crate::export::texel::Stored;
use crate::space::hull;

/// Copies that are drawn before what they show is added up: where a few tiles stand for thousands of cards, all of it
/// together is several times a page.
const AT_ONCE: usize = 256;

/// Makes every texel the mean of all cards that show it: coverage of all, colours and normals of what
/// covers it. A texel where only copies have leaves would be black otherwise.
pub(super) fn add_copies(foliage: &mut Foliage, trees: &[Cards]) {
    let all = foliage.charts.iter().zip(all_of(trees));
    let copies: Vec<_> = all.filter(|(c, _)| c.shape == Shape::Window).collect();
    let width = foliage.size[0];
    // For each texel the number of its sum, from 1; 0 where no copy shows it.
    let mut numbers = vec![0u32; foliage.texels.len()];
    let mut sums: Vec<Sum> = Vec::new();
    for some in copies.chunks(AT_ONCE) {
        let drawn: Vec<Vec<(usize, Texel)>> = some
            .par_iter()
            .map(|&(chart, of)| shown_by(chart, of.group(trees), &trees[of.tree as usize], width))
            .collect();
        // One after the other: those of one texel are added in the order of their cards.
        for (at, texel) in drawn.into_iter().flatten() {
            if numbers[at] == 0 {
                sums.push(Sum::new(&foliage.texels.at(at)));
                numbers[at] = sums.len() as u32;
            }
            sums[numbers[at] as usize - 1].add(&texel);
        }
    }
    for (at, &number) in numbers.iter().enumerate() {
        if let Some(sum) = (number as usize).checked_sub(1).map(|i| &sums[i]) {
            let mean = sum.mean(&foliage.texels.at(at));
            foliage.texels.set(at, mean.into());
        }
    }
}

/// What cards show on a texel.
struct Sum {
    /// Colour, normal and light, each weighted by coverage.
    values: [Vec3; 3],
    /// Coverage.
    mass: f32,
    cards: u32,
}

impl Sum {
    /// What the texel's own card shows.
    fn new(stored: &Stored) -> Self {
        let mass = stored.coverage();
        Self {
            values: [stored.color(), stored.normal(), stored.orm()].map(|v| v * mass),
            mass,
            cards: 1,
        }
    }

    fn add(&mut self, texel: &Texel) {
        let values = [texel.color, texel.normal, texel.orm];
        for (sum, value) in self.values.iter_mut().zip(values) {
            *sum += value * texel.coverage;
        }
        self.mass += texel.coverage;
        self.cards += 1;
    }

    /// The mean of all cards; what none covers looks as its own card does.
    fn mean(&self, own: &Stored) -> Texel {
        let [color, normal, orm] = match self.mass > 0.0 {
            true => self.values.map(|sum| sum / self.mass),
            false => [own.color(), own.normal(), own.orm()],
        };
        Texel {
            coverage: self.mass / self.cards as f32,
            color,
            normal,
            orm,
        }
    }
}

/// What a copy's own leaves show on the texels that it shows, by their index on the page.
fn shown_by(chart: &Chart, group: &CardGroup, cards: &Cards, width: u32) -> Vec<(usize, Texel)> {
    let triangles = group.triangles.iter().copied();
    let drawn = project(cards.model, triangles, chart, cards.samples);
    let outline: Vec<Vec2> = chart.corners.iter().map(|&c| chart.texel(c)).collect();
    let [w, h] = chart.size;
    let all = (0..w * h).map(|i| (i, Vec2::new((i % w) as f32 + 0.5, (i / w) as f32 + 0.5)));
    all.filter(|&(_, texel)| hull::holds(&outline, texel, 0.0))
        .map(|(i, _)| {
            let [ax, ay] = chart.in_atlas(i % w, i / w);
            ((ay * width + ax) as usize, drawn.texels[i as usize])
        })
        .collect()
}
