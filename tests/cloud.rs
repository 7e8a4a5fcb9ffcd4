//! Billboards and the adaptive loop on real trees. The trees are not part of the repository:
//! set PLEACH_TREES to their folder, or these tests say why they are skipped.

use std::path::PathBuf;
use std::time::Instant;

use pleach::botany::{Tree, load, recognise};
use pleach::cloud::cross::cross;
use pleach::cloud::foliage::faces_of;
use pleach::cloud::plane::planes;
use pleach::cloud::strip::{Sections, strip};
use pleach::cloud::{Card, Foliage, Occlusion, Outline, coverage};
use pleach::detail::adapt::unit::Units;
use pleach::detail::adapt::{AdaptOptions, Adapted, Generator, adapt};

fn tree(name: &str) -> Option<Tree> {
    let folder = std::env::var_os("PLEACH_TREES").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/trees")),
        PathBuf::from,
    );
    let path = folder.join(name);
    if !path.is_file() {
        println!("skipped: {} is absent (set PLEACH_TREES)", path.display());
        return None;
    }
    let model = load::load(&path).expect("the tree loads");
    Some(recognise::recognise(model, &Default::default()).expect("the tree is recognised"))
}

fn occlusion(tree: &Tree) -> Occlusion {
    let centers: Vec<_> = tree.leaves.iter().map(|l| l.center).collect();
    Occlusion::of_leaves(&centers, tree.model.height())
}

/// Tolerance of one pixel for a tree that is `pixels` high on the screen.
fn options(tree: &Tree, pixels: f64, triangles: Option<usize>) -> AdaptOptions {
    AdaptOptions {
        epsilon: f64::from(tree.model.height()) / pixels,
        triangles,
        ..AdaptOptions::default()
    }
}

fn sound(adapted: &Adapted, tree: &Tree) {
    let groups = adapted.groups.iter();
    let mut all: Vec<u32> = groups.flat_map(|g| g.leaves.clone()).collect();
    all.sort_unstable();
    assert_eq!(all, (0..tree.leaves.len() as u32).collect::<Vec<_>>());
    let mut cards = adapted.groups.iter().flat_map(|g| &g.cards);
    assert!(cards.all(Card::is_sound));
}

#[test]
fn a_palm_is_covered_at_every_distance_and_limit() {
    let Some(tree) = tree("sap_palm_fan.glb") else {
        return;
    };
    let occlusion = occlusion(&tree);
    let mut before = f64::MAX;
    for limit in [20, 100, 500] {
        let adapted = adapt(&tree, &occlusion, &options(&tree, 256.0, Some(limit)));
        sound(&adapted, &tree);
        assert!(adapted.triangles() <= limit);
        assert!(adapted.error() <= before * (1.0 + 1e-9), "{limit}");
        before = adapted.error();
    }
    sound(
        &adapt(&tree, &occlusion, &options(&tree, 64.0, None)),
        &tree,
    );
}

const STUDIED: [&str; 7] = [
    "sap_palm_fan.glb",
    "sap_palm_pinnate.glb",
    "sap_weeping_willow_rect.glb",
    "sap_small_pine_rect.glb",
    "sap_birch_6142.glb",
    "ez_oak_medium.glb",
    "mtree_oak_polyleaf.glb",
];

/// Prints which generators the loop chooses at which distance. Not a test of anything: run it
/// with `--ignored --nocapture`.
#[test]
#[ignore = "a study: prints figures"]
fn study_of_chosen_generators() {
    println!("tree pixels | ms groups triangles | share of area: geometry plane cross strip");
    for name in STUDIED {
        let Some(tree) = tree(name) else { continue };
        let clock = Instant::now();
        let occlusion = occlusion(&tree);
        let total: f64 = tree.leaves.iter().map(|l| f64::from(l.area)).sum();
        println!(
            "{name}: {} leaves, {} subtrees, radius/height {:.3}, d_min {:.1}, occlusion {} ms",
            tree.leaves.len(),
            tree.subtrees.len(),
            occlusion.radius() / tree.model.height(),
            occlusion.d_min(),
            clock.elapsed().as_millis()
        );
        for pixels in [1024.0, 512.0, 256.0, 128.0, 64.0, 32.0] {
            let clock = Instant::now();
            let adapted = adapt(&tree, &occlusion, &options(&tree, pixels, None));
            let share = |generator: Generator| {
                let own = adapted.groups.iter().filter(|g| g.generator == generator);
                let leaves = own.flat_map(|g| &g.leaves);
                let area: f64 = leaves
                    .map(|&l| f64::from(tree.leaves[l as usize].area))
                    .sum();
                area.abs() / total
            };
            println!(
                "  {pixels:5} | {:5} {:6} {:6} | {:.2} {:.2} {:.2} {:.2} | initial {} split {} merged {}",
                clock.elapsed().as_millis(),
                adapted.groups.len(),
                adapted.triangles(),
                share(Generator::Geometry),
                share(Generator::Plane),
                share(Generator::Cross),
                share(Generator::Strip),
                adapted.initial,
                adapted.split,
                adapted.merged,
            );
        }
    }
}

/// Prints strips against as many separate planes, and crosses, per branch: the root of the
/// area-weighted mean squared distance, in thousandths of the tree's height.
#[test]
#[ignore = "a study: prints figures"]
fn study_of_strips_against_planes() {
    println!("tree: branches, leaves a branch | triangles: planes strip cross");
    for name in STUDIED {
        let Some(tree) = tree(name) else { continue };
        for (what, groups) in [("branches", branches(&tree)), ("leaves", big_leaves(&tree))] {
            if groups.is_empty() {
                continue;
            }
            let leaves: usize = groups.iter().map(|g| g.0).sum();
            let each = leaves as f32 / groups.len() as f32;
            println!("{name}: {} {what}, {each:.1} leaves each", groups.len());
            for k in [1usize, 2, 3, 4, 6] {
                let mean = |make: &dyn Fn(&Foliage<'_>) -> Option<Vec<Card>>| {
                    let (mut square, mut area, mut wins) = (0.0, 0.0, Vec::new());
                    for (_, faces, connector) in &groups {
                        let foliage = Foliage {
                            faces,
                            connector: *connector,
                        };
                        let cards = make(&foliage).unwrap_or_default();
                        let c = coverage(&foliage, &cards, 0.0);
                        if c.mean_square.is_finite() {
                            square += c.mean_square * c.total;
                            area += c.total;
                        }
                        wins.push(c.mean_square);
                    }
                    let rms = (square / f64::max(area, 1e-30)).sqrt();
                    (rms / f64::from(tree.model.height()) * 1000.0, wins)
                };
                let (apart, a) = mean(&|f| planes(f, k, Outline::Quad));
                let sections = Sections {
                    count: k,
                    merge_error: 0.0,
                };
                let (band, b) = mean(&|f| strip(f, sections));
                let won = a.iter().zip(&b).filter(|(a, b)| b < a).count();
                let crossed = match k {
                    2 => format!("{:.2}", mean(&|f| cross(f, Outline::Quad)).0),
                    _ => "-".to_owned(),
                };
                let share = 100 * won / groups.len();
                println!(
                    "  {:3}: {apart:6.2} {band:6.2} {crossed} | strip closer on {share} %",
                    2 * k
                );
            }
        }
    }
}

type Group = (usize, Vec<pleach::cloud::Face>, glam::Vec3);

/// All foliage of each sub-tree that carries no other one and has two leaves or more.
fn branches(tree: &Tree) -> Vec<Group> {
    let units = Units::new(tree);
    let whole = units.units.iter().enumerate().filter(|(_, unit)| {
        let parent = unit.parent.map(|p| units.units[p as usize].subtree);
        let tip = tree.subtrees[unit.subtree as usize].children.is_empty();
        tip && unit.leaves.len() > 1 && parent != Some(unit.subtree)
    });
    let group = |(at, unit): (usize, &pleach::detail::adapt::unit::Unit)| {
        let leaves = units.leaves(at as u32);
        (leaves.len(), faces_of(tree, leaves), unit.connector)
    };
    whole.map(group).collect()
}

/// Single leaves that have ten triangles or more: fronds that were modelled whole.
fn big_leaves(tree: &Tree) -> Vec<Group> {
    let big = tree
        .leaves
        .iter()
        .zip(0u32..)
        .filter(|(l, _)| l.triangles.len() >= 10);
    let group = |(leaf, at): (&pleach::botany::tree::Leaf, u32)| {
        let node = tree.skeleton.nodes.get(leaf.node as usize);
        let connector = node.map_or(leaf.center, |n| n.position);
        (1, faces_of(tree, &[at]), connector)
    };
    big.map(group).collect()
}
