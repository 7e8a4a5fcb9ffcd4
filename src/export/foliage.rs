//! Bakes the cards of a level: charts, atlas, projected maps, and the mesh that shows them.

use std::ops::Range;
use std::sync::Arc;

use fixedbitset::FixedBitSet;
use glam::Vec2;
use rayon::prelude::*;

use super::atlas::{Layout, lay_out};
use super::chart::{Chart, Shape};
use super::maps::Maps;
use super::project::project;
use super::surface::Surface;
use super::texel::{Stored, Texels};
use crate::botany::model::{Image, Model};
use crate::cloud::card::Card;

/// A card and the triangles of the model that it shows.
#[derive(Clone, Debug, Default)]
pub struct CardGroup {
    /// The billboard.
    pub card: Card,
    /// What is projected on it.
    pub triangles: Vec<u32>,
}

/// How cards are baked.
#[derive(Clone, Copy, Debug)]
pub struct BakeOptions {
    /// Where cards lie on the page.
    pub layout: Layout,
    /// Sub-samples a texel along each axis.
    pub samples: u32,
}

/// Baked cards: one atlas page and where each card lies on it.
#[derive(Clone, Debug, Default)]
pub struct Foliage {
    /// One chart for each card.
    pub charts: Vec<Chart>,
    /// Charts of the backs of cards whose sides differ, and the fronts' indices, until
    /// [`Foliage::add_backs`].
    pub backs: Vec<(u32, Chart)>,
    /// Size of the page in texels.
    pub size: [u32; 2],
    /// The page, row by row; colours and normals are already bled into empty texels.
    pub texels: Texels,
    /// Whether the texel belongs to a chart.
    pub owned: FixedBitSet,
    /// What its images are of.
    pub maps: Maps,
    /// Whether cards are seen from their front alone.
    pub one_sided: bool,
    /// Final alpha of each texel; set from coverage by [`Foliage::threshold`] or by matching.
    pub alpha: Vec<u8>,
}

/// Cards that are projected at a time.
const BATCH: usize = 256;

impl Foliage {
    /// Lays out and projects all cards, those of `sided` from both sides.
    pub fn bake(model: &Model, groups: &[CardGroup], sided: &[u32], options: BakeOptions) -> Self {
        let cards: Vec<&Card> = groups.iter().map(|g| &g.card).collect();
        let (mut charts, size) = lay_out(&cards, sided, options.layout);
        let backs = charts.split_off(groups.len());
        let mut foliage = Self::of(charts, size, Maps::of(model));
        foliage.project(0, model, groups, options.samples);
        foliage.project_backs(model, groups, options.samples, sided, backs);
        foliage.threshold(0.5, 0);
        foliage
    }

    /// An empty page for `charts`.
    pub(super) fn of(charts: Vec<Chart>, size: [u32; 2], maps: Maps) -> Self {
        let count = (size[0] * size[1]) as usize;
        Self {
            owned: FixedBitSet::with_capacity(count),
            alpha: vec![0; count],
            charts,
            backs: Vec::new(),
            maps,
            one_sided: false,
            size,
            texels: Texels::empty(count, maps),
        }
    }

    /// Draws each card that has texels of its own; `groups` are the cards of the charts from `start` on.
    pub(super) fn project(
        &mut self,
        start: usize,
        model: &Model,
        groups: &[CardGroup],
        samples: u32,
    ) {
        let [width, _] = self.size;
        // Some cards at a time: projections are several times as large as what is kept of them.
        for (groups, charts) in groups.chunks(BATCH).zip(self.charts[start..].chunks(BATCH)) {
            let own = groups.par_iter().zip(charts);
            let projected: Vec<_> = own
                .filter(|(_, chart)| chart.shape != Shape::Window)
                .map(|(g, chart)| {
                    let drawn = project(model, g.triangles.iter().copied(), chart, samples);
                    let texels = drawn.texels.into_iter().map(Stored::from);
                    (chart, texels.collect::<Vec<Stored>>())
                })
                .collect();
            for (chart, texels) in projected {
                for (local, at) in placed_texels(chart, width) {
                    self.texels.set(at, texels[local]);
                    self.owned.insert(at);
                }
            }
        }
    }

    /// Draws the backs. Their texels are nobody's until alpha is final: what is fitted and matched is the fronts.
    fn project_backs(
        &mut self,
        model: &Model,
        groups: &[CardGroup],
        samples: u32,
        sided: &[u32],
        backs: Vec<Chart>,
    ) {
        let drawn: Vec<_> = sided
            .par_iter()
            .zip(&backs)
            .map(|(&card, back)| {
                let triangles = groups[card as usize].triangles.iter().copied();
                project(model, triangles, back, samples)
            })
            .collect();
        for (back, projection) in backs.iter().zip(drawn) {
            for (local, at) in placed_texels(back, self.size[0]) {
                self.texels.set(at, projection.texels[local].into());
            }
        }
        self.backs = sided.iter().copied().zip(backs).collect();
    }

    /// Charts and alpha alone, to try what becomes of them.
    pub fn without_texels(&self) -> Self {
        Self {
            charts: self.charts.clone(),
            backs: self.backs.clone(),
            size: self.size,
            texels: Texels::default(),
            owned: self.owned.clone(),
            maps: self.maps,
            one_sided: self.one_sided,
            alpha: self.alpha.clone(),
        }
    }

    /// Draws the backs of cards that have one: they take over the fronts' alpha, and both sides move apart by
    /// `gap` (normalised units), so that each hides the other.
    pub fn add_backs(&mut self, gap: f32) {
        let width = self.size[0];
        for (front, mut back) in std::mem::take(&mut self.backs) {
            let front = &mut self.charts[front as usize];
            for (local, at) in placed_texels(&back, width) {
                let texel = Vec2::new(
                    (local as u32 % back.size[0]) as f32 + 0.5,
                    (local as u32 / back.size[0]) as f32 + 0.5,
                );
                let there = front.texel(back.point(texel)).max(Vec2::ZERO);
                let [x, y] = [there.x, there.y].map(|t| t as u32);
                let seen = x < front.size[0] && y < front.size[1] && front.owns(x, y);
                self.alpha[at] = match seen {
                    true => {
                        let [x, y] = front.in_atlas(x, y);
                        self.alpha[(y * width + x) as usize]
                    }
                    false => 0,
                };
                self.owned.insert(at);
            }
            front.lift(0.5 * gap);
            back.lift(0.5 * gap);
            self.charts.push(back);
        }
    }

    /// Alpha 255 where the coverage reaches `t`, else `floor`.
    pub fn threshold(&mut self, t: f32, floor: u8) {
        let alpha = |coverage: f32| if coverage >= t { 255 } else { floor };
        self.alpha = self.texels.coverages().map(alpha).collect();
    }

    /// Bleeds colours into empty texels; call once, after the last use of `coverage` as it is.
    pub fn bleed(&mut self) {
        self.texels.bleed(self.size);
    }

    /// Some of the cards as a mesh with normals, tangents and atlas coordinates.
    pub fn surface(&self, charts: Range<usize>) -> Surface {
        let mut out = Surface {
            name: "foliage".into(),
            ..Surface::default()
        };
        let scale = Vec2::new(1.0 / self.size[0] as f32, 1.0 / self.size[1] as f32);
        for chart in &self.charts[charts] {
            let base = out.positions.len() as u32;
            for &corner in &chart.corners {
                out.positions.push(corner);
                out.normals.push(chart.normal);
                let t = chart.tangent;
                out.tangents.push([t.x, t.y, t.z, 1.0]);
                out.uvs[0].push(chart.atlas_point(corner) * scale);
            }
            for i in 2..chart.corners.len() as u32 {
                out.triangles.push([base, base + i - 1, base + i]);
            }
        }
        out
    }

    /// The images that [`Maps`] names. They are what the texels were: these are no more.
    pub fn take_images(&mut self) -> Vec<Image> {
        (0..self.maps.count()).map(|n| self.take(n)).collect()
    }

    /// The first one of [`take_images`](Self::take_images): base colour with alpha.
    pub fn take_page(&mut self) -> Image {
        self.take(0)
    }

    /// The others.
    pub fn take_light(&mut self) -> impl Iterator<Item = Image> {
        (1..self.maps.count()).map(|n| self.take(n))
    }

    fn take(&mut self, number: usize) -> Image {
        let rgba = match number {
            0 => self.texels.take_colors(&std::mem::take(&mut self.alpha)),
            1 => self.texels.take_normals(),
            _ => self.texels.take_orms(),
        };
        Image {
            name: self.maps.names()[number].into(),
            width: self.size[0],
            height: self.size[1],
            rgba: Arc::new(rgba),
        }
    }
}

/// The texels of a chart: their indices in the chart and on a page of the given width.
fn placed_texels(chart: &Chart, width: u32) -> impl Iterator<Item = (usize, usize)> + '_ {
    let all = (0..chart.size[1]).flat_map(|y| (0..chart.size[0]).map(move |x| (x, y)));
    all.filter(|&(x, y)| chart.owns(x, y)).map(move |(x, y)| {
        let [ax, ay] = chart.in_atlas(x, y);
        ((y * chart.size[0] + x) as usize, (ay * width + ax) as usize)
    })
}
