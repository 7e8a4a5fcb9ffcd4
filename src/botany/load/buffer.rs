//! The bytes behind buffer views: chunk, data URI, external file, or meshopt-compressed.

use std::borrow::Cow;
use std::path::Path;

use super::json::Document;
use super::{Limits, fault, meshopt, uri};
use crate::{Error, Result};

/// An opened document with the bytes of its buffers.
pub(super) struct Asset<'a> {
    pub path: &'a Path,
    pub json: &'a Document,
    pub limits: &'a Limits,
    /// Bytes of the file and its external buffers.
    pub file_bytes: u64,
    /// `None`: no source (the fallback of compressed views).
    buffers: Vec<Option<Cow<'a, [u8]>>>,
    /// Decompressed views by index; `None` where a view is plain.
    unpacked: Vec<Option<Vec<u8>>>,
}

impl<'a> Asset<'a> {
    /// Reads all buffers and decompresses the views that are compressed.
    pub fn open(
        path: &'a Path,
        json: &'a Document,
        file_bytes: u64,
        chunk: Option<&'a [u8]>,
        limits: &'a Limits,
    ) -> Result<Self> {
        let mut asset = Self {
            path,
            json,
            limits,
            file_bytes,
            buffers: Vec::with_capacity(json.buffers.len()),
            unpacked: Vec::new(),
        };
        let mut data_bytes = 0u64;
        for (i, buffer) in json.buffers.iter().enumerate() {
            let place = format!("buffer {i}");
            let bytes = match &buffer.uri {
                None if i == 0 => chunk.map(Cow::Borrowed),
                None => None,
                Some(uri) => {
                    let (bytes, external) = uri::fetch(path, uri, &place, limits)?;
                    asset.file_bytes += external;
                    data_bytes += bytes.len() as u64;
                    asset.check_bytes(data_bytes, &place)?;
                    Some(Cow::Owned(bytes))
                }
            };
            if let Some(bytes) = &bytes
                && bytes.len() < buffer.byte_length
            {
                return Err(asset.fault(
                    place,
                    format!(
                        "byteLength is {} and only {} bytes are there",
                        buffer.byte_length,
                        bytes.len()
                    ),
                    "the file or its .bin is cut off; export or copy it again",
                ));
            }
            asset.buffers.push(bytes);
        }
        asset.unpack()?;
        Ok(asset)
    }

    fn unpack(&mut self) -> Result<()> {
        let mut total = 0u64;
        let mut unpacked = Vec::with_capacity(self.json.buffer_views.len());
        for (i, view) in self.json.buffer_views.iter().enumerate() {
            let extensions = view.extensions.as_deref();
            let compressed =
                extensions.and_then(|e| e.khr_meshopt.as_ref().or(e.ext_meshopt.as_ref()));
            unpacked.push(match compressed {
                None => None,
                Some(c) => {
                    let place = format!("bufferView {i}");
                    let packed = self.slice(c.buffer, c.byte_offset, c.byte_length, &place)?;
                    total =
                        total.saturating_add((c.count as u64).saturating_mul(c.byte_stride as u64));
                    self.check_bytes(total, &place)?;
                    let bytes = meshopt::decode(packed, c).map_err(|what| {
                        self.fault(
                            place,
                            what,
                            "compress the file again, or export it without meshopt compression",
                        )
                    })?;
                    Some(bytes)
                }
            });
        }
        self.unpacked = unpacked;
        Ok(())
    }

    /// The bytes of a buffer view.
    pub fn view(&self, index: usize, place: &str) -> Result<&[u8]> {
        let Some(view) = self.json.buffer_views.get(index) else {
            return Err(self.fault(place, format!("there is no bufferView {index}"), BROKEN));
        };
        match self.unpacked.get(index) {
            Some(Some(bytes)) => Ok(bytes),
            _ => self.slice(view.buffer, view.byte_offset, view.byte_length, place),
        }
    }

    /// Distance of a view's elements where the file says it.
    pub fn stride(&self, index: usize) -> Option<usize> {
        let view = self.json.buffer_views.get(index)?;
        let extensions = view.extensions.as_deref();
        let compressed = extensions.and_then(|e| e.khr_meshopt.as_ref().or(e.ext_meshopt.as_ref()));
        // Compressed indices have the stride in the extension alone, and it is their size.
        compressed.map(|c| c.byte_stride).or(view.byte_stride)
    }

    fn slice(&self, buffer: usize, offset: usize, length: usize, place: &str) -> Result<&[u8]> {
        let Some(bytes) = self.buffers.get(buffer).and_then(Option::as_ref) else {
            return Err(self.fault(
                place,
                format!("buffer {buffer} has no bytes"),
                "the binary chunk or the .bin file is missing; export or copy the file again",
            ));
        };
        let end = offset.checked_add(length);
        end.and_then(|end| bytes.get(offset..end)).ok_or_else(|| {
            let what = format!(
                "bytes {offset} to {} lie outside buffer {buffer} of {} bytes",
                offset.saturating_add(length),
                bytes.len()
            );
            self.fault(place, what, BROKEN)
        })
    }

    fn check_bytes(&self, bytes: u64, place: &str) -> Result<()> {
        if bytes <= self.limits.bytes {
            return Ok(());
        }
        Err(self.fault(
            place,
            format!(
                "{bytes} bytes are more than the limit of {}",
                self.limits.bytes
            ),
            "split the scene: one tree a file; or raise bytes in the recipe's limits",
        ))
    }

    /// An input error of this file.
    pub fn fault(
        &self,
        place: impl Into<String>,
        what: impl Into<String>,
        help: impl Into<String>,
    ) -> Error {
        fault(self.path, place, what, help)
    }
}

/// What to do about a file that contradicts itself.
pub(super) const BROKEN: &str =
    "the file is broken; check it with the glTF validator and export it again";
