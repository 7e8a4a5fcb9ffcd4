//! Scene: how the tree is looked at, and so which levels are needed at which distances.

use serde::{Deserialize, Serialize};

use crate::client::Client;
use crate::knobs::{Knobs, Range};
use crate::space::sector::Sector;

/// Scenes to start from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum ScenePreset {
    /// A tree that the camera walks up to, on a large screen: 2160 lines, levels from 1024 pixels.
    Hero,
    /// Trees of a game: 1080 lines, levels from 512 pixels.
    #[default]
    Game,
    /// Trees in the middle distance and behind: never nearer than 40 m.
    Landscape,
    /// Seen from high above, as on a map: never nearer than 300 m, 30 degrees of view; nothing is
    /// drawn under 4 pixels.
    Map,
}

/// How texels lie on the GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum TextureFormat {
    /// Uncompressed.
    #[default]
    Rgba8,
    /// 4 x 4 texels in 16 bytes.
    Bc3,
    /// 4 x 4 texels in 16 bytes, finer than BC3.
    Bc7,
    /// 4 x 4 texels in 16 bytes.
    Astc4x4,
    /// 4 x 4 texels in 16 bytes, alpha by EAC.
    Etc2,
}

impl TextureFormat {
    /// Bytes of a texel.
    pub fn texel_bytes(self) -> f64 {
        match self {
            Self::Rgba8 => 4.0,
            Self::Bc3 | Self::Bc7 | Self::Astc4x4 | Self::Etc2 => 1.0,
        }
    }

    /// Whether mips can be shipped in it.
    pub fn can_be_shipped(self) -> bool {
        matches!(self, Self::Rgba8 | Self::Bc3 | Self::Bc7)
    }
}

/// Who makes mips.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mips {
    /// The engine, of the PNGs in the files, by a box filter.
    #[default]
    Engine,
    /// The bake: each image beside its level as a DDS file with all mips in the scene's texture format. Leaves of the
    /// original pass the alpha test as often as in the image; pages of cards have the mips that their level was
    /// matched with.
    Shipped,
}

/// The screen that distances are stated for. Read from RON; keys that are left out keep the default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Scene {
    /// Lines of the screen, 64 to 16384; default 1080.
    pub screen_height_px: u32,
    /// Width of the screen over its height, 0.25 to 8; default 16:9. Screen coverage, an area,
    /// needs it.
    pub aspect: f64,
    /// Vertical field of view, degrees, 1 to 170; default 60.
    pub fov_deg: f64,
    /// Height of the tree in pixels where the first level takes over from the original, 8 to
    /// 16384; default 512. Each further level starts at half the height, so at twice the distance.
    pub first_height_px: f64,
    /// Heights in pixels where each level starts, falling; empty: by `first_height_px`.
    pub heights_px: Vec<f64>,
    /// Height in pixels under which nothing is drawn, 0 to 64; default 0: never. The last level's area is matched
    /// to there, at most to eight times the distance where it starts.
    pub vanish_height_px: f64,
    /// Nearest that a camera comes to the middle of a tree, metres; default 0. Levels that end
    /// before are not baked.
    pub nearest_m: f64,
    /// Farthest that a tree is drawn, metres; default 0: no end. Levels that start behind are not
    /// baked, the area of others is not matched beyond.
    pub farthest_m: f64,
    /// Azimuths from which trees are seen, from and to, degrees around y, at most 360 apart: 0 looks from +z, 90
    /// from +x; default (0, 360): from all around. Levels are fitted and judged from there alone, and the sides of
    /// cards that are never seen get no texels.
    pub azimuths_deg: [f32; 2],
    /// Elevations from which trees are seen, from and to, degrees above the horizon; default (-90, 90).
    pub elevations_deg: [f32; 2],
    /// Whether light falls on trees; default true. Otherwise levels have base colours alone
    /// (KHR_materials_unlit), and no maps that only light shows are made.
    pub lit: bool,
    /// Who makes mips; default `Engine`.
    pub mips: Mips,
    /// How texels lie on the GPU; default `Rgba8`. Plans count bytes by it; reports count uncompressed ones.
    pub texture_format: TextureFormat,
    /// Who loads the package; default `Any`. Warnings say what it will not do.
    pub engine: Client,
    /// Levels fade into each other between their distance and this many times that, 1 to 2;
    /// default 1.1.
    pub fade: f64,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            screen_height_px: 1080,
            aspect: 16.0 / 9.0,
            fov_deg: 60.0,
            first_height_px: 512.0,
            heights_px: Vec::new(),
            vanish_height_px: 0.0,
            nearest_m: 0.0,
            farthest_m: 0.0,
            azimuths_deg: Sector::default().azimuths_deg,
            elevations_deg: Sector::default().elevations_deg,
            lit: true,
            mips: Mips::default(),
            texture_format: TextureFormat::default(),
            engine: Client::default(),
            fade: 1.1,
        }
    }
}

impl Knobs for Scene {
    const KIND: &'static str = "scene";

    fn ranges(&self) -> Vec<Range> {
        let mut out = vec![
            Range::of("screen_height_px", self.screen_height_px, 64.0, 16384.0),
            Range::of("aspect", self.aspect, 0.25, 8.0),
            Range::of("fov_deg", self.fov_deg, 1.0, 170.0),
            Range::of("first_height_px", self.first_height_px, 8.0, 16384.0),
            Range::of("vanish_height_px", self.vanish_height_px, 0.0, 64.0),
            Range::of("fade", self.fade, 1.0, 2.0),
            Range::of("nearest_m", self.nearest_m, 0.0, 1e9),
            Range::of(
                "farthest_m",
                self.farthest_m,
                if self.farthest_m == 0.0 {
                    0.0
                } else {
                    self.nearest_m
                },
                1e12,
            ),
        ];
        let [from, to] = self.azimuths_deg.map(f64::from);
        out.push(Range::of("azimuths_deg", from, -360.0, 360.0));
        out.push(Range::of("azimuths_deg", to, from, from + 360.0));
        let [low, high] = self.elevations_deg.map(f64::from);
        out.push(Range::of("elevations_deg", low, -90.0, 90.0));
        out.push(Range::of("elevations_deg", high, low, 90.0));
        let mut nearer = 16384.0;
        for &height in &self.heights_px {
            out.push(Range::of("heights_px", height, 4.0, nearer));
            nearer = height / 1.01;
        }
        out
    }
}

impl Scene {
    /// The directions from which trees are seen.
    pub fn sector(&self) -> Sector {
        Sector {
            azimuths_deg: self.azimuths_deg,
            elevations_deg: self.elevations_deg,
        }
    }

    /// The scene of a preset.
    pub fn preset(preset: ScenePreset) -> Self {
        let game = Self::default();
        match preset {
            ScenePreset::Game => game,
            ScenePreset::Hero => Self {
                screen_height_px: 2160,
                first_height_px: 1024.0,
                ..game
            },
            ScenePreset::Landscape => Self {
                nearest_m: 40.0,
                ..game
            },
            ScenePreset::Map => Self {
                nearest_m: 300.0,
                fov_deg: 30.0,
                vanish_height_px: 4.0,
                ..game
            },
        }
    }

    /// Whether anything of what is shown from `distance_m` to `end_m` is ever seen, metres.
    pub fn shows(&self, distance_m: f64, end_m: f64) -> bool {
        end_m > self.nearest_m && (self.farthest_m == 0.0 || distance_m < self.farthest_m)
    }

    /// Distance at which something `height` units high is `height_px` pixels high, in its unit:
    /// `d = H / (2 s tan(fov / 2))` with the share `s` of the screen's height.
    pub fn distance(&self, height: f64, height_px: f64) -> f64 {
        let share = height_px / f64::from(self.screen_height_px);
        height / (2.0 * share * (self.fov_deg / 2.0).to_radians().tan())
    }

    /// Focal length in pixels: a unit at distance `d` is `focal_px / d` pixels high.
    pub fn focal_px(&self) -> f64 {
        f64::from(self.screen_height_px) / (2.0 * (self.fov_deg / 2.0).to_radians().tan())
    }

    /// Share of the screen's area that a tree takes which is `height_px` pixels high and
    /// `width_to_height` times as wide, at most 1.
    pub fn screen_coverage(&self, height_px: f64, width_to_height: f64) -> f64 {
        let share = height_px / f64::from(self.screen_height_px);
        (share * share * width_to_height / self.aspect).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_worked_by_hand() {
        // 90 degrees: at distance d the screen shows 2 d; half of it is d.
        let scene = Scene {
            fov_deg: 90.0,
            screen_height_px: 1000,
            ..Scene::default()
        };
        assert!((scene.distance(10.0, 500.0) - 10.0).abs() < 1e-12);
        assert!((scene.distance(10.0, 250.0) - 20.0).abs() < 1e-12);
        assert!((scene.focal_px() - 500.0).abs() < 1e-9);
        // Half as high as the screen and as wide as high on a 2:1 screen: an eighth.
        let scene = Scene {
            aspect: 2.0,
            ..scene
        };
        assert!((scene.screen_coverage(500.0, 1.0) - 0.125).abs() < 1e-12);
        assert_eq!(scene.screen_coverage(5000.0, 1.0), 1.0);
    }

    #[test]
    fn heights_must_fall() {
        let scene = |heights_px| Scene {
            heights_px,
            ..Scene::default()
        };
        assert!(crate::knobs::check(&scene(vec![512.0, 256.0])).is_ok());
        assert!(crate::knobs::check(&scene(vec![256.0, 256.0])).is_err());
    }
}
