//! Engines and viewers that packages are for, and what each does with their files.
//!
//! What is said here was tried in November 2026: see [`Client`].

use serde::{Deserialize, Serialize};

/// Who loads a package. Each was given single files, the file with `MSFT_lod` and instances by
/// EXT_mesh_gpu_instancing; those that read 3D Tiles these, too, and 3d-tiles-renderer these alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Client {
    /// Any that reads glTF: single files are what every client shows right.
    #[default]
    Any,
    /// three.js r187.
    Three,
    /// Babylon.js 9.
    Babylon,
    /// PlayCanvas 2.
    PlayCanvas,
    /// CesiumJS 1.140.
    Cesium,
    /// NASA's 3d-tiles-renderer.
    TilesRenderer,
    /// Godot 4.6 at run time.
    Godot,
    /// Bevy 0.19.
    Bevy,
    /// Filament.
    Filament,
    /// Blender 5.0.
    Blender,
}

/// Which files of a package a client takes for levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Takes {
    /// `NAME_LODn.glb`, switched by the game at the distances of their `extras`.
    SingleFiles,
    /// `NAME.glb`: it reads `MSFT_lod` itself.
    Combined,
    /// `NAME_tileset.json` (`bake --hierarchy`): it refines by itself.
    Tiles,
}

impl Client {
    /// What it takes.
    pub fn takes(self) -> Takes {
        match self {
            Self::Babylon => Takes::Combined,
            Self::Cesium | Self::TilesRenderer => Takes::Tiles,
            _ => Takes::SingleFiles,
        }
    }

    /// Whether it makes mips of the PNGs in a file that it loads; where it does not, crowns flicker from afar. Two were
    /// seen to make none; of Blender, which is no engine, and of 3d-tiles-renderer, which draws by three.js, that was not
    /// looked at.
    pub fn makes_mips(self) -> bool {
        !matches!(self, Self::Godot | Self::Bevy)
    }

    /// Whether it draws instances of EXT_mesh_gpu_instancing; the others refuse the file, or draw one.
    pub fn draws_instances(self) -> bool {
        !matches!(self, Self::Godot | Self::Bevy)
    }
}
