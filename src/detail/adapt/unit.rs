//! The binary hierarchy of leaf groups that the adaptive loop splits and merges.
//!
//! It follows the sub-trees, from single leaves over all leaves of a chain to the whole tree.
//! Where a sub-tree carries more than two things (leaves, child sub-trees), neighbours are joined
//! first: the things are halved at the median of their longest extent. Else a trunk with sixty
//! branches could only go from sixty groups to one.

use std::ops::Range;

use glam::Vec3;

use crate::botany::Tree;
use crate::botany::tree::NO_NODE;

/// A group of leaves in the hierarchy; lengths in normalised units.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Unit {
    /// Parent in the hierarchy; `None` at the root, which is the last unit.
    pub parent: Option<u32>,
    /// Two children, before their parent in the list, or none.
    pub children: Option<[u32; 2]>,
    /// The sub-tree that holds all its leaves.
    pub subtree: u32,
    /// Where the group grows from.
    pub connector: Vec3,
    /// Bounding box of its leaves.
    pub bounds: (Vec3, Vec3),
    /// Its leaves, as a range of [`Units::order`].
    pub leaves: Range<usize>,
}

/// All units of a tree; children come before their parents, and the root is the last.
#[derive(Clone, Debug, Default)]
pub struct Units {
    /// Every leaf once, ordered so that each unit's leaves are one range.
    pub order: Vec<u32>,
    /// The units; empty for a tree without leaves.
    pub units: Vec<Unit>,
}

impl Unit {
    /// Diagonal of the bounding box.
    pub fn size(&self) -> f32 {
        self.bounds.0.distance(self.bounds.1)
    }

    fn center(&self) -> Vec3 {
        (self.bounds.0 + self.bounds.1) / 2.0
    }
}

impl Units {
    /// Builds the hierarchy over [`Tree::subtrees`]; leaves that no sub-tree lists are joined to
    /// the whole tree.
    pub fn new(tree: &Tree) -> Self {
        let mut out = Self::default();
        let hanging = leaves_of_subtrees(tree);
        // What each sub-tree's children have handed up so far.
        let mut carried: Vec<Vec<u32>> = vec![Vec::new(); hanging.len()];
        for (at, leaves) in hanging.iter().enumerate().rev() {
            let mut things = std::mem::take(&mut carried[at]);
            things.reverse();
            let own = leaves.iter().map(|&l| out.push_leaf(tree, l, at as u32));
            things.extend(own.collect::<Vec<_>>());
            let Some(top) = out.join(&mut things, at as u32) else {
                continue;
            };
            if let Some(subtree) = tree.subtrees.get(at)
                && out.units[top as usize].subtree == at as u32
            {
                out.units[top as usize].connector = subtree.connector;
            }
            let parent = tree.subtrees.get(at).and_then(|s| s.parent);
            if let Some(parent) = parent {
                carried[parent as usize].push(top);
            }
        }
        out.number_leaves();
        out
    }

    /// The whole tree, or `None` without leaves.
    pub fn root(&self) -> Option<u32> {
        (self.units.len() as u32).checked_sub(1)
    }

    /// The leaves of a unit.
    pub fn leaves(&self, unit: u32) -> &[u32] {
        &self.order[self.units[unit as usize].leaves.clone()]
    }

    fn push_leaf(&mut self, tree: &Tree, leaf: u32, subtree: u32) -> u32 {
        let leaf_data = &tree.leaves[leaf as usize];
        let corners = leaf_data
            .triangles
            .iter()
            .flat_map(|&t| tree.model.corners(t));
        let (low, high) = corners.fold((Vec3::MAX, Vec3::MIN), |(a, b), p| (a.min(p), b.max(p)));
        let bounds = if low.cmple(high).all() {
            (low, high)
        } else {
            (leaf_data.center, leaf_data.center)
        };
        let node = match leaf_data.node {
            NO_NODE => None,
            node => tree.skeleton.nodes.get(node as usize),
        };
        let grown = tree.subtrees.get(subtree as usize).map(|s| s.connector);
        self.units.push(Unit {
            subtree,
            connector: node.map(|n| n.position).or(grown).unwrap_or(bounds.0),
            bounds,
            // The leaf's own number; `number_leaves` replaces it by its place in `order`.
            leaves: leaf as usize..leaf as usize + 1,
            ..Unit::default()
        });
        self.units.len() as u32 - 1
    }

    /// Joins things by halves at the median of their longest extent; `None` for no things.
    fn join(&mut self, things: &mut [u32], subtree: u32) -> Option<u32> {
        let [first, rest @ ..] = things else {
            return None;
        };
        if rest.is_empty() {
            return Some(*first);
        }
        let center = |units: &[Unit], i: u32| units[i as usize].center();
        let centers = things.iter().map(|&i| center(&self.units, i));
        let (low, high) = centers.fold((Vec3::MAX, Vec3::MIN), |(a, b), p| (a.min(p), b.max(p)));
        let axis = (high - low).max_position();
        let along = |i: u32| center(&self.units, i)[axis];
        things.sort_unstable_by(|&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
        let (left, right) = things.split_at_mut(things.len() / 2);
        let (a, b) = (self.join(left, subtree)?, self.join(right, subtree)?);
        let parent = self.units.len() as u32;
        let [left, right] = [a, b].map(|i| &self.units[i as usize]);
        let unit = Unit {
            children: Some([a, b]),
            subtree,
            connector: (left.connector + right.connector) / 2.0,
            bounds: (
                left.bounds.0.min(right.bounds.0),
                left.bounds.1.max(right.bounds.1),
            ),
            ..Unit::default()
        };
        self.units.push(unit);
        self.units[a as usize].parent = Some(parent);
        self.units[b as usize].parent = Some(parent);
        Some(parent)
    }

    /// Orders the leaves depth first, so that each unit holds a range of them.
    fn number_leaves(&mut self) {
        let mut stack: Vec<u32> = self.root().into_iter().collect();
        while let Some(at) = stack.pop() {
            let unit = &mut self.units[at as usize];
            let next = self.order.len();
            match unit.children {
                Some([a, b]) => {
                    unit.leaves = next..next;
                    stack.extend([b, a]);
                }
                None => {
                    self.order.push(unit.leaves.start as u32);
                    unit.leaves = next..next + 1;
                }
            }
        }
        for at in 0..self.units.len() {
            if let Some([_, b]) = self.units[at].children {
                self.units[at].leaves.end = self.units[b as usize].leaves.end;
            }
        }
    }
}

/// The leaves that hang on each sub-tree's own chain; the first sub-tree also takes the leaves
/// that none lists.
fn leaves_of_subtrees(tree: &Tree) -> Vec<Vec<u32>> {
    let mut listed = vec![false; tree.leaves.len()];
    let mut hanging: Vec<Vec<u32>> = Vec::with_capacity(tree.subtrees.len().max(1));
    for subtree in &tree.subtrees {
        let mut own = subtree.leaves.clone();
        own.retain(|&leaf| !std::mem::replace(&mut listed[leaf as usize], true));
        hanging.push(own);
    }
    if hanging.is_empty() {
        hanging.push(Vec::new());
    }
    let strays = (0..tree.leaves.len() as u32).filter(|&leaf| !listed[leaf as usize]);
    hanging[0].extend(strays.collect::<Vec<_>>());
    hanging
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::botany::tree::{Leaf, Organ, Subtree, TriangleList};

    /// A trunk with `branches` branches around it, each with `leaves` square leaves along it.
    pub fn sample_tree(branches: usize, leaves: usize) -> Tree {
        let mut tree = Tree::default();
        tree.subtrees.push(Subtree::default());
        for branch in 0..branches {
            let base = Vec3::Y * (branch as f32 / branches as f32 * 0.8 - 0.4);
            let (sin, cos) = (branch as f32 * 2.4).sin_cos();
            let out = Vec3::new(cos, 0.3, sin) * 0.6;
            let at = tree.subtrees.len() as u32;
            tree.subtrees[0].children.push(at);
            tree.subtrees.push(Subtree {
                parent: Some(0),
                order: 1,
                connector: base,
                ..Subtree::default()
            });
            for i in 0..leaves {
                let middle = base + out * (i as f32 + 1.0) / leaves as f32;
                // Leaves turn about their branch, so that no plane holds them all.
                let lean = Vec3::new((i as f32).sin(), 1.0, (i as f32 * 1.7).cos()).normalize();
                let leaf = push_leaf(&mut tree, middle, out.normalize(), lean);
                tree.subtrees[at as usize].leaves.push(leaf);
            }
        }
        tree
    }

    fn push_leaf(tree: &mut Tree, middle: Vec3, along: Vec3, lean: Vec3) -> u32 {
        let half_u = along * 0.02;
        let half_v = along.cross(lean).normalize() * 0.02;
        let first = tree.model.positions.len() as u32;
        let signs = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corner = |(a, b): (f32, f32)| middle + half_u * a + half_v * b;
        tree.model.positions.extend(signs.map(corner));
        let triangle = tree.model.triangles.len() as u32;
        tree.model.triangles.push([first, first + 1, first + 2]);
        tree.model.triangles.push([first, first + 2, first + 3]);
        tree.organ.extend([Organ::Foliage; 2]);
        tree.leaves.push(Leaf {
            triangles: TriangleList::from_slice(&[triangle, triangle + 1]),
            center: middle,
            area: 0.0016,
            node: NO_NODE,
            ..Leaf::default()
        });
        tree.leaves.len() as u32 - 1
    }

    #[test]
    fn every_unit_is_its_children_and_the_root_is_all() {
        let tree = sample_tree(7, 9);
        let units = Units::new(&tree);
        assert_eq!(units.units.len(), 2 * 63 - 1);
        let mut all = units.leaves(units.root().unwrap()).to_vec();
        all.sort_unstable();
        assert_eq!(all, (0..63).collect::<Vec<u32>>());
        for (at, unit) in units.units.iter().enumerate() {
            let Some([a, b]) = unit.children else {
                assert_eq!(unit.leaves.len(), 1);
                continue;
            };
            assert!((a as usize) < at && (b as usize) < at);
            assert_eq!(units.units[a as usize].parent, Some(at as u32));
            let both = [units.leaves(a), units.leaves(b)].concat();
            assert_eq!(both, units.leaves(at as u32));
        }
    }

    #[test]
    fn a_branch_is_one_unit_with_its_connector() {
        let tree = sample_tree(5, 8);
        let units = Units::new(&tree);
        for branch in 1..=5u32 {
            let mine = units
                .units
                .iter()
                .find(|u| u.subtree == branch && u.leaves.len() == 8);
            let mine = mine.expect("a unit for the branch");
            assert_eq!(mine.connector, tree.subtrees[branch as usize].connector);
        }
    }

    #[test]
    fn trees_without_leaves_or_hierarchy_are_fine() {
        assert_eq!(Units::new(&Tree::default()).root(), None);
        let mut loose = sample_tree(2, 3);
        loose.subtrees.clear();
        let units = Units::new(&loose);
        assert_eq!(units.leaves(units.root().unwrap()).len(), 6);
        // A leaf that two sub-trees list, and one that none does.
        let mut wrong = sample_tree(2, 3);
        wrong.subtrees[2].leaves[0] = 0;
        let units = Units::new(&wrong);
        let mut all = units.order.clone();
        all.sort_unstable();
        assert_eq!(all, (0..6).collect::<Vec<u32>>());
    }
}
