//! Self-similar sub-trees: a card that shows most of one is laid over the tile of another's of the same order, with about
//! as many leaves and children, connector on connector, turned and scaled as they are (Kratt 2014, 3.2, for copies of
//! sub-trees). The picture says whether they are alike; the card keeps its own place and plane, so its geometry does.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use super::look::Look;
use super::window::Window;
use crate::botany::tree::{NO_NODE, Tree};
use crate::export::chart::Chart;
use crate::export::foliage::CardGroup;

/// The sub-tree that a card shows. Lengths in normalised units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kin {
    /// Branch order.
    pub order: u32,
    /// Leaves on it and all that it carries.
    pub leaves: u32,
    /// Sub-trees that it carries itself.
    pub children: u32,
    /// Where it is connected.
    pub connector: Vec3,
    /// From there to the middle of all of it.
    pub reach: Vec3,
}

/// Share of a card's triangles that one sub-tree has to have.
const MOST: f64 = 0.6;

/// Sub-trees seen along their axis can't be aligned: these show at least this share of it.
const ASIDE: f32 = 0.3;

/// Largest scale from one sub-tree to another.
const SCALE: f32 = 2.5;

/// Tiles of others that a card is laid over, at most, those with most nearly as many leaves.
const TRIED: usize = 32;

/// For each card the smallest sub-tree that has most of what it shows; none where that is a trunk or the whole tree.
pub fn kin(tree: &Tree, groups: &[CardGroup]) -> Vec<Option<Kin>> {
    let of_triangle = subtree_of_triangle(tree);
    let of = |group: &CardGroup| {
        let mut counts: HashMap<u32, usize> = HashMap::new();
        for &t in &group.triangles {
            let mut at = of_triangle[t as usize];
            while let Some(subtree) = at {
                *counts.entry(subtree).or_default() += 1;
                at = tree.subtrees[subtree as usize].parent;
            }
        }
        let least = MOST * group.triangles.len() as f64;
        let most = counts.into_iter().filter(|&(_, n)| n as f64 >= least);
        // No two of them are beside each other, and children come after their parents.
        let subtree = &tree.subtrees[most.map(|(i, _)| i).max()? as usize];
        (subtree.order > 0 && subtree.parent.is_some()).then(|| Kin {
            order: subtree.order,
            leaves: subtree.leaf_count,
            children: subtree.children.len() as u32,
            connector: subtree.connector,
            reach: subtree.sphere.0 - subtree.connector,
        })
    };
    groups.iter().map(of).collect()
}

/// For each triangle the sub-tree on whose own chain it is.
fn subtree_of_triangle(tree: &Tree) -> Vec<Option<u32>> {
    let mut of_chain = HashMap::new();
    let mut of_triangle = vec![None; tree.model.triangles.len()];
    for (i, subtree) in (0u32..).zip(&tree.subtrees) {
        of_chain.extend(subtree.chain.map(|chain| (chain, i)));
        let leaves = subtree
            .leaves
            .iter()
            .map(|&leaf| &tree.leaves[leaf as usize]);
        for &t in leaves.flat_map(|leaf| &leaf.triangles) {
            of_triangle[t as usize] = Some(i);
        }
    }
    for (of, &node) in of_triangle.iter_mut().zip(&tree.wood_node) {
        if node != NO_NODE {
            let chain = tree.skeleton.nodes[node as usize].chain;
            *of = of_chain.get(&chain).copied();
        }
    }
    of_triangle
}

impl Kin {
    /// Whether another is of the same order and has about as many leaves and children: at most half as many again.
    fn is_like(&self, other: &Self) -> bool {
        let near = |a: u32, b: u32| 2 * a.max(b) <= 3 * a.min(b) + 4;
        self.order == other.order
            && near(self.leaves, other.leaves)
            && near(self.children, other.children)
    }

    /// The window through which a card of this sub-tree shows another's tile, from the front or turned over; `None` where
    /// one of them is seen along its axis, or they differ too much in size.
    fn onto(
        &self,
        other: &Self,
        look: &Look,
        density: f32,
        tile: &Tile,
        mirrored: bool,
    ) -> Option<Window> {
        let flat = |v: Vec3| {
            let [x, y] = look.axes.map(|axis| v.dot(axis) * density);
            Vec2::new(x, if mirrored { -y } else { y })
        };
        let from = flat(self.connector - look.center);
        let along = flat(self.reach);
        let (own, others) = (
            self.reach.length() * density,
            other.reach.length() * tile.density,
        );
        let scale = others / own;
        let aside = along.length() > ASIDE * own && tile.reach.length() > ASIDE * others;
        let turn = Vec2::from_angle(tile.reach.to_angle() - along.to_angle());
        (aside && scale < SCALE && scale > SCALE.recip()).then(|| Window {
            middle: tile.connector - turn.rotate(from) * scale,
            turn,
            mirrored,
            scale,
            difference: 0.0,
        })
    }
}

/// A sub-tree as its tile shows it. Lengths in texels.
struct Tile {
    connector: Vec2,
    reach: Vec2,
    /// Texels a normalised unit.
    density: f32,
}

impl Tile {
    fn new(kin: &Kin, chart: &Chart) -> Self {
        let connector = chart.atlas_point(kin.connector);
        Self {
            connector,
            reach: chart.atlas_point(kin.connector + kin.reach) - connector,
            density: chart.to_x.length(),
        }
    }
}

/// Tiles of sub-trees by their order, those with fewer leaves first.
pub(super) struct Relatives {
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
        like.flat_map(|(other, tile)| {
            [false, true].map(|mirrored| kin.onto(other, look, density, tile, mirrored))
        })
        .flatten()
        .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::window::tests::before;
    use super::*;
    use glam::Quat;
    use std::path::Path;

    use crate::botany::grow::{Options, Species, grow};
    use crate::botany::load::{Limits, load_slice};
    use crate::botany::recognise::{RecogniseOptions, recognise};

    fn oak() -> Tree {
        let options = Options {
            leaves: Some(300),
            ..Options::default()
        };
        let grown = grow(&Species::named("oak").unwrap(), &options).unwrap();
        let model = load_slice(&grown.glb, Path::new("oak.glb"), &Limits::default()).unwrap();
        recognise(model, &RecogniseOptions::default()).unwrap()
    }

    fn showing(tree: &Tree, leaves: impl Iterator<Item = u32>) -> CardGroup {
        CardGroup {
            triangles: leaves
                .flat_map(|l| tree.leaves[l as usize].triangles.clone())
                .collect(),
            ..CardGroup::default()
        }
    }

    fn leaves_of(tree: &Tree, subtree: usize) -> Vec<u32> {
        let subtree = &tree.subtrees[subtree];
        let below = subtree
            .children
            .iter()
            .flat_map(|&c| leaves_of(tree, c as usize));
        subtree.leaves.iter().copied().chain(below).collect()
    }

    #[test]
    fn a_card_shows_the_smallest_sub_tree_that_has_most_of_it() {
        let tree = oak();
        let forks = |&i: &usize| {
            let subtree = &tree.subtrees[i];
            let largest = subtree
                .children
                .iter()
                .map(|&c| tree.subtrees[c as usize].leaf_count)
                .max();
            let is_small = 4 * subtree.leaf_count < tree.leaves.len() as u32;
            subtree.order > 0
                && is_small
                && largest.is_some_and(|most| 2 * most < subtree.leaf_count)
        };
        let i = (0..tree.subtrees.len()).find(forks).unwrap();
        let (twig, own) = (&tree.subtrees[i], leaves_of(&tree, i));
        assert_eq!(own.len(), twig.leaf_count as usize);
        // Some of a card may be of others.
        let other = (0..tree.leaves.len() as u32).find(|l| !own.contains(l));
        let everywhere = 0..tree.leaves.len() as u32;
        let groups = [
            showing(&tree, own.iter().copied().chain(other)),
            showing(&tree, everywhere),
            CardGroup::default(),
        ];
        let found = kin(&tree, &groups);
        let kin = found[0].unwrap();
        assert_eq!((kin.order, kin.leaves), (twig.order, twig.leaf_count));
        assert_eq!(kin.children as usize, twig.children.len());
        assert_eq!(kin.connector, twig.connector);
        assert_eq!(found[1..], [None, None]);
    }

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
