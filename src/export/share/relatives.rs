//! Self-similar sub-trees: a card that shows most of one is laid over the tile of another's of the same order, with about
//! as many leaves and children, connector on connector, turned and scaled as they are (Kratt 2014, 3.2, for copies of
//! sub-trees). The picture says whether they are alike; the card keeps its own place and plane, so its geometry does.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use super::kin::Kin;
use super::look::Look;
use super::window::Window;
use crate::export::chart::Chart;

/// Sub-trees seen along their axis can't be aligned: these show at least this share of it.
const ASIDE: f32 = 0.3;

/// Largest scale from one sub-tree to another.
const SCALE: f32 = 2.5;

/// Tiles of others that a card is laid over, at most, those with most nearly as many leaves.
const TRIED: usize = 32;

/// A sub-tree as its tile shows it. Lengths in texels.
struct Tile {
    connector: Vec2,
    reach: Vec2,
    /// Of the reach, were it not foreshortened.
    length: f32,
}

impl Tile {
    fn new(kin: &Kin, chart: &Chart) -> Self {
        let connector = chart.atlas_point(kin.connector);
        Self {
            connector,
            reach: chart.atlas_point(kin.connector + kin.reach) - connector,
            length: kin.reach.length() * chart.to_x.length(),
        }
    }
}

/// Tiles of sub-trees by their order, those with fewer leaves first.
pub struct Relatives {
    of_order: HashMap<u32, Vec<(Kin, Tile)>>,
}

impl Relatives {
    /// Those of cards that show a sub-tree.
    pub fn new<'a>(tiles: impl Iterator<Item = (Option<&'a Kin>, &'a Chart)>) -> Self {
        let mut of_order: HashMap<u32, Vec<(Kin, Tile)>> = HashMap::new();
        for (kin, chart) in tiles {
            if let Some(kin) = kin {
                let tile = Tile::new(kin, chart);
                of_order.entry(kin.order).or_default().push((*kin, tile));
            }
        }
        for tiles in of_order.values_mut() {
            tiles.sort_by_key(|(kin, _)| kin.leaves);
        }
        Self { of_order }
    }

    /// Windows onto those with most nearly as many leaves, from both sides.
    pub fn windows(&self, kin: &Kin, look: &Look, density: f32) -> Vec<Window> {
        let Some(tiles) = self.of_order.get(&kin.order) else {
            return Vec::new();
        };
        let middle = tiles.partition_point(|(other, _)| other.leaves < kin.leaves);
        let near = middle.saturating_sub(TRIED / 2)..tiles.len().min(middle + TRIED / 2);
        let like = tiles[near].iter().filter(|(other, _)| kin.is_like(other));
        like.flat_map(|(_, tile)| {
            [false, true].map(|mirrored| onto(kin, look, density, tile, mirrored))
        })
        .flatten()
        .collect()
    }
}

/// The window through which a card of a sub-tree shows another's tile, from the front or turned over; `None` where
/// one of them is seen along its axis, or they differ too much in size.
fn onto(kin: &Kin, look: &Look, density: f32, tile: &Tile, mirrored: bool) -> Option<Window> {
    let flat = |v: Vec3| {
        let [x, y] = look.axes.map(|axis| v.dot(axis) * density);
        Vec2::new(x, if mirrored { -y } else { y })
    };
    let from = flat(kin.connector - look.center);
    let along = flat(kin.reach);
    let length = kin.reach.length() * density;
    let scale = tile.length / length;
    let aside = along.length() > ASIDE * length && tile.reach.length() > ASIDE * tile.length;
    let turn = Vec2::from_angle(tile.reach.to_angle() - along.to_angle());
    (aside && scale < SCALE && scale > SCALE.recip()).then(|| Window {
        middle: tile.connector - turn.rotate(from) * scale,
        turn,
        mirrored,
        scale,
        difference: 0.0,
    })
}

#[cfg(test)]
mod tests {
    use super::super::window::tests::before;
    use super::*;
    use glam::Quat;

    fn branch(leaves: u32) -> Kin {
        let tile = before();
        Kin {
            order: 2,
            leaves,
            children: 1,
            connector: tile.corners[0],
            reach: (tile.corners[1] + tile.corners[2]) / 2.0 - tile.corners[0],
        }
    }

    #[test]
    fn a_sub_tree_is_laid_over_another_turned_scaled_and_from_both_sides() {
        let density = 9.0;
        let mut tile = before();
        tile.base = Vec2::splat(20.0);
        (tile.to_x, tile.to_y) = (tile.to_x * density, tile.to_y * density);
        let other = branch(10);
        let relatives = Relatives::new([(Some(&other), &tile), (None, &tile)].into_iter());
        // The same elsewhere, of half the size.
        let turn = Quat::from_rotation_y(0.8) * Quat::from_rotation_x(0.3);
        let away = |p: Vec3| Vec3::new(3.0, 1.0, -2.0) + turn * p * 0.5;
        let mut card = before();
        card.corners.iter_mut().for_each(|c| *c = away(*c));
        (card.normal, card.tangent) = (turn * card.normal, turn * card.tangent);
        let axes = [card.tangent, card.normal.cross(card.tangent)];
        let center = card.corners.iter().sum::<Vec3>() / 3.0;
        let look = Look {
            center,
            axes,
            outline: Vec::new(),
            points: Vec::new(),
        };
        let own = Kin {
            connector: away(other.connector),
            reach: turn * other.reach * 0.5,
            ..other
        };
        let found = relatives.windows(&own, &look, density);
        assert_eq!(
            found.iter().map(|w| w.mirrored).collect::<Vec<_>>(),
            [false, true]
        );
        for window in &found {
            assert!((window.scale - 2.0).abs() < 1e-4, "{window:?}");
            let flat = |p: Vec3| Vec2::from(axes.map(|axis| (p - center).dot(axis))) * density;
            for (at, onto) in [
                (own.connector, other.connector),
                (own.connector + own.reach, other.connector + other.reach),
            ] {
                let off = window.place(flat(at)).distance(tile.atlas_point(onto));
                assert!(off < 1e-2, "{off} {window:?}");
            }
        }
        // Another order, three times as many leaves, many more children: not alike.
        for strange in [
            Kin { order: 3, ..own },
            Kin { leaves: 30, ..own },
            Kin { children: 9, ..own },
        ] {
            assert_eq!(relatives.windows(&strange, &look, density), []);
        }
        // Seen along its axis it can't be aligned.
        let along = Kin {
            reach: card.normal,
            ..own
        };
        assert_eq!(relatives.windows(&along, &look, density), []);
    }
}
