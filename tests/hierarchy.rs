//! `bake --hierarchy`: what its files hold, together and each alone.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use glam::Vec3;
use pleach::botany::load::load;
use pleach::export::manifest::{Manifest, SUFFIX};
use pleach::export::manifest_tiles::Tiles;
use pleach::pipeline::{Baked, Request, Wanted, bake};
use pleach::recipe::Recipe;
use pleach::report::Reference;
use pleach::runtime::{ActiveCut, Drawn, Forest, Form, Place, Plain, Shown, View};
use pleach::scene::Scene;
use pleach::space::view::views;
use pleach::threads::pool;
use pleach::watch::Unwatched;
use serde_json::Value;

/// A tree grown as `name`.glb in `folder`.
fn grow(folder: &Path, species: &str, leaves: u32) -> PathBuf {
    use pleach::botany::grow::{Options, Species, grow};
    let options = Options {
        leaves: Some(leaves),
        ..Options::default()
    };
    let file = folder.join(format!("{species}.glb"));
    let grown = grow(&Species::named(species).unwrap(), &options).unwrap();
    std::fs::write(&file, grown.glb).unwrap();
    file
}

fn request(input: &Path, output: &Path) -> Request {
    Request {
        input: input.into(),
        output: output.into(),
        wanted: Wanted::Levels(1),
        recipe: Recipe {
            hierarchy: true,
            ..Recipe::draft()
        },
        scene: Scene {
            screen_height_px: 1000,
            heights_px: vec![64.0],
            ..Scene::default()
        },
        ..Request::default()
    }
}

/// The package of a small oak, baked once for all tests.
fn small() -> &'static (PathBuf, Baked) {
    static BAKED: OnceLock<(PathBuf, Baked)> = OnceLock::new();
    BAKED.get_or_init(|| {
        let home = Path::new(env!("CARGO_TARGET_TMPDIR")).join("hierarchy");
        std::fs::create_dir_all(&home).unwrap();
        let (input, out) = (grow(&home, "oak", 500), home.join("out"));
        let baked = bake(&request(&input, &out), &Unwatched).unwrap();
        (out, baked)
    })
}

fn manifest(folder: &Path, name: &str) -> (Manifest, Tiles) {
    let file = folder.join(format!("{name}{SUFFIX}"));
    let manifest = Manifest::from_ron(&std::fs::read_to_string(&file).unwrap(), &file).unwrap();
    let tiles = manifest.tiles.clone().unwrap();
    (manifest, tiles)
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entry = |e: std::fs::DirEntry| {
        let name = e.file_name().into_string().unwrap();
        (name, std::fs::read(e.path()).unwrap())
    };
    std::fs::read_dir(folder)
        .unwrap()
        .map(|e| entry(e.unwrap()))
        .collect()
}

/// Triangles of each node, by name, as other software reads the file; and of each scene.
fn triangles(bytes: &[u8]) -> (BTreeMap<String, usize>, BTreeMap<String, usize>) {
    let file = gltf::Gltf::from_slice(bytes).unwrap();
    let of = |node: &gltf::Node| {
        let primitives = node.mesh().into_iter().flat_map(|m| m.primitives());
        primitives
            .map(|p| p.indices().unwrap().count() / 3)
            .sum::<usize>()
    };
    let named = |n: gltf::Node| (n.name().unwrap().to_owned(), of(&n));
    let scene = |s: gltf::Scene| {
        let sum = s.nodes().map(|n| of(&n)).sum();
        (s.name().unwrap_or_default().to_owned(), sum)
    };
    (
        file.nodes().map(named).collect(),
        file.scenes().map(scene).collect(),
    )
}

#[test]
fn the_files_hold_every_tile_and_the_tips_are_the_tree() {
    let (out, baked) = small();
    let (manifest, tiles) = manifest(out, "oak");
    let on_disk = files(out);
    assert!(
        on_disk.keys().eq(sorted(&manifest.files).iter()),
        "manifest and folder differ"
    );
    assert!(tiles.list.len() > 8, "{} tiles", tiles.list.len());

    let (nodes, scenes) = triangles(&on_disk[&tiles.file]);
    assert_eq!(scenes["geometry"] as u64, manifest.tree.triangles);
    let mut billboard_triangles = 0;
    for tile in &tiles.list {
        if let Some(billboards) = &tile.billboards {
            assert_eq!(nodes[&billboards.node] as u64, billboards.triangles);
            assert!(billboards.triangles <= 48, "{}", billboards.triangles);
            let (alone, _) = triangles(&on_disk[&billboards.file]);
            assert_eq!(alone[&billboards.node] as u64, billboards.triangles);
            billboard_triangles += billboards.triangles;
        }
        assert_eq!(tile.geometry.is_some(), tile.children.is_empty());
        if let Some(geometry) = &tile.geometry {
            assert_eq!(nodes[&geometry.node] as u64, tile.triangles);
            // With images beside it, as a client loads it.
            let model = load(&out.join(&geometry.file)).unwrap();
            assert_eq!(model.triangles.len() as u64, tile.triangles);
            assert!(!model.images.is_empty());
        }
        for &child in &tile.children {
            assert!(tiles.list[child as usize].switch_distance_m <= tile.switch_distance_m);
        }
    }
    let told = baked.report.hierarchy.as_ref().unwrap();
    assert_eq!(
        (told.tiles, told.billboard_triangles),
        (tiles.list.len() as u64, billboard_triangles)
    );
    assert_eq!(scenes["billboards"] as u64, billboard_triangles);
    rectangles_lie_apart(&tiles);
    tileset_names_all(&on_disk, &tiles);
}

fn sorted(names: &[String]) -> Vec<String> {
    let mut names = names.to_vec();
    names.sort();
    names
}

fn rectangles_lie_apart(tiles: &Tiles) {
    let all: Vec<[u32; 4]> = tiles
        .list
        .iter()
        .filter_map(|t| Some(t.billboards.as_ref()?.atlas))
        .filter(|r| r[2] > 0)
        .collect();
    assert!(!all.is_empty());
    for (i, &[x, y, w, h]) in all.iter().enumerate() {
        assert!(x + w <= tiles.atlas[0] && y + h <= tiles.atlas[1]);
        for &[p, q, v, u] in &all[..i] {
            assert!(x + w <= p || p + v <= x || y + h <= q || q + u <= y);
        }
    }
}

/// The tileset refines from the whole tree to all tips, and errors never rise on the way.
fn tileset_names_all(on_disk: &BTreeMap<String, Vec<u8>>, tiles: &Tiles) {
    let set: Value = serde_json::from_slice(&on_disk[&tiles.tileset]).unwrap();
    assert_eq!(set["asset"]["version"], "1.1");
    let mut seen = Vec::new();
    let mut stack = vec![(&set["root"], f64::INFINITY)];
    while let Some((tile, above)) = stack.pop() {
        let error = tile["geometricError"].as_f64().unwrap();
        assert!(error <= above);
        seen.extend(tile["content"]["uri"].as_str().map(str::to_owned));
        let children = tile["children"].as_array();
        stack.extend(children.into_iter().flatten().map(|c| (c, error)));
        assert!(children.is_some() || error == 0.0, "a tip has no error");
    }
    let contents: Vec<String> = tiles.files().skip(2).map(str::to_owned).collect();
    assert_eq!(sorted(&seen), sorted(&contents));
}

#[test]
fn every_cut_of_the_tiles_covers_every_leaf_once() {
    let (out, _) = small();
    let (manifest, tiles) = manifest(out, "oak");
    let hierarchy = tiles.hierarchy(&manifest).unwrap();
    assert_eq!(hierarchy.nodes().len(), tiles.list.len());
    let middle = Vec3::from_array(tiles.list[0].center);
    let mut forest = Forest::new(vec![hierarchy.clone()], &[Place::at(Vec3::ZERO)], Plain);
    forest.fade = 0.0;
    let (mut counts, mut geometry) = (Vec::new(), Vec::new());
    let farthest = tiles.list[0].switch_distance_m;
    // Always in the picture; a longer focal length is a nearer tree.
    let away = 5.0 * tiles.list[0].radius_m;
    for share in [0.001, 0.05, 0.2, 0.5, 0.9, 1.1, 4.0] {
        let view = View {
            zoom: away / (farthest * share),
            ..View::looking(middle + Vec3::Z * away, -Vec3::Z, 1.0, 1.0)
        };
        forest.update(&view);
        let mut drawn = Vec::new();
        forest.collect(&view, &mut drawn);
        let tile = |d: &pleach::runtime::Drawn| {
            &tiles.list[hierarchy.origins()[d.node as usize].subtree as usize]
        };
        let leaves: u32 = drawn.iter().map(|d| tile(d).leaves).sum();
        assert_eq!(leaves, tiles.list[0].leaves, "at {share} of the farthest");
        let original: u64 = drawn.iter().map(|d| tile(d).triangles).sum();
        assert_eq!(original, manifest.tree.triangles);
        counts.push(drawn.len());
        geometry.push(drawn.iter().filter(|d| d.form == Form::Geometry).count());
    }
    assert!(
        geometry[0] > 0 && counts[0] > counts[3],
        "{counts:?} {geometry:?}"
    );
    assert_eq!((counts[5], geometry[5], counts[6]), (1, 0, 1));
}

#[test]
fn billboards_of_tips_look_like_their_geometry() {
    let (out, _) = small();
    let (_, tiles) = manifest(out, "oak");
    let (mut f1, mut count) = (0.0, 0.0);
    for tile in &tiles.list {
        let (Some(billboards), Some(geometry)) = (&tile.billboards, &tile.geometry) else {
            continue;
        };
        let original = load(&out.join(&geometry.file)).unwrap();
        let level = load(&out.join(&billboards.file)).unwrap();
        let height_px = (64.0 * original.height()) as u32;
        let found = Reference::new(&original, &views(10, 5.0), height_px.max(8)).compare(&level);
        let area = found.area_ratio.mean;
        assert!((0.8..1.25).contains(&area), "{}: {area}", billboards.node);
        assert!(
            found.f1.mean > 0.7,
            "{}: {}",
            billboards.node,
            found.f1.mean
        );
        (f1, count) = (f1 + found.f1.mean, count + 1.0);
    }
    assert!(
        count > 4.0 && f1 / count > 0.85,
        "{count} tips, F1 {}",
        f1 / count
    );
}

#[test]
fn tiles_that_the_scene_never_opens_are_not_baked() {
    let home = tempfile::tempdir().unwrap();
    let (input, out) = (grow(home.path(), "palm", 40), home.path().join("out"));
    let near = request(&input, &out);
    bake(&near, &Unwatched).unwrap();
    let (_, all) = manifest(&out, "palm");
    let far = Request {
        scene: Scene {
            nearest_m: f64::from(all.list[0].switch_distance_m) * 1.5,
            ..near.scene.clone()
        },
        ..near
    };
    bake(&far, &Unwatched).unwrap();
    let (_, one) = manifest(&out, "palm");
    assert!(all.list.len() > 1);
    assert_eq!((one.list.len(), &one.list[0].geometry), (1, &None));
    // A glTF scene without nodes would be invalid.
    let (_, scenes) = triangles(&files(&out)[&one.file]);
    assert!(scenes.keys().eq(["billboards"]), "{scenes:?}");
    assert!(
        !files(&out)
            .keys()
            .any(|f| f.contains("geometry") || f.ends_with(".png"))
    );
}

#[test]
fn the_same_bytes_on_one_thread_and_two() {
    let home = tempfile::tempdir().unwrap();
    let input = grow(home.path(), "palm", 40);
    let of = |threads: usize| {
        let out = home.path().join(format!("{threads}"));
        let request = request(&input, &out);
        let pool = pool(threads).unwrap();
        pool.install(|| bake(&request, &Unwatched)).unwrap();
        files(&out)
    };
    let (one, two) = (of(1), of(2));
    assert!(one.len() > 8);
    assert!(one == two);
}

#[test]
fn a_manifest_with_flawed_tiles_is_refused_by_field() {
    let home = tempfile::tempdir().unwrap();
    let (input, out) = (grow(home.path(), "palm", 40), home.path().join("out"));
    bake(&request(&input, &out), &Unwatched).unwrap();
    let (manifest, _) = manifest(&out, "palm");
    type Spoil = fn(&mut Tiles);
    let spoilt: [(Spoil, &str); 6] = [
        (|t| t.list.clear(), "tiles.list"),
        (|t| t.list[0].parent = Some(9999), "tiles.list[0].parent"),
        (|t| t.list[0].children.push(9999), "tiles.list[0].children"),
        (|t| t.list[1].subtree = 9999, "tiles.list[1].subtree"),
        (|t| t.list[1].center[2] = f32::NAN, "tiles.list[1].center"),
        (
            |t| t.list[0].billboards.as_mut().unwrap().sigma = f64::INFINITY,
            "tiles.list[0].billboards.sigma",
        ),
    ];
    for (spoil, field) in spoilt {
        let mut flawed = manifest.clone();
        spoil(flawed.tiles.as_mut().unwrap());
        let text = flawed.to_ron().unwrap();
        let error = Manifest::from_ron(&text, Path::new("x")).unwrap_err();
        assert!(error.to_string().contains(field), "{field}: {error}");
    }
}

#[test]
fn the_manifest_tells_what_every_sub_tree_shows() {
    let (out, _) = small();
    let (manifest, _) = manifest(out, "oak");
    let measured = manifest.measured().unwrap().unwrap();
    let count = manifest.subtrees.len();
    assert_eq!(measured.bytes().len(), 25 * count);
    // All that the whole tree has it shows; of its branches some is hidden.
    assert!(measured.bytes()[..25].iter().all(|&share| share >= 250));
    let others = &measured.bytes()[25..];
    let mean = others.iter().map(|&b| f64::from(b)).sum::<f64>() / others.len() as f64;
    assert!((50.0..250.0).contains(&mean), "{mean}");
    // A cut that knows it draws less geometry than one by distance, from where some is hidden.
    let hierarchy = manifest.hierarchy().unwrap();
    let shown = Shown::new(vec![(&hierarchy, measured)]);
    let eye = Vec3::from_array(manifest.tree.center.map(|c| c as f32)) + Vec3::X * 12.0;
    let view = View::looking(eye, Vec3::NEG_X, 1.0, 1.0);
    let geometry = |drawn: Vec<Drawn>| drawn.iter().filter(|d| d.form == Form::Geometry).count();
    let place = Place::at(Vec3::ZERO);
    let mut plain = ActiveCut::new(hierarchy.clone(), place, Plain);
    let mut seen = ActiveCut::new(hierarchy.clone(), place, shown);
    let (mut all, mut some) = (Vec::new(), Vec::new());
    plain.update(&view);
    plain.collect(&view, &mut all);
    seen.update(&view);
    seen.collect(&view, &mut some);
    let (all, some) = (geometry(all), geometry(some));
    assert!(0 < some && some < all, "{some} of {all}");
    // Sub-trees that are like others name the first of them.
    let first = manifest
        .subtrees
        .iter()
        .zip(0..)
        .filter(|(s, i)| s.representative == *i);
    let first = first.count();
    assert!(0 < first && first < count, "{first} of {count}");
}
