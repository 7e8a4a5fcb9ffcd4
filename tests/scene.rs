//! What a scene says of light and of where it looks from, and what levels make of it.

use std::path::{Path, PathBuf};

use pleach::botany::grow::{Options, Species, grow};
use pleach::botany::load::load;
use pleach::botany::model::Model;
use pleach::pipeline::{Baked, Request, Wanted, bake};
use pleach::recipe::Recipe;
use pleach::report::{Settings, evaluate};
use pleach::scene::Scene;
use pleach::watch::Unwatched;

fn tree(folder: &Path) -> PathBuf {
    let options = Options {
        leaves: Some(200),
        ..Options::default()
    };
    let file = folder.join("oak.glb");
    let grown = grow(&Species::named("oak").unwrap(), &options).unwrap();
    std::fs::write(&file, grown.glb).unwrap();
    file
}

fn baked(input: &Path, output: &Path, scene: Scene, hierarchy: bool) -> Baked {
    let request = Request {
        input: input.into(),
        output: output.into(),
        wanted: Wanted::Levels(2),
        recipe: Recipe {
            hierarchy,
            ..Recipe::draft()
        },
        scene: Scene {
            heights_px: vec![160.0, 64.0],
            ..scene
        },
        accept: true,
        ..Request::default()
    };
    bake(&request, &Unwatched).unwrap()
}

fn unlit() -> Scene {
    Scene {
        lit: false,
        ..Scene::default()
    }
}

/// Whether all its materials are unlit and have base colours alone.
fn is_plain(model: &Model) -> bool {
    let plain = |m: &pleach::botany::model::Material| {
        m.unlit && m.normal.is_none() && m.metallic_roughness.is_none() && m.occlusion.is_none()
    };
    let named = |part: &str| model.images.iter().any(|i| i.name.contains(part));
    model.materials.iter().all(plain) && !named("normal") && !named("orm")
}

#[test]
fn without_light_levels_have_base_colours_alone_and_the_same_shapes() {
    let home = tempfile::tempdir().unwrap();
    let input = tree(home.path());
    let [lit, dark] = ["lit", "dark"].map(|name| home.path().join(name));
    let with = baked(&input, &lit, Scene::default(), true).report;
    let without = baked(&input, &dark, unlit(), true).report;
    for level in 0..3 {
        let name = format!("oak_LOD{level}.glb");
        let [lit, dark] = [&lit, &dark].map(|folder| load(&folder.join(&name)).unwrap());
        assert!(is_plain(&dark), "{name}");
        assert!(!is_plain(&lit), "{name}");
        assert_eq!(dark.positions, lit.positions);
        assert_eq!(dark.triangles, lit.triangles);
        let page = |m: &Model| {
            let base = m.images.iter().find(|i| i.name == "foliage_base_color");
            base.map(|i| i.rgba.clone())
        };
        assert!(page(&dark) == page(&lit));
        assert_eq!(page(&dark).is_some(), level > 0);
    }
    for name in ["oak.glb", "oak_hierarchy.glb"] {
        assert!(is_plain(&load(&dark.join(name)).unwrap()), "{name}");
    }
    // A page is one image where it was three.
    for (with, without) in with.levels.iter().zip(&without.levels) {
        assert!(2 * without.texture_bytes < with.texture_bytes);
        assert_eq!(without.sizes[0].f1, with.sizes[0].f1);
    }
    // What is unlit by itself stays so.
    let again = home.path().join("again");
    baked(&dark.join("oak_LOD0.glb"), &again, Scene::default(), false);
    assert!(is_plain(&load(&again.join("oak_LOD0_LOD1.glb")).unwrap()));
}

#[test]
fn levels_are_fitted_and_judged_where_the_scene_looks_from() {
    let home = tempfile::tempdir().unwrap();
    let input = tree(home.path());
    let front = Scene {
        azimuths_deg: [60.0, 90.0],
        elevations_deg: [-5.0, 10.0],
        ..Scene::default()
    };
    let sector = front.sector();
    let [all, some] = ["all", "some"].map(|name| home.path().join(name));
    baked(&input, &all, Scene::default(), false);
    let report = baked(&input, &some, front, false).report;
    let views = &report.levels[0].sizes[0].views;
    assert!(views.len() >= 15);
    for view in views {
        let words: Vec<&str> = view.view.split(' ').collect();
        let ["azimuth", azimuth, "elevation", elevation] = words[..] else {
            panic!("{}", view.view);
        };
        let [azimuth, elevation] = [azimuth, elevation].map(|n| n.parse::<f32>().unwrap());
        assert!((60.0..=90.0).contains(&azimuth) && (-5.0..=10.0).contains(&elevation));
    }
    // From there they are nearer to the original than levels for all directions are.
    let original = load(&input).unwrap();
    let [all, some] = [&all, &some].map(|folder| load(&folder.join("oak_LOD2.glb")).unwrap());
    assert_eq!(all.triangles.len(), some.triangles.len());
    let settings = Settings {
        heights_px: vec![64],
        sector,
        ..Settings::default()
    };
    let named = [(&all, "all"), (&some, "some")];
    let judged = evaluate((&original, "oak"), &named, &settings);
    let [all, some] = [0, 1].map(|i| judged.levels[i].sizes[0].f1.mean);
    assert!(some > all, "{some} {all}");
}
