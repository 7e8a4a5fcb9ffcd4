//! What a tree is does not depend on where it stands, how large it is, which way it is turned or in which order
//! its triangles are listed.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;

use glam::DVec3;
use pleach::botany::Model;
use pleach::botany::grow::{Options, Species, grow};
use pleach::botany::load::{Limits, load_slice};
use pleach::botany::model::AlphaMode;
use pleach::botany::recognise::{RecogniseOptions, recognise};
use pleach::botany::tree::{Organ, Tree};
use pleach::cloud::Outline;
use pleach::detail::element::elements;
use pleach::detail::level::Planner;
use pleach::detail::merge::merge;
use pleach::detail::opaque::Opaque;
use pleach::detail::reassign::Reassign;
use pleach::detail::tiles::{TileSize, tiles};
use pleach::pipeline::{Limit, Request, Wanted, bake};
use pleach::recipe::{Preset, Recipe};
use pleach::scene::Scene;
use pleach::watch::Unwatched;
use proptest::prelude::*;
use serde_json::{Value, json};

const SPECIES: [&str; 3] = ["oak", "palm", "spruce"];

/// A few small trees as files.
fn grown() -> &'static [Vec<u8>] {
    static FILES: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    FILES.get_or_init(|| {
        let one = |(seed, name): (u64, &&str)| {
            let options = Options {
                leaves: Some(300),
                seed,
                ..Options::default()
            };
            grow(&Species::named(name).unwrap(), &options).unwrap().glb
        };
        (3..).zip(&SPECIES).map(one).collect()
    })
}

/// The file with all that it shows under a node of this transform.
fn under(glb: &[u8], node: Value) -> Vec<u8> {
    let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    let (length, rest) = (word(12), &glb[20 + word(12)..]);
    let mut root: Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    let mut node = node;
    node["children"] = root["scenes"][0]["nodes"].clone();
    let nodes = root["nodes"].as_array_mut().unwrap();
    nodes.push(node);
    root["scenes"][0]["nodes"] = json!([nodes.len() - 1]);
    let mut text = serde_json::to_vec(&root).unwrap();
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 20 + text.len() + rest.len();
    let mut out = Vec::with_capacity(total);
    out.extend(b"glTF");
    out.extend(
        [2, total as u32, text.len() as u32]
            .map(u32::to_le_bytes)
            .concat(),
    );
    out.extend(b"JSON");
    out.extend(text);
    out.extend(rest);
    out
}

fn model(glb: &[u8]) -> Model {
    load_slice(glb, Path::new("tree.glb"), &Limits::default()).unwrap()
}

/// What the program makes of a tree, without lengths.
#[derive(Debug, PartialEq)]
struct Botany {
    parts: u32,
    wood: usize,
    leaves: usize,
    classes: usize,
    /// Chains of each order.
    chains: BTreeMap<u32, usize>,
    /// Sub-trees with so many leaves.
    subtrees: BTreeMap<u32, usize>,
}

fn botany(tree: &Tree) -> Botany {
    let counted = |list: &mut dyn Iterator<Item = u32>| {
        let mut out = BTreeMap::new();
        list.for_each(|key| *out.entry(key).or_insert(0) += 1);
        out
    };
    Botany {
        parts: tree.part_count,
        wood: tree.organ.iter().filter(|o| **o == Organ::Wood).count(),
        leaves: tree.leaves.len(),
        classes: tree.leaf_classes.len(),
        chains: counted(&mut tree.skeleton.chains.iter().map(|c| c.order)),
        subtrees: counted(&mut tree.subtrees.iter().map(|s| s.leaf_count)),
    }
}

/// Sub-trees that are tiles (what lies between is split along the axes), cards of the best level of a
/// fifth of the leaves' triangles, and its error in the world.
fn cut(tree: &Tree) -> ([usize; 2], f64) {
    let size = TileSize {
        least: 60,
        most: usize::MAX,
    };
    let tiles = tiles(tree, size).iter().filter(|t| t.whole).count();
    let opaque = Opaque::of(tree);
    let mut elements = elements(tree, &opaque);
    elements.retain(|e| e.chain.is_none());
    let hierarchy = merge(&elements, 0.01);
    let choices = vec![Vec::new(); elements.len()];
    let planner = Planner {
        model: &tree.model,
        elements: &elements,
        opaque: &opaque,
        hierarchy: &hierarchy,
        choices: &choices,
        outline: Outline::Triangle,
        reassign: Reassign {
            rounds: 0,
            locality: 0.01,
            neighbours: 12,
        },
    };
    let plan = planner.plan(elements.len() as u64 / 5).unwrap();
    // Area times length squared: the sphere around a turned tree is another one.
    (
        [tiles, plan.cards.len()],
        plan.error * tree.model.frame.radius.powi(4),
    )
}

/// What there is, and a cut through it.
type Seen = (Botany, ([usize; 2], f64));

fn seen(model: Model) -> Seen {
    let tree = recognise(model, &RecogniseOptions::default()).unwrap();
    (botany(&tree), cut(&tree))
}

fn originals() -> &'static [Seen] {
    static SEEN: OnceLock<Vec<Seen>> = OnceLock::new();
    SEEN.get_or_init(|| grown().iter().map(|g| seen(model(g))).collect())
}

/// Compares a model, `size` times as large as the original, with it.
fn same(species: usize, model: Model, size: f64) -> Result<(), TestCaseError> {
    let (botany, (counts, error)) = seen(model);
    let (want, (want_counts, want_error)) = &originals()[species];
    prop_assert_eq!(&botany, want);
    prop_assert!(botany.chains.len() > 1 && botany.leaves > 30 && counts[0] > 1);
    // Rounding may swap two merges of equal cost, and move a triangle from one chain to the next.
    for (count, want) in counts.iter().zip(want_counts) {
        let near = count.abs_diff(*want) * 20 <= *want;
        prop_assert!(near, "{:?} {:?}", counts, want_counts);
    }
    let off = (error / (want_error * size.powi(4)) - 1.0).abs();
    prop_assert!(off < 0.05, "{} {}", error, want_error);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_tree_placed_anywhere_is_the_same_tree(
        species in 0..SPECIES.len(),
        power in -9.0..9.0f64,
        turn in 0.0..std::f64::consts::TAU,
        mirrored: bool,
        heights in prop::array::uniform3(-1e7..1e7f64),
    ) {
        let glb = &grown()[species];
        let size = 10f64.powf(power);
        let height = model(glb).frame.radius * size;
        let (sin, cos) = (turn / 2.0).sin_cos();
        let placed = model(&under(glb, json!({
            "translation": heights.map(|h| h * height),
            "rotation": [0.0, sin, 0.0, cos],
            "scale": [if mirrored { -size } else { size }, size, size],
        })));
        let whole = model(glb);
        prop_assert!((placed.frame.radius / (whole.frame.radius * size) - 1.0).abs() < 0.5);
        let center = DVec3::from_array(heights) * height;
        prop_assert!((placed.frame.center - center).length() < 3.0 * height);
        same(species, placed, size)?;
    }

    #[test]
    fn the_order_of_triangles_and_vertices_does_not_matter(
        species in 0..SPECIES.len(),
        seed in 1..u64::MAX,
    ) {
        let mut shuffled = model(&grown()[species]);
        let mut state = seed;
        let mut below = |n: usize| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as usize % n
        };
        for i in (1..shuffled.triangles.len()).rev() {
            let j = below(i + 1);
            shuffled.triangles.swap(i, j);
            shuffled.triangle_object.swap(i, j);
            shuffled.triangles[i].rotate_left(j % 3);
        }
        let mut order: Vec<usize> = (0..shuffled.positions.len()).collect();
        for i in (1..order.len()).rev() {
            order.swap(i, below(i + 1));
        }
        let mut number = vec![0u32; order.len()];
        for (new, &old) in order.iter().enumerate() {
            number[old] = new as u32;
        }
        shuffled.positions = order.iter().map(|&i| shuffled.positions[i]).collect();
        shuffled.normals = order.iter().map(|&i| shuffled.normals[i]).collect();
        for uvs in shuffled.uvs.iter_mut().filter(|uvs| !uvs.is_empty()) {
            *uvs = order.iter().map(|&i| uvs[i]).collect();
        }
        if !shuffled.colors.is_empty() {
            shuffled.colors = order.iter().map(|&i| shuffled.colors[i]).collect();
        }
        for corner in shuffled.triangles.iter_mut().flatten() {
            *corner = number[*corner as usize];
        }
        same(species, shuffled, 1.0)?;
    }
}

/// Triangles and F1 of each level, and of its foliage's texels that show something: the mean colour, 0 to 255.
fn texels(glb: &[u8]) -> Vec<(u64, f64, [f64; 3])> {
    let home = tempfile::tempdir().unwrap();
    let input = home.path().join("tree.glb");
    std::fs::write(&input, glb).unwrap();
    let request = Request {
        input,
        output: home.path().join("out"),
        wanted: Wanted::Limits(vec![Limit::Share(0.3), Limit::Count(24)]),
        recipe: Recipe::preset(Preset::Draft),
        scene: Scene {
            screen_height_px: 512,
            heights_px: vec![128.0, 64.0],
            ..Scene::default()
        },
        accept: true,
        ..Request::default()
    };
    let baked = bake(&request, &Unwatched).unwrap();
    let levels = baked.report.levels.iter();
    levels
        .map(|level| {
            let bytes = std::fs::read(request.output.join(&level.file)).unwrap();
            let model = model(&bytes);
            let foliage = model
                .materials
                .iter()
                .find(|m| m.alpha_mode == AlphaMode::Mask);
            let image = foliage.unwrap().base_color.unwrap().image;
            let (mut sum, mut count) = (DVec3::ZERO, 0.0);
            for texel in model.images[image as usize].rgba.chunks_exact(4) {
                if texel[3] >= 128 {
                    sum += DVec3::from([0, 1, 2].map(|c| f64::from(texel[c])));
                    count += 1.0;
                }
            }
            (
                level.triangles,
                level.sizes[0].f1.mean,
                (sum / count).to_array(),
            )
        })
        .collect()
}

#[test]
fn quarter_turns_turn_levels_and_keep_their_texels() {
    let glb = grow(
        &Species::named("palm").unwrap(),
        &Options {
            leaves: Some(60),
            seed: 3,
            ..Options::default()
        },
    )
    .unwrap()
    .glb;
    let still = texels(&glb);
    for turn in 1..4 {
        let (sin, cos) = (std::f64::consts::FRAC_PI_4 * f64::from(turn)).sin_cos();
        let turned = texels(&under(&glb, json!({ "rotation": [0.0, sin, 0.0, cos] })));
        for ((n, f1, color), (want_n, want_f1, want_color)) in turned.iter().zip(&still) {
            println!("{n} {want_n} {f1} {want_f1} {color:?} {want_color:?}");
            // Ties between cards of equal cost may fall the other way.
            assert!(n.abs_diff(*want_n) * 20 <= *want_n, "{n} {want_n}");
            // Twenty-four triangles are few: which of them a tie gives to whom is seen, and views stay where they are:
            // of a turned tree they see other sides (.768, .739, .728 and .756; with one alpha .752, .736, .725 and .752).
            let most = if *n > 24 { 0.01 } else { 0.05 };
            assert!((f1 - want_f1).abs() < most, "{f1} {want_f1}");
            for (c, want) in color.iter().zip(want_color) {
                assert!((c - want).abs() < 2.0, "{color:?} {want_color:?}");
            }
        }
    }
}
