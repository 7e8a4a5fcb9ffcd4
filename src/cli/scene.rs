//! `--scene`: a preset's name or a file.

use std::path::Path;

use clap::ValueEnum;

use crate::error::Result;
use crate::knobs::read;
use crate::scene::{Scene, ScenePreset};

/// The scene that an argument names; the default where there is none.
pub fn scene(asked: Option<&Path>) -> Result<Scene> {
    let Some(file) = asked else {
        return Ok(Scene::default());
    };
    match file.to_str().map(|name| ScenePreset::from_str(name, false)) {
        Some(Ok(preset)) => Ok(Scene::preset(preset)),
        _ => read(file, &Scene::default()),
    }
}
