//! URIs of buffers and images: data URIs, and relative files that stay in the file's folder.

use std::path::{Component, Path, PathBuf};

use base64::Engine as _;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

use super::container::read_file;
use super::{Limits, fault};
use crate::Result;

/// Padding is often missing in hand-made files.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The bytes that a URI names, and how many of them were read from another file.
pub(super) fn fetch(
    document: &Path,
    uri: &str,
    place: &str,
    limits: &Limits,
) -> Result<(Vec<u8>, u64)> {
    if uri
        .get(..5)
        .is_some_and(|s| s.eq_ignore_ascii_case("data:"))
    {
        return Ok((data(document, &uri[5..], place)?, 0));
    }
    let path = resolve(document, uri, place)?;
    let bytes = read_file(&path, limits)?;
    let length = bytes.len() as u64;
    Ok((bytes, length))
}

/// RFC 2397: `[type][;base64],bytes`.
fn data(document: &Path, rest: &str, place: &str) -> Result<Vec<u8>> {
    let broken = |what: String| {
        fault(
            document,
            place,
            what,
            "export again as .glb, which needs no data URIs",
        )
    };
    let Some((head, body)) = rest.split_once(',') else {
        return Err(broken("the data URI has no comma".into()));
    };
    let base64 = head
        .get(head.len().saturating_sub(7)..)
        .is_some_and(|s| s.eq_ignore_ascii_case(";base64"));
    let plain: Vec<u8> = percent_decode_str(body).collect();
    if !base64 {
        return Ok(plain);
    }
    BASE64
        .decode(plain)
        .map_err(|e| broken(format!("the data URI is not base64: {e}")))
}

/// The file that a relative URI names, if it lies in the document's folder.
fn resolve(document: &Path, uri: &str, place: &str) -> Result<PathBuf> {
    let refuse = |why: &str| {
        let shown: String = uri.chars().take(80).collect();
        Err(fault(
            document,
            place,
            format!("the URI \"{shown}\" {why}"),
            "put the file beside the .gltf and name it by a relative URI, or export as .glb",
        ))
    };
    let decoded = match percent_decode_str(uri).decode_utf8() {
        Ok(decoded) if !decoded.is_empty() && !decoded.contains('\0') => decoded,
        _ => return refuse("is empty or not text"),
    };
    if has_scheme(uri) {
        return refuse("is absolute; nothing is fetched from elsewhere");
    }
    // Backslashes separate folders on Windows, so they are judged as such everywhere.
    let path = PathBuf::from(decoded.replace('\\', "/"));
    let mut inside = PathBuf::new();
    for component in path.components() {
        match component {
            Component::Normal(name) => inside.push(name),
            Component::CurDir => {}
            Component::ParentDir if inside.pop() => {}
            _ => return refuse("leaves the file's folder"),
        }
    }
    let folder = match document.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    let full = folder.join(inside);
    // A link inside the folder may still lead out of it.
    if let (Ok(target), Ok(root)) = (full.canonicalize(), folder.canonicalize())
        && !target.starts_with(root)
    {
        return refuse("is a link that leaves the file's folder");
    }
    Ok(full)
}

/// `scheme:` (RFC 3986), or a drive letter.
fn has_scheme(uri: &str) -> bool {
    let Some((scheme, _)) = uri.split_once(':') else {
        return false;
    };
    scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c))
}
