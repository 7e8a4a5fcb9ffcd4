//! Whether a package is still what a bake would make.

use std::path::PathBuf;

use crate::botany::load::read;
use crate::export::manifest::{Manifest, SUFFIX};
use crate::pipeline::{Request, provenance};

/// Whether the request's folder holds the whole package that it would bake: made by this version
/// from the same input (its external files too), levels, recipe and scene. Whatever can't be read
/// counts as changed.
pub fn is_unchanged(request: &Request) -> bool {
    unchanged(request).is_some_and(|manifest| manifest.species.is_empty())
}

/// What the package says of the request's tree, alone or as one of a species, where a bake would make
/// the same.
pub fn unchanged(request: &Request) -> Option<Manifest> {
    let mut name = request.input.file_stem()?.to_os_string();
    name.push(SUFFIX);
    let file: PathBuf = request.output.join(name);
    // Without a package there is no need to read the input twice.
    let text = std::fs::read_to_string(&file).ok()?;
    let manifest = Manifest::from_ron(&text, &file).ok()?;
    let there = |name: &String| request.output.join(name).is_file();
    let input = read(&request.input, &request.recipe.limits).ok()?;
    let same = manifest.recipe.bakes_like(&request.recipe)
        && manifest.scene == request.scene
        && manifest.provenance == provenance(request, &input).ok()?
        && manifest.files.iter().all(there);
    same.then_some(manifest)
}
