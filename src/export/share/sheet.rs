//! The contact sheet: tiles with the cards that show pieces of them.

use std::sync::Arc;

use glam::Vec2;

use crate::botany::model::Image;
use crate::export::chart::{Chart, Shape};
use crate::space::hull;

/// Side of a picture, pixels.
const CELL: u32 = 96;

/// Pictures in a row: a tile, and as many of its copies.
const COLUMNS: u32 = 12;

/// Most rows.
const ROWS: usize = 32;

const PAPER: [u8; 4] = [255; 4];
const CARD: [u8; 4] = [214, 222, 232, 255];
const TILE: [u8; 4] = [232, 222, 196, 255];

/// One row for each tile that others show pieces of, most copies first: the tile on sand, then
/// copies on blue, each in the shape of its card and as large as it fits. `owners` are those of
/// [`owners`](super::owners), `page` is the level's base colour with alpha.
pub fn sheet(charts: &[Chart], owners: &[Option<u32>], page: &Image) -> Image {
    let mut copies: Vec<(u32, Vec<u32>)> = Vec::new();
    for (copy, owner) in (0..).zip(owners) {
        let Some(owner) = *owner else { continue };
        match copies.iter_mut().find(|(tile, _)| *tile == owner) {
            Some((_, copies)) => copies.push(copy),
            None => copies.push((owner, vec![copy])),
        }
    }
    copies.sort_by_key(|(tile, copies)| (std::cmp::Reverse(copies.len()), *tile));
    copies.truncate(ROWS);
    let widest = copies
        .iter()
        .map(|(_, copies)| copies.len() as u32 + 1)
        .max();
    let columns = widest.unwrap_or(1).min(COLUMNS);
    let (width, height) = (CELL * columns, CELL * copies.len().max(1) as u32);
    let mut rgba = PAPER.repeat((width * height) as usize);
    for (row, (tile, copies)) in (0..).zip(&copies) {
        let cards = std::iter::once(tile).chain(copies).take(columns as usize);
        for (column, &card) in (0..).zip(cards) {
            let chart = &charts[card as usize];
            draw(chart, page, |x, y, pixel| {
                let at = ((row * CELL + y) * width + column * CELL + x) as usize * 4;
                rgba[at..at + 4].copy_from_slice(&pixel);
            });
        }
    }
    Image {
        name: "sharing".into(),
        width,
        height,
        rgba: Arc::new(rgba),
    }
}

/// Draws a card, seen from its front, in a cell.
fn draw(chart: &Chart, page: &Image, mut put: impl FnMut(u32, u32, [u8; 4])) {
    let axes = [chart.tangent, chart.normal.cross(chart.tangent)];
    let flat = |i: usize| Vec2::from(axes.map(|a| (chart.corners[i] - chart.origin).dot(a)));
    let outline: Vec<Vec2> = (0..chart.corners.len()).map(flat).collect();
    let low = outline.iter().fold(Vec2::MAX, |m, &c| m.min(c));
    let high = outline.iter().fold(Vec2::MIN, |m, &c| m.max(c));
    let scale = (high - low).max_element().max(1e-9) / (CELL - 4) as f32;
    let ground = if chart.shape == Shape::Window {
        CARD
    } else {
        TILE
    };
    for (x, y) in (0..CELL).flat_map(|y| (0..CELL).map(move |x| (x, y))) {
        let offset = Vec2::new(x as f32, y as f32) + 0.5 - CELL as f32 / 2.0;
        let q = (low + high) / 2.0 + offset * scale;
        if !hull::holds(&outline, q, 0.0) {
            continue;
        }
        let texel = chart.atlas_point(chart.origin + axes[0] * q.x + axes[1] * q.y);
        let (tx, ty) = (texel.x.max(0.0) as u32, texel.y.max(0.0) as u32);
        let at = (ty.min(page.height - 1) * page.width + tx.min(page.width - 1)) as usize * 4;
        let [r, g, b, a] = [0, 1, 2, 3].map(|k| page.rgba[at + k]);
        put(x, y, if a >= 128 { [r, g, b, 255] } else { ground });
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::owners;
    use super::*;

    /// A square card of 8 texels, its left upper corner at `left` and `top` of the page.
    fn chart(left: u32, top: u32, shape: Shape) -> Chart {
        let corners = [(0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)];
        Chart {
            corners: corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
            normal: Vec3::Z,
            tangent: Vec3::X,
            origin: Vec3::ZERO,
            to_x: Vec3::X,
            to_y: Vec3::Y,
            base: Vec2::ZERO,
            size: [8, 8],
            shape,
            place: [left, top],
            turned: false,
        }
    }

    /// Two tiles side by side on a page whose right half is red, and a copy that shows five columns of
    /// the right one and three of the left.
    fn shared() -> (Vec<Chart>, Image) {
        let charts = vec![
            chart(0, 0, Shape::Whole),
            chart(8, 0, Shape::Whole),
            chart(5, 0, Shape::Window),
        ];
        let texel = |i: u32| match i % 16 < 8 {
            true => [0; 4],
            false => [255, 0, 0, 255],
        };
        let page = Image {
            name: "page".into(),
            width: 16,
            height: 8,
            rgba: Arc::new((0..16 * 8).flat_map(texel).collect()),
        };
        (charts, page)
    }

    #[test]
    fn a_copy_belongs_to_the_tile_that_it_shows_most_of() {
        let (charts, page) = shared();
        let size = [page.width, page.height];
        assert_eq!(owners(&charts, size), [None, None, Some(1)]);
        // One that shows no tile at all still names one.
        let lost = [charts[0].clone(), chart(8, 0, Shape::Window)];
        assert_eq!(owners(&lost, size), [None, Some(0)]);
    }

    #[test]
    fn a_row_shows_the_tile_and_then_its_copy() {
        let (charts, page) = shared();
        let sheet = sheet(&charts, &owners(&charts, [16, 8]), &page);
        // The other tile has no copies, so there is one row.
        assert_eq!((sheet.width, sheet.height), (2 * CELL, CELL));
        let pixel = |x: u32, y: u32| {
            let at = ((y * sheet.width + x) * 4) as usize;
            [0, 1, 2, 3].map(|k| sheet.rgba[at + k])
        };
        let red = [255, 0, 0, 255];
        assert_eq!(pixel(CELL / 2, CELL / 2), red);
        // Of the copy three columns of eight are transparent, the rest is red; around it is paper.
        assert_eq!(pixel(CELL + CELL / 4, CELL / 2), CARD);
        assert_eq!(pixel(CELL + CELL / 2, CELL / 2), red);
        assert_eq!(pixel(CELL, 0), PAPER);
    }
}
