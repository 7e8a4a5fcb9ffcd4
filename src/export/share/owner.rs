//! Whose texels a copy shows.

use glam::Vec2;

use crate::export::chart::{Chart, Shape};
use crate::space::hull;

/// For each card that shows texels of others, the card that has most of them.
pub fn owners(charts: &[Chart], size: [u32; 2]) -> Vec<Option<u32>> {
    if charts.iter().all(|chart| chart.shape != Shape::Window) {
        return vec![None; charts.len()];
    }
    // The owner of each texel of the page, by its number from 1; 0: nobody.
    let mut owner = vec![0u32; (size[0] * size[1]) as usize];
    for (number, chart) in (1..).zip(charts) {
        each_owned(chart, |x, y| owner[(y * size[0] + x) as usize] = number);
    }
    let of_copy = |chart: &Chart| {
        let outline: Vec<Vec2> = chart.corners.iter().map(|&c| chart.texel(c)).collect();
        let [w, h] = chart.size;
        let inside = (0..w * h).filter(|i| {
            hull::holds(
                &outline,
                Vec2::new((i % w) as f32 + 0.5, (i / w) as f32 + 0.5),
                0.0,
            )
        });
        let mut seen: Vec<u32> = inside
            .filter_map(|i| {
                let [x, y] = chart.in_atlas(i % w, i / w);
                owner[(y * size[0] + x) as usize].checked_sub(1)
            })
            .collect();
        seen.sort_unstable();
        let most = seen.chunk_by(|a, b| a == b).max_by_key(|run| run.len());
        // Narrower than a texel, or beside all tiles: no tile has most, any will do.
        let any = || {
            (0..)
                .zip(charts)
                .find(|(_, c)| c.shape != Shape::Window)
                .map(|(i, _)| i)
        };
        most.map(|run| run[0]).or_else(any)
    };
    let copy = |chart: &Chart| {
        (chart.shape == Shape::Window)
            .then(|| of_copy(chart))
            .flatten()
    };
    charts.iter().map(copy).collect()
}

fn each_owned(chart: &Chart, mut visit: impl FnMut(u32, u32)) {
    let [w, h] = chart.size;
    for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
        if chart.owns(x, y) {
            let [ax, ay] = chart.in_atlas(x, y);
            visit(ax, ay);
        }
    }
}
