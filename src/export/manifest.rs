//! The manifest of a package: what was baked from what, and what an engine needs to choose levels.
//!
//! RON, one card or sub-tree a line. All positions and lengths are in the world of the glTF files
//! (metres by the glTF specification), unless a name says otherwise. [`VERSION`] grows when a
//! reader of the old form would misread the new one; keys may be added without.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::{Deserialize, Serialize};

use super::manifest_tiles::Tiles;
use crate::error::{Error, Result};
use crate::recipe::Recipe;
use crate::runtime::Measured;
use crate::scene::Scene;

/// What a manifest's name ends with.
pub const SUFFIX: &str = ".pleach.ron";
/// What [`Manifest::format`] says.
pub const FORMAT: &str = "pleach";
/// Version of this form.
pub const VERSION: u32 = 5;

/// The whole manifest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// [`FORMAT`].
    pub format: String,
    /// [`VERSION`].
    pub version: u32,
    /// What it was made from, and by what.
    pub provenance: Provenance,
    /// All files of the package, this one last.
    pub files: Vec<String>,
    /// The knobs, all of them.
    pub recipe: Recipe,
    /// The screen that distances are stated for.
    pub scene: Scene,
    /// The original.
    pub tree: Original,
    /// The levels, nearest first; level 0 is the original.
    pub levels: Vec<Level>,
    /// Texels along a sub-tree's texture, for which optimal distances are stated.
    pub subtree_texels: u32,
    /// The hierarchy of sub-trees: parents before children; 0 is the whole tree.
    pub subtrees: Vec<Subtree>,
    /// The species whose trees share pages, which name the package's folder had; empty where a tree was baked
    /// alone.
    #[serde(default)]
    pub species: String,
    /// How much of each sub-tree is seen; only with `--hierarchy`.
    #[serde(default)]
    pub visibility: Option<Visibility>,
    /// The hierarchy as it is written, by `--hierarchy`.
    #[serde(default)]
    pub tiles: Option<Tiles>,
}

/// What a package was made from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// "pleach" and its version.
    pub generator: String,
    /// Name of the input file, without its folder.
    pub input: String,
    /// Bytes of the input file.
    pub input_bytes: u64,
    /// SHA-256 of the input file (not of files that it refers to), hexadecimal.
    pub input_sha256: String,
    /// The files that it refers to, in its order.
    #[serde(default)]
    pub references: Vec<Reference>,
    /// Which levels were asked for, as on the command line.
    #[serde(default)]
    pub asked: String,
}

/// A file that the input refers to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// As the input names it, relative to its folder.
    pub uri: String,
    /// SHA-256, hexadecimal.
    pub sha256: String,
}

/// What the original is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Original {
    /// The input's stem, with which all file names start.
    pub name: String,
    /// Triangles.
    pub triangles: u64,
    /// Leaves that were recognised.
    pub leaves: u64,
    /// Extent along y.
    pub height_m: f64,
    /// Centre of the bounding sphere.
    pub center: [f64; 3],
    /// Radius of the bounding sphere.
    pub radius_m: f64,
    /// What was guessed or could not be had.
    pub warnings: Vec<String>,
}

/// One level.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// Number; 0 is the original.
    pub level: u32,
    /// The file that holds it alone; empty for a level 0 that the scene never comes near enough to show.
    pub file: String,
    /// Triangles, wood included.
    pub triangles: u64,
    /// From where, and until where, it is shown.
    pub range: Range,
    /// Root of the area-weighted mean squared distance between what is drawn and the original;
    /// in whole-tree levels, too.
    pub error_m: f64,
    /// The same in pixels where the level starts.
    pub error_px: f64,
    /// Width and height of its atlas, texels; (0, 0) without one.
    pub atlas: [u32; 2],
    /// Triangles of wood that is drawn as geometry.
    pub wood_triangles: u64,
    /// Its billboards.
    pub cards: Vec<Card>,
}

/// Where a level is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// From this distance on.
    pub distance_m: f64,
    /// Up to this distance; the last level's is infinite, or where the tree vanishes.
    pub end_m: f64,
    /// Distances between which it fades in over the nearer level. Draw both in between; before
    /// the first only the nearer one, after the second only this one. Zeros for level 0.
    pub fade_m: [f64; 2],
    /// Height of the tree over the screen's where the level starts; infinite for level 0.
    pub screen_height: f64,
    /// The same in pixels of [`Scene::screen_height_px`].
    pub height_px: f64,
    /// Share of the screen's area under which the level ends: the number of `MSFT_lod`.
    pub screen_coverage: f64,
}

/// One billboard.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Card {
    /// The smallest sub-tree that carries all that the card shows; levels may regroup leaves.
    pub subtree: u32,
    /// Corners, counter-clockwise seen from the front.
    pub corners: Vec<[f32; 3]>,
    /// Left, top, width, height in the atlas, texels. Two triangular cards may share one.
    pub atlas: [u32; 4],
    /// The same of its back, where that has texels of its own: the card is then drawn once for each side.
    pub back: Option<[u32; 4]>,
    /// Sharing reference: the card of this level that has most of the texels that this one shows; `None` where they
    /// are its own.
    pub copy_of: Option<u32>,
    /// The tree whose card that is, where it is another one of the same species; see [`Manifest::species`].
    #[serde(default)]
    pub copy_in: Option<String>,
    /// Triangles of the original that it shows.
    pub shows: u32,
    /// Root of the area-weighted mean squared distance from what it shows to the card.
    pub error_m: f64,
    /// `A`: surface area of the foliage that it shows, one side, square metres.
    pub area_m2: f64,
    /// `C`: foliage within four pixels of the card (at the distance where the level starts), minus
    /// what is farther off; square metres.
    pub coverage_m2: f64,
    /// `sigma`: how visible the place is from anywhere, 1 free, 0 hidden by leaves.
    pub sigma: f64,
    /// `sigma * C` as the paper prints it; cuts weigh `sigma * (A - C)`.
    pub quality: f64,
    /// Distance at which its texels have the size of pixels: `extent * focal_px / texels`.
    pub optimal_distance_m: f64,
}

/// One sub-tree. [`Manifest::hierarchy`] makes of all of them what cuts are made through.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Subtree {
    /// The sub-tree that carries it: an index into [`Manifest::subtrees`], smaller than its own.
    /// `None` for the whole tree alone.
    pub parent: Option<u32>,
    /// The sub-trees that it carries, ascending.
    pub children: Vec<u32>,
    /// Branch order: 0 for a trunk.
    pub order: u32,
    /// Where it is connected.
    pub connector: [f32; 3],
    /// Centre of its bounding sphere.
    pub center: [f32; 3],
    /// Radius of its bounding sphere.
    pub radius_m: f32,
    /// Leaves on it and all that it carries.
    pub leaves: u32,
    /// Distance from which it may be drawn as a whole by a texture of [`Manifest::subtree_texels`]: there
    /// one texel is one pixel. `extent * focal_px / texels`, the sphere's diameter for the extent.
    pub optimal_distance_m: f32,
    /// Distance at which its surface is one pixel off (root mean square) from the plane through it.
    pub geometric_distance_m: f32,
    /// Unit direction of the order-1 branch that carries it, from that branch's connector to its
    /// middle; zeros for the trunk and the whole tree.
    pub branch: [f32; 3],
    /// Density of that branch's siblings, 0 (alone) to 1 (what is behind them is hidden).
    pub density: f32,
    /// The first sub-tree that is like it by Deng's criterion (same order and levels, leaves and children within a
    /// tenth): an engine that makes textures of its own may draw it with that one's. Its own index where it is the
    /// first; files of the package don't rest on it.
    pub representative: u32,
    /// What grows on its own branch, leaves and wood; `None` where it carries no other branches:
    /// then that is all of it.
    pub own: Option<Own>,
}

/// Measured visibility: for each sub-tree the share of its pixels that the whole tree shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Visibility {
    /// Directions along an edge of the octahedral map over the sphere ([`Measured`]).
    pub side: u32,
    /// `side * side` bytes a sub-tree in the order of [`Manifest::subtrees`], 255 for all of it; base64.
    pub shares: String,
}

/// What grows on a sub-tree's own branch.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Own {
    /// Centre of its bounding sphere.
    pub center: [f32; 3],
    /// Radius of its bounding sphere.
    pub radius_m: f32,
    /// As [`Subtree::optimal_distance_m`]; nearer than this, geometry stands for it.
    pub optimal_distance_m: f32,
    /// As [`Subtree::geometric_distance_m`].
    pub geometric_distance_m: f32,
}

impl Manifest {
    /// The text of the file.
    ///
    /// # Errors
    /// [`Error::Internal`].
    pub fn to_ron(&self) -> Result<String> {
        let pretty = ron::ser::PrettyConfig::new()
            .depth_limit(4)
            .new_line("\n")
            .indentor("  ");
        let text = ron::ser::to_string_pretty(self, pretty).map_err(|e| Error::Internal {
            step: "write manifest",
            what: e.to_string(),
        })?;
        Ok(text + "\n")
    }
}

impl Visibility {
    /// In the form that is kept.
    pub fn of(measured: &Measured) -> Self {
        Self {
            side: measured.side(),
            shares: STANDARD.encode(measured.bytes()),
        }
    }

    /// What can be looked up, for so many sub-trees; or what is wrong with `shares`.
    pub(super) fn measured(&self, subtrees: usize) -> std::result::Result<Measured, String> {
        let bytes = STANDARD.decode(&self.shares);
        let bytes = bytes.map_err(|e| format!("it is not base64: {e}"))?;
        let (side, found) = (self.side as usize, bytes.len());
        let wrong =
            || format!("{found} bytes are not {side} x {side} for each of {subtrees} sub-trees");
        if Some(found) != side.checked_mul(side).and_then(|n| n.checked_mul(subtrees)) {
            return Err(wrong());
        }
        Measured::from_bytes(self.side, bytes).ok_or_else(wrong)
    }
}
