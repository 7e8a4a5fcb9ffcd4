//! The sub-trees of one species in the order of a walk, so that a sub-tree is a range of nodes.

use glam::Vec3;

/// A sub-tree as the manifest holds it. Lengths are in the tree's own units (metres).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Subtree {
    /// The sub-tree that carries it; it comes earlier in the list. `None` for the whole tree.
    pub parent: Option<u32>,
    /// Centre of the bounding sphere.
    pub center: Vec3,
    /// Radius of the bounding sphere.
    pub radius: f32,
    /// Leaves on it and on all that it carries.
    pub leaves: u32,
    /// From this distance on it is drawn as a whole. The distance at which its billboard's texels
    /// have the size of pixels (Deng's optimal distance), or at which its error is small enough.
    pub switch_distance: f32,
    /// Unit direction of the order-1 branch that it belongs to; zero for trunk and whole tree.
    pub branch: Vec3,
    /// Density of that branch's siblings, 0 (alone) to 1 (what is behind them is hidden).
    pub density: f32,
    /// What grows on its own branch (leaves, wood), where it carries other branches as well.
    pub own: Option<OwnLeaves>,
}

/// What grows on a sub-tree's own branch: leaves, and the branch's wood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnLeaves {
    /// Centre of the bounding sphere.
    pub center: Vec3,
    /// Radius of the bounding sphere.
    pub radius: f32,
    /// From this distance on a billboard stands for them, nearer their geometry.
    pub switch_distance: f32,
}

impl Default for Subtree {
    fn default() -> Self {
        Self {
            parent: None,
            center: Vec3::ZERO,
            radius: 1.0,
            leaves: 0,
            switch_distance: 0.0,
            branch: Vec3::ZERO,
            density: 0.0,
            own: None,
        }
    }
}

/// What a traversal reads of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Centre of the bounding sphere.
    pub center: Vec3,
    /// Its radius.
    pub radius: f32,
    /// Nearer than this the node is opened: children, or geometry, stand for it.
    pub switch_distance: f32,
    /// Unit direction of the order-1 branch; zero where there is none.
    pub branch: Vec3,
    /// Density of that branch's siblings, 0 to 1.
    pub density: f32,
    /// The node after the last one under this one.
    pub end: u32,
}

/// What a node stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Origin {
    /// Index of the sub-tree in the list that the hierarchy was made from.
    pub subtree: u32,
    /// Only the leaves on its own branch, not those of the branches that it carries.
    pub own: bool,
    /// Parent node; the root is its own.
    pub parent: u32,
    /// Leaves under the node.
    pub leaves: u32,
}

/// The nodes of one species: parents first, everything under a node right behind it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hierarchy {
    nodes: Vec<Node>,
    origins: Vec<Origin>,
    center: Vec3,
    radius: f32,
}

/// Why a list of sub-trees is no hierarchy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Flaw {
    /// Index of the sub-tree.
    pub subtree: usize,
    /// Its field.
    pub field: &'static str,
    /// What is wrong with it.
    pub what: &'static str,
}

impl std::fmt::Display for Flaw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "subtrees[{}].{}: {}",
            self.subtree, self.field, self.what
        )
    }
}

impl std::error::Error for Flaw {}

impl Hierarchy {
    /// Orders sub-trees for traversal.
    ///
    /// # Errors
    /// A [`Flaw`] where numbers are not finite, a parent is missing or comes late, or leaves don't add up.
    pub fn new(subtrees: &[Subtree]) -> Result<Self, Flaw> {
        let own_leaves = check(subtrees)?;
        let mut children: Vec<Vec<u32>> = vec![Vec::new(); subtrees.len()];
        for (i, subtree) in subtrees.iter().enumerate() {
            if let Some(parent) = subtree.parent {
                children[parent as usize].push(i as u32);
            }
        }
        let mut out = Self {
            center: subtrees[0].center,
            radius: subtrees[0].radius,
            ..Self::default()
        };
        // A stack of what is still to be visited; `None` closes the node on top of `open`.
        let (mut stack, mut open) = (vec![Some(0u32)], Vec::new());
        while let Some(next) = stack.pop() {
            let Some(subtree) = next else {
                let node: u32 = open.pop().unwrap_or_default();
                out.nodes[node as usize].end = out.nodes.len() as u32;
                continue;
            };
            let parent = open.last().copied().unwrap_or(0);
            let index = subtree as usize;
            open.push(out.push(&subtrees[index], subtree, parent));
            stack.push(None);
            stack.extend(children[index].iter().rev().map(|&c| Some(c)));
            let has_own = own_leaves[index] > 0 || subtrees[index].own.is_some();
            if !children[index].is_empty() && has_own {
                out.push_own(&subtrees[index], subtree, own_leaves[index]);
            }
        }
        Ok(out)
    }

    fn push(&mut self, subtree: &Subtree, index: u32, parent: u32) -> u32 {
        self.nodes.push(Node {
            center: subtree.center,
            radius: subtree.radius,
            switch_distance: subtree.switch_distance,
            branch: subtree.branch,
            density: subtree.density,
            end: 0,
        });
        self.origins.push(Origin {
            subtree: index,
            own: false,
            parent,
            leaves: subtree.leaves,
        });
        self.nodes.len() as u32 - 1
    }

    fn push_own(&mut self, subtree: &Subtree, index: u32, leaves: u32) {
        let parent = self.nodes.len() as u32 - 1;
        let own = subtree.own.unwrap_or(OwnLeaves {
            center: subtree.center,
            radius: subtree.radius,
            switch_distance: subtree.switch_distance,
        });
        self.push(subtree, index, parent);
        let node = &mut self.nodes[parent as usize + 1];
        (node.center, node.radius) = (own.center, own.radius);
        node.switch_distance = own.switch_distance;
        node.end = parent + 2;
        let origin = &mut self.origins[parent as usize + 1];
        (origin.own, origin.leaves) = (true, leaves);
    }

    /// The nodes; 0 is the whole tree.
    #[inline]
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// For each node what it stands for.
    pub fn origins(&self) -> &[Origin] {
        &self.origins
    }

    /// Bounding sphere of the whole tree: centre and radius.
    #[inline]
    pub fn sphere(&self) -> (Vec3, f32) {
        (self.center, self.radius)
    }

    /// Whether nothing is under a node.
    #[inline]
    pub fn is_tip(&self, node: u32) -> bool {
        self.nodes[node as usize].end == node + 1
    }
}

/// Checks every field; returns the leaves on each sub-tree's own branch.
fn check(subtrees: &[Subtree]) -> Result<Vec<u32>, Flaw> {
    let mut own: Vec<u32> = subtrees.iter().map(|s| s.leaves).collect();
    if subtrees.is_empty() {
        return Err(flaw(0, "parent", "there is no sub-tree at all"));
    }
    for (i, s) in subtrees.iter().enumerate() {
        let numbers = [
            ("center", s.center.is_finite()),
            ("radius", s.radius.is_finite()),
            ("switch_distance", s.switch_distance.is_finite()),
            ("branch", s.branch.is_finite()),
            ("density", s.density.is_finite()),
            (
                "own",
                s.own.is_none_or(|o| {
                    o.center.is_finite() && o.radius.is_finite() && o.switch_distance.is_finite()
                }),
            ),
        ];
        if let Some((field, _)) = numbers.iter().find(|(_, finite)| !finite) {
            return Err(flaw(i, field, "a number is not finite"));
        }
        let ranges = [
            ("radius", s.radius >= 0.0),
            ("switch_distance", s.switch_distance >= 0.0),
            ("density", (0.0..=1.0).contains(&s.density)),
            ("branch", s.branch.length_squared() < 1.001),
        ];
        if let Some((field, _)) = ranges.iter().find(|(_, holds)| !holds) {
            return Err(flaw(i, field, "the number is out of range"));
        }
        match (s.parent, i) {
            (None, 0) => {}
            (None, _) => return Err(flaw(i, "parent", "only the first sub-tree has none")),
            (Some(p), _) if p as usize >= i => {
                return Err(flaw(
                    i,
                    "parent",
                    "there is no such sub-tree before this one",
                ));
            }
            (Some(p), _) => {
                let rest = own[p as usize].checked_sub(s.leaves);
                own[p as usize] =
                    rest.ok_or(flaw(i, "leaves", "more leaves than the parent has"))?;
            }
        }
    }
    Ok(own)
}

fn flaw(subtree: usize, field: &'static str, what: &'static str) -> Flaw {
    Flaw {
        subtree,
        field,
        what,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn subtree(parent: Option<u32>, leaves: u32) -> Subtree {
        Subtree {
            parent,
            leaves,
            ..Subtree::default()
        }
    }

    #[test]
    fn a_subtree_is_a_range_and_own_leaves_come_first() {
        // 0 carries 1 and 2; 1 carries 3 and has two leaves of its own.
        let list = [
            subtree(None, 10),
            subtree(Some(0), 6),
            subtree(Some(0), 4),
            subtree(Some(1), 4),
        ];
        let h = Hierarchy::new(&list).unwrap();
        let order: Vec<(u32, bool, u32)> = h
            .origins()
            .iter()
            .map(|o| (o.subtree, o.own, o.leaves))
            .collect();
        assert_eq!(
            order,
            [
                (0, false, 10),
                (1, false, 6),
                (1, true, 2),
                (3, false, 4),
                (2, false, 4)
            ]
        );
        let ends: Vec<u32> = h.nodes().iter().map(|n| n.end).collect();
        assert_eq!(ends, [5, 4, 3, 4, 5]);
        let parents: Vec<u32> = h.origins().iter().map(|o| o.parent).collect();
        assert_eq!(parents, [0, 0, 1, 1, 0]);
    }

    #[test]
    fn every_flaw_names_its_field() {
        let whole = subtree(None, 5);
        let nan = Subtree {
            switch_distance: f32::NAN,
            ..subtree(Some(0), 1)
        };
        let dense = Subtree {
            density: 1.5,
            ..subtree(Some(0), 1)
        };
        let cases = [
            (vec![], "parent"),
            (vec![whole, nan], "switch_distance"),
            (vec![whole, dense], "density"),
            (vec![whole, subtree(Some(7), 1)], "parent"),
            (vec![whole, subtree(None, 1)], "parent"),
            (vec![whole, subtree(Some(0), 6)], "leaves"),
        ];
        for (list, field) in cases {
            let flaw = Hierarchy::new(&list).unwrap_err();
            assert_eq!(flaw.field, field);
            assert!(flaw.to_string().contains(field));
        }
    }
}
