//! Which sub-trees are alike (Deng and others, "Memory Strategy").
//!
//! The paper lets a sub-tree be represented by another with "the same levels and similar number of leaves, as well as
//! similar number of child branches". Similar is here: within a tenth. That is a hint by counts: it
//! doesn't look at shapes, and no file of a package rests on it.

use std::collections::BTreeMap;

use crate::botany::tree::Tree;

/// Counts are similar within this share of the larger one.
const SIMILAR: f32 = 0.1;

/// For each sub-tree the first that is like it: itself where there is none before it.
pub fn representatives(tree: &Tree) -> Vec<u32> {
    let mut levels = vec![0u32; tree.subtrees.len()];
    for i in (1..tree.subtrees.len()).rev() {
        if let Some(parent) = tree.subtrees[i].parent {
            levels[parent as usize] = levels[parent as usize].max(levels[i] + 1);
        }
    }
    let counts = |i: usize| {
        let subtree = &tree.subtrees[i];
        [subtree.leaf_count, subtree.children.len() as u32]
    };
    // By order and levels; representatives of a class with their counts.
    let mut classes: BTreeMap<[u32; 2], Vec<(u32, [u32; 2])>> = BTreeMap::new();
    let all = (0..tree.subtrees.len()).map(|i| {
        let class = classes.entry([tree.subtrees[i].order, levels[i]]);
        let known = class.or_default();
        let counts = counts(i);
        let like = known.iter().find(|(_, other)| {
            let pairs = counts.iter().zip(other);
            pairs.fold(true, |all, (&a, &b)| all && similar(a, b))
        });
        like.map(|(first, _)| *first).unwrap_or_else(|| {
            known.push((i as u32, counts));
            i as u32
        })
    });
    all.collect()
}

fn similar(a: u32, b: u32) -> bool {
    a.abs_diff(b) as f32 <= SIMILAR * a.max(b) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::botany::tree::Subtree;

    #[test]
    fn sub_trees_of_one_order_with_similar_counts_are_alike() {
        let subtree =
            |parent: Option<u32>, order: u32, leaf_count: u32, children: &[u32]| Subtree {
                parent,
                order,
                leaf_count,
                children: children.to_vec(),
                ..Subtree::default()
            };
        let tree = Tree {
            subtrees: vec![
                subtree(None, 0, 400, &[1, 2, 3, 4, 5]),
                subtree(Some(0), 1, 100, &[6]),
                subtree(Some(0), 1, 91, &[7]), // within a tenth of 100
                subtree(Some(0), 1, 80, &[8]), // not
                subtree(Some(0), 1, 100, &[]), // carries nothing
                subtree(Some(0), 2, 100, &[]), // another order
                subtree(Some(1), 2, 10, &[]),
                subtree(Some(2), 2, 10, &[]),
                subtree(Some(3), 2, 20, &[]),
            ],
            ..Tree::default()
        };
        assert_eq!(representatives(&tree), [0, 1, 1, 3, 4, 5, 6, 6, 8]);
    }
}
