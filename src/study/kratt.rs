//! Precision and recall of baked levels (Kratt and others 2014, Fig. 3): the paper's adaptive loop beside
//! the optimal cut.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::pipeline::{Limit, Request, Wanted, bake};
use crate::recipe::{Method, Preset, Recipe};
use crate::report::schema::Level;
use crate::watch::Unwatched;

/// Shares of the original's triangles.
const SHARES: [f64; 3] = [0.1, 0.03, 0.01];

/// The levels of one tree by one method.
#[derive(Clone, Debug)]
pub struct Row {
    /// Name of the tree.
    pub tree: String,
    /// "optimal cut" or "adaptive loop".
    pub method: &'static str,
    /// The levels, nearest first.
    pub levels: Vec<Level>,
}

/// Bakes each tree twice; packages go to folders in `folder`, which stay if `keep`.
///
/// # Errors
/// Those of a bake.
pub fn study(inputs: &[PathBuf], preset: Preset, folder: &Path, keep: bool) -> Result<Vec<Row>> {
    let mut out = Vec::new();
    for input in inputs {
        let tree = input
            .file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        for (name, method) in [
            ("optimal cut", Method::OptimalCut),
            ("adaptive loop", Method::AdaptiveLoop),
        ] {
            let package = folder.join(format!("{tree}_{}", name.replace(' ', "_")));
            let request = Request {
                input: input.clone(),
                output: package.clone(),
                wanted: Wanted::Limits(SHARES.map(Limit::Share).to_vec()),
                recipe: Recipe {
                    method,
                    ..Recipe::preset(preset)
                },
                force: true,
                accept: true,
                ..Request::default()
            };
            let baked = bake(&request, &Unwatched)?;
            if !keep {
                std::fs::remove_dir_all(&package).map_err(|e| Error::io(&package, "remove", e))?;
            }
            out.push(Row {
                tree: tree.clone(),
                method: name,
                levels: baked.report.levels,
            });
        }
    }
    Ok(out)
}

/// The figures for programs.
pub fn to_json(rows: &[Row]) -> Value {
    let level = |l: &Level| {
        let size = l.sizes.first().cloned().unwrap_or_default();
        json!({
            "triangles": l.triangles, "height_px": size.height_px, "precision": size.precision.mean,
            "recall": size.recall.mean, "f1": size.f1.mean, "worst_f1": size.f1.worst,
        })
    };
    let row = |r: &Row| json!({ "tree": r.tree, "method": r.method, "levels": r.levels.iter().map(level).collect::<Vec<_>>() });
    json!({ "trees": rows.iter().map(row).collect::<Vec<_>>() })
}

/// The figures for people.
pub fn table(rows: &[Row]) -> String {
    let mut out = format!(
        "{:<28}{:<16}{:>10}{:>8}{:>11}{:>9}{:>8}{:>11}\n",
        "tree", "method", "triangles", "px", "precision", "recall", "F1", "worst view"
    );
    for row in rows {
        for level in &row.levels {
            let Some(size) = level.sizes.first() else {
                continue;
            };
            out += &format!(
                "{:<28}{:<16}{:>10}{:>8}{:>11.3}{:>9.3}{:>8.3}{:>11.3}\n",
                row.tree,
                row.method,
                level.triangles,
                size.height_px,
                size.precision.mean,
                size.recall.mean,
                size.f1.mean,
                size.f1.worst
            );
        }
    }
    out
}
