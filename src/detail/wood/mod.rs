//! Wood along the skeleton: for every chain a curve of error against triangles, and its mesh.
//!
//! A chain is drawn as its original triangles, as a tube of 3 to 8 sides with few rings, as a
//! tapering ribbon that both faces show, or as one triangle. All options of a chain keep its
//! **surface area**: by Cauchy's formula the mean projected area of a convex body over all
//! directions is a quarter of its surface, and that of a flat piece half of its one-sided area,
//! so equal surface means equal covered area, whatever the number of sides. Nothing that is
//! thinner than a pixel then vanishes.
//!
//! Error is area times squared displacement, as for foliage on cards, so that one multiplier
//! trades wood against foliage. The area is *half* the surface of the tube: a tube of surface S
//! covers S/4 in the mean, as a leaf of one-sided area S/2 does.

mod bark;
mod build;
mod curve;
mod fit;
mod path;
mod rings;
mod thin;

use rayon::prelude::*;

use crate::botany::Tree;
use crate::botany::tree::{NO_NODE, Organ};

pub use build::WoodMesh;
pub use curve::{ChainCurve, Shape, WoodOption};

use bark::Bark;
use path::Path;
use thin::Absence;

/// The wood of a tree, ready to be simplified chain by chain.
pub struct Wood<'a> {
    tree: &'a Tree,
    chains: Vec<ChainWood>,
    /// For each chain, what leaving it out means.
    absences: Vec<Option<Absence>>,
    loose: Vec<u32>,
    /// For each node its place in its chain.
    slots: Vec<u32>,
}

/// One chain: its triangles, its centre line, its bark, and what it costs.
struct ChainWood {
    triangles: Vec<u32>,
    /// Surface of the triangles.
    area: f64,
    /// `None` where no tube can stand in for the triangles (no length or no area).
    tube: Option<(Path, Bark)>,
    curve: ChainCurve,
}

impl<'a> Wood<'a> {
    /// Fits every chain; O(n log n) in nodes and triangles, on all threads, in a fixed order.
    ///
    /// `double_sided` says that the level's bark will be drawn from both sides: ribbons then
    /// cost one triangle where they would cost two.
    pub fn new(tree: &'a Tree, double_sided: bool) -> Self {
        let (by_chain, loose) = triangles_by_chain(tree);
        let slots = node_slots(tree);
        let mut chains: Vec<_> = by_chain
            .into_par_iter()
            .enumerate()
            .map(|(chain, triangles)| {
                ChainWood::new(tree, chain as u32, triangles, &slots, double_sided)
            })
            .collect();
        let absences = thin::absences(tree, &chains);
        for (chain, absence) in chains.iter_mut().zip(&absences) {
            chain.curve.may_be_absent(absence.map(|a| a.error));
        }
        Self {
            tree,
            chains,
            absences,
            loose,
            slots,
        }
    }

    /// Number of chains: as many as the skeleton has.
    pub fn len(&self) -> usize {
        self.chains.len()
    }

    /// True where the skeleton has no chain.
    pub fn is_empty(&self) -> bool {
        self.chains.is_empty()
    }

    /// The options of a chain, fewest triangles first; never empty.
    pub fn tube_options(&self, chain: u32) -> &ChainCurve {
        &self.chains[chain as usize].curve
    }

    /// Surface area of a chain's own triangles, normalised units squared.
    pub fn area(&self, chain: u32) -> f64 {
        self.chains[chain as usize].area
    }

    /// The original triangles of a chain.
    pub fn triangles(&self, chain: u32) -> &[u32] {
        &self.chains[chain as usize].triangles
    }

    /// Wood that hangs on no skeleton node: it can only be kept as it is.
    pub fn loose_triangles(&self) -> &[u32] {
        &self.loose
    }

    /// The cheapest options whose triangles add up to at most `budget` (loose triangles not
    /// counted), by steepest descent on the convex curves; the cheapest of all where even they
    /// exceed it.
    pub fn choose(&self, budget: u64) -> Vec<usize> {
        let mut steps: Vec<(f64, u32, usize)> = Vec::new();
        let mut total = 0u64;
        for (chain, wood) in self.chains.iter().enumerate() {
            let options = &wood.curve.options;
            total += u64::from(options[0].triangles);
            for next in 1..options.len() {
                let gain = options[next - 1].error - options[next].error;
                let cost = options[next].triangles - options[next - 1].triangles;
                steps.push((gain / f64::from(cost), chain as u32, next));
            }
        }
        steps.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut chosen = vec![0; self.chains.len()];
        for (_, chain, next) in steps {
            let options = &self.chains[chain as usize].curve.options;
            let cost = u64::from(options[next].triangles - options[next - 1].triangles);
            // A curve is climbed in order: a step whose forerunner was too dear is left out.
            if chosen[chain as usize] + 1 == next && total + cost <= budget {
                total += cost;
                chosen[chain as usize] = next;
            }
        }
        chosen
    }

    /// Repairs a choice in which a chain is left out that carries one which is drawn: the carrier
    /// gets its cheapest shape. Returns the triangles that this adds.
    ///
    /// `None` stands for a chain that is drawn elsewhere (on a card).
    pub fn settle(&self, chosen: &mut [Option<usize>]) -> u32 {
        let mut added = 0;
        for chain in (0..self.chains.len()).rev() {
            if chosen[chain].is_none() || self.is_absent(chain, chosen[chain]) {
                continue;
            }
            // Carriers have smaller indices: one backward pass reaches every root.
            if let Some(carrier) = self.tree.skeleton.chains[chain].parent {
                let carrier = carrier as usize;
                if self.is_absent(carrier, chosen[carrier]) {
                    chosen[carrier] = Some(1);
                    added += self.chains[carrier].curve.options[1].triangles;
                }
            }
        }
        added
    }

    /// For each chain the factor of its radius that makes up for the chains that `chosen` leaves
    /// out; `None` stands for a chain that is drawn elsewhere (on a card), which neither gives
    /// nor takes.
    pub fn widening(&self, chosen: &[Option<usize>]) -> Vec<f32> {
        let areas: Vec<_> = self.chains.iter().map(|c| c.area).collect();
        let state = |chain: usize| match chosen[chain] {
            None => thin::State::Elsewhere,
            Some(_) if self.is_absent(chain, chosen[chain]) => thin::State::Absent,
            Some(_) => thin::State::Drawn,
        };
        thin::widening(&areas, &self.absences, state)
    }

    fn is_absent(&self, chain: usize, option: Option<usize>) -> bool {
        option.is_some_and(|o| self.chains[chain].curve.options[o].shape == Shape::Absent)
    }
}

impl ChainWood {
    fn new(
        tree: &Tree,
        chain: u32,
        triangles: Vec<u32>,
        slots: &[u32],
        double_sided: bool,
    ) -> Self {
        let area = surface(tree, &triangles);
        let path = Path::new(tree, chain, &triangles, slots, area);
        let count = triangles.len() as u32;
        let tube = path.map(|path| {
            let bark = Bark::fit(tree, &path, &triangles, slots);
            (path, bark)
        });
        let curve = match &tube {
            Some((path, _)) => curve::chain_curve(path, count, double_sided),
            None => ChainCurve::original(count),
        };
        Self {
            triangles,
            area,
            tube,
            curve,
        }
    }
}

/// The wood triangles of each chain in file order, and those without a node.
fn triangles_by_chain(tree: &Tree) -> (Vec<Vec<u32>>, Vec<u32>) {
    let mut by_chain = vec![Vec::new(); tree.skeleton.chains.len()];
    let mut loose = Vec::new();
    for (triangle, &node) in tree.wood_node.iter().enumerate() {
        if tree.organ.get(triangle) != Some(&Organ::Wood) {
            continue;
        }
        let chain = match tree.skeleton.nodes.get(node as usize) {
            Some(node) => node.chain as usize,
            None => NO_NODE as usize,
        };
        match by_chain.get_mut(chain) {
            Some(list) => list.push(triangle as u32),
            None => loose.push(triangle as u32),
        }
    }
    (by_chain, loose)
}

/// For each node its place in its chain.
fn node_slots(tree: &Tree) -> Vec<u32> {
    let mut slots = vec![0; tree.skeleton.nodes.len()];
    for chain in &tree.skeleton.chains {
        for (slot, &node) in chain.nodes.iter().enumerate() {
            slots[node as usize] = slot as u32;
        }
    }
    slots
}

/// Sum of the areas of triangles.
fn surface(tree: &Tree, triangles: &[u32]) -> f64 {
    triangles
        .iter()
        .map(|&t| {
            let [a, b, c] = tree.model.corners(t).map(|p| p.as_dvec3());
            (b - a).cross(c - a).length() / 2.0
        })
        .sum()
}

#[cfg(test)]
mod tests;
