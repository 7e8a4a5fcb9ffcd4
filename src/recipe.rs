//! Recipe: every knob of a bake with unit, range and default; presets draft, balanced, best.

use serde::{Deserialize, Serialize};

use crate::botany::load::Limits;
use crate::botany::recognise::OrganRule;
use crate::error::{Error, Result};
use crate::knobs::{Knobs, Range};

/// Where a recipe starts from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Preset {
    /// A quick look: fewer samples, views and rounds.
    Draft,
    /// Accuracy that is worth its time.
    #[default]
    Balanced,
    /// The last percent, whatever it takes.
    Best,
}

/// How foliage is grouped into billboards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Method {
    /// The optimal cut of one hierarchy of planes, and leaves reassigned after it.
    #[default]
    OptimalCut,
    /// Kratt's adaptive loop: groups are kept, merged or split by their coverage (section 3).
    AdaptiveLoop,
    /// No grouping: upright rectangles that cross on the tree's axis, two triangles each, as many
    /// as the limit pays for (at most 32). What others make; here to compare with.
    CrossedQuads,
}

/// How cards share an atlas page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Packer {
    /// In rectangles, two triangles each.
    #[default]
    Rectangles,
    /// By their trimmed outlines, with xatlas; only in builds with the feature `xatlas`.
    Outlines,
}

impl Packer {
    /// Whether this build has it.
    ///
    /// # Errors
    /// [`Error::Usage`].
    pub fn check(self) -> Result<()> {
        match self {
            Self::Outlines if cfg!(not(feature = "xatlas")) => Err(Error::usage(
                "recipe: packer is Outlines, but this build of pleach can't pack outlines",
                "build with `--features xatlas` (needs libclang; Debian: libclang-dev), \
                 or take Rectangles",
            )),
            _ => Ok(()),
        }
    }
}

/// A billboard beside the plane that the adaptive loop may choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Billboard {
    /// Two cards that cross on the group's axis.
    Cross,
    /// A connected band along the group's axis.
    Strip,
}

/// How a tree is baked. Read from RON; keys that are left out keep the preset's value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Recipe {
    /// Weight of the squared spread inside a card's plane against the squared distance to it (no
    /// unit, 0 to 1): more makes compact cards that need fewer texels and fit less well.
    pub locality: f64,
    /// Rounds in which leaves move to nearer planes after the cut, 0 to 100.
    pub reassign_rounds: u32,
    /// Texels a pixel at the distance where a level starts, 0.25 to 4.
    pub texel_density: f32,
    /// Transparent texels around each card at least, 0 to 16; up to 12 where the page has room.
    pub gutter_texels: f32,
    /// How cards share an atlas page; outlines need a build with the feature `xatlas`.
    pub packer: Packer,
    /// Sub-samples a texel along each axis, 1 to 8.
    pub samples: u32,
    /// Rounds in which texels are fitted to the original's silhouettes; 0 leaves them as projected.
    pub refine_rounds: u32,
    /// Training views of the fit and of the area match, 4 to 64.
    pub training_views: u32,
    /// F1 that a level may lose where cards share texels on a page of half the size, a quarter and so on,
    /// 0 to 0.2; default 0: every card has texels of its own.
    pub sharing: f64,
    /// Squared difference (opacity and colour) of a card that shows another's texels from what it should look like, over
    /// that of an empty card, 0 to 1; cards that are farther off get texels of their own. Default 0.9; 1: any will do
    /// that is better than none.
    pub copy_tolerance: f64,
    /// Times that each side of a level's maps of light (normals; occlusion, roughness, metalness) is half
    /// that of its colours, 0 to 4; from 1 on a map that is the same everywhere is one texel. Default: 2 where
    /// `sharing` is more than 0, else 0.
    pub light_map_halvings: Option<u32>,
    /// Whether cards whose sides differ visibly get a texture for each, at twice the triangles; not with `sharing`.
    pub second_sides: bool,
    /// What is wood and what is foliage where shape and material mislead; the first rule that
    /// matches wins. Default: none.
    pub organs: Vec<OrganRule>,
    /// Outline of a card: one triangle or a rectangle of two.
    pub triangular_cards: bool,
    /// How foliage is grouped.
    pub method: Method,
    /// What the adaptive loop tries where a plane fails. Default: crosses and strips.
    pub billboards: Vec<Billboard>,
    /// Distance from its billboard within which the adaptive loop counts a leaf, pixels where the
    /// level starts, 0.1 to 64.
    pub validity_px: f64,
    /// Share of a group's visible area that the adaptive loop may lose, 0 to 1.
    pub tolerance: f64,
    /// Whether level 0 is also written as prototypes of leaves and their places, in a file of its
    /// own.
    pub instancing: bool,
    /// Largest distance of a copy's corner from the original's, over the leaf's radius, 0 to 0.1; no
    /// less is asked than what rounding to f32 does.
    pub instance_tolerance: f64,
    /// Largest angle between a copy's normal and the original's, degrees, 0 to 180: leaves of one
    /// shape whose normals lean out of the crown need more than the default of 1.
    pub instance_normals_deg: f64,
    /// Up to so many copies are plain nodes, more are EXT_mesh_gpu_instancing, 0 to 1,000,000.
    pub instance_nodes: u32,
    /// Whether the hierarchy of sub-trees is written, too: as nodes of one file, and as 3D Tiles.
    pub hierarchy: bool,
    /// Triangles that stand for a sub-tree of that hierarchy, 8 to 4096.
    pub tile_triangles: u32,
    /// Error (root mean square) of such a stand-in where it takes over, pixels, 0.25 to 16; one of its
    /// texels is at most one pixel there.
    pub tile_error_px: f64,
    /// What a file may hold at most: triangles (50,000,000), pixels of all images (2^29), nodes
    /// (8,000,000), bytes (2^32). Changes no package.
    pub limits: Limits,
    /// Seconds that a bake may take, asked between its steps, 0 to 1,000,000; default 0: any.
    /// Changes no package.
    pub most_seconds: u32,
    /// Memory that the trees of a batch may take together, MiB, 0 to 1,048,576; 0: half of the
    /// machine's. Changes no package.
    pub memory_mib: u32,
}

impl Default for Recipe {
    fn default() -> Self {
        Self::balanced()
    }
}

impl Knobs for Recipe {
    const KIND: &'static str = "recipe";

    fn ranges(&self) -> Vec<Range> {
        vec![
            Range::of("locality", self.locality, 0.0, 1.0),
            Range::of("reassign_rounds", self.reassign_rounds, 0.0, 100.0),
            Range::of("texel_density", self.texel_density, 0.25, 4.0),
            Range::of("gutter_texels", self.gutter_texels, 0.0, 16.0),
            Range::of("sharing", self.sharing, 0.0, 0.2),
            Range::of("copy_tolerance", self.copy_tolerance, 0.0, 1.0),
            Range::of("light_map_halvings", self.own_light_halvings(), 0.0, 4.0),
            Range::of("samples", self.samples, 1.0, 8.0),
            Range::of("refine_rounds", self.refine_rounds, 0.0, 100.0),
            Range::of("validity_px", self.validity_px, 0.1, 64.0),
            Range::of("tolerance", self.tolerance, 0.0, 1.0),
            Range::of("instance_tolerance", self.instance_tolerance, 0.0, 0.1),
            Range::of(
                "instance_normals_deg",
                self.instance_normals_deg,
                0.0,
                180.0,
            ),
            Range::of("instance_nodes", self.instance_nodes, 0.0, 1_000_000.0),
            Range::of("tile_triangles", self.tile_triangles, 8.0, 4096.0),
            Range::of("tile_error_px", self.tile_error_px, 0.25, 16.0),
            Range::of("memory_mib", self.memory_mib, 0.0, 1_048_576.0),
            Range::of("most_seconds", self.most_seconds, 0.0, 1e6),
            Range::of("training_views", self.training_views, 4.0, 64.0),
        ]
    }
}

impl Recipe {
    /// The recipe of a preset.
    pub fn preset(preset: Preset) -> Self {
        match preset {
            Preset::Draft => Self::draft(),
            Preset::Balanced => Self::balanced(),
            Preset::Best => Self::best(),
        }
    }

    /// [`light_map_halvings`](Self::light_map_halvings) of cards with texels of their own.
    pub fn own_light_halvings(&self) -> u32 {
        self.light_map_halvings.unwrap_or(0)
    }

    /// [`light_map_halvings`](Self::light_map_halvings) of cards that share texels.
    pub fn shared_light_halvings(&self) -> u32 {
        self.light_map_halvings.unwrap_or(2)
    }

    /// Whether both make the same package.
    pub fn bakes_like(&self, other: &Self) -> bool {
        self.clone().as_described() == other.clone().as_described()
    }

    /// As a manifest says it: without what changes no package.
    pub fn as_described(self) -> Self {
        Self {
            limits: Limits::default(),
            most_seconds: 0,
            memory_mib: 0,
            ..self
        }
    }

    /// A quick look.
    pub fn draft() -> Self {
        Self {
            reassign_rounds: 4,
            samples: 2,
            refine_rounds: 2,
            training_views: 12,
            ..Self::balanced()
        }
    }

    /// The last percent.
    pub fn best() -> Self {
        Self {
            reassign_rounds: 30,
            samples: 6,
            refine_rounds: 12,
            training_views: 48,
            ..Self::balanced()
        }
    }

    /// The default: accuracy that is worth its time.
    pub fn balanced() -> Self {
        Self {
            locality: 0.01,
            reassign_rounds: 12,
            texel_density: 1.0,
            gutter_texels: 1.0,
            packer: Packer::Rectangles,
            samples: 3,
            refine_rounds: 3,
            training_views: 24,
            sharing: 0.0,
            copy_tolerance: 0.9,
            light_map_halvings: None,
            second_sides: true,
            organs: Vec::new(),
            triangular_cards: true,
            method: Method::OptimalCut,
            billboards: vec![Billboard::Cross, Billboard::Strip],
            validity_px: 3.0,
            tolerance: 0.2,
            instancing: false,
            instance_tolerance: 1e-5,
            instance_normals_deg: 1.0,
            instance_nodes: 500,
            hierarchy: false,
            tile_triangles: 48,
            tile_error_px: 2.0,
            limits: Limits::default(),
            most_seconds: 0,
            memory_mib: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(not(feature = "xatlas"))]
    #[test]
    fn a_packer_that_the_build_lacks_is_refused() {
        let error = Packer::Outlines.check().unwrap_err();
        assert_eq!(error.exit_code(), 2);
        assert!(error.to_string().contains("--features xatlas"), "{error}");
    }

    #[test]
    fn a_packer_that_the_build_has_is_accepted() {
        assert!(Packer::Rectangles.check().is_ok());
        assert_eq!(Packer::Outlines.check().is_ok(), cfg!(feature = "xatlas"));
    }
}
