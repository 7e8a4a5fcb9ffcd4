//! The original's silhouettes, rendered once and pooled for every level.

use std::ops::Range;

use fixedbitset::FixedBitSet;
use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::mip::halve;
use super::refine::Target;
use crate::botany::model::{Image, Model, Wrap};
use crate::space::directions::Direction;
use crate::space::raster::{
    Camera, Geometry, Mask, Material, Mips, Sampling, Scene, Texture, Tone, coverage, each_tone,
};
use crate::space::sector::{Eyes, Sector};
use crate::space::texture::cutoff;

/// One sample each: masks are fine enough.
pub const SAMPLING: Sampling = Sampling {
    side: 1,
    mips: Mips::Base,
};

/// Samples of a mask, along a line, for a pixel of the pictures that mean colours are summed from.
const SAMPLES_A_PIXEL: f32 = 8.0 / 3.0;

/// Images are halved to this side first: a mean needs no more.
const TONE_SIDE: u32 = 1024;

/// Masks of the original from the training directions.
pub struct Original {
    /// Where the tree is seen from.
    pub eyes: Eyes,
    /// The directions.
    pub directions: Vec<Direction>,
    /// Those from which colours are compared.
    toned: Vec<Direction>,
    /// One mask a direction, at `samples_per_unit`.
    masks: Vec<Bits>,
    /// Samples for a normalised unit.
    samples_per_unit: f32,
    /// Height of the tree in normalised units.
    pub height: f32,
    /// Triangles that were seen, in order, and of each the pixels and the sums of the linear RGB of its base colour; empty
    /// where that was not asked for.
    tones: Vec<(u32, [f32; 4])>,
}

/// A mask in an eighth of its size: those of all directions wait for all levels.
struct Bits {
    width: u32,
    height: u32,
    /// Rows of whole bytes, from the top; the first sample of a byte is its lowest bit.
    bits: Vec<u8>,
}

impl Bits {
    fn of(mask: &Mask) -> Self {
        let rows = mask.samples.chunks(mask.width.max(1) as usize);
        let byte = |samples: &[u8]| samples.iter().rev().fold(0, |byte, s| byte << 1 | (s & 1));
        Self {
            width: mask.width,
            height: mask.height,
            bits: rows.flat_map(|row| row.chunks(8).map(byte)).collect(),
        }
    }

    /// Samples that are hit.
    fn count(&self) -> u64 {
        self.bits.iter().map(|b| u64::from(b.count_ones())).sum()
    }

    /// The samples of a row, 0 or 1.
    fn row(&self, y: u32) -> impl Iterator<Item = u8> + '_ {
        let across = self.width.div_ceil(8) as usize;
        let bytes = &self.bits[y as usize * across..][..across];
        let samples = bytes
            .iter()
            .flat_map(|byte| (0..8).map(move |i| byte >> i & 1));
        samples.take(self.width as usize)
    }
}

/// A view of the unit sphere around the tree at `pixels` pixels a unit.
pub fn camera(direction: &Direction, pixels: f32) -> Camera {
    let side = (pixels * 2.0).ceil() as u32 + 2;
    Camera::orthographic(
        direction.forward,
        direction.up,
        Vec3::ZERO,
        pixels,
        side,
        side,
    )
}

impl Original {
    /// Renders `model`, which has these silhouettes, from `views` directions of a sector, the tree `height_samples`
    /// samples high.
    pub fn new(
        model: &Model,
        silhouettes: &Pictures,
        views: u32,
        sector: Sector,
        height_samples: f32,
    ) -> Self {
        let drawn = Drawn::new(model);
        let scene = drawn.scene(model, silhouettes);
        let height = model.height().max(1e-6);
        let samples_per_unit = height_samples / height;
        let directions = sector.training(views);
        let cameras: Vec<Camera> = directions
            .iter()
            .map(|d| camera(d, samples_per_unit))
            .collect();
        Self {
            masks: cameras
                .par_iter()
                .map(|camera| Bits::of(&coverage(&scene, camera, SAMPLING)))
                .collect(),
            eyes: sector.eyes(),
            directions,
            toned: sector.toning(),
            samples_per_unit,
            height,
            tones: Vec::new(),
        }
    }

    /// With its colours.
    pub fn with_tones(self, model: &Model, colors: &Pictures) -> Self {
        let drawn = Drawn::new(model);
        let scene = drawn.scene(model, colors);
        let cameras: Vec<Camera> = self
            .toned_from(self.samples_per_unit / SAMPLES_A_PIXEL)
            .collect();
        let mut all = vec![Tone::default(); model.triangles.len()];
        each_tone(&scene, &cameras, SAMPLING, |triangle, tone| {
            all[triangle as usize].add(tone);
        });
        let seen = (0..).zip(all).filter(|(_, tone)| tone.covered > 0.0);
        let short = |tone: Tone| {
            let [r, g, b] = tone.light;
            [r, g, b, tone.covered].map(|v| v as f32)
        };
        let mut tones: Vec<_> = seen
            .map(|(triangle, tone)| (triangle, short(tone)))
            .collect();
        tones.shrink_to_fit();
        Self { tones, ..self }
    }

    /// What is seen of some triangles in the whole tree.
    pub fn tone(&self, triangles: &FixedBitSet) -> Tone {
        let some = self
            .tones
            .iter()
            .filter(|(t, _)| triangles.contains(*t as usize));
        let long = |&(_, [r, g, b, covered]): &(u32, [f32; 4])| Tone {
            light: [r, g, b].map(f64::from),
            covered: covered.into(),
        };
        some.map(long).sum()
    }

    /// From where colours are compared, at so many pixels a unit.
    pub fn toned_from(&self, pixels: f32) -> impl Iterator<Item = Camera> + '_ {
        self.toned.iter().map(move |d| camera(d, pixels))
    }

    /// Height of the tree in samples of its masks.
    pub fn height_samples(&self) -> f32 {
        self.samples_per_unit * self.height
    }

    /// Covered area in normalised units squared, one for each direction.
    pub fn areas(&self) -> Vec<f64> {
        let unit = f64::from(self.samples_per_unit);
        self.masks
            .iter()
            .map(|m| m.count() as f64 / (unit * unit))
            .collect()
    }

    /// Targets with cells of `pool` x `pool` samples for the tree's `charts`; `wood` is what covers cells
    /// beside these.
    pub fn targets(&self, pool: u32, wood: Option<&Scene>, charts: Range<usize>) -> Vec<Target> {
        self.directions
            .par_iter()
            .zip(&self.masks)
            .map(|(direction, mask)| {
                let view = camera(direction, self.samples_per_unit);
                let size = [mask.width / pool, mask.height / pool];
                let cells = self.samples_per_unit / pool as f32;
                let taken = match wood {
                    Some(scene) => {
                        let drawn = coverage(scene, &view, SAMPLING);
                        let rows = drawn.samples.chunks(drawn.width.max(1) as usize);
                        pooled(rows.map(|row| row.iter().copied()), size, pool)
                    }
                    None => FixedBitSet::new(),
                };
                Target {
                    right: view.right * cells,
                    down: -view.up * cells,
                    base: Vec2::new(mask.width as f32, mask.height as f32) / (2.0 * pool as f32),
                    size,
                    wanted: pooled((0..mask.height).map(|y| mask.row(y)), size, pool),
                    taken,
                    charts: charts.clone(),
                }
            })
            .collect()
    }
}

/// Images of a tree as its originals are drawn with them; those of its parts are the same.
pub struct Pictures(Vec<Texture>);

impl Pictures {
    /// Where images are opaque, no more.
    pub fn silhouettes(model: &Model) -> Self {
        let texture = |image: &Image| {
            let alpha = image.rgba.chunks_exact(4).map(|t| t[3]).collect();
            Texture::from_alpha(image.width, image.height, alpha)
        };
        Self(model.images.par_iter().map(texture).collect())
    }

    /// Images as large as a mean needs them.
    pub fn colors(model: &Model) -> Self {
        let mut is_seen = vec![false; model.images.len()];
        for base in model.materials.iter().filter_map(|m| m.base_color) {
            is_seen[base.image as usize] = true;
        }
        let texture = |(image, is_seen): (&Image, bool)| {
            if !is_seen {
                return Texture::from_alpha(1, 1, vec![255]);
            }
            let mut image = image.clone();
            while image.width.max(image.height) > TONE_SIDE {
                halve(&mut image, true);
            }
            Texture::base_of_rgba(image.width, image.height, &image.rgba)
        };
        let images: Vec<(&Image, bool)> = model.images.iter().zip(is_seen).collect();
        Self(images.into_par_iter().map(texture).collect())
    }
}

/// The original for the raster.
struct Drawn {
    materials: Vec<Material>,
    triangle_material: Vec<u32>,
}

impl Drawn {
    fn new(model: &Model) -> Self {
        let of_object = |&o: &u32| model.objects[o as usize].material;
        Self {
            materials: model.materials.iter().map(raster_material).collect(),
            triangle_material: model.triangle_object.iter().map(of_object).collect(),
        }
    }

    fn scene<'a>(&'a self, model: &'a Model, Pictures(textures): &'a Pictures) -> Scene<'a> {
        Scene {
            geometry: Geometry {
                positions: &model.positions,
                normals: &[],
                uvs: [&model.uvs[0], &model.uvs[1]],
                colors: &model.colors,
                triangles: &model.triangles,
                triangle_material: &self.triangle_material,
            },
            materials: &self.materials,
            textures,
        }
    }
}

/// Cells of `pool` x `pool` samples of which at least half are covered, from rows of samples.
fn pooled<R: Iterator<Item = u8>>(
    mut rows: impl Iterator<Item = R>,
    [w, h]: [u32; 2],
    pool: u32,
) -> FixedBitSet {
    let mut out = FixedBitSet::with_capacity((w * h) as usize);
    let mut sums = vec![0u32; w as usize];
    for first in (0..h * w).step_by(w.max(1) as usize) {
        sums.fill(0);
        for mut row in rows.by_ref().take(pool as usize) {
            for sum in &mut sums {
                *sum += row.by_ref().take(pool as usize).map(u32::from).sum::<u32>();
            }
        }
        for (cell, sum) in (first as usize..).zip(&sums) {
            out.set(cell, sum * 2 >= pool * pool);
        }
    }
    out
}

/// The raster's view of a material: where it is a hole and whether its back shows.
pub fn raster_material(m: &crate::botany::model::Material) -> Material {
    let cutoff = cutoff(m);
    Material {
        texture: m.base_color.map(|t| t.image),
        uv_set: m.base_color.map_or(0, |t| t.uv_set),
        wrap: m
            .base_color
            .map_or([crate::space::raster::Wrap::Repeat; 2], |t| {
                t.wrap.map(wrap)
            }),
        linear: m.base_color.is_none_or(|t| t.linear),
        factor: m.base_color_factor,
        cutoff: (cutoff > 0.0).then_some(cutoff),
        double_sided: m.double_sided,
    }
}

fn wrap(w: Wrap) -> crate::space::raster::Wrap {
    match w {
        Wrap::Repeat => crate::space::raster::Wrap::Repeat,
        Wrap::Mirror => crate::space::raster::Wrap::Mirror,
        Wrap::Clamp => crate::space::raster::Wrap::Clamp,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_keep_their_samples_in_bits_and_cells_are_covered_by_half() {
        // 11 samples wide: rows end within a byte.
        let samples: Vec<u8> = (0..11 * 6u32).map(|i| u8::from(i * i % 7 < 3)).collect();
        let mask = Mask {
            width: 11,
            height: 6,
            side: 1,
            samples: samples.clone(),
        };
        let bits = Bits::of(&mask);
        let again: Vec<u8> = (0..6).flat_map(|y| bits.row(y)).collect();
        assert_eq!(again, samples);
        assert_eq!(bits.count() as f64, mask.area());
        for pool in [2, 3] {
            let size = [11 / pool, 6 / pool];
            let cells = pooled((0..6).map(|y| bits.row(y)), size, pool);
            for at in 0..size[0] * size[1] {
                let cell = cells[at as usize];
                let (x, y) = (at % size[0] * pool, at / size[0] * pool);
                let inside = (y..y + pool).flat_map(|y| (x..x + pool).map(move |x| y * 11 + x));
                let sum: u32 = inside.map(|i| u32::from(samples[i as usize])).sum();
                assert_eq!(cell, 2 * sum >= pool * pool, "{pool}: {at}");
            }
        }
    }
}
