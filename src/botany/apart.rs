//! Whether a file holds several trees that stand apart: they become one object, and nothing in them says so.

use glam::Vec2;

use super::tree::{NO_NODE, Tree};

/// A tree has this share of all triangles at least: smaller ones beside it are seedlings, or stones.
const LEAST_SHARE: f64 = 0.1;

/// Trunks beyond this number are stems of one thicket.
const MOST: usize = 256;

/// All that grows from one trunk, seen from above.
#[derive(Clone, Copy)]
struct Plan {
    low: Vec2,
    high: Vec2,
    triangles: u64,
}

impl Plan {
    const NOTHING: Self = Self {
        low: Vec2::INFINITY,
        high: Vec2::NEG_INFINITY,
        triangles: 0,
    };

    fn touches(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }

    fn join(&mut self, other: &Self) {
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
        self.triangles += other.triangles;
    }
}

/// How many trees stand apart, so that no part of one is above or below another: 1 where it is one.
pub fn trees(tree: &Tree) -> usize {
    let mut trunks = trunks(tree);
    if trunks.len() > MOST {
        return 1;
    }
    // Crowns that touch join until none do.
    let mut apart: Vec<Plan> = Vec::new();
    while let Some(mut plan) = trunks.pop() {
        let before = plan.triangles;
        apart.retain(|other| {
            let touches = plan.touches(other);
            if touches {
                plan.join(other);
            }
            !touches
        });
        // What it has become may touch others than it did.
        match plan.triangles == before {
            true => apart.push(plan),
            false => trunks.push(plan),
        }
    }
    let least = LEAST_SHARE * tree.model.triangles.len() as f64;
    let large = |plan: &&Plan| plan.triangles as f64 >= least;
    apart.iter().filter(large).count().max(1)
}

/// What to say of so many trees.
pub fn warning(trees: usize) -> String {
    format!(
        "{trees} trees stand apart in the file and become one object with one set of levels; bake each from a file of its \
         own, and place them in the engine"
    )
}

/// What grows from each trunk.
fn trunks(tree: &Tree) -> Vec<Plan> {
    let chains = &tree.skeleton.chains;
    let mut trunk: Vec<usize> = Vec::with_capacity(chains.len());
    for (index, chain) in chains.iter().enumerate() {
        trunk.push(chain.parent.map_or(index, |parent| trunk[parent as usize]));
    }
    let mut plans = vec![Plan::NOTHING; chains.len()];
    let mut add = |node: u32, triangle: u32| {
        if node == NO_NODE {
            return;
        }
        let chain = tree.skeleton.nodes[node as usize].chain as usize;
        let corners = tree.model.corners(triangle).map(|p| Vec2::new(p.x, p.z));
        let [a, b, c] = corners;
        plans[trunk[chain]].join(&Plan {
            low: a.min(b).min(c),
            high: a.max(b).max(c),
            triangles: 1,
        });
    };
    for (triangle, &node) in (0..).zip(&tree.wood_node) {
        add(node, triangle);
    }
    for leaf in &tree.leaves {
        leaf.triangles.iter().for_each(|&t| add(leaf.node, t));
    }
    plans.retain(|plan| plan.triangles > 0);
    plans
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::botany::model::Model;
    use crate::botany::tree::{Chain, Node, Skeleton};

    /// Trunks of so many triangles, each two wide, at these places along x.
    fn grove(trunks: &[(f32, usize)]) -> Tree {
        let mut tree = Tree::default();
        let mut skeleton = Skeleton::default();
        let mut model = Model::default();
        for (chain, &(x, count)) in (0..).zip(trunks) {
            for node in 0..2 {
                skeleton.nodes.push(Node {
                    position: Vec3::new(x, node as f32, 0.0),
                    radius: 1.0,
                    parent: NO_NODE,
                    chain,
                });
            }
            skeleton.chains.push(Chain {
                nodes: vec![2 * chain, 2 * chain + 1],
                ..Chain::default()
            });
            let first = model.positions.len() as u32;
            let corners = [[-1.0, 0.0], [1.0, 0.0], [0.0, 5.0]];
            let at = |[dx, y]: [f32; 2]| Vec3::new(x + dx, y, dx);
            model.positions.extend(corners.map(at));
            let triangle = [first, first + 1, first + 2];
            model.triangles.extend(vec![triangle; count]);
            tree.wood_node.extend(vec![2 * chain; count]);
        }
        (tree.model, tree.skeleton) = (model, skeleton);
        tree
    }

    #[test]
    fn trees_stand_apart_where_none_is_above_another() {
        assert_eq!(trees(&grove(&[(0.0, 5)])), 1);
        assert_eq!(trees(&grove(&[(0.0, 5), (3.0, 5)])), 2);
        // Stems of one bush; one of them joins two others.
        assert_eq!(trees(&grove(&[(0.0, 5), (1.5, 5)])), 1);
        assert_eq!(trees(&grove(&[(0.0, 5), (3.0, 5), (1.5, 5)])), 1);
        assert_eq!(trees(&grove(&[(0.0, 5), (9.0, 5), (1.5, 5), (30.0, 5)])), 3);
        // A seedling.
        assert_eq!(trees(&grove(&[(0.0, 50), (9.0, 5)])), 1);
        assert_eq!(trees(&Tree::default()), 1);
    }
}
