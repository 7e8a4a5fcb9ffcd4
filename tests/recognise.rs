//! Recognition scored against grown trees, whose skeleton is known.
//!
//! `cargo test --release --test recognise -- --nocapture` prints one line for each species and
//! way of meshing.

use glam::Vec3;
use pleach::botany::attach::segments;
use pleach::botany::grow::{Foliage, Grown, Nodes, Options, Species, TrueSkeleton, Wood, grow};
use pleach::botany::load::{Limits, load_slice};
use pleach::botany::recognise::{RecogniseOptions, recognise};
use pleach::botany::skeleton::near::{Grid, Segment};
use pleach::botany::tree::{NO_NODE, Tree};

/// Points on each true branch that look for the branch that was found there.
const SAMPLES: usize = 24;

/// Shares from 0 to 1.
#[derive(Debug)]
struct Score {
    branches: usize,
    /// True branches that one found branch follows, and that follows it.
    found: f64,
    /// Found branches for one true branch: above 1 there are inventions.
    per_branch: f64,
    /// Of the found ones, those whose parent is the true one.
    parent: f64,
    leaves: usize,
    /// Leaves that hang on the true branch.
    leaf: f64,
}

fn recognised(grown: &Grown) -> Tree {
    let path = std::path::Path::new("grown.glb");
    let model = load_slice(&grown.glb, path, &Limits::default()).expect("own files load");
    recognise(model, &RecogniseOptions::default()).expect("own files are recognised")
}

/// The true skeleton in normalised space.
struct Truth {
    chains: Vec<Vec<(Vec3, f32)>>,
    parent: Vec<Option<u32>>,
}

impl Truth {
    fn new(tree: &Tree, skeleton: &TrueSkeleton) -> Self {
        let chains = (skeleton.chains.iter())
            .map(|c| {
                let radius = |r: f32| (r as f64 / tree.model.frame.radius) as f32;
                let nodes = c.points.iter().zip(&c.radii);
                nodes
                    .map(|(p, &r)| (normalised(tree, *p), radius(r)))
                    .collect()
            })
            .collect();
        let parent = skeleton.chains.iter().map(|c| c.parent).collect();
        Self { chains, parent }
    }

    fn segments(&self) -> Vec<Segment> {
        let mut out = Vec::new();
        for (chain, nodes) in self.chains.iter().enumerate() {
            for (i, pair) in nodes.windows(2).enumerate() {
                out.push(Segment {
                    ends: [pair[0].0, pair[1].0],
                    radii: [pair[0].1, pair[1].1],
                    chain: chain as u32,
                    index: i as u32,
                });
            }
        }
        out
    }
}

fn normalised(tree: &Tree, p: [f32; 3]) -> Vec3 {
    let frame = &tree.model.frame;
    ((Vec3::from(p).as_dvec3() - frame.center) / frame.radius).as_vec3()
}

/// Points evenly along a line of nodes, with the radius there; the foot is left out, since it
/// lies inside the parent.
fn samples(nodes: &[(Vec3, f32)], foot: f32) -> Vec<(Vec3, f32)> {
    let length: f32 = nodes.windows(2).map(|w| w[0].0.distance(w[1].0)).sum();
    let foot = foot.min(0.5 * length);
    let mut out = Vec::new();
    for k in 0..SAMPLES {
        let mut at = foot + (length - foot) * (k as f32 + 0.5) / SAMPLES as f32;
        for w in nodes.windows(2) {
            let step = w[0].0.distance(w[1].0);
            if at <= step && step > 0.0 {
                let t = at / step;
                out.push((w[0].0.lerp(w[1].0, t), w[0].1 + (w[1].1 - w[0].1) * t));
                break;
            }
            at -= step;
        }
    }
    out
}

/// The chain whose centre line is nearest to most samples, if those are at least 60 % of them
/// and lie within the wood.
fn most_voted(grid: &Grid, points: &[(Vec3, f32)]) -> Option<u32> {
    let mut votes: Vec<u32> = Vec::new();
    for &(p, radius) in points {
        let mut best: Option<(f32, u32)> = None;
        grid.each_near(p, radius.max(1e-4), |s| {
            let d = s.contact(p).distance;
            if d <= radius.max(1e-4) && best.is_none_or(|b| (d, s.chain) < b) {
                best = Some((d, s.chain));
            }
        });
        votes.extend(best.map(|b| b.1));
    }
    votes.sort_unstable();
    let top = votes.chunk_by(|a, b| a == b).max_by_key(|run| run.len())?;
    (top.len() * 10 >= points.len() * 6).then(|| top[0])
}

fn foot(chains: &[Vec<(Vec3, f32)>], nodes: &[(Vec3, f32)], parent: Option<u32>) -> f32 {
    // The parent's radius where the branch leaves it, and a little for the angle.
    parent.map_or(0.0, |p| {
        let nearest = (chains[p as usize].iter()).min_by(|a, b| {
            a.0.distance(nodes[0].0)
                .total_cmp(&b.0.distance(nodes[0].0))
        });
        nearest.map_or(0.0, |n| 1.5 * n.1)
    })
}

fn score(tree: &Tree, truth: &TrueSkeleton) -> Score {
    let known = Truth::new(tree, truth);
    let found_grid = Grid::new(segments(&tree.skeleton));
    let true_grid = Grid::new(known.segments());
    let found_chains: Vec<Vec<(Vec3, f32)>> = (tree.skeleton.chains.iter())
        .map(|c| {
            let node = |&n: &u32| &tree.skeleton.nodes[n as usize];
            c.nodes
                .iter()
                .map(|n| (node(n).position, node(n).radius))
                .collect()
        })
        .collect();
    let true_of: Vec<Option<u32>> = (found_chains.iter().zip(&tree.skeleton.chains))
        .map(|(nodes, chain)| {
            let foot = foot(&found_chains, nodes, chain.parent);
            most_voted(&true_grid, &samples(nodes, foot))
        })
        .collect();
    let found_of: Vec<Option<u32>> = (known.chains.iter().zip(&known.parent).enumerate())
        .map(|(index, (nodes, &parent))| {
            let foot = foot(&known.chains, nodes, parent);
            most_voted(&found_grid, &samples(nodes, foot))
                .filter(|&f| true_of[f as usize] == Some(index as u32))
        })
        .collect();
    let found = found_of.iter().flatten().count();
    let right_parent = (0..known.chains.len())
        .filter(|&i| {
            found_of[i].is_some_and(|f| {
                let parent = tree.skeleton.chains[f as usize].parent;
                match (known.parent[i], parent) {
                    (None, None) => true,
                    (Some(t), Some(p)) => found_of[t as usize] == Some(p),
                    _ => false,
                }
            })
        })
        .count();
    Score {
        branches: known.chains.len(),
        found: found as f64 / known.chains.len() as f64,
        per_branch: found_chains.len() as f64 / known.chains.len() as f64,
        parent: right_parent as f64 / found.max(1) as f64,
        leaves: truth.leaves.len(),
        leaf: right_leaves(tree, truth, &found_of),
    }
}

/// Share of true leaves whose recognised leaf (the one with the nearest centre) hangs right.
fn right_leaves(tree: &Tree, truth: &TrueSkeleton, found_of: &[Option<u32>]) -> f64 {
    let mut order: Vec<u32> = (0..tree.leaves.len() as u32).collect();
    let x = |l: u32| tree.leaves[l as usize].center.x;
    order.sort_by(|&a, &b| x(a).total_cmp(&x(b)));
    let mut right = 0;
    for leaf in &truth.leaves {
        let p = normalised(tree, leaf.center);
        let start = order.partition_point(|&l| x(l) < p.x - 2e-4);
        let nearest = (order[start..].iter().copied())
            .take_while(|&l| x(l) <= p.x + 2e-4)
            .min_by(|&a, &b| {
                let d = |l: u32| tree.leaves[l as usize].center.distance(p);
                d(a).total_cmp(&d(b))
            });
        let chain = nearest
            .filter(|&l| tree.leaves[l as usize].center.distance(p) < 1e-3)
            .map(|l| tree.leaves[l as usize].node)
            .filter(|&n| n != NO_NODE)
            .map(|n| tree.skeleton.nodes[n as usize].chain);
        right += usize::from(chain.is_some() && chain == found_of[leaf.chain as usize]);
    }
    right as f64 / truth.leaves.len().max(1) as f64
}

#[test]
fn grown_trees_are_recognised() {
    println!(
        "{:<14} {:<6} {:<9} {:<5} {:>8} {:>7} {:>7} {:>7} {:>8} {:>7}",
        "species",
        "wood",
        "foliage",
        "nodes",
        "branches",
        "found",
        "ratio",
        "parent",
        "leaves",
        "right"
    );
    let mut failed = Vec::new();
    for name in Species::names() {
        let species = Species::named(name).expect("a built-in species");
        for (wood, foliage, nodes) in [
            (Wood::Tubes, Foliage::Quads, Nodes::One),
            (Wood::Tubes, Foliage::Polygons, Nodes::Many),
            (Wood::Skin, Foliage::Crossed, Nodes::One),
            (Wood::Soup, Foliage::Polygons, Nodes::One),
        ] {
            if wood == Wood::Skin && nodes == Nodes::Many {
                continue;
            }
            let options = Options {
                seed: 7,
                wood,
                foliage,
                nodes,
                ..Options::default()
            };
            let grown = match grow(&species, &options) {
                Ok(grown) => grown,
                Err(error) => {
                    println!("{name} {wood:?}: skipped, {error}");
                    continue;
                }
            };
            let tree = recognised(&grown);
            let s = score(&tree, &grown.skeleton);
            println!(
                "{name:<14} {:<6} {:<9} {:<5} {:>8} {:>7.4} {:>7.3} {:>7.4} {:>8} {:>7.4}",
                format!("{wood:?}"),
                format!("{foliage:?}"),
                format!("{nodes:?}"),
                s.branches,
                s.found,
                s.per_branch,
                s.parent,
                s.leaves,
                s.leaf
            );
            let leaves_right = s.leaves == 0 || s.leaf >= 0.98;
            if s.found < 0.98 || s.parent < 0.97 || !leaves_right || s.per_branch > 1.05 {
                failed.push(format!("{name} {wood:?} {foliage:?}: {s:?}"));
            }
        }
    }
    assert!(failed.is_empty(), "below the floor:\n{}", failed.join("\n"));
}

/// Wood of MTree is one welded skin, and its file says which stem each vertex belongs to.
#[test]
fn stems_of_a_welded_skin_are_found() {
    let folder = std::env::var("PLEACH_TREES")
        .unwrap_or_else(|_| concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/trees").to_owned());
    let path = std::path::Path::new(&folder).join("mtree_oak_polyleaf.glb");
    let Ok(bytes) = std::fs::read(&path) else {
        println!("skipped: {} is not there", path.display());
        return;
    };
    let model = load_slice(&bytes, &path, &Limits::default()).unwrap();
    let tree = recognise(model, &RecogniseOptions::default()).unwrap();
    let (positions, stems, depths) = stem_attributes(&bytes);
    let key = |p: Vec3| (p * 2e4).round().as_ivec3().to_array();
    let stem_at: std::collections::HashMap<[i32; 3], (i64, i64)> = (positions.iter())
        .zip(stems.iter().zip(&depths))
        .map(|(&p, (&stem, &depth))| (key(normalised(&tree, p)), (stem as i64, depth as i64)))
        .collect();
    // Triangles vote for pairs of stem and chain.
    let mut votes: Vec<(i64, u32, i64)> = Vec::new();
    for (t, &node) in tree.wood_node.iter().enumerate() {
        if node != NO_NODE {
            let chain = tree.skeleton.nodes[node as usize].chain;
            let corners = tree.model.corners(t as u32);
            let stems = corners.iter().filter_map(|&p| stem_at.get(&key(p)));
            votes.extend(stems.map(|&(stem, depth)| (stem, chain, depth)));
        }
    }
    votes.sort_unstable();
    let (mut all, mut found, mut order) = (0, 0, 0);
    for stem in votes.chunk_by(|a, b| a.0 == b.0) {
        let most = stem.chunk_by(|a, b| a.1 == b.1).max_by_key(|r| r.len());
        let Some(most) = most else { continue };
        let (_, chain, depth) = most[0];
        let of_chain = votes.iter().filter(|v| v.1 == chain).count();
        let alone = most.len() * 10 >= of_chain * 6 && most.len() * 10 >= stem.len() * 6;
        all += 1;
        found += usize::from(alone);
        order += usize::from(alone && tree.skeleton.chains[chain as usize].order as i64 == depth);
    }
    println!(
        "mtree skin: {found} of {all} stems found, {order} with the right order, {} chains",
        tree.skeleton.chains.len()
    );
    assert!(found * 100 >= all * 92, "{found} of {all} stems found");
}

/// Positions and the attributes `_stem_id` and `_hierarchy_depth` of the file's wood.
fn stem_attributes(glb: &[u8]) -> (Vec<[f32; 3]>, Vec<f32>, Vec<f32>) {
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let json: serde_json::Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    let binary = &glb[28 + length..];
    let attributes = &json["meshes"][0]["primitives"][0]["attributes"];
    let floats = |name: &str, width: usize| -> Vec<f32> {
        let accessor = &json["accessors"][attributes[name].as_u64().unwrap() as usize];
        let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        assert_eq!(accessor["componentType"], 5126);
        let start =
            view["byteOffset"].as_u64().unwrap_or(0) + accessor["byteOffset"].as_u64().unwrap_or(0);
        let count = accessor["count"].as_u64().unwrap() as usize * width;
        let bytes = &binary[start as usize..start as usize + count * 4];
        let value = |b: &[u8]| f32::from_le_bytes(b.try_into().unwrap());
        bytes.chunks_exact(4).map(value).collect()
    };
    let flat = floats("POSITION", 3);
    let positions = flat.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    (
        positions,
        floats("_stem_id", 1),
        floats("_hierarchy_depth", 1),
    )
}
