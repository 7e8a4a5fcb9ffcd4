//! Trees in a stand: cuts through them along a camera's path, what the cuts cost, and their pictures.

use std::time::Instant;

use glam::Vec3;

use super::frame::{Batch, Frame, Key};
use super::species::Species;
use crate::runtime::{Changes, Drawn, Forest, Form, Place, View, Visibility};
use crate::space::raster::{Camera, Material, Texture};

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
            if batch.is_full() {
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
