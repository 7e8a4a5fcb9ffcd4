//! Trees in a stand: cuts through them along a camera's path, what the cuts cost, and their pictures.

use std::time::Instant;

use glam::{Vec2, Vec3};

use super::species::Species;
use crate::runtime::{Changes, Drawn, Forest, Form, Place, View, Visibility};
use crate::space::raster::{
    Camera, Coverage, EMPTY, Geometry, Mask, Material, Mips, Sampling, Scene, Texture, draw,
};

/// A batch of so many triangles is drawn at once.
const BATCH: usize = 200_000;

/// Two by two samples of the base level: areas are right at any distance.
const SAMPLING: Sampling = Sampling {
    side: 2,
    mips: Mips::Base,
};

/// Trees of a few species where they stand.
pub struct Stand<'s> {
    /// The species.
    pub species: &'s [Species],
    /// The trees; a scale is the radius of the bounding sphere in metres.
    pub places: Vec<Place>,
    materials: Vec<Material>,
    textures: Vec<Texture>,
    /// For each species the first material of its model, and of the billboards of each node.
    model_material: Vec<u32>,
    node_material: Vec<Vec<u32>>,
}

/// What a cut costs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cost {
    /// Billboards (a node may have several).
    pub billboards: f64,
    /// Their texels.
    pub texels: f64,
    /// Triangles: two a billboard, and those of the geometry.
    pub triangles: f64,
}

/// What following a path took, means over frames.
#[derive(Clone, Debug, Default)]
pub struct Walk {
    /// What was drawn.
    pub cost: Cost,
    /// Nodes opened and closed.
    pub changes: [f64; 2],
    /// Microseconds for following and listing.
    pub micros: f64,
    /// What was drawn in the frames that are looked at.
    pub shown: Vec<Vec<Drawn>>,
}

impl<'s> Stand<'s> {
    /// Gets trees ready to be drawn.
    pub fn new(species: &'s [Species], places: Vec<Place>) -> Self {
        let mut out = Self {
            species,
            places,
            materials: Vec::new(),
            textures: Vec::new(),
            model_material: Vec::new(),
            node_material: Vec::new(),
        };
        for species in species {
            out.model_material.push(out.materials.len() as u32);
            let first = out.textures.len() as u32;
            out.textures.extend(species.textures.iter().cloned());
            let moved = |m: &Material| Material {
                texture: m.texture.map(|t| t + first),
                uv_set: 0,
                ..*m
            };
            out.materials.extend(species.materials.iter().map(moved));
            let mut of_node = Vec::new();
            for looks in &species.looks {
                of_node.push(out.materials.len() as u32);
                for billboard in &looks.billboards {
                    out.materials.push(Material {
                        texture: Some(out.textures.len() as u32),
                        wrap: [crate::space::raster::Wrap::Clamp; 2],
                        cutoff: Some(0.5),
                        double_sided: true,
                        ..Material::default()
                    });
                    out.textures.push(billboard.texture.clone());
                }
            }
            out.node_material.push(of_node);
        }
        out
    }

    /// Follows a path; keeps what is drawn in the frames of `shown`.
    pub fn walk<V: Visibility>(&self, visibility: V, path: &[View], shown: &[usize]) -> Walk {
        let hierarchies = self.species.iter().map(|s| s.hierarchy.clone()).collect();
        let mut forest = Forest::new(hierarchies, &self.places, visibility);
        forest.fade = 0.0;
        let (mut out, mut drawn) = (Walk::default(), Vec::new());
        // The first frame makes all cuts: it is not counted.
        forest.update(&path[0]);
        for (frame, view) in path.iter().enumerate() {
            drawn.clear();
            let start = Instant::now();
            let Changes { splits, merges, .. } = forest.update(view);
            forest.collect(view, &mut drawn);
            out.micros += start.elapsed().as_secs_f64() * 1e6;
            out.changes[0] += f64::from(splits);
            out.changes[1] += f64::from(merges);
            let cost = self.cost(&drawn);
            out.cost.billboards += cost.billboards;
            out.cost.texels += cost.texels;
            out.cost.triangles += cost.triangles;
            if shown.contains(&frame) {
                out.shown.push(drawn.clone());
            }
        }
        let n = path.len() as f64;
        out.micros /= n;
        out.changes = out.changes.map(|c| c / n);
        for sum in [
            &mut out.cost.billboards,
            &mut out.cost.texels,
            &mut out.cost.triangles,
        ] {
            *sum /= n;
        }
        out
    }

    /// What a list costs.
    pub fn cost(&self, drawn: &[Drawn]) -> Cost {
        let mut out = Cost::default();
        for d in drawn {
            let looks = &self.species_of(d.tree).looks[d.node as usize];
            match d.form {
                Form::Billboard => {
                    out.billboards += looks.billboards.len() as f64;
                    out.triangles += 2.0 * looks.billboards.len() as f64;
                    out.texels += looks
                        .billboards
                        .iter()
                        .map(|b| b.texels as f64)
                        .sum::<f64>();
                }
                Form::Geometry => out.triangles += looks.triangles.len() as f64,
            }
        }
        out
    }

    fn species_of(&self, tree: u32) -> &'s Species {
        &self.species[self.places[tree as usize].species as usize]
    }

    /// All trees in the picture, leaf by leaf: what cuts are compared with.
    pub fn everything(&self, view: &View) -> Vec<Drawn> {
        let mut out = Vec::new();
        for (tree, place) in self.places.iter().enumerate() {
            let hierarchy = &self.species[place.species as usize].hierarchy;
            let (center, radius) = hierarchy.sphere();
            if view.meets(place.to_world(center), radius * place.scale) {
                let tips = (0..hierarchy.nodes().len() as u32).filter(|&n| hierarchy.is_tip(n));
                out.extend(tips.map(|node| Drawn {
                    tree: tree as u32,
                    node,
                    form: Form::Geometry,
                    fade: 1.0,
                }));
            }
        }
        out
    }

    /// Draws a list, nearest trees first; trees that are hidden completely are left out, which
    /// changes nothing.
    pub fn draw(&self, drawn: &[Drawn], view: &View, height_px: u32) -> Frame {
        let width_px = (height_px as f32 * view.half.x / view.half.y).round() as u32;
        let fov = 2.0 * view.half.y.atan();
        let camera = Camera::perspective(
            view.eye,
            view.eye + view.forward,
            Vec3::Y,
            fov,
            width_px,
            height_px,
        );
        let mut frame = Frame::new(width_px, height_px);
        let mut trees: Vec<&[Drawn]> = drawn.chunk_by(|a, b| a.tree == b.tree).collect();
        let distance = |d: &&[Drawn]| {
            self.places[d[0].tree as usize]
                .position
                .distance_squared(view.eye)
        };
        trees.sort_by(|a, b| {
            distance(a)
                .total_cmp(&distance(b))
                .then(a[0].tree.cmp(&b[0].tree))
        });
        let mut batch = Batch::default();
        for tree in trees {
            let place = &self.places[tree[0].tree as usize];
            let (center, radius) = self.species_of(tree[0].tree).hierarchy.sphere();
            if frame.hides(&camera, place.to_world(center), radius * place.scale) {
                continue;
            }
            for d in tree {
                self.add(d, &mut batch);
            }
            if batch.keys.len() >= BATCH {
                frame.flush(&mut batch, &camera, &self.materials, &self.textures);
            }
        }
        frame.flush(&mut batch, &camera, &self.materials, &self.textures);
        frame
    }

    fn add(&self, d: &Drawn, batch: &mut Batch) {
        let place = &self.places[d.tree as usize];
        let species = self.species_of(d.tree);
        let looks = &species.looks[d.node as usize];
        let key = |index: usize| Key::of(d, index);
        if d.form == Form::Billboard {
            let first = self.node_material[place.species as usize][d.node as usize];
            for (i, billboard) in looks.billboards.iter().enumerate() {
                let corners = billboard.corners.map(|p| place.to_world(p));
                for (half, pick) in [[0, 1, 2], [0, 2, 3]].into_iter().enumerate() {
                    let material = first + i as u32;
                    batch.push(
                        pick.map(|k| corners[k]),
                        pick.map(|k| billboard.uvs[k]),
                        material,
                        key(2 * i + half),
                    );
                }
            }
            return;
        }
        let (model, first) = (
            &species.tree.model,
            self.model_material[place.species as usize],
        );
        for (i, &t) in looks.triangles.iter().enumerate() {
            let own = species
                .triangle_material
                .get(t as usize)
                .copied()
                .unwrap_or(0);
            let set = &model.uvs[species.materials[own as usize].uv_set.min(1) as usize];
            let uvs = model.triangles[t as usize]
                .map(|v| set.get(v as usize).copied().unwrap_or_default());
            batch.push(
                model.corners(t).map(|p| place.to_world(p)),
                uvs,
                first + own,
                key(i),
            );
        }
    }
}

/// What a sample shows: tree, node, form and triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Key(u64);

impl Key {
    const NONE: Self = Self(u64::MAX);

    fn of(d: &Drawn, index: usize) -> Self {
        let form = u64::from(d.form == Form::Geometry);
        Self(
            u64::from(d.tree) << 42
                | u64::from(d.node) << 23
                | form << 22
                | (index as u64 & 0x3f_ffff),
        )
    }

    /// The drawn thing that the triangle belongs to.
    pub fn drawn(self) -> u64 {
        self.0 >> 22
    }

    /// Index of the tree.
    pub fn tree(self) -> u64 {
        self.0 >> 42
    }

    /// As [`Key::drawn`] of every triangle of a drawn thing.
    pub fn drawn_of(d: &Drawn) -> u64 {
        Self::of(d, 0).drawn()
    }
}

#[derive(Default)]
struct Batch {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    triangles: Vec<[u32; 3]>,
    material: Vec<u32>,
    keys: Vec<Key>,
}

impl Batch {
    fn push(&mut self, corners: [Vec3; 3], uvs: [Vec2; 3], material: u32, key: Key) {
        let at = self.positions.len() as u32;
        self.positions.extend(corners);
        self.uvs.extend(uvs);
        self.triangles.push([at, at + 1, at + 2]);
        self.material.push(material);
        self.keys.push(key);
    }
}

/// A picture: what every sample shows.
pub struct Frame {
    width: u32,
    height: u32,
    near: Vec<f32>,
    /// What is seen; rows from the top.
    pub keys: Vec<Key>,
}

impl Frame {
    fn new(width: u32, height: u32) -> Self {
        let samples = (width * height * SAMPLING.side * SAMPLING.side) as usize;
        Self {
            width,
            height,
            near: vec![f32::NEG_INFINITY; samples],
            keys: vec![Key::NONE; samples],
        }
    }

    fn flush(
        &mut self,
        batch: &mut Batch,
        camera: &Camera,
        materials: &[Material],
        textures: &[Texture],
    ) {
        if batch.keys.is_empty() {
            return;
        }
        let scene = Scene {
            geometry: Geometry {
                positions: &batch.positions,
                normals: &[],
                uvs: [&batch.uvs, &[]],
                colors: &[],
                triangles: &batch.triangles,
                triangle_material: &batch.material,
            },
            materials,
            textures,
        };
        let items = draw(&scene, camera, SAMPLING);
        for (i, (&t, &near)) in items.triangle.iter().zip(&items.near).enumerate() {
            if t != EMPTY && near > self.near[i] {
                (self.near[i], self.keys[i]) = (near, batch.keys[t as usize]);
            }
        }
        *batch = Batch::default();
    }

    /// Whether every sample that a sphere could show shows something nearer.
    fn hides(&self, camera: &Camera, center: Vec3, radius: f32) -> bool {
        let at = center - camera.origin;
        let depth = at.dot(camera.forward) - radius;
        if depth < 0.1 {
            return false;
        }
        let scale = camera.pixels / depth;
        let side = SAMPLING.side as f32;
        let middle = Vec2::new(self.width as f32, self.height as f32) * 0.5;
        let x = (at.dot(camera.right), -at.dot(camera.up));
        // The nearest depth gives the widest projection on either side.
        let reach = |c: f32| {
            [
                (c - radius) * scale,
                (c + radius) * scale,
                (c - radius) * camera.pixels / (depth + 2.0 * radius),
                (c + radius) * camera.pixels / (depth + 2.0 * radius),
            ]
        };
        let range = |c: f32, middle: f32, most: u32| {
            let ends = reach(c);
            let low = ends.iter().fold(f32::MAX, |a, &b| a.min(b)) + middle;
            let high = ends.iter().fold(f32::MIN, |a, &b| a.max(b)) + middle;
            let most = most * SAMPLING.side;
            ((low * side).floor().max(0.0) as u32).min(most)
                ..((high * side).ceil().max(0.0) as u32).min(most)
        };
        let (columns, rows) = (
            range(x.0, middle.x, self.width),
            range(x.1, middle.y, self.height),
        );
        let row = (self.width * SAMPLING.side) as usize;
        rows.into_iter().all(|y| {
            let line = &self.near[y as usize * row..(y as usize + 1) * row];
            line[columns.start as usize..columns.end as usize]
                .iter()
                .all(|&near| near >= 1.0 / depth)
        })
    }

    /// Share of each pixel that is covered.
    pub fn coverage(&self) -> Coverage {
        let mask = Mask {
            width: self.width,
            height: self.height,
            side: SAMPLING.side,
            samples: self
                .keys
                .iter()
                .map(|&k| u8::from(k != Key::NONE))
                .collect(),
        };
        mask.coverage()
    }

    /// Of the samples that show anything here, the share for which `same` holds of both.
    pub fn agrees(&self, other: &Self, same: impl Fn(Key, Key) -> bool) -> f64 {
        let covered = self
            .keys
            .iter()
            .zip(&other.keys)
            .filter(|(a, _)| **a != Key::NONE);
        let (mut all, mut good) = (0u64, 0u64);
        for (&a, &b) in covered {
            all += 1;
            good += u64::from(b != Key::NONE && same(a, b));
        }
        good as f64 / all.max(1) as f64
    }

    /// All triangles that are seen, each once.
    pub fn visible(&self) -> Vec<Key> {
        let mut out: Vec<Key> = self
            .keys
            .iter()
            .copied()
            .filter(|&k| k != Key::NONE)
            .collect();
        out.sort_unstable();
        out.dedup();
        out
    }

    /// RGBA: every tree in its own green, white where nothing is.
    pub fn picture(&self) -> (u32, u32, Vec<u8>) {
        let (width, height) = (self.width * SAMPLING.side, self.height * SAMPLING.side);
        let color = |&key: &Key| {
            if key == Key::NONE {
                return [255; 4];
            }
            let mixed = key.drawn().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
            let tree = key.tree().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
            let part = |n: u64, from: u64, span: u64| (from + n % span) as u8;
            [
                part(tree, 20, 90),
                part(tree >> 8, 70, 100).saturating_add(part(mixed, 0, 50)),
                part(tree >> 16, 10, 60),
                255,
            ]
        };
        (width, height, self.keys.iter().flat_map(color).collect())
    }
}
