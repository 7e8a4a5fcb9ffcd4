//! `bake --sharing`: fewer texels within the F1 that the user allows.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::LazyLock;

use pleach::botany::grow::{Options, Species, grow};
use pleach::botany::load::load;
use pleach::botany::model::{AlphaMode, Image, Model};
use pleach::export::manifest::{Manifest, SUFFIX};
use pleach::ladder::Limit;
use pleach::pipeline::{Baked, Request, Wanted, bake};
use pleach::recipe::Recipe;
use pleach::report::texture_bytes;
use pleach::scene::Scene;
use pleach::threads::pool;
use pleach::watch::Unwatched;

/// A baked oak in `folder`; a level may lose `sharing` of F1.
fn baked(folder: &Path, sharing: f64, threads: usize) -> Baked {
    let recipe = Recipe {
        sharing,
        ..Recipe::draft()
    };
    baked_by(folder, recipe, threads)
}

fn baked_by(folder: &Path, recipe: Recipe, threads: usize) -> Baked {
    std::fs::create_dir_all(folder).unwrap();
    let options = Options {
        leaves: Some(400),
        ..Options::default()
    };
    let input = folder.join("tree.glb");
    std::fs::write(
        &input,
        grow(&Species::named("oak").unwrap(), &options).unwrap().glb,
    )
    .unwrap();
    let request = Request {
        input,
        output: folder.join("out"),
        wanted: Wanted::Levels(2),
        recipe,
        scene: Scene {
            screen_height_px: 256,
            heights_px: vec![160.0, 48.0],
            ..Scene::default()
        },
        accept: true,
        ..Request::default()
    };
    pool(threads)
        .unwrap()
        .install(|| bake(&request, &Unwatched))
        .unwrap()
}

/// What all tests compare with: nothing is shared. Its folder and what is in it.
static PLAIN: LazyLock<(tempfile::TempDir, Baked)> = LazyLock::new(|| {
    let home = tempfile::tempdir().unwrap();
    let plain = baked(home.path(), 0.0, 1);
    (home, plain)
});

fn bytes(folder: &Path, baked: &Baked) -> Vec<Vec<u8>> {
    let read = |file: &String| std::fs::read(folder.join("out").join(file)).unwrap();
    baked.files.iter().map(read).collect()
}

#[test]
fn levels_with_shared_texels_are_smaller_and_nearly_as_good() {
    const MOST: f64 = 0.02;
    let home = tempfile::tempdir().unwrap();
    let shared = home.path().join("shared");
    let (without, with) = (&PLAIN.1, baked(&shared, MOST, 1));

    // Nothing is asked for: the same figures twice.
    let told = without.report.sharing.as_ref().unwrap();
    assert_eq!(told.texture_bytes_with, told.texture_bytes_without);
    assert_eq!(told.f1_with, told.f1_without);
    assert!(
        told.levels
            .iter()
            .all(|l| l.copies == 0 && l.density == 1.0 && l.tiles > 0)
    );

    let sharing = with.report.sharing.as_ref().unwrap();
    assert_eq!(sharing.texture_bytes_without, told.texture_bytes_without);
    assert!((sharing.f1_without - told.f1_without).abs() < 1e-9);
    assert!(sharing.f1_with >= sharing.f1_without - MOST);
    assert!(
        2 * sharing.texture_bytes_with <= sharing.texture_bytes_without,
        "{sharing:?}"
    );
    assert!(sharing.levels.iter().any(|l| l.copies > 0), "{sharing:?}");

    let file = shared.join("out").join(format!("tree{SUFFIX}"));
    let manifest = Manifest::from_ron(&std::fs::read_to_string(&file).unwrap(), &file).unwrap();
    for (told, level) in sharing.levels.iter().zip(&manifest.levels[1..]) {
        // What is told is what the files hold.
        let model = load(&shared.join("out").join(&level.file)).unwrap();
        assert_eq!(texture_bytes(&model), told.texture_bytes_with);
        let copies = level.cards.iter().filter_map(|c| c.copy_of);
        for tile in copies.clone() {
            assert_eq!(level.cards[tile as usize].copy_of, None);
        }
        let classes: BTreeSet<u32> = copies.clone().collect();
        assert_eq!(classes.len() as u64, told.classes);
        assert_eq!(copies.count() as u64, told.copies);
        let allowed = Recipe::draft().copy_tolerance;
        assert!(told.farthest_copy <= allowed, "{told:?}");
        assert_eq!(told.farthest_copy > 0.0, told.copies > 0, "{told:?}");
        let sheet = with
            .files
            .contains(&format!("tree_LOD{}_sharing.png", told.level));
        assert_eq!(sheet, told.copies > 0);
        // Texture coordinates of copies stay on the page.
        let all = 0..model.triangles.len() as u32;
        let cards = all.filter(|&t| model.material_of(t).alpha_mode == AlphaMode::Mask);
        let uvs = cards.flat_map(|t| model.triangles[t as usize].map(|i| model.uvs[0][i as usize]));
        let uvs: Vec<_> = uvs.collect();
        assert!(uvs.len() > 3 * told.copies as usize);
        for uv in uvs {
            assert!(
                uv.min_element() >= -1e-4 && uv.max_element() <= 1.0001,
                "{uv}"
            );
        }
    }
}

#[test]
fn leaves_that_have_cards_of_their_own_show_a_few_tiles() {
    const MOST: f64 = 0.01;
    let home = tempfile::tempdir().unwrap();
    let options = Options {
        leaves: Some(300),
        ..Options::default()
    };
    let input = home.path().join("tree.glb");
    let grown = grow(&Species::named("oak").unwrap(), &options).unwrap();
    std::fs::write(&input, grown.glb).unwrap();
    let request = Request {
        input,
        output: home.path().join("out"),
        wanted: Wanted::Limits(vec![Limit::Count(1200)]),
        recipe: Recipe {
            sharing: MOST,
            ..Recipe::draft()
        },
        scene: Scene {
            screen_height_px: 256,
            heights_px: vec![200.0],
            ..Scene::default()
        },
        accept: true,
        ..Request::default()
    };
    let with = bake(&request, &Unwatched).unwrap();
    let level = &with.report.sharing.as_ref().unwrap().levels[0];
    assert!(level.copies > 150, "{level:?}");
    assert!(level.f1_with >= level.f1_without - MOST, "{level:?}");
    assert!(
        12 * level.texture_bytes_with <= level.texture_bytes_without,
        "{level:?}"
    );
}

#[test]
fn a_copy_that_is_farther_off_than_the_recipe_allows_has_texels_of_its_own() {
    let copies = |copy_tolerance: f64| {
        let home = tempfile::tempdir().unwrap();
        let recipe = Recipe {
            sharing: 0.05,
            copy_tolerance,
            ..Recipe::draft()
        };
        let baked = baked_by(home.path(), recipe, 2);
        let levels = baked.report.sharing.unwrap().levels;
        for level in &levels {
            assert!(level.farthest_copy <= copy_tolerance, "{level:?}");
        }
        levels.iter().map(|l| l.copies).sum::<u64>()
    };
    let (any, like, same) = (copies(1.0), copies(0.1), copies(0.0));
    assert!(any > like && like > same, "{any} {like} {same}");
}

#[test]
fn what_no_level_can_afford_changes_no_file_and_is_said() {
    let home = tempfile::tempdir().unwrap();
    let (plain, without) = (PLAIN.0.path(), &PLAIN.1);
    let shared = home.path().join("shared");
    let with = baked(&shared, 1e-9, 2);
    let said = with.warnings.iter().any(|w| w.contains("keeps its page"));
    assert!(said, "{:?}", with.warnings);
    let kept = |baked: &Baked| -> Vec<String> {
        let levels = baked.files.iter().filter(|f| f.ends_with(".glb"));
        levels.cloned().collect()
    };
    assert_eq!(kept(without), kept(&with));
    let levels = &with.report.sharing.as_ref().unwrap().levels;
    let unchanged = || {
        let same = levels.iter();
        same.filter(|l| !l.smaller_page && l.copies == 0 && l.density == 1.0)
    };
    assert!(unchanged().count() > 0);
    for level in unchanged() {
        // The same in all but maps of light, which have a quarter of the texels along a line.
        assert_eq!(level.f1_with, level.f1_without);
        let file = format!("tree_LOD{}.glb", level.level);
        let [a, b] = [plain, &shared].map(|f| load(&f.join("out").join(&file)).unwrap());
        assert_eq!((&a.positions, &a.uvs), (&b.positions, &b.uvs));
        let ([color, lights @ ..], [same, coarser @ ..]) = (maps(&a), maps(&b));
        assert_eq!(color.rgba, same.rgba);
        for (fine, coarse) in lights.iter().zip(&coarser) {
            assert_eq!(
                [coarse.width, coarse.height],
                [fine.width / 4, fine.height / 4]
            );
            assert_eq!(alike(fine, coarse), [true; 3]);
        }
    }
}

/// Base colour, normals and the rest of the cards of a level.
fn maps(m: &Model) -> [Image; 3] {
    let foliage = m.materials.iter().find(|m| m.alpha_mode == AlphaMode::Mask);
    let foliage = foliage.unwrap();
    [
        foliage.base_color,
        foliage.normal,
        foliage.metallic_roughness,
    ]
    .map(|t| m.images[t.unwrap().image as usize].clone())
}

#[test]
fn maps_of_light_may_be_coarser_where_nothing_is_shared() {
    let home = tempfile::tempdir().unwrap();
    let (plain, without) = (PLAIN.0.path(), &PLAIN.1);
    let coarser = home.path().join("coarser");
    let recipe = Recipe {
        light_map_halvings: Some(1),
        ..Recipe::draft()
    };
    let with = baked_by(&coarser, recipe, 2);
    let bytes = |b: &Baked| b.report.levels.iter().map(|l| l.texture_bytes).sum::<u64>();
    assert!(bytes(&with) < bytes(without));
    for level in 1..=2 {
        let file = format!("tree_LOD{level}.glb");
        let [a, b] = [plain, &coarser].map(|f| load(&f.join("out").join(&file)).unwrap());
        assert_eq!((&a.positions, &a.uvs), (&b.positions, &b.uvs));
        let ([color, lights @ ..], [same, halves @ ..]) = (maps(&a), maps(&b));
        assert_eq!(color.rgba, same.rgba);
        for (fine, half) in lights.iter().zip(&halves) {
            let [w, h] = [fine.width / 2, fine.height / 2];
            assert_eq!([half.width, half.height], [w, h]);
            assert_eq!(alike(fine, half), [true; 3]);
        }
    }
}

/// Whether the means of red, green and blue of two images are within 4 of 255: means of normals that differ
/// point more along the card's own.
fn alike(a: &Image, b: &Image) -> [bool; 3] {
    let mean = |image: &Image, k: usize| {
        let all = image.rgba.chunks_exact(4).map(|t| f64::from(t[k]));
        all.sum::<f64>() / (image.rgba.len() / 4) as f64
    };
    [0, 1, 2].map(|k| (mean(a, k) - mean(b, k)).abs() < 4.0)
}

#[test]
fn the_same_bytes_on_one_thread_and_on_two() {
    let home = tempfile::tempdir().unwrap();
    let (one, two) = (home.path().join("one"), home.path().join("two"));
    let [a, b] = [(&one, 1), (&two, 2)].map(|(f, threads)| bytes(f, &baked(f, 0.02, threads)));
    assert_eq!(a, b);
}

#[test]
fn the_option_takes_its_number_after_an_equals_sign_and_no_file() {
    let home = tempfile::tempdir().unwrap();
    let message = |arguments: &[&str]| {
        let done = std::process::Command::new(env!("CARGO_BIN_EXE_pleach"))
            .arg("bake")
            .args(arguments)
            .args(["-o", "out"])
            .current_dir(home.path())
            .output()
            .unwrap();
        assert_eq!(done.status.code(), Some(2));
        String::from_utf8(done.stderr).unwrap()
    };
    assert!(message(&["--sharing", "absent.glb"]).contains("absent.glb: open"));
    assert!(message(&["--sharing=0.3", "absent.glb"]).contains("sharing is 0.3"));
    assert!(message(&["--sharing=much", "absent.glb"]).contains("much"));
}
