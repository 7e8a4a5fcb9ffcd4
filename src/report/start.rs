//! From where a level is shown, as its own file says.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use serde_json::Value;

use crate::space::view::Lens;

/// Bytes of JSON beyond which a level is not asked.
const MOST_JSON: u64 = 1 << 28;

/// What a level's file says of where it is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Start {
    /// Height of the tree in pixels where it takes over.
    pub height_px: Option<u32>,
    /// The lens of the screen that this is stated for.
    pub lens: Option<Lens>,
}

/// Where a level takes over and on which screen, from its node's `extras` (`screen_height`,
/// `screen_height_px`, `fov_deg`); nothing where a file does not say, as those of other tools.
pub fn start(file: &Path) -> Start {
    let told = || {
        let root = json(file)?;
        let nodes = root["nodes"].as_array()?;
        let told = nodes.iter().map(|node| Start::of(&node["extras"]));
        told.into_iter().reduce(|a, b| Start {
            height_px: a.height_px.or(b.height_px),
            lens: a.lens.or(b.lens),
        })
    };
    told().unwrap_or_default()
}

impl Start {
    fn of(extras: &Value) -> Self {
        let number = |key: &str| extras[key].as_f64();
        let lines = number("screen_height_px").filter(|l| (1.0..=1e6).contains(l));
        let fov_deg = number("fov_deg").filter(|f| (1.0..=170.0).contains(f));
        // The original's own level starts at the eye: its share of the screen is no height.
        let pixels = number("screen_height")
            .zip(lines)
            .map(|(s, l)| (s * l).round());
        Self {
            height_px: pixels
                .filter(|p| (2.0..=4096.0).contains(p))
                .map(|p| p as u32),
            lens: lines.zip(fov_deg).map(|(l, f)| Lens::of_screen(l, f)),
        }
    }
}

/// The JSON of a GLB.
pub(super) fn json(file: &Path) -> Option<Value> {
    let mut file = File::open(file).ok()?;
    let mut head = [0; 20];
    file.read_exact(&mut head).ok()?;
    let json = head.strip_prefix(b"glTF")?;
    let length = u64::from(u32::from_le_bytes(*json[8..].first_chunk()?));
    let mut text = Vec::new();
    file.take(length.min(MOST_JSON))
        .read_to_end(&mut text)
        .ok()?;
    serde_json::from_slice(&text).ok()
}
