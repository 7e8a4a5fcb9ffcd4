//! Which sub-tree a card shows, and which sub-trees are like each other.

use std::collections::HashMap;

use glam::Vec3;

use crate::botany::tree::{NO_NODE, Tree};
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
    pub fn is_like(&self, other: &Self) -> bool {
        let near = |a: u32, b: u32| 2 * a.max(b) <= 3 * a.min(b) + 4;
        self.order == other.order
            && near(self.leaves, other.leaves)
            && near(self.children, other.children)
    }
}

#[cfg(test)]
mod tests {
    use super::super::lone::tests::{oak, showing};
    use super::*;

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
        let tree = oak(300);
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
}
