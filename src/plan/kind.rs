//! One kind of tree: what the plan has to know of its file, and where its trees stand.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};

use super::places::{self, Spot};
use super::spec::{Spec, Species};
use crate::botany::load::load;
use crate::botany::model::{Material, Model};
use crate::error::{Error, Result};
use crate::export::maps::Maps;
use crate::ladder::{LEAST_TRIANGLES, Rung, Wanted, rungs};
use crate::level::LevelRequest;
use crate::recipe::Method;
use crate::report::texture_bytes;
use crate::runtime::Cells;
use crate::scene::Scene;
use crate::solid;
use crate::space::sha256::sha256;

/// A kind of tree.
#[derive(Clone, Debug)]
pub struct Kind {
    /// The file's stem.
    pub name: String,
    /// The file.
    pub input: PathBuf,
    /// Triangles of the original.
    pub triangles: u64,
    /// Bytes of the original's textures on the GPU, RGBA8 with mips.
    pub texture_bytes: u64,
    /// Bytes of the file and of those that it refers to.
    pub file_bytes: u64,
    /// What it is painted with: each material's colour and image.
    pub paints: BTreeSet<String>,
    /// What the pages of its cards have images of.
    pub maps: Maps,
    /// The atlas that the plan says it shares; empty: none.
    pub atlas: String,
    /// Height, metres.
    pub height_m: f64,
    /// Middle of the bounding sphere in the file's space, and its radius, metres.
    pub center: DVec3,
    /// Metres.
    pub radius_m: f64,
    /// Where its trees stand.
    pub spots: Vec<Spot>,
    /// How solid it is, in its normalised space.
    pub cells: Cells,
}

/// Where a level starts, and what it costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Metres at scale 1.
    pub distance_m: f64,
    /// Pixels; infinite for the original.
    pub height_px: f64,
    /// Most triangles.
    pub triangles: u64,
}

impl Step {
    /// Texels that a level's cards have for the height of the tree.
    pub fn texels_high(&self) -> f64 {
        let rung = Rung {
            triangles: self.triangles,
            height_px: self.height_px,
            end_px: self.height_px / 2.0,
        };
        LevelRequest::of(&rung, Method::default())
            .height_texels
            .into()
    }
}

impl Kind {
    /// Reads the tree and its places.
    ///
    /// # Errors
    /// [`Error::Usage`] where neither places nor a count is given, or both are; those of reading.
    pub fn read(spec: &Spec, index: usize, species: &Species, folder: &Path) -> Result<Self> {
        let input = folder.join(&species.input);
        let spots = match (&species.places, species.count) {
            (Some(file), 0) => places::read(&folder.join(file))?,
            (None, count @ 1..) => places::strewn(count, spec.region_m, index),
            (None, 0) => {
                return Err(Error::usage(
                    format!("the plan says of no {} where it stands", input.display()),
                    "give count: 100, or places: \"file.csv\"",
                ));
            }
            (Some(_), _) => {
                return Err(Error::usage(
                    format!("the plan gives {} both count and places", input.display()),
                    "leave one of them out",
                ));
            }
        };
        let model = load(&input)?;
        Ok(Self {
            name: model.name.clone(),
            triangles: model.triangles.len() as u64,
            texture_bytes: texture_bytes(&model),
            file_bytes: model.file_bytes,
            paints: paints(&model),
            maps: Maps::of(&model),
            atlas: species.atlas.clone(),
            height_m: f64::from(model.height()) * model.frame.radius,
            center: model.frame.center,
            radius_m: model.frame.radius,
            cells: solid::cells(&model, own_cells(spots.len()), None),
            spots,
            input,
        })
    }

    /// Bounding sphere of one that stands there, metres.
    pub fn sphere(&self, spot: &Spot) -> (Vec3, f32) {
        let center = spot.foot + self.center.as_vec3() * spot.scale;
        (center, self.radius_m as f32 * spot.scale)
    }

    /// Its levels, the original first, with all but that moved `nearer` times.
    ///
    /// # Errors
    /// [`Error::Usage`] where the scene lists fewer heights than levels.
    pub fn ladder(&self, spec: &Spec, nearer: f64) -> Result<Vec<Step>> {
        let wanted = Wanted::Levels(spec.levels.into());
        let rungs = rungs(&wanted, &spec.scene, self.triangles, LEAST_TRIANGLES)?;
        let mut out = vec![Step {
            distance_m: 0.0,
            height_px: f64::INFINITY,
            triangles: self.triangles,
        }];
        out.extend(rungs.iter().map(|rung| {
            // What a scene file may say at most.
            let height_px = (rung.height_px * nearer).min(16384.0);
            Step {
                distance_m: spec.scene.distance(self.height_m, height_px),
                height_px,
                triangles: rung.triangles.min(self.triangles),
            }
        }));
        Ok(out)
    }

    /// Distance at which a tree of scale 1 is no longer drawn, metres.
    pub fn end_m(&self, scene: &Scene) -> f64 {
        let vanished = scene.distance(self.height_m, scene.vanish_height_px);
        match scene.farthest_m {
            0.0 => vanished,
            far => far.min(vanished),
        }
    }
}

/// Colour and image, by its SHA-256, of each material of a model.
fn paints(model: &Model) -> BTreeSet<String> {
    let mut digests = vec![None; model.images.len()];
    let mut digest = |image: u32| {
        let pixels = &model.images[image as usize].rgba;
        digests[image as usize]
            .get_or_insert_with(|| sha256(pixels))
            .clone()
    };
    let paint = |m: &Material| {
        let image = m.base_color.map(|t| digest(t.image));
        format!("{:?} {image:?}", m.base_color_factor)
    };
    model.materials.iter().map(paint).collect()
}

/// Cells along the longest side of a tree of which so many stand in the scene.
fn own_cells(trees: usize) -> u32 {
    match trees {
        0..=20_000 => 16,
        20_001..=200_000 => 8,
        _ => 4,
    }
}
