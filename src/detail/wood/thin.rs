//! Fewer twigs: a chain may be left out when a neighbour takes over its area.
//!
//! One triangle a twig is too dear for a bare tree at one percent. So every chain but the
//! largest trunk has a last option of no triangle at all. What it covered is drawn as more width
//! on the nearest chain that is left, a sister or the carrier, and the error is, as everywhere,
//! area times squared displacement: from the twig to that neighbour. Chains are left out in the
//! order of that error, those that carry others after what they carry, and what a chain has taken
//! over moves on with it.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::ChainWood;
use super::rings::Cost;
use crate::botany::Tree;
use crate::botany::tree::Skeleton;

/// Sisters on each side that are looked at as neighbours.
const REACH: usize = 4;

/// Points of a chain that stand for all of it when distances are measured.
const PROBES: usize = 5;

/// What leaving out a chain means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Absence {
    /// The chain that takes over its area.
    pub host: u32,
    /// Area times squared displacement, as in a curve's options.
    pub error: f64,
}

/// For each chain its absence; `None` for the chain that stays to the last.
pub(super) fn absences(tree: &Tree, chains: &[ChainWood]) -> Vec<Option<Absence>> {
    let mut order = Order::new(tree, chains);
    let mut absences = vec![None; chains.len()];
    let mut heap: BinaryHeap<_> = (0..chains.len() as u32)
        .filter(|&c| order.carried[c as usize] == 0)
        .filter_map(|c| order.cheapest(c).map(|(cost, host)| (cost, c, host)))
        .map(|(cost, c, host)| Reverse((Cost(cost), c, host)))
        .collect();
    while let Some(Reverse((Cost(cost), chain, _))) = heap.pop() {
        // The neighbour may have gone, or given its area to this chain: ask again.
        let Some((now, host)) = order.cheapest(chain) else {
            continue;
        };
        if now > cost {
            heap.push(Reverse((Cost(now), chain, host)));
            continue;
        }
        absences[chain as usize] = Some(Absence { host, error: cost });
        if let Some(carrier) = order.leave_out(chain, host, cost)
            && let Some((cost, host)) = order.cheapest(carrier)
        {
            heap.push(Reverse((Cost(cost), carrier, host)));
        }
    }
    absences
}

/// What a level does with a chain.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum State {
    /// It has triangles.
    Drawn,
    /// It is left out.
    Absent,
    /// Something else shows it.
    Elsewhere,
}

/// For each chain the factor of its radius that makes up for the chains that are left out.
pub(super) fn widening(
    areas: &[f64],
    absences: &[Option<Absence>],
    state: impl Fn(usize) -> State,
) -> Vec<f32> {
    let mut covered = areas.to_vec();
    for (chain, area) in areas.iter().enumerate() {
        if state(chain) != State::Absent {
            continue;
        }
        // Hosts never lead back: each was there when its guest left.
        let mut host = Some(chain);
        while let Some(at) = host.filter(|&h| state(h) != State::Drawn) {
            host = absences[at].map(|a| a.host as usize);
        }
        if let Some(host) = host {
            covered[host] += area;
        }
    }
    let factor = |(covered, area): (&f64, &f64)| match *area > 0.0 {
        true => (covered / area) as f32,
        false => 1.0,
    };
    covered.iter().zip(areas).map(factor).collect()
}

/// Who is left, who carries what, and how much each stands for.
struct Order<'a> {
    skeleton: &'a Skeleton,
    probes: Vec<Vec<DVec3>>,
    area: Vec<f64>,
    /// Children that are left.
    carried: Vec<u32>,
    /// Least error at which a chain may go: that of what it carried.
    floor: Vec<f64>,
    /// Sisters in the order of their feet; roots are sisters.
    families: Vec<Vec<u32>>,
    /// For each chain its family and its place in it.
    place: Vec<(u32, u32)>,
    left: Vec<bool>,
}

impl<'a> Order<'a> {
    fn new(tree: &'a Tree, chains: &[ChainWood]) -> Self {
        let skeleton = &tree.skeleton;
        let count = chains.len();
        let mut families = vec![Vec::new(); count + 1];
        let mut carried = vec![0; count];
        for (c, chain) in skeleton.chains.iter().enumerate() {
            let family = chain.parent.map_or(count, |p| p as usize);
            families[family].push(c as u32);
            if let Some(parent) = chain.parent {
                carried[parent as usize] += 1;
            }
        }
        let foot = |c: &u32| skeleton.chains[*c as usize].nodes[0] as usize;
        for family in &mut families {
            // Along the carrier, as its nodes are numbered from base to tip.
            family.sort_by_key(|c| (skeleton.nodes[foot(c)].parent, *c));
        }
        let mut place = vec![(0, 0); count];
        for (f, family) in families.iter().enumerate() {
            for (i, &c) in family.iter().enumerate() {
                place[c as usize] = (f as u32, i as u32);
            }
        }
        Self {
            skeleton,
            probes: (0..count as u32).map(|c| probes(skeleton, c)).collect(),
            area: chains.iter().map(|c| c.area).collect(),
            carried,
            floor: vec![0.0; count],
            families,
            place,
            left: vec![true; count],
        }
    }

    /// The least error of leaving a chain out, and the neighbour that makes it so.
    fn cheapest(&self, chain: u32) -> Option<(f64, u32)> {
        let carrier = self.skeleton.chains[chain as usize].parent;
        let (family, place) = self.place[chain as usize];
        let family = &self.families[family as usize];
        let left = |c: &&u32| self.left[**c as usize];
        let (before, after) = family.split_at(place as usize);
        let sisters = before.iter().rev().filter(left).take(REACH);
        let sisters = sisters.chain(after[1..].iter().filter(left).take(REACH));
        let hosts = sisters.copied().chain(carrier);
        let displacement = |host: u32| {
            let to = &self.probes[host as usize];
            let from = &self.probes[chain as usize];
            let sum: f64 = from.iter().map(|&p| distance_squared(p, to)).sum();
            sum / from.len() as f64
        };
        let best = hosts
            .map(|host| (displacement(host), host))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
        let error = 0.5 * self.area[chain as usize] * best.0;
        Some((error.max(self.floor[chain as usize]), best.1))
    }

    /// Leaves a chain out; the answer is its carrier where it was the last that it carried.
    fn leave_out(&mut self, chain: u32, host: u32, error: f64) -> Option<u32> {
        self.left[chain as usize] = false;
        self.area[host as usize] += self.area[chain as usize];
        let carrier = self.skeleton.chains[chain as usize].parent?;
        let c = carrier as usize;
        self.floor[c] = self.floor[c].max(error);
        self.carried[c] -= 1;
        (self.carried[c] == 0).then_some(carrier)
    }
}

/// A few points of a chain from base to tip, evenly by node.
fn probes(skeleton: &Skeleton, chain: u32) -> Vec<DVec3> {
    let nodes = &skeleton.chains[chain as usize].nodes;
    let last = nodes.len() - 1;
    let count = PROBES.min(nodes.len());
    (0..count)
        .map(|i| nodes[(i * last).checked_div(count - 1).unwrap_or(0)])
        .map(|n| skeleton.nodes[n as usize].position.as_dvec3())
        .collect()
}

/// Squared distance to a broken line of at least one point.
fn distance_squared(p: DVec3, line: &[DVec3]) -> f64 {
    let segment = |s: &[DVec3]| {
        let along = s[1] - s[0];
        let t = (p - s[0]).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
        p.distance_squared(s[0] + along * t.clamp(0.0, 1.0))
    };
    line.windows(2)
        .map(segment)
        .fold(p.distance_squared(line[0]), f64::min)
}
