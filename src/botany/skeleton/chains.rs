//! Pieces of bands become chains: each fork says which piece goes on and which begin branches.

use glam::Vec3;

use super::bands::Bands;
use super::fork::{branches, continuations, shared};
use super::line::{needed, straighten};
use super::mesh::PartMesh;
use super::pieces::Piece;
use super::{LocalChain, PartSkeleton};

/// A branch that forks off: its first piece, and the chain and node that carry it.
type Fork = (u32, Option<(u32, u32)>);

/// Follows all chains from the base to their tips; `foot` is the ring where the first one starts.
pub fn grow(mesh: &PartMesh, bands: &Bands, pieces: &[Piece], foot: (Vec3, f32)) -> PartSkeleton {
    let next = continuations(pieces);
    let mut chains: Vec<LocalChain> = Vec::new();
    let mut place: Vec<Option<(u32, u32)>> = vec![None; pieces.len()];
    let mut starts: Vec<Fork> = vec![(0, None)];
    while chains.len() < starts.len() {
        let (start, from) = starts[chains.len()];
        let nodes = if from.is_none() {
            vec![foot]
        } else {
            Vec::new()
        };
        let (chain, forks) = follow(pieces, &next, start, nodes, chains.len() as u32, &mut place);
        starts.extend(forks);
        chains.push(LocalChain {
            nodes: chain,
            parent: from,
        });
    }
    // Bumps belong to the node that they grow from.
    for p in 0..pieces.len() {
        if place[p].is_none() {
            let below = pieces[p].parent.and_then(|q| place[q as usize]);
            place[p] = below.or(Some((0, 0)));
        }
    }
    let node_of_triangle = (0..mesh.triangles.len())
        .map(|t| {
            let cells = bands.of_triangle(t);
            place[cells[cells.len() / 2].piece as usize].unwrap_or((0, 0))
        })
        .collect();
    PartSkeleton {
        chains,
        node_of_triangle,
        by_segment: false,
    }
}

/// Follows a chain from its first piece to its tip; gives its nodes and what forks off.
fn follow(
    pieces: &[Piece],
    next: &[Option<u32>],
    start: u32,
    mut nodes: Vec<(Vec3, f32)>,
    chain: u32,
    place: &mut [Option<(u32, u32)>],
) -> (Vec<(Vec3, f32)>, Vec<Fork>) {
    let mut forks: Vec<(u32, u32)> = Vec::new();
    let mut trail = vec![start];
    let mut node_of: Vec<u32> = Vec::new();
    let mut at = start;
    loop {
        let piece = &pieces[at as usize];
        if piece.solid || nodes.is_empty() {
            nodes.push((piece.position, piece.radius));
        }
        let node = nodes.len() as u32 - 1;
        node_of.push(node);
        let on = next[at as usize];
        for &child in piece.children.iter().filter(|&&c| Some(c) != on) {
            forks.extend(branches(pieces, at, child).into_iter().map(|b| (b, node)));
        }
        let Some(on) = on else {
            break;
        };
        at = on;
        trail.push(at);
    }
    let mut clean = vec![true; nodes.len()];
    for (shared, &node) in shared(pieces, &trail).into_iter().zip(&node_of) {
        clean[node as usize] &= !shared;
    }
    straighten(&mut nodes, &clean);
    if pieces[at as usize].children.is_empty() {
        let (tip, radius) = pieces[at as usize].end;
        if let Some(last) = nodes.last().copied()
            && last.0.distance(tip) > 0.25 * last.1.max(1e-9)
        {
            nodes.push((tip, radius));
        }
    }
    let mut keep = vec![false; nodes.len()];
    for (_, from) in &forks {
        keep[*from as usize] = true;
    }
    needed(&nodes, &mut keep);
    let renumbered = renumber(&nodes, &keep);
    for (&piece, &node) in trail.iter().zip(&node_of) {
        place[piece as usize] = Some((chain, renumbered[node as usize]));
    }
    let forks = (forks.into_iter())
        .map(|(first, node)| (first, Some((chain, renumbered[node as usize]))))
        .collect();
    let kept = nodes.into_iter().zip(keep).filter(|n| n.1).map(|n| n.0);
    (kept.collect(), forks)
}

/// For each node the number of the nearest one that is kept.
fn renumber(nodes: &[(Vec3, f32)], keep: &[bool]) -> Vec<u32> {
    let mut out = vec![0; nodes.len()];
    let mut below = 0;
    for i in 1..nodes.len() {
        if !keep[i] {
            continue;
        }
        let number = out[below] + 1;
        for k in below + 1..=i {
            let nearer = nodes[k].0.distance(nodes[i].0) <= nodes[k].0.distance(nodes[below].0);
            out[k] = if nearer { number } else { out[below] };
        }
        below = i;
    }
    out
}
