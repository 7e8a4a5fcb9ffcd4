//! A species: the parameters of growth, read from RON.
//!
//! Names follow Weber and Penn where the meaning is theirs. Every number has a range; what lies
//! outside it, an unknown key and a wrong type are errors with line and column.

use std::path::Path;

use serde::{Deserialize, Deserializer, Serialize, de::Error as _};

use super::rng::{Vary, sin_cos};
use crate::{Error, Result};

/// A kind of tree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Species {
    /// Name: becomes part of the names of nodes.
    pub name: String,
    /// Envelope of the crown.
    pub shape: Shape,
    /// Height of the trunk, metres (0.1 to 200).
    #[serde(deserialize_with = "height")]
    pub height: Vary,
    /// Share of the trunk's length that is bare (0 to 1).
    #[serde(deserialize_with = "fraction")]
    pub bare: f32,
    /// Radius of the trunk over its length (0.001 to 0.5).
    #[serde(deserialize_with = "ratio")]
    pub ratio: f32,
    /// A child's radius falls with its length to this power (0.1 to 5).
    #[serde(deserialize_with = "exponent")]
    pub ratio_power: f32,
    /// How much wider the trunk is at the ground (0 to 5; 1: twice as wide).
    #[serde(deserialize_with = "flare")]
    pub flare: f32,
    /// Number of the trunk's lobes and their depth as a share of the radius.
    #[serde(default)]
    pub lobes: (u32, f32),
    /// Trunk, branches, twigs: 1 to 5 levels.
    #[serde(deserialize_with = "levels")]
    pub levels: Vec<Level>,
    /// Leaves; absent on a bare tree.
    #[serde(default)]
    pub leaf: Option<LeafKind>,
    /// Bark.
    pub bark: Bark,
}

/// One level of branching.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Level {
    /// Length over that of the parent (for the trunk: over the height). 0.001 to 10.
    #[serde(deserialize_with = "length")]
    pub length: Vary,
    /// Share of the radius that is lost towards the tip (0 to 1).
    #[serde(deserialize_with = "fraction")]
    pub taper: f32,
    /// Pieces along the length (1 to 100).
    #[serde(deserialize_with = "segments")]
    pub segments: u32,
    /// Sides of the tube (3 to 64).
    #[serde(deserialize_with = "sides")]
    pub sides: u32,
    /// Bend over the first half, degrees.
    #[serde(deserialize_with = "degrees")]
    pub curve: f32,
    /// Bend over the second half, degrees.
    #[serde(deserialize_with = "degrees")]
    pub curve_back: f32,
    /// Random bend over the whole length, degrees.
    #[serde(deserialize_with = "degrees")]
    pub crook: f32,
    /// Turn towards the sky (below zero: towards the ground) over the whole length, degrees
    /// where the stem is horizontal.
    #[serde(deserialize_with = "degrees")]
    pub lift: f32,
    /// Number of such stems on a parent of full length (0 to 10000); ignored for the trunk.
    #[serde(deserialize_with = "count")]
    pub branches: f32,
    /// Stems that leave the parent at one height (1 to 20).
    #[serde(deserialize_with = "whorl")]
    pub whorl: u32,
    /// Angle to the parent at the parent's base, at its tip, and its variation, degrees.
    #[serde(deserialize_with = "angle")]
    pub angle: (f32, f32, f32),
    /// Turn about the parent from one stem to the next, degrees.
    #[serde(deserialize_with = "turn")]
    pub rotate: Vary,
    /// Share of this stem's length that carries no children (0 to 1); the trunk has `bare`.
    #[serde(deserialize_with = "fraction")]
    pub bare: f32,
    /// Forks a stem, on average (0 to 10).
    #[serde(deserialize_with = "forks")]
    pub forks: f32,
    /// Angle between the two arms of a fork, degrees.
    #[serde(deserialize_with = "turn")]
    pub fork_angle: Vary,
    /// Leaves grow from this share of the length on; 1: none do.
    #[serde(deserialize_with = "fraction")]
    pub leaves_from: f32,
}

impl Default for Level {
    fn default() -> Self {
        Self {
            length: Vary(1.0, 0.0),
            taper: 1.0,
            segments: 6,
            sides: 6,
            curve: 0.0,
            curve_back: 0.0,
            crook: 0.0,
            lift: 0.0,
            branches: 0.0,
            whorl: 1,
            angle: (50.0, 40.0, 5.0),
            rotate: Vary(137.5, 10.0),
            bare: 0.1,
            forks: 0.0,
            fork_angle: Vary(40.0, 10.0),
            leaves_from: 1.0,
        }
    }
}

/// Leaves: how they are painted, how large they are and how they hang.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeafKind {
    /// Outline of one leaf.
    pub outline: Outline,
    /// Leaves painted on one card (1 to 200).
    #[serde(deserialize_with = "sprig")]
    pub sprig: u32,
    /// Number of cards where the user asks for none.
    #[serde(deserialize_with = "leaf_count")]
    pub count: u32,
    /// Length of a card, metres, when there are `count` of them; fewer are larger.
    #[serde(deserialize_with = "height")]
    pub length: Vary,
    /// Angle to the twig, degrees.
    #[serde(deserialize_with = "turn")]
    pub angle: Vary,
    /// Turn about the twig from one leaf to the next, degrees.
    #[serde(deserialize_with = "turn")]
    pub rotate: Vary,
    /// Turn towards the ground, degrees.
    #[serde(deserialize_with = "degrees")]
    pub droop: f32,
    /// 0: faces lie as chance has it; 1: all face up and outwards.
    #[serde(deserialize_with = "fraction")]
    pub facing: f32,
    /// sRGB colour of the upper side.
    #[serde(deserialize_with = "colour")]
    pub color: [f32; 3],
    /// How much leaves differ in colour (0 to 1).
    #[serde(deserialize_with = "fraction")]
    pub color_variation: f32,
}

/// Bark: its pattern and colours.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bark {
    /// Pattern.
    pub pattern: Pattern,
    /// sRGB colour of what is high.
    #[serde(deserialize_with = "colour")]
    pub color: [f32; 3],
    /// sRGB colour of what is deep.
    #[serde(deserialize_with = "colour")]
    pub deep: [f32; 3],
    /// Width of one tile of the texture, metres (0.01 to 10).
    #[serde(deserialize_with = "tile")]
    pub tile: f32,
}

/// Envelope of the crown: length of a branch by its height (Weber and Penn, ShapeRatio).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Shape {
    /// Spruces.
    Conical,
    /// Round crowns.
    Spherical,
    /// Round above, flat below.
    Hemispherical,
    /// All alike.
    Cylindrical,
    /// Nearly all alike.
    TaperedCylindrical,
    /// Longest in the middle.
    Flame,
    /// Longest at the top.
    InverseConical,
}

impl Shape {
    /// Relative length of a branch; `ratio` is 1 at the crown's foot and 0 at its top.
    pub(super) fn ratio(self, ratio: f32) -> f32 {
        match self {
            // Weber and Penn have 0.2 + 0.8 ratio: too blunt a top for a spruce.
            Self::Conical => 0.05 + 0.95 * ratio,
            Self::Spherical => 0.2 + 0.8 * sin_cos(180.0 * ratio).0,
            Self::Hemispherical => 0.2 + 0.8 * sin_cos(90.0 * ratio).0,
            Self::Cylindrical => 1.0,
            Self::TaperedCylindrical => 0.5 + 0.5 * ratio,
            Self::Flame if ratio <= 0.7 => ratio / 0.7,
            Self::Flame => (1.0 - ratio) / 0.3,
            Self::InverseConical => 1.0 - 0.8 * ratio,
        }
    }
}

/// Outline of one leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Outline {
    /// Oaks.
    Lobed,
    /// Birches.
    Ovate,
    /// Willows.
    Lance,
    /// Conifers.
    Needle,
    /// Leaflets of a feather palm.
    Blade,
}

/// Relief of a bark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Pattern {
    /// Long ridges (oak, willow).
    Furrowed,
    /// Plates (spruce).
    Scaly,
    /// White with dark marks across (birch).
    Papery,
    /// Scars of old leaves around the stem (palm).
    Ringed,
}

const BUILT_IN: [(&str, &str); 5] = [
    ("oak", include_str!("../../../assets/species/oak.ron")),
    ("spruce", include_str!("../../../assets/species/spruce.ron")),
    ("palm", include_str!("../../../assets/species/palm.ron")),
    ("willow", include_str!("../../../assets/species/willow.ron")),
    (
        "birch_winter",
        include_str!("../../../assets/species/birch_winter.ron"),
    ),
];

impl Species {
    /// Names of the species that are part of the program.
    pub fn names() -> impl Iterator<Item = &'static str> {
        BUILT_IN.iter().map(|&(name, _)| name)
    }

    /// A species that is part of the program.
    pub fn named(name: &str) -> Option<Self> {
        let &(_, text) = BUILT_IN.iter().find(|&&(n, _)| n == name)?;
        Self::from_ron(text, Path::new(name)).ok()
    }

    /// Reads a species; `file` is for messages only.
    ///
    /// # Errors
    /// Unknown keys, wrong types and numbers out of range, with line and column.
    pub fn from_ron(text: &str, file: &Path) -> Result<Self> {
        ron::from_str(text).map_err(|e| {
            Error::input(
                file,
                format!("line {}, column {}", e.span.end.line, e.span.end.col),
                e.code.to_string(),
                "see assets/species for complete examples; every key is documented in `botany::grow::Species`",
            )
        })
    }

    /// Reads a species file.
    ///
    /// # Errors
    /// As [`from_ron`](Self::from_ron), and where the file can't be opened.
    pub fn read(file: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(file).map_err(|e| Error::io(file, "open", e))?;
        Self::from_ron(&text, file)
    }
}

/// Reads a number and refuses one outside a range.
fn within<'de, D: Deserializer<'de>>(
    d: D,
    low: f32,
    high: f32,
) -> std::result::Result<f32, D::Error> {
    let x = f32::deserialize(d)?;
    check(x, low, high).map_err(D::Error::custom)
}

fn vary_within<'de, D: Deserializer<'de>>(
    d: D,
    low: f32,
    high: f32,
) -> std::result::Result<Vary, D::Error> {
    let vary = Vary::deserialize(d)?;
    check(vary.0 - vary.1.abs(), low, high)
        .and_then(|_| check(vary.0 + vary.1.abs(), low, high))
        .map_err(D::Error::custom)?;
    Ok(vary)
}

fn check(x: f32, low: f32, high: f32) -> std::result::Result<f32, String> {
    if (low..=high).contains(&x) {
        Ok(x)
    } else {
        Err(format!("{x} is out of range ({low} to {high})"))
    }
}

/// One reader a range: serde wants a function's name.
macro_rules! ranges {
    ($($name:ident: $type:ty = $read:ident($low:expr, $high:expr);)*) => {$(
        fn $name<'de, D: Deserializer<'de>>(d: D) -> std::result::Result<$type, D::Error> {
            $read(d, $low, $high)
        }
    )*};
}

ranges! {
    fraction: f32 = within(0.0, 1.0);
    ratio: f32 = within(0.001, 0.5);
    exponent: f32 = within(0.1, 5.0);
    flare: f32 = within(0.0, 5.0);
    degrees: f32 = within(-720.0, 720.0);
    count: f32 = within(0.0, 10_000.0);
    forks: f32 = within(0.0, 10.0);
    tile: f32 = within(0.01, 10.0);
    height: Vary = vary_within(0.001, 200.0);
    length: Vary = vary_within(0.001, 10.0);
    turn: Vary = vary_within(-720.0, 720.0);
    segments: u32 = whole(1, 100);
    sides: u32 = whole(3, 64);
    whorl: u32 = whole(1, 20);
    sprig: u32 = whole(1, 200);
    leaf_count: u32 = whole(1, super::MAX_LEAVES);
}

fn whole<'de, D: Deserializer<'de>>(
    d: D,
    low: u32,
    high: u32,
) -> std::result::Result<u32, D::Error> {
    let x = u32::deserialize(d)?;
    if (low..=high).contains(&x) {
        Ok(x)
    } else {
        Err(D::Error::custom(format!(
            "{x} is out of range ({low} to {high})"
        )))
    }
}

fn angle<'de, D: Deserializer<'de>>(d: D) -> std::result::Result<(f32, f32, f32), D::Error> {
    let angle = <(f32, f32, f32)>::deserialize(d)?;
    for x in [angle.0, angle.1, angle.2] {
        check(x, -180.0, 180.0).map_err(D::Error::custom)?;
    }
    Ok(angle)
}

fn colour<'de, D: Deserializer<'de>>(d: D) -> std::result::Result<[f32; 3], D::Error> {
    let color = <[f32; 3]>::deserialize(d)?;
    for x in color {
        check(x, 0.0, 1.0).map_err(D::Error::custom)?;
    }
    Ok(color)
}

fn levels<'de, D: Deserializer<'de>>(d: D) -> std::result::Result<Vec<Level>, D::Error> {
    let levels = Vec::<Level>::deserialize(d)?;
    if (1..=5).contains(&levels.len()) {
        Ok(levels)
    } else {
        Err(D::Error::custom(format!(
            "{} levels; there must be 1 to 5",
            levels.len()
        )))
    }
}
