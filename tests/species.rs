//! `bake --species`: trees of one species on shared pages.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

use pleach::batch::is_unchanged;
use pleach::botany::grow::{Options, Species as Kind, grow};
use pleach::botany::load::load;
use pleach::botany::model::{AlphaMode, Image};
use pleach::export::manifest::{Manifest, SUFFIX};
use pleach::pipeline::{Request, Wanted, bake};
use pleach::recipe::Recipe;
use pleach::scene::Scene;
use pleach::species::{BakedSpecies, Species, bake_species, standing};
use pleach::threads::pool;
use pleach::watch::Unwatched;
use serde_json::Value;
use tempfile::TempDir;

const MOST: f64 = 0.015;

/// A name that a URI has to say in other letters.
const SPECIES: &str = "our oaks 50%41 #1";

const NAMES: [&str; 3] = ["ash", "elm", "lime"];

/// Three oaks of different seeds and sizes in `folder`.
fn trees(folder: &Path) -> Vec<PathBuf> {
    std::fs::create_dir_all(folder).unwrap();
    let tree = |(i, name): (usize, &&str)| {
        let options = Options {
            leaves: Some(60 + 20 * i as u32),
            seed: i as u64 + 1,
            ..Options::default()
        };
        let file = folder.join(format!("{name}.glb"));
        let grown = grow(&Kind::named("oak").unwrap(), &options).unwrap();
        std::fs::write(&file, grown.glb).unwrap();
        file
    };
    NAMES.iter().enumerate().map(tree).collect()
}

fn request(output: PathBuf, sharing: f64) -> Request {
    Request {
        output,
        wanted: Wanted::Levels(2),
        recipe: Recipe {
            sharing,
            training_views: 8,
            ..Recipe::draft()
        },
        scene: Scene {
            screen_height_px: 256,
            heights_px: vec![80.0, 32.0],
            ..Scene::default()
        },
        accept: true,
        ..Request::default()
    }
}

fn baked(folder: &Path, sharing: f64, threads: usize) -> BakedSpecies {
    let species = Species {
        inputs: trees(folder),
        request: request(folder.join(SPECIES), sharing),
        ..Species::default()
    };
    let pool = pool(threads).unwrap();
    pool.install(|| bake_species(&species, &Unwatched)).unwrap()
}

/// What most tests look at, baked once.
static BAKED: LazyLock<(TempDir, BakedSpecies)> = LazyLock::new(|| {
    let home = tempfile::tempdir().unwrap();
    let all = baked(home.path(), MOST, 2);
    (home, all)
});

/// The JSON of a GLB.
fn json(file: &Path) -> Value {
    let bytes = std::fs::read(file).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

/// The files of the images of a GLB's foliage.
fn page_of(file: &Path) -> BTreeSet<String> {
    let uris = json(file)["images"].as_array().unwrap().clone();
    let uris = uris.iter().map(|i| i["uri"].as_str().unwrap().to_owned());
    uris.filter(|u| u.contains("_page")).collect()
}

#[test]
fn levels_of_all_trees_show_one_page_and_are_nearly_as_good_as_alone() {
    let (home, all) = &*BAKED;
    let folder = home.path().join(SPECIES);
    assert_eq!(all.report.trees.len(), 3);
    assert_eq!(all.report.pages.len(), 2);
    for (level, page) in (1..).zip(&all.report.pages) {
        assert!(page.shared, "{page:?}");
        let files: Vec<BTreeSet<String>> = NAMES
            .iter()
            .map(|name| page_of(&folder.join(format!("{name}_LOD{level}.glb"))))
            .collect();
        assert_eq!(files[0].len(), 3);
        assert!(files.iter().all(|f| *f == files[0]), "{files:?}");
        assert!(2 * page.bytes_with <= page.bytes_without, "{page:?}");
        let cards: u64 = manifests(&folder)
            .map(|m| m.levels[level].cards.len() as u64)
            .sum();
        assert_eq!(page.tiles + page.copies, cards);
    }
    let with: u64 = all.report.pages.iter().map(|p| p.bytes_with).sum();
    assert_eq!(all.report.page_bytes_with, with);

    // The same trees alone, as the ruler of the report sees both.
    for (i, name) in NAMES.iter().enumerate() {
        let alone = Request {
            input: home.path().join(format!("{name}.glb")),
            ..request(home.path().join(format!("alone_{name}")), 0.0)
        };
        let alone = bake(&alone, &Unwatched).unwrap().report;
        let shared = &all.report.trees[i].report;
        assert_eq!(shared.levels.len(), 2);
        for (k, (with, without)) in shared.levels.iter().zip(&alone.levels).enumerate() {
            let [with, without] = [with, without].map(|l| l.sizes[0].f1.mean);
            assert!(
                with >= without - MOST && with > 0.5,
                "{name} {with} {without}"
            );
            let told = &all.report.pages[k].trees[i];
            assert_eq!((told.name.as_str(), told.level), (*name, k as u32 + 1));
            assert!(
                (told.f1_with - with).abs() < 1e-9,
                "{name} {k}: {} {with}",
                told.f1_with
            );
            assert!((told.f1_without - without).abs() < 1e-9);
        }
        let report = &shared.levels[0].sizes[0];
        assert!((0.95..1.05).contains(&report.area_ratio.mean), "{name}");
    }
}

fn manifests(folder: &Path) -> impl Iterator<Item = Manifest> {
    NAMES
        .map(|name| {
            let file = folder.join(name.to_owned() + SUFFIX);
            Manifest::from_ron(&std::fs::read_to_string(&file).unwrap(), &file).unwrap()
        })
        .into_iter()
}

#[test]
fn manifests_say_whose_texels_a_copy_shows() {
    let (home, all) = &*BAKED;
    let folder = home.path().join(SPECIES);
    let manifests: Vec<Manifest> = manifests(&folder).collect();
    let (mut copies, mut others, mut large, mut on_tiles) = (0, 0, 0, 0);
    for (own, manifest) in manifests.iter().enumerate() {
        assert_eq!(
            (manifest.species.as_str(), &manifest.files),
            (SPECIES, &all.files)
        );
        for (k, level) in manifest.levels.iter().enumerate() {
            for card in &level.cards {
                let Some(of) = card.copy_of else {
                    assert_eq!(card.copy_in, None);
                    continue;
                };
                copies += 1;
                others += u64::from(card.copy_in.is_some());
                let tree = card.copy_in.as_deref();
                let tree = tree.map_or(own, |t| NAMES.iter().position(|n| *n == t).unwrap());
                assert!(card.copy_in.is_none() || tree != own);
                // A tile of its own, which the copy lies on.
                let tile = &manifests[tree].levels[k].cards[of as usize];
                assert_eq!(tile.copy_of, None);
                let [a, b] = [card.atlas, tile.atlas];
                let meet = |i: usize| a[i] < b[i] + b[i + 2] && b[i] < a[i] + a[i + 2];
                // Nearly empty cards, most of them of a few texels, may lie where no tile has any.
                if a[2] * a[3] > 32 {
                    large += 1;
                    on_tiles += u64::from(meet(0) && meet(1));
                }
            }
        }
    }
    let told = |of: fn(&pleach::report::species::SharedPage) -> u64| -> u64 {
        all.report.pages.iter().map(of).sum()
    };
    assert_eq!(
        [copies, others],
        [told(|p| p.copies), told(|p| p.copies_of_others)]
    );
    assert!(others > 0);
    assert!(large > copies / 4, "{large} of {copies}");
    assert!(50 * on_tiles >= 49 * large, "{on_tiles} of {large}");
}

#[test]
fn one_file_holds_all_trees_a_scene_each_and_every_image_is_written_once() {
    let (home, all) = &*BAKED;
    let folder = home.path().join(SPECIES);
    let combined = json(&folder.join(format!("{SPECIES}.glb")));
    let scenes = combined["scenes"].as_array().unwrap();
    let named: Vec<&str> = scenes.iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(named, NAMES);
    for scene in scenes {
        let root = &combined["nodes"][scene["nodes"][0].as_u64().unwrap() as usize];
        let lower = &root["extensions"]["MSFT_lod"]["ids"];
        assert_eq!(lower.as_array().unwrap().len(), 2);
    }
    let mut contents = BTreeSet::new();
    let pngs = all
        .files
        .iter()
        .filter(|f| f.ends_with(".png") && !f.contains("_sharing"));
    for png in pngs {
        assert!(
            contents.insert(std::fs::read(folder.join(png)).unwrap()),
            "{png}"
        );
    }
    assert!(contents.len() >= 6);
    let mut names: Vec<String> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let mut told = all.files.clone();
    told.sort();
    assert_eq!(names, told);
}

/// Opaque texels that are black, as none of an oak's leaves are, as a share of the opaque ones.
fn black(image: &Image) -> f64 {
    let opaque = image.rgba.chunks_exact(4).filter(|t| t[3] >= 128);
    let all = opaque.clone().count();
    assert!(all > 100);
    opaque.filter(|t| t[..3].iter().all(|&c| c < 8)).count() as f64 / all as f64
}

#[test]
fn texels_that_only_copies_cover_have_a_colour() {
    let (home, _) = &*BAKED;
    for name in NAMES {
        let model = load(&home.path().join(format!("{SPECIES}/{name}_LOD1.glb"))).unwrap();
        let foliage = model
            .materials
            .iter()
            .find(|m| m.alpha_mode == AlphaMode::Mask);
        let page = foliage.unwrap().base_color.unwrap().image;
        let share = black(&model.images[page as usize]);
        assert!(share < 1e-3, "{name}: {share}");
    }
}

#[test]
fn where_no_page_is_good_enough_each_level_keeps_its_own() {
    let home = tempfile::tempdir().unwrap();
    let all = baked(home.path(), 1e-9, 2);
    let folder = home.path().join(SPECIES);
    assert!(all.report.pages.iter().any(|p| !p.shared));
    for page in all.report.pages.iter().filter(|p| !p.shared) {
        // Pages as they were, with maps of light of a 16th of the bytes: (1 + 1/16 + 1/16) / 3 of all, but for mips.
        assert_eq!(page.copies, 0);
        let share = page.bytes_with as f64 / page.bytes_without as f64;
        assert!((share - 0.375).abs() < 1e-3, "{share}");
        assert!(page.trees.iter().all(|t| t.f1_with == t.f1_without));
        for name in NAMES {
            let file = folder.join(format!("{name}_LOD{}.glb", page.page));
            assert!(page_of(&file).is_empty());
        }
    }
    for page in &all.report.pages {
        let lost = |t: &pleach::report::species::SharedTree| t.f1_without - t.f1_with;
        assert!(page.trees.iter().all(|t| lost(t) <= 1e-9), "{page:?}");
    }
}

#[test]
fn the_same_bytes_on_one_thread_and_on_two() {
    let home = tempfile::tempdir().unwrap();
    let (two, with_two) = &*BAKED;
    let with_one = baked(home.path(), MOST, 1);
    assert_eq!(with_one.files, with_two.files);
    for file in &with_one.files {
        let read = |home: &Path| std::fs::read(home.join(SPECIES).join(file)).unwrap();
        assert!(read(home.path()) == read(two.path()), "{file}");
    }
}

#[test]
fn a_package_stands_while_trees_scene_and_files_are_what_they_were() {
    let (home, all) = &*BAKED;
    let mut species = Species {
        inputs: NAMES.map(|n| home.path().join(format!("{n}.glb"))).into(),
        request: request(home.path().join(SPECIES), MOST),
        ..Species::default()
    };
    // Floats may have lost their last digit.
    let [read, written] = [standing(&species).unwrap(), all.report.clone()].map(|report| {
        let trees = report.trees.iter().map(|t| t.name.clone());
        let f1 = report
            .pages
            .iter()
            .flat_map(|p| &p.trees)
            .map(|t| t.f1_with);
        let f1: Vec<f64> = f1.map(|f| (f * 1e9).round()).collect();
        (trees.collect::<Vec<_>>(), report.page_bytes_with, f1)
    });
    assert_eq!(read, written);
    species.request.recipe.memory_mib = 4096;
    assert!(standing(&species).is_some());
    let changed = |change: fn(&mut Species)| {
        let mut other = species.clone();
        change(&mut other);
        standing(&other).is_none()
    };
    assert!(changed(|s| s.request.scene.fov_deg = 50.0));
    assert!(changed(|s| s.request.recipe.sharing = 0.5));
    assert!(changed(|s| s.request.wanted = Wanted::Levels(1)));
    assert!(changed(|s| drop(s.inputs.pop())));
    assert!(changed(|s| s.scenes = vec![Scene::default()]));
    // A tree alone is another package.
    assert!(!is_unchanged(&Request {
        input: species.inputs[0].clone(),
        ..species.request.clone()
    }));
    let lost = home.path().join(SPECIES).join("elm_LOD1.glb");
    let aside = home.path().join("elm_LOD1.glb");
    std::fs::rename(&lost, &aside).unwrap();
    assert!(standing(&species).is_none());
    std::fs::rename(&aside, &lost).unwrap();
    assert!(standing(&species).is_some());
}

#[test]
fn trees_that_do_not_fit_into_the_stated_memory_are_refused() {
    let home = tempfile::tempdir().unwrap();
    let mut species = Species {
        inputs: trees(home.path()),
        request: request(home.path().join("out"), MOST),
        ..Species::default()
    };
    species.request.recipe.memory_mib = 100;
    let error = bake_species(&species, &Unwatched).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    let said = error.to_string();
    assert!(
        said.contains("memory_mib") && said.contains("these 3"),
        "{said}"
    );
    assert!(!home.path().join("out").exists());
}

#[test]
fn what_can_not_be_a_species_is_said_before_anything_is_written() {
    let home = tempfile::tempdir().unwrap();
    trees(home.path());
    std::fs::create_dir(home.path().join("more")).unwrap();
    std::fs::copy(
        home.path().join("elm.glb"),
        home.path().join("more/Elm.glb"),
    )
    .unwrap();
    std::fs::write(home.path().join("r.ron"), "(hierarchy: true)").unwrap();
    let message = |arguments: &[&str]| {
        let done = Command::new(env!("CARGO_BIN_EXE_pleach"))
            .args(["bake", "--species"])
            .args(arguments)
            .current_dir(home.path())
            .output()
            .unwrap();
        assert_eq!(done.status.code(), Some(2), "{arguments:?}");
        String::from_utf8(done.stderr).unwrap()
    };
    let same = message(&["elm.glb", "more/Elm.glb", "-o", "out"]);
    assert!(same.contains("have one name"), "{same}");
    let same = message(&["elm.glb", "ash.glb", "-o", "elm"]);
    assert!(same.contains("have one name"), "{same}");
    let recipe = message(&["elm.glb", "ash.glb", "-o", "out", "--recipe", "r.ron"]);
    assert!(recipe.contains("hierarchy"), "{recipe}");
    let absent = message(&["elm.glb", "absent.glb", "-o", "out"]);
    assert!(absent.contains("absent.glb: open"), "{absent}");
    let both = message(&["elm.glb", "-o", "out", "--hierarchy"]);
    assert!(both.contains("--species"), "{both}");
    assert!(!home.path().join("out").exists());
}
