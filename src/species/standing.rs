//! What is known of a species' package before it is baked: whether it stands already, and the memory it will take.

use super::{Species, of_all};
use crate::batch::{expected_bytes, memory_bytes, unchanged};
use crate::error::{Error, Result};
use crate::export::manifest::SUFFIX;
use crate::report::species::SpeciesReport;

/// The report of the package that lies in the output folder, where a bake would make the same package: of the same
/// trees, levels, recipe, scene and version, with all its files. Whatever can't be read counts as changed.
pub fn standing(species: &Species) -> Option<SpeciesReport> {
    let requests = of_all(species);
    for request in &requests {
        let manifest = unchanged(request)?;
        let manifests = manifest.files.iter().filter(|f| f.ends_with(SUFFIX));
        // Another package may have this tree among others.
        if manifest.species.is_empty() || manifests.count() != requests.len() {
            return None;
        }
    }
    let report = std::fs::read(species.request.output.join("report.json")).ok()?;
    serde_json::from_slice(&report).ok()
}

/// Checks that trees which are in memory together fit into the recipe's bound, and says where they may not fit into
/// half of the machine's memory, which is the default.
///
/// # Errors
/// [`Error::Usage`] where the recipe states a bound, and they are expected to take more.
pub(super) fn check_memory(species: &Species) -> Result<Option<String>> {
    let recipe = &species.request.recipe;
    let wanted: u64 = of_all(species).iter().map(expected_bytes).sum();
    let bound = memory_bytes(recipe);
    if wanted <= bound {
        return Ok(None);
    }
    let what = format!(
        "trees of a species are in memory together, and these {} are expected to take {} MiB: more than {}",
        species.inputs.len(),
        wanted >> 20,
        bound >> 20
    );
    match recipe.memory_mib {
        0 => Ok(Some(format!("{what}, half of what the machine has"))),
        _ => Err(Error::usage(
            format!("{what}, the recipe's memory_mib"),
            "raise memory_mib, or bake fewer trees together",
        )),
    }
}
