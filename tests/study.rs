//! The studies on small grown trees, and the manifest's sub-trees.

use std::path::Path;

use pleach::botany::grow::{Options, Species as Kind, grow};
use pleach::botany::load::{Limits, load_slice};
use pleach::botany::recognise::{RecogniseOptions, recognise};
use pleach::botany::tree::Tree;
use pleach::describe::Describer;
use pleach::detail::element::elements;
use pleach::detail::opaque::Opaque;
use pleach::detail::optimal_distance::{TEXELS, aspects};
use pleach::export::manifest::{Card, FORMAT, Level, Manifest, VERSION, Visibility};
use pleach::runtime::{Density, Form, Hidden, Law, Occlusion, Plain};
use pleach::scene::Scene;
use pleach::study::lee;
use pleach::study::scenes::{approach, focal_px, stand_at, tree_cells};
use pleach::study::species::Species;
use pleach::study::stand::Stand;

fn tree(name: &str, leaves: u32) -> Tree {
    let kind = Kind::named(name).unwrap();
    let options = Options {
        leaves: Some(leaves),
        ..Options::default()
    };
    let grown = grow(&kind, &options).unwrap();
    let model = load_slice(&grown.glb, Path::new(name), &Limits::default()).unwrap();
    recognise(model, &RecogniseOptions::default()).unwrap()
}

/// A manifest of a tree without levels.
fn manifest(tree: &Tree) -> Manifest {
    let (elements, scene) = (elements(tree, &Opaque::of(tree)), Scene::default());
    let describer = Describer::new(tree, &elements, &scene);
    Manifest {
        format: FORMAT.into(),
        version: VERSION,
        tree: describer.original(),
        subtree_texels: TEXELS,
        subtrees: describer.subtrees(),
        scene: scene.clone(),
        ..Manifest::default()
    }
}

fn read(text: &str) -> pleach::Result<Manifest> {
    Manifest::from_ron(text, Path::new("tree.pleach.ron"))
}

#[test]
fn a_manifest_says_of_every_subtree_what_a_cut_needs() {
    let tree = tree("oak", 400);
    let written = manifest(&tree);
    let manifest = read(&written.to_ron().unwrap()).unwrap();
    assert_eq!(manifest, written);
    let focal = manifest.scene.focal_px() as f32;
    for (i, s) in manifest.subtrees.iter().enumerate() {
        assert!(
            (s.optimal_distance_m - 2.0 * s.radius_m * focal / TEXELS as f32).abs()
                < 1e-3 * s.optimal_distance_m
        );
        assert!(
            s.children
                .iter()
                .all(|&c| manifest.subtrees[c as usize].parent == Some(i as u32))
        );
        assert_eq!(
            s.order == 0,
            s.branch == [0.0; 3],
            "order {} with direction {:?}",
            s.order,
            s.branch
        );
    }
    assert!(manifest.subtrees.iter().any(|s| s.density > 0.0));
    let hierarchy = manifest.hierarchy().unwrap();
    assert_eq!(hierarchy.origins()[0].leaves as u64, manifest.tree.leaves);
    let tips = (0..hierarchy.nodes().len()).filter(|&n| hierarchy.is_tip(n as u32));
    assert_eq!(
        tips.map(|n| hierarchy.origins()[n].leaves).sum::<u32>() as u64,
        manifest.tree.leaves
    );
}

#[test]
fn a_spoiled_manifest_is_refused_by_its_field() {
    let good = manifest(&tree("palm", 60));
    let text = good.to_ron().unwrap();
    let refusal = |text: &str| read(text).unwrap_err().to_string();
    let spoiled = |spoil: &dyn Fn(&mut Manifest)| {
        let mut bad = good.clone();
        spoil(&mut bad);
        refusal(&bad.to_ron().unwrap())
    };
    let message = refusal(&text.replacen(&format!("version: {VERSION}"), "version: 1", 1));
    assert!(
        message.contains("version") && message.contains('1'),
        "{message}"
    );
    for part in [0.1, 0.5, 0.99] {
        let message = refusal(&text[..(text.len() as f64 * part) as usize]);
        assert!(message.contains("line "), "{message}");
    }
    let last = good.subtrees.len() - 1;
    type Spoil<'a> = (&'a str, &'a dyn Fn(&mut Manifest));
    let cases: [Spoil; 13] = [
        ("cards[0].copy_of", &|m| {
            m.levels.push(Level {
                cards: vec![Card {
                    copy_of: Some(0),
                    ..Card::default()
                }],
                ..Level::default()
            });
        }),
        ("representative", &|m| {
            m.subtrees[0].representative = 1;
        }),
        ("visibility.shares", &|m| {
            m.visibility = Some(Visibility {
                side: 6,
                shares: "AAAA".into(),
            });
        }),
        ("visibility.shares", &|m| {
            m.visibility = Some(Visibility {
                side: 0,
                shares: "!".into(),
            });
        }),
        ("radius_m", &|m| m.subtrees[last].radius_m = f32::NAN),
        ("connector", &|m| m.subtrees[1].connector[2] = f32::INFINITY),
        ("optimal_distance_m", &|m| {
            m.subtrees[0].optimal_distance_m = f32::NEG_INFINITY
        }),
        ("own.geometric_distance_m", &|m| {
            m.subtrees[1].own.as_mut().unwrap().geometric_distance_m = f32::NAN
        }),
        ("density", &|m| m.subtrees[1].density = 1.5),
        ("children", &|m| m.subtrees[0].children.push(4000)),
        ("parent", &|m| m.subtrees[last].parent = Some(4000)),
        ("parent", &|m| m.subtrees[last].parent = None),
        ("tree.height_m", &|m| m.tree.height_m = f64::NAN),
    ];
    for (field, spoil) in cases {
        let message = spoiled(spoil);
        assert!(message.contains(field), "{field}: {message}");
    }
    let message = spoiled(&|m| m.subtrees.truncate(last));
    assert!(
        message.contains("subtrees[") && message.contains("no sub-tree"),
        "{message}"
    );
    assert!(refusal(&text.replacen("density:", "destiny:", 1)).contains("density"));
}

#[test]
fn a_dense_crown_is_denser_than_a_sparse_one() {
    let density = |leaves: u32| {
        let tree = tree("oak", leaves);
        let aspects = aspects(&tree, 1000.0);
        let first: Vec<f32> = tree
            .subtrees
            .iter()
            .zip(&aspects)
            .filter(|(s, _)| s.order == 1)
            .map(|(_, a)| a.density)
            .collect();
        first.iter().sum::<f32>() / first.len() as f32
    };
    let palm = tree("palm", 200);
    assert!(
        aspects(&palm, 1000.0)
            .iter()
            .all(|a| (0.0..=1.0).contains(&a.density))
    );
    let [sparse, dense] = [150, 4000].map(density);
    assert!(dense > sparse && dense > 0.05, "{sparse} {dense}");
}

#[test]
fn cuts_of_a_real_hierarchy_draw_every_leaf_once_and_cost_less_with_occlusion() {
    let alone = [Species::new(tree("oak", 600), focal_px(), 64).unwrap()];
    let place = stand_at(&alone[0].tree, glam::Vec2::ZERO, 0.0, 1.0, 0);
    let cells = tree_cells(&alone[0], &place, 12, None);
    assert!(cells.solidity().iter().any(|&s| s > 0.05));
    let stand = Stand::new(&alone, vec![place]);
    let path = approach(&place, 60);
    let shown: Vec<usize> = (0..60).collect();
    let density = Density::default();
    let hidden = Hidden::new(density, Occlusion::new(&cells, Law::Beer));
    let walks = [
        stand.walk(Plain, &path, &shown),
        stand.walk(density, &path, &shown),
        stand.walk(hidden, &path, &shown),
    ];
    for walk in &walks {
        for drawn in &walk.shown {
            let mut triangles: Vec<u32> = drawn
                .iter()
                .flat_map(|d| &alone[0].looks[d.node as usize].triangles)
                .copied()
                .collect();
            triangles.sort_unstable();
            let all = alone[0].tree.model.triangles.len() as u32;
            assert!(
                triangles.iter().copied().eq(0..all),
                "{} of {all}",
                triangles.len()
            );
        }
    }
    let triangles = walks.each_ref().map(|w| w.cost.triangles);
    assert!(
        triangles[0] >= triangles[1] && triangles[1] > triangles[2],
        "{triangles:?}"
    );
    let last = walks[0].shown.last().unwrap();
    assert!(last.iter().any(|d| d.form == Form::Geometry) && walks[0].shown[0].len() < last.len());
}

#[test]
fn everything_drawn_by_the_cut_or_leaf_by_leaf_is_one_picture_up_close() {
    let alone = [Species::new(tree("palm", 120), focal_px(), 64).unwrap()];
    let place = stand_at(&alone[0].tree, glam::Vec2::ZERO, 0.0, 1.0, 0);
    let stand = Stand::new(&alone, vec![place]);
    let view = approach(&place, 40)[39];
    let whole = stand.draw(&stand.everything(&view), &view, 120);
    // So near that every sub-tree is open: nothing but geometry.
    let near = pleach::runtime::View { zoom: 1e6, ..view };
    let cut = stand.walk(Plain, &[near], &[0]);
    let drawn = stand.draw(&cut.shown[0], &view, 120);
    assert_eq!(whole.agrees(&drawn, |a, b| a == b), 1.0);
    assert!(whole.visible().len() > 100);
}

#[test]
fn measured_priorities_beat_the_papers_three() {
    let tree = tree("oak", 500);
    let settings = lee::Settings {
        height_px: 128,
        views: 7,
        map_side: 8,
        ..lee::Settings::default()
    };
    let study = lee::study(&tree, &settings);
    assert_eq!(study.leaves, 500);
    for figures in &study.figures {
        let best = figures[..3]
            .iter()
            .map(|f| f.incorrect)
            .fold(f64::MAX, f64::min);
        assert!(figures[3].incorrect < best, "{figures:?}");
    }
    // The fewer leaves, the more pixels are wrong.
    for pair in study.figures.windows(2) {
        assert!((0..4).all(|p| pair[0][p].incorrect < pair[1][p].incorrect));
    }
    let json = study.to_json();
    let first = &json["budgets"][0];
    assert_eq!(first["budget"], 0.8);
    assert_eq!(first.as_object().unwrap().len(), 5);
    assert!(first["layer_normal"].as_f64().unwrap() < 1.0);
}

#[test]
fn groups_of_leaves_spend_the_same_budget() {
    let tree = tree("oak", 500);
    let settings = lee::Settings {
        height_px: 96,
        views: 4,
        map_side: 4,
        group: 8,
        ..lee::Settings::default()
    };
    let study = lee::study(&tree, &settings);
    assert_eq!(study.leaves, 500);
    assert!(
        study
            .figures
            .iter()
            .flatten()
            .all(|f| f.incorrect > 0.0 && f.incorrect < 1.0)
    );
}
