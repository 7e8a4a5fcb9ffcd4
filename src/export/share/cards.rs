//! The cards of the trees that share a page.

use super::fitted::Fitted;
use super::kin::Kin;
use super::lone::Lone;
use crate::botany::model::Model;
use crate::export::chart::Chart;
use crate::export::foliage::CardGroup;

/// The cards of a tree's level, how they are drawn, and what they look like on a page of their own.
#[derive(Clone, Copy)]
pub struct Cards<'a> {
    /// The tree.
    pub model: &'a Model,
    /// Its cards.
    pub groups: &'a [CardGroup],
    /// Texels a normalised unit of this tree that the level should have.
    pub density: f32,
    /// Sub-samples a texel along each axis.
    pub samples: u32,
    /// Gutter on each side of a chart, texels.
    pub pad: f32,
    /// Cards that show one leaf.
    pub lone: &'a [Option<Lone>],
    /// Sub-trees that cards show.
    pub kin: &'a [Option<Kin>],
    /// The level with texels of its own.
    pub fitted: Fitted<'a>,
}

/// A card of one of the trees that share a page.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Of {
    pub tree: u32,
    pub card: u32,
}

impl Of {
    pub fn group<'a>(self, trees: &[Cards<'a>]) -> &'a CardGroup {
        &trees[self.tree as usize].groups[self.card as usize]
    }

    /// Its chart where it has texels of its own.
    pub fn before<'a>(self, trees: &[Cards<'a>]) -> &'a Chart {
        &trees[self.tree as usize].fitted.foliage.charts[self.card as usize]
    }

    /// Its only leaf, and the tree and family that it belongs to.
    pub fn lone<'a>(self, trees: &'a [Cards<'a>]) -> Option<((u32, u32), &'a Lone)> {
        let lone = trees[self.tree as usize]
            .lone
            .get(self.card as usize)?
            .as_ref()?;
        Some(((self.tree, lone.family), lone))
    }

    /// The sub-tree that it shows, if most of it is of one.
    pub fn kin<'a>(self, trees: &[Cards<'a>]) -> Option<&'a Kin> {
        let kin = trees[self.tree as usize].kin;
        kin.get(self.card as usize)?.as_ref()
    }

    pub fn fitted<'a>(self, trees: &[Cards<'a>]) -> Fitted<'a> {
        trees[self.tree as usize].fitted
    }
}

/// Every card of all trees, tree by tree.
pub(super) fn all_of(trees: &[Cards]) -> Vec<Of> {
    let of_tree = |(tree, cards): (u32, &Cards)| {
        (0..cards.groups.len() as u32).map(move |card| Of { tree, card })
    };
    (0..).zip(trees).flat_map(of_tree).collect()
}
