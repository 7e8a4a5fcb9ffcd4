//! What a package holds beside its levels, where the recipe asks for it.

use crate::botany::tree::Tree;
use crate::error::{Error, Result};
use crate::export::combined::Packed;
use crate::export::instanced::{copies_but_for_normals, write_instanced};
use crate::export::manifest_tiles::Tiles;
use crate::export::package::Package;
use crate::recipe::Recipe;
use crate::report::schema::{Hierarchy, Instancing};
use crate::scene::Scene;
use crate::tiles::bake_tiles;
use crate::watch::Watch;

/// Writes level 0 as prototypes and copies, if its leaves repeat.
///
/// # Errors
/// [`Error::Io`], and those of encoding images.
pub fn instanced(
    package: &Package,
    tree: &Tree,
    recipe: &Recipe,
    plain: &Packed,
    files: &mut Vec<String>,
) -> Result<Option<Instancing>> {
    let Some((bytes, told)) = write_instanced(tree, recipe, plain.extras.clone())? else {
        return Ok(None);
    };
    let file = format!("{}_instanced.glb", tree.model.name);
    package.write(&file, &bytes)?;
    let plain = package.file(&files[0]);
    let plain_file_bytes = std::fs::metadata(&plain).map_err(|e| Error::io(&plain, "read", e))?;
    // The manifest stays last: who finds it finds all the others.
    files.insert(files.len() - 1, file.clone());
    Ok(Some(Instancing {
        file,
        plain_file_bytes: plain_file_bytes.len(),
        ..told
    }))
}

/// What keeps leaves from being copies, where it is most of them.
pub fn alone(tree: &Tree, recipe: &Recipe, instancing: Option<&Instancing>) -> Option<String> {
    let (leaves, copies) = (
        tree.leaves.len(),
        instancing.map_or(0, |i| i.copies as usize),
    );
    if 2 * copies >= leaves {
        return None;
    }
    let shapes = copies_but_for_normals(tree, recipe);
    let help = match shapes > 2 * copies {
        true => format!(
            "; {shapes} have the shape but not the normals of another \
             (recipe: instance_normals_deg: 180 shares them)"
        ),
        false => String::new(),
    };
    Some(format!(
        "only {copies} of {leaves} leaves are exact copies of others{help}"
    ))
}

/// Bakes and writes the hierarchy of sub-trees.
///
/// # Errors
/// Those of [`bake_tiles`].
pub fn hierarchy(
    package: &Package,
    tree: &Tree,
    (recipe, scene): (&Recipe, &Scene),
    files: &mut Vec<String>,
    watch: &dyn Watch,
) -> Result<Tiles> {
    // Tiles lie on one page in blocks of their own, and each is loaded when it is needed.
    let recipe = Recipe {
        sharing: 0.0,
        ..recipe.clone()
    };
    let (tiles, images) = bake_tiles(package, tree, &recipe, scene, watch)?;
    let last = files.len() - 1;
    let more = tiles.files().map(str::to_owned).chain(images);
    files.splice(last..last, more);
    Ok(tiles)
}

/// What the report says of the hierarchy.
pub fn told(tiles: &Tiles) -> Hierarchy {
    let billboards = tiles.list.iter().filter_map(|t| t.billboards.as_ref());
    Hierarchy {
        file: tiles.file.clone(),
        tileset: tiles.tileset.clone(),
        tiles: tiles.list.len() as u64,
        tips: tiles.list.iter().filter(|t| t.geometry.is_some()).count() as u64,
        billboard_triangles: billboards.map(|b| b.triangles).sum(),
        atlas: tiles.atlas,
    }
}
