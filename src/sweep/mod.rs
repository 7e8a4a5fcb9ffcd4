//! Speed against accuracy: trees baked by every preset, and by each knob alone.
//!
//! Runs follow one another in one process with the same threads, so that their times compare; the
//! base is baked first and once more at the end, and the difference of the two says how far times
//! can be trusted. Times are compared as processor time, which other work on the machine does not
//! stretch. Figures are those of the packages' own reports, each level at its own size.

mod advice;
mod csv;
mod flip;
mod plot;
mod run;
mod variants;
mod whole;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::pipeline::Wanted;
use crate::recipe::Recipe;
use crate::scene::Scene;
use crate::watch::Watch;
pub use advice::advice;
pub use plot::plot;
pub use run::Run;
use run::{mark_front, run};
pub use variants::{BASE, Variant, variants};
pub use whole::{OverTrees, Whole, whole};

/// What to sweep.
#[derive(Clone, Debug, Default)]
pub struct Asked {
    /// The trees.
    pub inputs: Vec<PathBuf>,
    /// Which levels.
    pub wanted: Wanted,
    /// The screen.
    pub scene: Scene,
    /// Names of the variants to try beside the base; empty: all.
    pub only: Vec<String>,
}

/// Everything that a sweep found of one tree.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Sweep {
    /// Name of the input file.
    pub input: String,
    /// Every variant, in the order in which they ran.
    pub runs: Vec<Run>,
    /// Time of the base's second run over that of its first: how far times can be trusted.
    pub repeat_ratio: f64,
    /// What to make of it, a sentence each.
    pub advice: Vec<String>,
}

/// Sweeps one tree after the other; `found` is called after each. Every variant is baked into a
/// folder under `scratch`, which is removed after each.
///
/// # Errors
/// [`Error::Usage`] where a variant is unknown, those of a bake and of `found`, and
/// [`Error::Interrupted`]. Levels out of their band are accepted.
pub fn sweep(
    asked: &Asked,
    scratch: &Path,
    watch: &dyn Watch,
    mut found: impl FnMut(&Sweep) -> Result<()> + Send,
) -> Result<Vec<Sweep>> {
    let variants = chosen(&asked.only)?;
    let mut out = Vec::with_capacity(asked.inputs.len());
    for input in &asked.inputs {
        let sweep = of_tree((input, asked), &variants, scratch, watch)?;
        found(&sweep)?;
        out.push(sweep);
    }
    Ok(out)
}

fn of_tree(
    tree: (&Path, &Asked),
    variants: &[Variant],
    scratch: &Path,
    watch: &dyn Watch,
) -> Result<Sweep> {
    let again = Variant {
        name: format!("{BASE}, again"),
        recipe: Recipe::balanced(),
    };
    let name = tree.0.file_name().unwrap_or_default().to_string_lossy();
    watch.stage(&name, variants.len() as u64 + 1);
    let mut runs = Vec::with_capacity(variants.len() + 1);
    for variant in variants.iter().chain([&again]) {
        watch.part(&variant.name);
        runs.push(run(tree, variant, scratch, watch)?);
        watch.step();
    }
    let again = runs.pop().map_or(0.0, |r| r.cost());
    let first = runs.first().map_or(0.0, Run::cost);
    mark_front(&mut runs);
    Ok(Sweep {
        input: name.into_owned(),
        advice: advice(&runs),
        runs,
        repeat_ratio: again / first.max(1e-9),
    })
}

/// The base and the variants that were asked for.
fn chosen(only: &[String]) -> Result<Vec<Variant>> {
    let all = variants();
    let names: Vec<&str> = all.iter().map(|v| v.name.as_str()).collect();
    if let Some(unknown) = only.iter().find(|name| !names.contains(&name.as_str())) {
        return Err(Error::usage(
            format!("there is no variant {unknown:?}"),
            format!("the variants are: {}", names.join(", ")),
        ));
    }
    let wanted = |v: &Variant| only.is_empty() || v.name == BASE || only.contains(&v.name);
    Ok(all.into_iter().filter(wanted).collect())
}
