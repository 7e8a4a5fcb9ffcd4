//! Whether what was baked is fit to be handed out.

use std::path::Path;

use crate::botany::stance::lies;
use crate::botany::tree::Tree;
use crate::describe::trunk;
use crate::error::Error;
use crate::ladder::Rung;
use crate::report::Judged;
use crate::report::band::{Fault, Trunk, faults};
use crate::report::schema::Report;

/// What follows the folder's name in that of the report on a bake that was refused: beside the
/// package, so that nobody takes it for one.
pub const REFUSED: &str = ".refused.json";

/// What is wrong with the levels.
pub fn in_band(tree: &Tree, rungs: &[Rung], judged: &[Judged], report: &Report) -> Vec<Fault> {
    let lies = lies(&tree.skeleton).is_some();
    let trunk = Trunk::new(&tree.model, &trunk(tree), lies);
    let mut out = Vec::new();
    for ((rung, level), row) in rungs.iter().zip(judged).zip(&report.levels) {
        if row.triangles > rung.triangles {
            out.push(Fault {
                what: format!(
                    "level {} ({}): {} triangles, more than its limit of {}",
                    row.level, row.file, row.triangles, rung.triangles
                ),
                help: "give --triangles a larger number".into(),
            });
        }
        out.extend(faults(&tree.model, level, row, trunk.as_ref()));
    }
    out
}

/// All faults as one error; `report` is where their figures are.
pub fn refusal(faults: &[Fault], report: &Path) -> Error {
    let lines: Vec<&str> = faults.iter().map(|f| f.what.as_str()).collect();
    let help = faults.first().map_or("", |f| f.help.as_str());
    Error::Refused {
        what: lines.join("\n  "),
        help: format!(
            "{help}; --accept keeps the levels as they are; {} has all figures",
            report.display()
        ),
    }
}
