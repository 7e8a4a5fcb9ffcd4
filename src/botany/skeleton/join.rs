//! Chains of separate parts become one graph: each base looks for the branch that carries it.

use glam::Vec3;
use rayon::prelude::*;

use super::near::{Contact, Grid, Segment};
use super::{LocalChain, PartSkeleton};
use crate::botany::tree::{Chain, NO_NODE, Node, Skeleton};

/// Parents that are kept for each end of a part.
const KEPT: usize = 6;
/// A parent thinner than this share of its child is doubtful.
const THINNER: f32 = 0.8;
/// A base that fits no branch better than this (see [`fit`]) may be a stem of its own.
const LOOSE: f32 = 2.0;

/// Parts with more nodes are branches in their own right, not segments of a longer one.
const MOST_SEGMENT_NODES: usize = 3;

/// The graph, and for each part the node of each of its triangles.
#[derive(Clone, Debug, Default)]
pub struct Joined {
    /// The skeleton.
    pub skeleton: Skeleton,
    /// As `PartSkeleton::node_of_triangle`, but nodes of the skeleton.
    pub node_of_triangle: Vec<Vec<u32>>,
}

/// A possible place for a part to grow from.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    cost: f32,
    chain: u32,
    node: u32,
    /// Whether the part's tip touches instead of its base.
    reversed: bool,
}

/// All chains of all parts, before they are joined.
struct Flat {
    chains: Vec<LocalChain>,
    part_of_chain: Vec<u32>,
    /// First chain of each part, and the number of chains at the end.
    first_chain: Vec<u32>,
}

/// Joins the parts of a tree.
pub fn join(mut parts: Vec<PartSkeleton>, warnings: &mut Vec<String>) -> Joined {
    for part in &mut parts {
        point_towards_tip(part);
    }
    let flat = flatten(&parts);
    if flat.chains.is_empty() {
        return Joined::default();
    }
    let grid = Grid::new(segments(&flat.chains));
    let candidates: Vec<Vec<Candidate>> = (0..parts.len())
        .into_par_iter()
        .map(|part| find_parents(part, &flat, &grid))
        .collect();
    let trunk = trunk(&flat);
    let chosen = choose(&flat, &candidates, trunk);
    assemble(parts, flat, &chosen, warnings)
}

/// A part of one chain whose tip is wider than its base is turned round.
fn point_towards_tip(part: &mut PartSkeleton) {
    if let [chain] = part.chains.as_slice() {
        let count = chain.nodes.len();
        let mean = |nodes: &[(Vec3, f32)]| {
            nodes.iter().map(|n| n.1).sum::<f32>() / nodes.len().max(1) as f32
        };
        let (low, high) = chain.nodes.split_at(count / 2);
        if count > 1 && mean(high) > 1.02 * mean(low) {
            reverse(part);
        }
    }
}

fn reverse(part: &mut PartSkeleton) {
    let count = part.chains[0].nodes.len() as u32;
    part.chains[0].nodes.reverse();
    let shift = if part.by_segment { count } else { count - 1 };
    for place in &mut part.node_of_triangle {
        place.1 = (shift - place.1.min(shift)).min(count - 1);
    }
}

fn flatten(parts: &[PartSkeleton]) -> Flat {
    let mut flat = Flat {
        chains: Vec::new(),
        part_of_chain: Vec::new(),
        first_chain: Vec::new(),
    };
    for (index, part) in parts.iter().enumerate() {
        flat.first_chain.push(flat.chains.len() as u32);
        flat.chains.extend(part.chains.iter().cloned());
        flat.part_of_chain.resize(flat.chains.len(), index as u32);
    }
    flat.first_chain.push(flat.chains.len() as u32);
    flat
}

fn segments(chains: &[LocalChain]) -> Vec<Segment> {
    let mut out = Vec::new();
    for (chain, index) in chains.iter().zip(0u32..) {
        let nodes = &chain.nodes;
        for i in 0..nodes.len().saturating_sub(1).max(1) {
            let (a, b) = (nodes[i], nodes[(i + 1).min(nodes.len() - 1)]);
            out.push(Segment {
                ends: [a.0, b.0],
                radii: [a.1, b.1],
                chain: index,
                index: i as u32,
            });
        }
    }
    out
}

/// The best places for a part to grow from, cheapest first.
fn find_parents(part: usize, flat: &Flat, grid: &Grid) -> Vec<Candidate> {
    let own = flat.first_chain[part]..flat.first_chain[part + 1];
    let chain = &flat.chains[own.start as usize];
    let (base, tip) = (chain.nodes[0], chain.nodes[chain.nodes.len() - 1]);
    let mut found = parents_of_end(base.0, base.1, &own, flat, grid, false);
    // Where both ends are about as wide either may be the base.
    if own.len() == 1 && chain.nodes.len() > 1 && tip.1 > 0.5 * base.1 {
        let taper = 3.0 * (1.0 - tip.1 / base.1.max(1e-12)).max(0.0);
        let mut other = parents_of_end(tip.0, tip.1, &own, flat, grid, true);
        for candidate in &mut other {
            candidate.cost += taper + 0.05;
        }
        found.append(&mut other);
    }
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.chain.cmp(&b.chain)));
    found
}

fn parents_of_end(
    end: Vec3,
    radius: f32,
    own: &std::ops::Range<u32>,
    flat: &Flat,
    grid: &Grid,
    reversed: bool,
) -> Vec<Candidate> {
    let mut best: Vec<Candidate> = Vec::new();
    let mut reach = (2.0 * radius).max(0.25 * grid.cell());
    loop {
        best.clear();
        let mut nearest = f32::MAX;
        grid.each_near(end, reach, |segment| {
            if own.contains(&segment.chain) {
                return;
            }
            let contact = segment.contact(end);
            nearest = nearest.min(contact.gap());
            let nodes = &flat.chains[segment.chain as usize].nodes;
            let candidate = Candidate {
                cost: fit(radius, &contact) + at_base(end, radius, nodes[0]),
                chain: segment.chain,
                node: (segment.index + (contact.along > 0.5) as u32).min(nodes.len() as u32 - 1),
                reversed,
            };
            keep(&mut best, candidate);
        });
        if nearest <= reach || reach > grid.whole(end) {
            return best;
        }
        reach *= 2.0;
    }
}

/// Keeps the cheapest place on each of the cheapest chains.
fn keep(best: &mut Vec<Candidate>, candidate: Candidate) {
    match best.iter_mut().find(|c| c.chain == candidate.chain) {
        Some(same) => {
            if candidate.cost < same.cost {
                *same = candidate;
            }
        }
        None => best.push(candidate),
    }
    if best.len() > 2 * KEPT {
        best.sort_by(|a, b| a.cost.total_cmp(&b.cost).then(a.chain.cmp(&b.chain)));
        best.truncate(KEPT);
    }
}

/// How badly a base fits a branch: 0 on its centre line, 1 on its surface, more outside (in
/// units of both radii) and where the branch is thinner than what it would carry.
fn fit(radius: f32, contact: &Contact) -> f32 {
    let unit = contact.radius.max(1e-9);
    let depth = if contact.distance <= contact.radius {
        contact.distance / unit
    } else {
        let both = (0.5 * (contact.radius + radius)).max(1e-9);
        1.0 + (contact.distance - contact.radius) / both
    };
    depth + (THINNER * radius / unit - 1.0).clamp(0.0, 10.0)
}

/// Siblings start in one point without carrying each other: near the other's own base a fit
/// counts for less.
fn at_base(end: Vec3, radius: f32, base: (Vec3, f32)) -> f32 {
    let reach = radius.max(base.1).max(1e-9);
    0.8 * (1.0 - end.distance(base.0) / reach).max(0.0)
}

/// The part that carries the tree: the widest, the lowest of nearly equal ones.
fn trunk(flat: &Flat) -> usize {
    let parts = flat.first_chain.len() - 1;
    let base = |part: usize| flat.chains[flat.first_chain[part] as usize].nodes[0];
    let widest = (0..parts).map(|p| base(p).1).fold(0.0, f32::max);
    (0..parts)
        .filter(|&p| base(p).1 >= 0.7 * widest)
        .min_by(|&a, &b| base(a).0.y.total_cmp(&base(b).0.y).then(a.cmp(&b)))
        .unwrap_or(0)
}

/// One parent for each part, without circles; `None` for stems.
fn choose(flat: &Flat, candidates: &[Vec<Candidate>], trunk: usize) -> Vec<Option<Candidate>> {
    let base = |part: usize| flat.chains[flat.first_chain[part] as usize].nodes[0];
    let ground = base(trunk).0.y;
    let is_stem = |part: usize| {
        let loose = candidates[part].first().is_none_or(|c| c.cost > LOOSE);
        let low = (base(part).0.y - ground).abs() <= (2.0 * base(trunk).1).max(0.02);
        part == trunk || loose && low && base(part).1 > 0.2 * base(trunk).1
    };
    let mut pick: Vec<usize> = vec![0; candidates.len()];
    let stem: Vec<bool> = (0..candidates.len()).map(is_stem).collect();
    let parent = |part: usize, pick: &[usize]| -> Option<usize> {
        let chosen = candidates[part].get(pick[part])?;
        (!stem[part]).then(|| flat.part_of_chain[chosen.chain as usize] as usize)
    };
    // A circle is opened at the member that loses least by taking its next best parent. Every
    // opening uses up a candidate, so this ends.
    while let Some(circle) = find_circle(candidates.len(), |p| parent(p, &pick)) {
        let loss = |part: usize| {
            let list = &candidates[part];
            let next = list.get(pick[part] + 1).map_or(1e6, |c| c.cost);
            next - list[pick[part]].cost
        };
        let member =
            (circle.into_iter()).min_by(|&a, &b| loss(a).total_cmp(&loss(b)).then(a.cmp(&b)));
        if let Some(member) = member {
            pick[member] += 1;
        }
    }
    (0..candidates.len())
        .map(|part| {
            let chosen = candidates[part].get(pick[part]).copied();
            if stem[part] { None } else { chosen }
        })
        .collect()
}

/// The parts of one circle of parents, if there is any.
fn find_circle(count: usize, parent: impl Fn(usize) -> Option<usize>) -> Option<Vec<usize>> {
    let mut seen = vec![0usize; count];
    for start in 0..count {
        let mut at = start;
        while seen[at] == 0 {
            seen[at] = start + 1;
            match parent(at) {
                Some(up) => at = up,
                None => break,
            }
            if seen[at] == start + 1 {
                let mut circle = vec![at];
                let mut on = parent(at);
                while let Some(next) = on.filter(|&n| n != at) {
                    circle.push(next);
                    on = parent(next);
                }
                return Some(circle);
            }
        }
    }
    None
}

/// For each chain the one that carries it on: its base is this chain's tip, about as wide, and
/// it goes on in about the same direction (branches made of one cylinder a segment).
fn heirs(flat: &Flat, up: &[Option<(usize, u32)>]) -> Vec<Option<usize>> {
    let mut heir: Vec<Option<usize>> = vec![None; flat.chains.len()];
    let mut best = vec![0.0f32; flat.chains.len()];
    for (chain, parent) in up.iter().enumerate() {
        let Some((parent, node)) = *parent else {
            continue;
        };
        let (below, above) = (&flat.chains[parent].nodes, &flat.chains[chain].nodes);
        let short = |n: usize| (2..=MOST_SEGMENT_NODES).contains(&n);
        if node as usize + 1 != below.len() || !short(below.len()) || !short(above.len()) {
            continue;
        }
        let (tip, base) = (below[below.len() - 1], above[0]);
        let touches = tip.0.distance(base.0) <= 0.5 * tip.1.max(base.1);
        let alike = base.1 <= 1.4 * tip.1 && tip.1 <= 1.7 * base.1;
        let direction = |a: Vec3, b: Vec3| (b - a).normalize_or_zero();
        let straight =
            direction(below[below.len() - 2].0, tip.0).dot(direction(base.0, above[1].0));
        if touches && alike && straight > 0.6 && straight > best[parent] {
            best[parent] = straight;
            heir[parent] = Some(chain);
        }
    }
    heir
}

/// Numbers chains and nodes from the roots outwards.
fn assemble(
    mut parts: Vec<PartSkeleton>,
    mut flat: Flat,
    chosen: &[Option<Candidate>],
    warnings: &mut Vec<String>,
) -> Joined {
    for (index, choice) in chosen.iter().enumerate() {
        if choice.is_some_and(|c| c.reversed) {
            reverse(&mut parts[index]);
            let first = flat.first_chain[index] as usize;
            flat.chains[first].nodes.reverse();
        }
    }
    let carrier = |chain: usize| -> Option<(usize, u32)> {
        let part = flat.part_of_chain[chain] as usize;
        match flat.chains[chain].parent {
            Some((local, node)) => Some(((flat.first_chain[part] + local) as usize, node)),
            None => chosen[part].map(|c| {
                // Where the carrier itself was turned round, its nodes count from the other end.
                let up = flat.part_of_chain[c.chain as usize] as usize;
                let turned = chosen[up].is_some_and(|u| u.reversed);
                let last = flat.chains[c.chain as usize].nodes.len() as u32 - 1;
                (
                    c.chain as usize,
                    if turned { last - c.node } else { c.node },
                )
            }),
        }
    };
    let up: Vec<Option<(usize, u32)>> = (0..flat.chains.len()).map(carrier).collect();
    let heir = heirs(&flat, &up);
    let mut children = vec![Vec::new(); flat.chains.len()];
    let mut order: Vec<usize> = Vec::new();
    for chain in 0..flat.chains.len() {
        match up[chain] {
            Some((up, _)) if heir[up] == Some(chain) => {}
            Some((up, _)) => children[up].push(chain),
            None => order.push(chain),
        }
    }
    // Breadth first: by branch order, then by part.
    let line = |first: usize| std::iter::successors(Some(first), |&c| heir[c]);
    let mut at = 0;
    while at < order.len() {
        for chain in line(order[at]) {
            order.extend(children[chain].iter().copied());
        }
        at += 1;
    }
    let mut skeleton = Skeleton::default();
    let mut new_chain = vec![0u32; flat.chains.len()];
    let mut first_node = vec![0u32; flat.chains.len()];
    for &first in &order {
        let index = skeleton.chains.len() as u32;
        let up = up[first].map(|(chain, node)| (new_chain[chain], first_node[chain] + node));
        let mut parent = up.map_or(NO_NODE, |u| u.1);
        let mut nodes = Vec::new();
        for old in line(first) {
            new_chain[old] = index;
            first_node[old] = skeleton.nodes.len() as u32;
            for &(position, radius) in &flat.chains[old].nodes {
                nodes.push(skeleton.nodes.len() as u32);
                skeleton.nodes.push(Node {
                    position,
                    radius,
                    parent,
                    chain: index,
                });
                parent = skeleton.nodes.len() as u32 - 1;
            }
        }
        skeleton.chains.push(Chain {
            nodes,
            parent: up.map(|u| u.0),
            order: up.map_or(0, |u| skeleton.chains[u.0 as usize].order + 1),
        });
    }
    let loose = chosen
        .iter()
        .flatten()
        .filter(|c| c.cost > 2.0 * LOOSE)
        .count();
    if loose > 0 {
        warnings.push(format!(
            "{loose} branches touch no other; they were joined to the nearest one"
        ));
    }
    let node_of_triangle = (parts.iter().enumerate())
        .map(|(index, part)| {
            let first = flat.first_chain[index];
            (part.node_of_triangle.iter())
                .map(|&(chain, node)| first_node[(first + chain) as usize] + node)
                .collect()
        })
        .collect();
    Joined {
        skeleton,
        node_of_triangle,
    }
}
