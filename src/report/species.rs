//! `report.json` of a species: what its pages save and cost, and each tree's figures.

use serde::{Deserialize, Serialize};

use super::schema::Report;

/// Figures of a package of several trees of one species.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SpeciesReport {
    /// The species.
    pub name: String,
    /// Bytes of all levels' pages of cards on the GPU: uncompressed RGBA with all mips.
    pub page_bytes_with: u64,
    /// Bytes where each level of each tree had a page of its own.
    pub page_bytes_without: u64,
    /// The pages, one for each size at which levels start.
    pub pages: Vec<SharedPage>,
    /// The trees.
    pub trees: Vec<SpeciesTree>,
}

/// A tree of a species.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SpeciesTree {
    /// Its name: with it its files begin.
    pub name: String,
    /// Figures of its written files.
    pub report: Report,
}

/// A page of cards of several trees' levels.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SharedPage {
    /// Its number, as in the names of its files.
    pub page: u32,
    /// Height of the trees in pixels where its levels start.
    pub height_px: f64,
    /// Whether the levels share it; otherwise each has a page of its own, because on a shared one some level loses
    /// more F1 than the recipe allows.
    pub shared: bool,
    /// Width and height, texels; zeros where it is not shared.
    pub size: [u32; 2],
    /// Texels along a line over those of pages of their own.
    pub density: f64,
    /// Cards with texels of their own.
    pub tiles: u64,
    /// Cards that show a piece of these.
    pub copies: u64,
    /// Those of them that show a piece of another tree's card.
    pub copies_of_others: u64,
    /// Bytes of its images on the GPU: uncompressed RGBA with all mips.
    pub bytes_with: u64,
    /// Bytes of the levels' own pages.
    pub bytes_without: u64,
    /// Its levels.
    pub trees: Vec<SharedTree>,
}

/// A level on a page of several trees.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SharedTree {
    /// The tree.
    pub name: String,
    /// Number of its level.
    pub level: u32,
    /// F1 where the level starts, supersampled, mean over views, as it is written.
    pub f1_with: f64,
    /// F1 on a page of its own.
    pub f1_without: f64,
}
