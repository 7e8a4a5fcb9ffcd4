//! FLIP of a package: what silhouettes don't see.
//!
//! Each level at its own size alone, from three azimuths a little above the horizon and the top: a
//! sweep bakes a tree thirty times, and the full set of views and sizes would take longer than that.
//! Not counted in a run's time.

use std::path::Path;

use crate::botany::Model;
use crate::botany::load::load;
use crate::error::Result;
use crate::report::schema::Report;
use crate::report::{Settings, evaluate};
use crate::watch::{Quiet, Watch, part};

/// Views, the top included.
const VIEWS: usize = 4;
/// Their elevation, degrees. Not zero: from the horizon orbits are measured, too.
const ELEVATION_DEG: f32 = 15.0;

/// Mean FLIP over the levels of a package in `folder`.
pub fn flip(input: &Path, folder: &Path, report: &Report, watch: &dyn Watch) -> Result<f64> {
    let original = load(input)?;
    let mut sum = 0.0;
    for level in &report.levels {
        part(&Quiet(watch), "flip")?;
        let height_px = level.sizes.first().map_or(0, |s| s.height_px);
        sum += of_level(&original, &load(&folder.join(&level.file))?, height_px);
    }
    Ok(sum / report.levels.len().max(1) as f64)
}

fn of_level(original: &Model, level: &Model, height_px: u32) -> f64 {
    let settings = Settings {
        heights_px: vec![height_px],
        views: VIEWS,
        elevations_deg: vec![ELEVATION_DEG],
        azimuth_offset_deg: crate::pipeline::REPORT_OFFSET_DEG,
        appearance: true,
        ..Settings::default()
    };
    let found = evaluate((original, ""), &[(level, "")], &settings);
    let sizes = found.levels.first().and_then(|l| l.sizes.first());
    let look = sizes.and_then(|s| s.appearance.as_ref());
    look.map_or(0.0, |a| a.flip.mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::botany::grow::{Options, Species, grow};

    #[test]
    fn a_tree_does_not_differ_from_itself_and_a_bare_one_does() {
        let options = Options {
            leaves: Some(100),
            ..Options::default()
        };
        let grown = grow(&Species::named("palm").unwrap(), &options).unwrap();
        let home = tempfile::tempdir().unwrap();
        let file = home.path().join("palm.glb");
        std::fs::write(&file, grown.glb).unwrap();
        let tree = load(&file).unwrap();
        let mut half = tree.clone();
        half.retain_triangles(|t| t % 2 == 0);
        assert_eq!(of_level(&tree, &tree, 48), 0.0);
        assert!(of_level(&tree, &half, 48) > 0.02);
    }
}
