//! Whether a level is fit to be used: what makes a bake refuse to hand it out.

use super::drawable::Drawable;
use super::judge::Judged;
use super::schema::Level;
use crate::botany::model::AlphaMode;
use crate::botany::{Model, stance};
use crate::space::raster::{Camera, Geometry, Sampling, Scene, coverage};
use crate::space::texture::{cutoff, nearest};
use crate::space::view::View;

/// Mean covered area over the original's.
const AREA: std::ops::RangeInclusive<f64> = 0.8..=1.25;
/// Share of all cards' area that may show nothing. Fitting to silhouettes empties some cards on
/// purpose (up to a seventh of a palm's); half of them is a fault.
const EMPTY_SHARE: f64 = 0.5;
/// Share of the free-standing trunk that a level must cover.
const TRUNK_SHARE: f64 = 0.5;
/// Heights of the tree at which the trunk is looked for, pixels: the level's own within these.
const TRUNK_HEIGHTS_PX: [u32; 2] = [32, 256];
/// A trunk of fewer pixels than this is hidden by its crown.
const LEAST_TRUNK_PX: f64 = 12.0;

/// Something that is wrong with a level.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// Level, view and figure.
    pub what: String,
    /// Which knob helps.
    pub help: String,
}

/// All faults of a level. `trunk` is the original cut in two: trunk, and everything else.
pub fn faults(original: &Model, level: &Judged, row: &Level, trunk: Option<&Trunk>) -> Vec<Fault> {
    let mut out = Vec::new();
    let mut say = |what: String, help: &str| {
        out.push(Fault {
            what: format!("level {} ({}): {what}", row.level, row.file),
            help: help.into(),
        });
    };
    if let Some(size) = row.sizes.first()
        && !AREA.contains(&size.area_ratio.mean)
    {
        let (mean, worst) = (size.area_ratio.mean, size.area_ratio.worst);
        say(
            format!(
                "covered area is {mean:.2} of the original's at {} px, {worst:.2} in view {:?}; the band is {} to {}",
                size.height_px,
                size.area_ratio.worst_view,
                AREA.start(),
                AREA.end(),
            ),
            "give the level more triangles, or raise the recipe's texel_density or training_views",
        );
    }
    let empty = empty_share(&level.model);
    if empty > EMPTY_SHARE {
        say(
            format!(
                "{:.0} % of the cards' area shows nothing (empty tiles)",
                empty * 100.0
            ),
            "raise the recipe's texel_density or samples",
        );
    }
    if let Some(trunk) = trunk {
        let [least, most] = TRUNK_HEIGHTS_PX;
        let height_px = level
            .heights_px
            .first()
            .map_or(most, |h| *h.clamp(&least, &most));
        let (share, view) = trunk.kept(original, &level.model, height_px);
        if share < TRUNK_SHARE {
            say(
                format!(
                    "{:.0} % of the trunk is left in view {view:?}",
                    share * 100.0
                ),
                trunk.help,
            );
        }
    }
    out
}

/// Area of the triangles whose alpha test leaves no texel, over the area of all that are tested.
fn empty_share(model: &Model) -> f64 {
    let (mut empty, mut all) = (0.0, 0.0);
    for (t, corners) in model.triangles.iter().enumerate() {
        let material = model.material_of(t as u32);
        let Some(texture) = material.base_color else {
            continue;
        };
        if material.alpha_mode != AlphaMode::Mask {
            continue;
        }
        let [a, b, c] = model.corners(t as u32).map(|p| p.as_dvec3());
        let area = (b - a).cross(c - a).length() / 2.0;
        all += area;
        let image = &model.images[texture.image as usize];
        let uvs = corners.map(|i| model.uvs[usize::from(texture.uv_set)][i as usize]);
        let edge = (0..3).map(|i| {
            (uvs[i] - uvs[(i + 1) % 3]) * glam::Vec2::new(image.width as f32, image.height as f32)
        });
        let steps = edge
            .map(|e| e.length())
            .fold(1.0f32, f32::max)
            .ceil()
            .min(512.0) as u32;
        let limit = cutoff(material);
        let shows = (0..=steps).any(|i| {
            (0..=steps - i).any(|j| {
                let (s, t) = (i as f32 / steps as f32, j as f32 / steps as f32);
                let uv = uvs[0] + (uvs[1] - uvs[0]) * s + (uvs[2] - uvs[0]) * t;
                f32::from(nearest(image, texture.wrap, uv)[3]) / 255.0 >= limit
            })
        });
        if !shows {
            empty += area;
        }
    }
    if all > 0.0 { empty / all } else { 0.0 }
}

/// The trunk of an original, and what stands before it.
pub struct Trunk {
    /// For each triangle, whether it is the trunk's.
    is_trunk: Vec<bool>,
    /// Which knob helps where it is lost.
    help: &'static str,
}

/// Triangles and their materials.
type Part = (Vec<[u32; 3]>, Vec<u32>);

fn only<'a>(whole: &Scene<'a>, (triangles, triangle_material): &'a Part) -> Scene<'a> {
    Scene {
        geometry: Geometry {
            triangles,
            triangle_material,
            ..whole.geometry
        },
        ..*whole
    }
}

impl Trunk {
    /// `None` where there is no trunk; `lies` says that it does not stand upright.
    pub fn new(original: &Model, trunk: &[u32], lies: bool) -> Option<Self> {
        let mut is_trunk = vec![false; original.triangles.len()];
        for &t in trunk {
            is_trunk[t as usize] = true;
        }
        let help = match lies {
            // Whole-tree billboards stand upright.
            true => stance::HELP,
            false => "give the level more triangles",
        };
        (!trunk.is_empty()).then_some(Self { is_trunk, help })
    }

    /// Least share of the trunk's free pixels that a level covers over two sides, and the side.
    /// A pixel beside it will do: here is asked whether there is a trunk, not how well it fits.
    fn kept(&self, original: &Model, level: &Model, height_px: u32) -> (f64, String) {
        let whole = Drawable::silhouette(original);
        let whole = whole.scene();
        let part = |wanted: bool| {
            let pairs = whole
                .geometry
                .triangles
                .iter()
                .zip(whole.geometry.triangle_material);
            let chosen = pairs.zip(&self.is_trunk).filter(|(_, t)| **t == wanted);
            chosen.map(|((t, m), _)| (*t, *m)).unzip()
        };
        let (trunk, rest): (Part, Part) = (part(true), part(false));
        let level = Drawable::silhouette(level);
        let placement = level.placement_in(original.frame);
        let mut worst = (1.0, String::new());
        for azimuth_deg in [0.0, 90.0] {
            let view = View {
                name: format!("azimuth {azimuth_deg} elevation 0"),
                azimuth_deg,
                elevation_deg: 0.0,
            };
            let camera = view.camera(original.height(), height_px);
            let width = camera.width as usize;
            let draw = |scene: &Scene, camera: &Camera| {
                coverage(scene, camera, Sampling::REFERENCE)
                    .coverage()
                    .fraction
            };
            let (trunk, rest) = (
                draw(&only(&whole, &trunk), &camera),
                draw(&only(&whole, &rest), &camera),
            );
            let level = draw(&level.scene(), &camera.placed(placement));
            let (mut free, mut kept) = (0.0, 0.0);
            for (i, (&t, &r)) in trunk.iter().zip(&rest).enumerate() {
                let visible = f64::from(t - r).max(0.0);
                let row = i / width * width;
                let near = i.saturating_sub(1).max(row)..(i + 2).min(row + width);
                free += visible;
                kept += visible * f64::from(u8::from(level[near].iter().any(|&l| l > 0.25)));
            }
            if free >= LEAST_TRUNK_PX && kept / free < worst.0 {
                worst = (kept / free, view.name);
            }
        }
        worst
    }
}
