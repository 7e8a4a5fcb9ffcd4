//! Shades what one pane shows.

use glam::Vec3;

use super::camera::Corner;
use super::front::{EMPTY, Front};
use super::pane::Pane;
use super::relief::{Bumps, Relief};
use super::shade::{Light, Surface};
use super::triangle::Triangle;
use super::{Sampling, Scene};

/// Samples along a pixel's edge that are shaded, at most.
const SHADED: usize = 4;

/// Triangles that are ready to be shaded, at most.
const KNOWN: usize = 256;

/// What is seen at a sample.
pub(super) struct Shaded {
    /// Place of the triangle in the pane's list.
    pub item: u32,
    /// Linear.
    pub light: [f32; 3],
    pub normal: Vec3,
    /// As [`super::Items::near`].
    pub near: f32,
    /// How many samples look like this.
    pub samples: u32,
}

/// A triangle that is ready to be shaded.
struct Known<'a> {
    surface: Surface<'a>,
    bumps: Option<Bumps<'a>>,
}

/// Shades what a pane shows.
pub(super) struct Shader<'a> {
    scene: &'a Scene<'a>,
    corners: &'a [Corner],
    sampling: Sampling,
    light: Light,
    reliefs: &'a [Option<Relief<'a>>],
    /// The triangles that were met last in this pane, with their places in its list.
    known: Vec<(u32, Known<'a>)>,
    /// The next of them that makes room.
    oldest: usize,
    /// For each triangle of the pane's list its place among them, if it is still there.
    places: Vec<u32>,
}

impl<'a> Shader<'a> {
    pub fn new(
        scene: &'a Scene<'a>,
        corners: &'a [Corner],
        sampling: Sampling,
        light: Light,
        reliefs: &'a [Option<Relief<'a>>],
    ) -> Self {
        Self {
            scene,
            corners,
            sampling,
            light,
            reliefs,
            known: Vec::new(),
            oldest: 0,
            places: Vec::new(),
        }
    }

    /// Calls `add` with what is seen at the samples of a pane that are shaded: of every pixel in which
    /// anything is seen there is at least one.
    pub fn shade(
        &mut self,
        front: &Front,
        pane: &Pane,
        ids: &[u32],
        mut add: impl FnMut([i32; 2], Shaded),
    ) {
        self.known.clear();
        self.places.clear();
        self.places.resize(ids.len(), EMPTY);
        let side = self.sampling.side as usize;
        // Which samples are shaded: all of 4 x 4, as many of more.
        let stride = (side / SHADED).max(1);
        let chosen = |size: usize, step: usize| (stride / 2..size).step_by(step);
        // Four neighbours are shaded as one where that leaves 2 x 2 or more of a pixel.
        let step = match side == SHADED * stride {
            true => 2 * stride,
            false => stride,
        };
        for y in chosen(pane.height(), step) {
            for x in chosen(pane.width(), step) {
                match step > stride {
                    true => self.shade_four(front, pane, ids, [x, y], stride, &mut add),
                    false => self.sample(front, pane, ids, [x, y], &mut add),
                }
            }
        }
        if stride == 1 {
            return;
        }
        // Pixels that are hit, but at none of the chosen samples: the first hit stands for all.
        let hit = |at: [usize; 2]| front.at(at).0 != EMPTY;
        for y in (0..pane.height()).step_by(side) {
            for x in (0..pane.width()).step_by(side) {
                let samples = |stride: usize| {
                    let steps = (stride / 2..side).step_by(stride);
                    let rows = steps.clone().map(move |down| y + down);
                    rows.flat_map(move |y| steps.clone().map(move |right| [x + right, y]))
                };
                if samples(stride).any(hit) {
                    continue;
                }
                if let Some(at) = samples(1).find(|&at| hit(at)) {
                    self.sample(front, pane, ids, at, &mut add);
                }
            }
        }
    }

    /// Shades four samples `stride` apart, given as column and row of the first in the pane: once in
    /// their middle where one triangle is seen at all of them.
    fn shade_four(
        &mut self,
        front: &Front,
        pane: &Pane,
        ids: &[u32],
        [x, y]: [usize; 2],
        stride: usize,
        add: &mut impl FnMut([i32; 2], Shaded),
    ) {
        let places = [
            [x, y],
            [x + stride, y],
            [x, y + stride],
            [x + stride, y + stride],
        ];
        let seen = places.map(|at| front.at(at));
        let item = seen[0].0;
        if seen.iter().any(|s| s.0 != item) {
            for at in places {
                self.sample(front, pane, ids, at, add);
            }
        } else if item != EMPTY {
            let near = seen.iter().map(|s| s.1).sum::<f32>() / 4.0;
            let half = stride as f32 / 2.0;
            self.add(ids, (item, near), pane.place([x, y]), half, 4, add);
        }
    }

    /// Shades a sample, given as column and row of the pane, if anything is seen there.
    fn sample(
        &mut self,
        front: &Front,
        pane: &Pane,
        ids: &[u32],
        at: [usize; 2],
        add: &mut impl FnMut([i32; 2], Shaded),
    ) {
        let seen = front.at(at);
        if seen.0 != EMPTY {
            self.add(ids, seen, pane.place(at), 0.0, 1, add);
        }
    }

    /// Shades a triangle of the pane's list `off` samples right of and below a sample; it stands for so
    /// many.
    #[inline]
    fn add(
        &mut self,
        ids: &[u32],
        (item, near): (u32, f32),
        place: [i32; 2],
        off: f32,
        samples: u32,
        add: &mut impl FnMut([i32; 2], Shaded),
    ) {
        let Some(known) = self.place(item, ids) else {
            return;
        };
        let (_, Known { surface, bumps }) = &self.known[known];
        let at = place.map(|p| p as f32 + off);
        let (albedo, mut normal, q) = surface.at(at);
        if let Some(bumps) = bumps {
            normal = bumps.at(at, q, normal * surface.side) * surface.side;
        }
        let lit = self.light.on(normal);
        let seen = Shaded {
            item,
            light: albedo.map(|c| c * lit),
            normal,
            near,
            samples,
        };
        add(place, seen);
    }

    /// Where a triangle of the pane's list is among those that are known.
    #[inline]
    fn place(&mut self, item: u32, ids: &[u32]) -> Option<usize> {
        let place = self.places[item as usize] as usize;
        if self
            .known
            .get(place)
            .is_some_and(|(known, _)| *known == item)
        {
            return Some(place);
        }
        let id = ids[item as usize];
        let known = Known::new(self.scene, self.corners, id, self.sampling, self.reliefs)?;
        let place = if self.known.len() < KNOWN {
            self.known.push((item, known));
            self.known.len() - 1
        } else {
            self.oldest = (self.oldest + 1) % KNOWN;
            self.known[self.oldest] = (item, known);
            self.oldest
        };
        self.places[item as usize] = place as u32;
        Some(place)
    }
}

impl<'a> Known<'a> {
    fn new(
        scene: &Scene<'a>,
        corners: &[Corner],
        id: u32,
        sampling: Sampling,
        reliefs: &'a [Option<Relief<'a>>],
    ) -> Option<Self> {
        let indices = &scene.geometry.triangles[id as usize];
        let at = indices.map(|i| corners[i as usize]);
        let material = scene.geometry.triangle_material.get(id as usize);
        let relief = reliefs.get(material.map_or(0, |&m| m as usize));
        let surface = Surface::new(scene, corners, id, sampling)?;
        let front = surface.normal().map(|normal| normal * surface.side);
        let bumps = relief.and_then(Option::as_ref).and_then(|relief| {
            let triangle = Triangle::new(at, true)?;
            Bumps::new(relief, scene, indices, at, &triangle, front)
        });
        Some(Self { surface, bumps })
    }
}
