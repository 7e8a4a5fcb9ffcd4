//! Pictures inside of the page.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// A PNG as an address that asks for nothing.
pub fn data_uri(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", STANDARD.encode(png))
}
