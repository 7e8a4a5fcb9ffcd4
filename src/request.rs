//! What to bake.

use std::path::PathBuf;

use crate::ladder::Wanted;
use crate::recipe::Recipe;
use crate::scene::Scene;

/// What to bake.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// The tree.
    pub input: PathBuf,
    /// The package's folder.
    pub output: PathBuf,
    /// Which levels.
    pub wanted: Wanted,
    /// Levels take no more triangles than this error needs, in pixels where they start. Beside a
    /// limit of triangles, both hold.
    pub max_error_px: Option<f64>,
    /// Knobs.
    pub recipe: Recipe,
    /// The screen that levels are for.
    pub scene: Scene,
    /// Whether to keep what a page on the bake shows: [`Baked::recognised`](crate::pipeline::Baked::recognised).
    pub page: bool,
    /// Whether to write into a folder that holds other files.
    pub force: bool,
    /// Whether to keep levels that left their band.
    pub accept: bool,
}
