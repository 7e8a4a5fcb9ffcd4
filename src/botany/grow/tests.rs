//! What a grown tree promises, tried on every built-in species.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use glam::Vec3;

use super::mesh::Mesh;
use super::*;

fn species() -> impl Iterator<Item = Species> {
    Species::names().map(|name| Species::named(name).unwrap_or_else(|| panic!("{name} is wrong")))
}

fn small(species: &Species) -> Options {
    Options {
        leaves: species.leaf.as_ref().map(|_| 1000),
        ..Options::default()
    }
}

fn stems(species: &Species) -> Vec<stem::Stem> {
    let amount = leaf_amount(species, &small(species)).unwrap();
    stem::grow(species, &branch_scales(species, amount), 0)
}

/// Vertices that have the same position have the same number.
fn welded(mesh: &Mesh) -> Vec<[u32; 3]> {
    let mut numbers = BTreeMap::new();
    let number: Vec<u32> = mesh
        .positions
        .iter()
        .map(|p| {
            let next = numbers.len() as u32;
            *numbers
                .entry(p.to_array().map(f32::to_bits))
                .or_insert(next)
        })
        .collect();
    let triangles = mesh.triangles.iter();
    triangles.map(|t| t.map(|i| number[i as usize])).collect()
}

/// Number of pieces that share no vertex.
fn pieces(triangles: &[[u32; 3]]) -> usize {
    fn root(link: &mut [u32], mut i: u32) -> u32 {
        while link[i as usize] != i {
            link[i as usize] = link[link[i as usize] as usize];
            i = link[i as usize];
        }
        i
    }
    let count = triangles.iter().flatten().max().map_or(0, |&m| m + 1);
    let mut link: Vec<u32> = (0..count).collect();
    for &[a, b, c] in triangles {
        for other in [b, c] {
            let (x, y) = (root(&mut link, a), root(&mut link, other));
            link[x as usize] = y;
        }
    }
    let used: BTreeSet<u32> = triangles
        .iter()
        .flatten()
        .map(|&i| root(&mut link, i))
        .collect();
    used.len()
}

fn joined(meshes: &[Mesh]) -> Mesh {
    let mut all = Mesh::default();
    meshes.iter().for_each(|m| all.append(m));
    all
}

#[test]
fn same_options_give_the_same_bytes_and_other_seeds_another_tree() {
    for species in species() {
        let options = small(&species);
        let (a, b) = (
            grow(&species, &options).unwrap(),
            grow(&species, &options).unwrap(),
        );
        assert!(
            a.glb == b.glb && a.skeleton == b.skeleton,
            "{}",
            species.name
        );
        let other = grow(&species, &Options { seed: 1, ..options }).unwrap();
        assert!(a.glb != other.glb, "{}", species.name);
    }
}

#[test]
fn as_many_leaves_as_asked_for_on_more_twigs() {
    for species in species().filter(|s| s.leaf.is_some()) {
        let mut branches = 0;
        for n in [1, 1000, 20_001] {
            let options = Options {
                leaves: Some(n),
                ..Options::default()
            };
            let skeleton = grow(&species, &options).unwrap().skeleton;
            assert_eq!(skeleton.leaves.len(), n as usize, "{}", species.name);
            assert!(skeleton.chains.len() > branches, "{} at {n}", species.name);
            branches = skeleton.chains.len();
        }
    }
}

#[test]
fn numbers_of_leaves_out_of_range_are_refused() {
    let (oak, bare) = (
        Species::named("oak").unwrap(),
        Species::named("birch_winter").unwrap(),
    );
    for (species, n) in [(&oak, 0), (&oak, MAX_LEAVES + 1), (&bare, 1000)] {
        let options = Options {
            leaves: Some(n),
            ..Options::default()
        };
        assert_eq!(grow(species, &options).unwrap_err().exit_code(), 2);
    }
}

#[test]
fn skeleton_is_a_tree_whose_branches_begin_on_their_parents() {
    for species in species() {
        let skeleton = grow(&species, &small(&species)).unwrap().skeleton;
        for (i, chain) in skeleton.chains.iter().enumerate() {
            assert_eq!(chain.points.len(), chain.radii.len());
            assert!(chain.points.len() > 1 && chain.radii.iter().all(|&r| r > 0.0));
            let Some(parent) = chain.parent else {
                assert_eq!((i, chain.order), (0, 0));
                continue;
            };
            assert!((parent as usize) < i);
            let parent = &skeleton.chains[parent as usize];
            assert_eq!(chain.order, parent.order + 1);
            let distance = distance_to(&parent.points, chain.points[0]);
            assert!(
                distance < 1e-3,
                "{}: chain {i} floats by {distance} m",
                species.name
            );
        }
    }
}

#[test]
fn leaves_hang_within_reach_of_their_chain() {
    for species in species() {
        let Some(kind) = &species.leaf else { continue };
        let skeleton = grow(&species, &small(&species)).unwrap().skeleton;
        let size = rng::pow(kind.count as f32 / 1000.0, 0.42);
        for leaf in &skeleton.leaves {
            let chain = &skeleton.chains[leaf.chain as usize];
            let reach = 0.7 * size * (kind.length.0 + kind.length.1) + chain.radii[0];
            let distance = distance_to(&chain.points, leaf.center);
            assert!(
                distance < reach,
                "{}: {distance} m of {reach}",
                species.name
            );
        }
    }
}

fn distance_to(line: &[[f32; 3]], point: [f32; 3]) -> f32 {
    let p = Vec3::from(point);
    let pairs = line.windows(2).map(|w| {
        let (a, b) = (Vec3::from(w[0]), Vec3::from(w[1]));
        let t = (p - a).dot(b - a) / (b - a).length_squared().max(1e-12);
        a.lerp(b, t.clamp(0.0, 1.0)).distance(p)
    });
    pairs.fold(f32::MAX, f32::min)
}

#[test]
fn a_tube_is_one_piece_and_soup_shares_nothing() {
    for species in species() {
        let stems = stems(&species);
        for stem in stems.iter().step_by(17) {
            let tube = tube::tube(&species, stem);
            assert_eq!(pieces(&welded(&tube)), 1);
            let count = tube.triangles.len();
            let soup = tube.into_soup();
            assert_eq!(pieces(&soup.triangles), count);
            assert_eq!(pieces(&welded(&soup)), 1);
        }
        let all: Vec<Mesh> = stems.iter().map(|s| tube::tube(&species, s)).collect();
        assert_eq!(
            pieces(&joined(&all).triangles),
            stems.len(),
            "{}",
            species.name
        );
    }
}

#[test]
fn tangents_run_around_the_stem_and_bitangents_up() {
    for species in species() {
        for stem in stems(&species).iter().step_by(29) {
            let tube = tube::tube(&species, stem);
            for &t in &tube.triangles[..2 * species.levels[stem.level].sides as usize] {
                let [a, b, c] = t.map(|i| i as usize);
                let n = tube.normals[a];
                let t = Vec3::from_slice(&tube.tangents()[a][..3]);
                assert!(n.dot(t).abs() < 1e-4 && (t.length() - 1.0).abs() < 1e-4);
                // The bitangent looks to where v falls: rows of an image go down.
                for corner in [b, c] {
                    let rise = tube.uvs[a].y - tube.uvs[corner].y;
                    let up = n.cross(t).dot(tube.positions[corner] - tube.positions[a]);
                    assert!(rise.abs() < 1e-3 || rise * up > 0.0, "{}", species.name);
                }
            }
        }
    }
}

#[test]
fn a_skin_is_one_closed_piece_open_at_the_ground_alone() {
    for species in species() {
        let stems = stems(&species);
        let skin = joined(&skin::skin(&species, &stems));
        let triangles = welded(&skin);
        assert_eq!(pieces(&triangles), 1, "{}", species.name);
        // Each edge has a partner that runs the other way.
        let mut edges: BTreeMap<(u32, u32), i32> = BTreeMap::new();
        for &[a, b, c] in triangles
            .iter()
            .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
        {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
            }
        }
        let open = edges.values().filter(|&&n| n != 0).count();
        assert_eq!(open, species.levels[0].sides as usize, "{}", species.name);
    }
}

#[test]
fn leaf_meshes_have_the_promised_pieces() {
    for species in species() {
        let Some(kind) = &species.leaf else { continue };
        let sprig = outline::sprig(kind.outline, kind.sprig);
        for (way, count) in [
            (Foliage::Quads, 1),
            (Foliage::Crossed, 2),
            (Foliage::Polygons, 1),
        ] {
            let leaf = foliage::prototype(&sprig, way);
            assert_eq!(pieces(&leaf.triangles), count, "{} {way:?}", species.name);
            assert!(
                leaf.uvs
                    .iter()
                    .all(|uv| uv.min_element() > -1e-4 && uv.max_element() < 1.0001)
            );
            for t in &leaf.triangles {
                let [a, b, c] = t.map(|i| leaf.positions[i as usize]);
                let normal = (b - a).cross(c - a);
                assert!(
                    normal.dot(leaf.normals[t[0] as usize]) > 0.0,
                    "{} {way:?}",
                    species.name
                );
            }
        }
    }
}

#[test]
fn a_painted_leaf_is_partly_opaque_and_nowhere_black() {
    for species in species() {
        let Some(kind) = &species.leaf else { continue };
        let sprig = outline::sprig(kind.outline, kind.sprig);
        let painted = paint::paint_sprig(&sprig, kind).unwrap();
        let texels: Vec<&[u8]> = painted.texels.chunks_exact(4).collect();
        assert_eq!(texels.len() as u32, painted.width * painted.height);
        let opaque = texels.iter().filter(|t| t[3] >= 128).count() as f32 / texels.len() as f32;
        assert!((0.12..0.85).contains(&opaque), "{}: {opaque}", species.name);
        assert!(texels.iter().all(|t| t[1] > 16), "{}: black", species.name);
        // The card's sides and top cut no leaf.
        let width = painted.width as usize;
        assert!(
            texels[..width].iter().all(|t| t[3] == 0),
            "{}: top",
            species.name
        );
        let sides = texels
            .chunks_exact(width)
            .map(|row| row[0][3].max(row[width - 1][3]));
        assert_eq!(sides.max(), Some(0), "{}: sides", species.name);
    }
}

#[test]
fn polygons_cover_what_the_painting_covers() {
    for species in species() {
        let Some(kind) = &species.leaf else { continue };
        let sprig = outline::sprig(kind.outline, kind.sprig);
        let painted = paint::paint_sprig(&sprig, kind).unwrap();
        let texels = painted.texels.chunks_exact(4);
        let painted = texels.clone().filter(|t| t[3] >= 128).count() as f32 / texels.len() as f32;
        let size = sprig.high - sprig.low;
        let leaf = foliage::prototype(&sprig, Foliage::Polygons);
        let area: f32 = leaf
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| leaf.positions[i as usize]);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum();
        // Leaves of a sprig overlap, coarse outlines cut corners.
        let ratio = area / (size.x * size.y) / painted;
        assert!((0.7..1.7).contains(&ratio), "{}: {ratio}", species.name);
    }
}

#[test]
fn wrong_species_are_refused_with_line_and_column() {
    let good = include_str!("../../../assets/species/oak.ron");
    let line_of = |text: &str, part: &str| 1 + text.lines().position(|l| l.contains(part)).unwrap();
    for (old, new, says) in [
        ("bare: 0.2,", "bare: 1.2,", "1.2 is out of range (0 to 1)"),
        ("bare: 0.2,", "bald: 0.2,", "bald"),
        ("shape: Spherical,", "shape: Round,", "Round"),
        ("flare: 0.9,", "flare: \"much\",", "float"),
        (
            "height: (11.0, 0.0),",
            "height: (11.0, 300.0),",
            "out of range (0.001 to 200)",
        ),
        ("count: 6000,", "count: 0,", "0 is out of range"),
    ] {
        let bad = good.replacen(old, new, 1);
        assert_ne!(bad, good, "{old} is not in oak.ron");
        let error = Species::from_ron(&bad, Path::new("oak.ron")).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        let message = error.to_string();
        let place = format!("oak.ron: line {}, column ", line_of(&bad, new));
        assert!(message.starts_with(&place), "{message}");
        assert!(
            message.to_lowercase().contains(&says.to_lowercase()),
            "{message}"
        );
    }
}

#[test]
fn the_sample_oak_is_what_the_program_grows() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    let options = Options {
        seed: 5,
        ..Options::default()
    };
    let oak = grow(&Species::named("oak").unwrap(), &options).unwrap();
    assert!(oak.glb.len() < 6_000_000, "{} bytes", oak.glb.len());
    let asset = std::fs::read(folder.join("oak.glb")).unwrap();
    assert!(
        asset == oak.glb,
        "write it anew: pleach grow oak --seed 5 -o assets/oak.glb"
    );
    let truth = TrueSkeleton::read(&folder.join("oak.skeleton.ron")).unwrap();
    assert_eq!(truth, oak.skeleton);
}
