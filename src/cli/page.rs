//! `bake --page`: one file that shows what was baked and how, beside the package.

use std::path::PathBuf;

use crate::botany::Model;
use crate::botany::load::{load, load_with};
use crate::error::{Error, Result};
use crate::export::package::beside;
use crate::pipeline::{Baked, REPORT_OFFSET_DEG, Request, lens};
use crate::report::schema::{Bake, Report};
use crate::report::{Content, Made, Settings, Sheet, evaluate};
use crate::written::SHEET;

/// Follows the folder's name in that of the page.
pub const PAGE: &str = ".report.html";

/// Heights of the tree at which all levels are compared, pixels.
const HEIGHTS_PX: [u32; 2] = [256, 64];

/// Evaluates the levels of a package and writes the page; returns where.
///
/// # Errors
/// Those of loading the files, and [`Error::Io`].
pub fn write(request: &Request, baked: &Baked, took: &Bake) -> Result<PathBuf> {
    let mut original = load_with(&request.input, &request.recipe.limits)?;
    if !request.scene.lit {
        original.unlight();
    }
    let rows = &baked.report.levels;
    let levels: Vec<Model> = rows
        .iter()
        .map(|row| load(&request.output.join(&row.file)))
        .collect::<Result<_>>()?;
    let settings = Settings {
        heights_px: HEIGHTS_PX.to_vec(),
        own_heights_px: rows
            .iter()
            .map(|row| row.sizes.first().map(|s| s.height_px))
            .collect(),
        azimuth_offset_deg: REPORT_OFFSET_DEG,
        lens: lens(&request.scene),
        sector: request.scene.sector(),
        client: true,
        appearance: true,
        ..Settings::default()
    };
    let named: Vec<(&Model, &str)> = levels
        .iter()
        .zip(rows)
        .map(|(model, row)| (model, row.file.as_str()))
        .collect();
    let file = request.input.file_name().unwrap_or_default();
    let report = Report {
        sharing: baked.report.sharing.clone(),
        cuts: baked.report.cuts.clone(),
        ..evaluate((&original, &file.to_string_lossy()), &named, &settings)
    };
    let files: Vec<(String, u64)> = baked
        .files
        .iter()
        .map(|name| {
            let path = request.output.join(name);
            let about = std::fs::metadata(&path).map_err(|e| Error::io(&path, "read", e))?;
            Ok((name.clone(), about.len()))
        })
        .collect::<Result<_>>()?;
    let models: Vec<&Model> = levels.iter().collect();
    let page = Content {
        report: &report,
        original: &original,
        levels: &models,
        views: &settings.view_set(),
        lens: settings.lens,
        sheets: &sheets(request, &baked.files)?,
        made: Some(Made {
            title: "How they were made",
            recognised: &baked.recognised,
            took,
            files: &files,
        }),
    };
    let html = page.html()?;
    let file = beside(&request.output, PAGE);
    let draft = beside(&request.output, ".report.html.draft");
    let written = std::fs::write(&draft, html).and_then(|()| std::fs::rename(&draft, &file));
    written.map_err(|e| {
        // Nothing half-written stays; the error that led here is the one to tell.
        let _ = std::fs::remove_file(&draft);
        Error::io(&file, "write", e)
    })?;
    Ok(file)
}

/// The package's pictures of tiles and their copies, nearest level first.
fn sheets(request: &Request, files: &[String]) -> Result<Vec<Sheet>> {
    let level = |file: &String| {
        let name = file.strip_suffix(SHEET)?;
        name.rsplit_once("_LOD")?.1.parse::<u32>().ok()
    };
    let sheet = |file: &String| {
        let path = request.output.join(file);
        let read = |level| {
            let png = std::fs::read(&path).map_err(|e| Error::io(&path, "read", e))?;
            Ok(Sheet { level, png })
        };
        level(file).map(read)
    };
    let mut sheets: Vec<Sheet> = files.iter().filter_map(sheet).collect::<Result<_>>()?;
    sheets.sort_by_key(|sheet| sheet.level);
    Ok(sheets)
}
