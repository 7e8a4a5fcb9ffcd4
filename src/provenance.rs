//! Where a package comes from: the input, the files that it refers to, and what was asked for.

use std::path::Path;

use crate::botany::load::references;
use crate::error::{Error, Result};
use crate::export::manifest::{Provenance, Reference};
use crate::request::Request;
use crate::space::sha256::sha256;

/// Bytes of the longest name of a tree: the rest of 255 is for "_hierarchy.glb" and names of drafts.
const LONGEST_NAME: usize = 220;

/// File systems take names of 255 bytes, and a package's files are named after the tree.
pub fn check_name(input: &Path) -> Result<()> {
    let bytes = input.file_stem().map_or(0, |stem| stem.len());
    if bytes <= LONGEST_NAME {
        return Ok(());
    }
    Err(Error::usage(
        format!(
            "{}: the tree's name has {bytes} bytes, and the files of its package would have more than file systems take",
            input.display()
        ),
        format!("rename it: {LONGEST_NAME} bytes before the extension at most"),
    ))
}

/// Where a package comes from; `input` are the input's bytes.
///
/// # Errors
/// Those of [`references`].
pub fn provenance(request: &Request, input: &[u8]) -> Result<Provenance> {
    let name = request.input.file_name().unwrap_or_default();
    let others = references(input, &request.input, &request.recipe.limits)?;
    let mut asked = request.wanted.to_string();
    if let Some(pixels) = request.max_error_px {
        asked += &format!(" --max-error {pixels}");
    }
    if request.accept {
        asked += " --accept";
    }
    Ok(Provenance {
        generator: concat!("pleach ", env!("CARGO_PKG_VERSION")).into(),
        input: name.to_string_lossy().into_owned(),
        input_bytes: input.len() as u64,
        input_sha256: sha256(input),
        references: others
            .into_iter()
            .map(|(uri, bytes)| Reference {
                uri,
                sha256: sha256(&bytes),
            })
            .collect(),
        asked,
    })
}
