//! From where a level is shown, as its own file says.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use serde_json::Value;

/// Bytes of JSON beyond which a level is not asked.
const MOST_JSON: u64 = 1 << 28;

/// The tree's height in pixels where a level takes over, from its node's `extras` (`screen_height`
/// and `screen_height_px`); `None` where a file does not say, as those of other tools.
pub fn start_height_px(file: &Path) -> Option<u32> {
    let mut file = File::open(file).ok()?;
    let mut head = [0; 20];
    file.read_exact(&mut head).ok()?;
    let json = head.strip_prefix(b"glTF")?;
    let length = u64::from(u32::from_le_bytes(*json[8..].first_chunk()?));
    let mut text = Vec::new();
    file.take(length.min(MOST_JSON))
        .read_to_end(&mut text)
        .ok()?;
    let root: Value = serde_json::from_slice(&text).ok()?;
    // The original's own level starts at the eye: its share of the screen is no height.
    root["nodes"].as_array()?.iter().find_map(|node| {
        let extras = &node["extras"];
        let share = extras["screen_height"].as_f64()?;
        let lines = extras["screen_height_px"].as_f64()?;
        let pixels = (share * lines).round();
        (2.0..=4096.0).contains(&pixels).then_some(pixels as u32)
    })
}
