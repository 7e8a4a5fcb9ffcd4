//! The file's outermost layer: a GLB container or bare JSON, and what it requires of a reader.

use std::path::Path;

use super::json::Document;
use super::settled::read_settled;
use super::warning::Warnings;
use super::{Limits, fault};
use crate::{Error, Result};

const MAGIC: &[u8] = b"glTF";
const CHUNK_JSON: &[u8] = b"JSON";
const CHUNK_BIN: &[u8] = b"BIN\0";
const HELP_EXPORT: &str = "export the tree again as glTF 2.0 binary (.glb)";

/// Extensions that are read.
const READ: &[&str] = &[
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "EXT_texture_webp",
    "KHR_materials_unlit",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_node_visibility",
];

/// Extensions that are judged where they are used, because a file may do without them.
const JUDGED: &[&str] = &[
    "KHR_draco_mesh_compression",
    "KHR_texture_basisu",
    "EXT_texture_avif",
    "MSFT_texture_dds",
];

/// Beginnings of names of extensions that don't change where triangles lie or how they are cut.
const HARMLESS: &[&str] = &[
    "KHR_materials_",
    "KHR_lights",
    "EXT_lights",
    "KHR_xmp",
    "KHR_animation",
    "KHR_audio",
    "EXT_mesh_features",
    "EXT_structural_metadata",
    "EXT_instance_features",
    "MSFT_lod",
    "VRMC_",
    "KHR_interactivity",
];

/// Reads a file of bounded size; folders, pipes and devices are refused.
pub(super) fn read_file(path: &Path, limits: &Limits) -> Result<Vec<u8>> {
    let meta = std::fs::metadata(path).map_err(|source| Error::io(path, "open", source))?;
    if !meta.is_file() {
        return Err(fault(
            path,
            "file",
            "it is not a regular file",
            "give the path of a .glb or .gltf file",
        ));
    }
    if meta.len() > limits.bytes {
        return Err(fault(
            path,
            "file",
            format!(
                "{} bytes are more than the limit of {}",
                meta.len(),
                limits.bytes
            ),
            "split the scene: one tree a file; or raise bytes in the recipe's limits",
        ));
    }
    read_settled(path)
}

/// Splits a file into its JSON and its binary chunk.
pub(super) fn open<'a>(
    bytes: &'a [u8],
    path: &Path,
    limits: &Limits,
) -> Result<(Document, Option<&'a [u8]>)> {
    let (text, chunk) = if bytes.starts_with(MAGIC) {
        split_glb(bytes, path)?
    } else {
        // A byte order mark is forbidden and common.
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        if text.iter().find(|b| !b.is_ascii_whitespace()) != Some(&b'{') {
            return Err(fault(
                path,
                "file",
                "it is neither a GLB container nor JSON",
                "pleach reads glTF 2.0 (.glb, .gltf); convert other formats with Blender or obj2gltf",
            ));
        }
        (text, None)
    };
    // Some exporters pad the chunk with zeros instead of spaces.
    let zeros = text.iter().rev().take_while(|&&b| b == 0).count();
    let text = &text[..text.len() - zeros];
    check_size(text, path, limits)?;
    let document: Document = serde_json::from_slice(text)
        .map_err(|e| fault(path, "JSON", e.to_string(), HELP_EXPORT))?;
    if !document.asset.version.starts_with("2.") {
        let version = &document.asset.version;
        return Err(fault(
            path,
            "asset.version",
            format!("the version is \"{version}\", not 2.x"),
            "convert glTF 1.0 files with gltf-pipeline, or export again",
        ));
    }
    Ok((document, chunk))
}

/// JSON of many tiny objects takes far more memory than its text, so both are bounded.
fn check_size(text: &[u8], path: &Path, limits: &Limits) -> Result<()> {
    let objects = text.iter().filter(|&&b| b == b'{').count();
    if text.len() as u64 <= limits.bytes / 8 && objects / 4 <= limits.nodes {
        return Ok(());
    }
    Err(fault(
        path,
        "JSON",
        format!("{} bytes with {objects} objects are too many", text.len()),
        "join objects before the export, and export as .glb; or raise bytes and nodes in the recipe's limits",
    ))
}

fn split_glb<'a>(bytes: &'a [u8], path: &Path) -> Result<(&'a [u8], Option<&'a [u8]>)> {
    let broken = |what: String| fault(path, "GLB container", what, HELP_EXPORT);
    let word = |at: usize| -> Option<usize> {
        let four = bytes.get(at..at.checked_add(4)?)?;
        Some(u32::from_le_bytes(four.try_into().ok()?) as usize)
    };
    let header = word(4).zip(word(8));
    let (version, total) = header.ok_or_else(|| broken("the header is cut off".into()))?;
    if version != 2 {
        return Err(broken(format!("container version {version}, not 2")));
    }
    if total > bytes.len() {
        return Err(broken(format!(
            "the header promises {total} bytes and the file has {}: it is cut off",
            bytes.len()
        )));
    }
    let (mut at, mut text, mut chunk) = (12, None, None);
    while let Some(length) = word(at) {
        let kind = bytes.get(at + 4..at + 8);
        let body = bytes.get(at + 8..(at + 8).saturating_add(length));
        let (Some(kind), Some(body)) = (kind, body) else {
            return Err(broken(format!("the chunk at byte {at} is cut off")));
        };
        if kind == CHUNK_JSON && text.is_none() {
            text = Some(body);
        } else if kind == CHUNK_BIN && chunk.is_none() {
            chunk = Some(body);
        }
        at += 8 + length.next_multiple_of(4);
        if at >= total {
            break;
        }
    }
    let text = text.ok_or_else(|| broken("there is no JSON chunk".into()))?;
    Ok((text, chunk))
}

/// Refuses a file that requires what would change its geometry unread; warns of what is ignored.
pub(super) fn check_extensions(
    document: &Document,
    path: &Path,
    warnings: &mut Warnings,
) -> Result<()> {
    for name in &document.extensions_required {
        let known = |list: &[&str]| list.iter().any(|&n| n == name);
        if known(READ) || known(JUDGED) {
            continue;
        }
        if HARMLESS.iter().any(|start| name.starts_with(start)) {
            warnings.say(
                &format!("the required extension {name} is ignored"),
                "extensionsRequired",
            );
        } else {
            return Err(fault(
                path,
                "extensionsRequired",
                format!("the file requires the extension {name}, which pleach does not read"),
                format!("export the tree again without {name}"),
            ));
        }
    }
    Ok(())
}
