//! Mips that the bake ships: DDS files beside levels, read by software that is not ours.

use std::path::Path;
use std::process::Command;

use pleach::botany::grow::{Options, Species, grow};
use pleach::botany::load::load;

fn pleach(folder: &Path, args: &[&str]) -> (i32, String) {
    let done = Command::new(env!("CARGO_BIN_EXE_pleach"))
        .args(args)
        .current_dir(folder)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    (done.status.code().unwrap(), said)
}

fn tree(file: &Path) {
    let options = Options {
        leaves: Some(60),
        ..Options::default()
    };
    let grown = grow(&Species::named("oak").unwrap(), &options).unwrap();
    std::fs::write(file, grown.glb).unwrap();
}

/// Share of the texels of a mip whose alpha passes the test.
fn passing(file: &ddsfile::Dds, mip: u32) -> f64 {
    let image = image_dds::image_from_dds(file, mip).unwrap();
    let pass = image.pixels().filter(|t| t.0[3] >= 128).count();
    pass as f64 / f64::from(image.width() * image.height())
}

/// Mean alpha of a mip, 0 to 1.
fn mean_alpha(file: &ddsfile::Dds, mip: u32) -> f64 {
    let image = image_dds::image_from_dds(file, mip).unwrap();
    let sum: f64 = image.pixels().map(|t| f64::from(t.0[3]) / 255.0).sum();
    sum / f64::from(image.width() * image.height())
}

#[test]
fn every_image_of_a_level_has_a_file_with_its_mips() {
    let home = tempfile::tempdir().unwrap();
    tree(&home.path().join("oak.glb"));
    let scene = "(mips: Shipped, texture_format: Bc7, first_height_px: 128, lit: false)";
    std::fs::write(home.path().join("s.ron"), scene).unwrap();
    let args = [
        "bake", "oak.glb", "-o", "out", "--scene", "s.ron", "--levels", "2",
    ];
    let args = [&args[..], &["--preset", "draft", "--accept"]].concat();
    let (code, said) = pleach(home.path(), &args);
    assert_eq!(code, 0, "{said}");
    let mut cut = 0;
    for level in 0..3 {
        let name = home.path().join(format!("out/oak_LOD{level}"));
        let model = load(&name.with_extension("glb")).unwrap();
        for (number, image) in model.images.iter().enumerate() {
            let file = format!("{}_image{number}_{}.dds", name.display(), image.name);
            let bytes = std::fs::read(&file).unwrap_or_else(|e| panic!("{file}: {e}"));
            let read = ddsfile::Dds::read(&bytes[..]).unwrap();
            assert_eq!(
                [read.get_width(), read.get_height()],
                [image.width, image.height]
            );
            let longer = image.width.max(image.height);
            assert_eq!(read.get_num_mipmap_levels(), longer.ilog2() + 1);
            let all = passing(&read, 0);
            if all == 1.0 {
                continue;
            }
            cut += 1;
            // While a mip has texels enough to tell.
            for mip in 1..read.get_num_mipmap_levels().saturating_sub(4) {
                // A level's area was matched with plain mips, a leaf's is kept.
                let [own, wanted] = match level {
                    0 => [passing(&read, mip), all],
                    _ => [mean_alpha(&read, mip), mean_alpha(&read, 0)],
                };
                assert!(
                    (own - wanted).abs() < 0.01,
                    "{file} mip {mip}: {own} {wanted}"
                );
            }
        }
    }
    // Leaves of the original, and a page for each level.
    assert_eq!(cut, 3);
}

#[test]
fn what_is_not_to_be_had_is_said() {
    let home = tempfile::tempdir().unwrap();
    tree(&home.path().join("oak.glb"));
    let bake = |scene: &str, more: &[&str]| {
        std::fs::write(home.path().join("s.ron"), scene).unwrap();
        let args = ["bake", "oak.glb", "-o", "out", "--scene", "s.ron"];
        let usual = ["--preset", "draft", "--accept", "--levels", "1"];
        pleach(home.path(), &[&args[..], &usual, more].concat())
    };
    let (code, said) = bake("(mips: Shipped, texture_format: Astc4x4)", &[]);
    assert_eq!(code, 2);
    assert!(said.contains("Astc4x4") && said.contains("Bc7"), "{said}");
    assert!(!home.path().join("out").exists());
    let (code, said) = bake("(engine: Bevy, first_height_px: 64)", &["--instancing"]);
    assert_eq!(code, 0);
    assert!(
        said.contains("no mips") && said.contains("instances"),
        "{said}"
    );
    let (code, said) = bake("(engine: Three, first_height_px: 64)", &["--instancing"]);
    assert_eq!((code, said.contains("Three")), (0, false), "{said}");
}
