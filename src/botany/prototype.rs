//! Leaves as placed copies of a few prototypes, verified corner by corner.
//!
//! Recognition sorts leaves into classes that are alike within a percent or two. Here a leaf counts
//! as a copy only if one rotation, translation and scale brings *every* corner of the prototype to
//! its place, with the same triangles, texture coordinates, colours and turned normals: what is
//! drawn from copies is then what the file shows. A mirrored leaf is no copy, because engines
//! disagree on instances that are turned inside out; mirrored leaves have a prototype of their own.

use std::collections::HashMap;

use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;

use super::model::Model;
use super::tree::Tree;
use crate::space::align::{Similarity, align};

/// Prototypes that a leaf is compared with before it founds its own.
const MOST_COMPARED: usize = 24;
/// Rounding of f32 in normalised space, twice: in the file, and in the loader.
const GRAIN: f64 = 2.5e-7;
/// Texture coordinates may differ by this: a step of 16 bits.
const SAME_UV: f32 = 1.6e-5;
/// Colours may differ by this: half a step of 8 bits.
const SAME_COLOR: f32 = 2e-3;

/// A leaf that others are copies of.
#[derive(Clone, Debug)]
pub struct Prototype {
    /// Index of the leaf that it is made of.
    pub leaf: u32,
    /// The centre of that leaf's vertices, normalised space: the origin of the prototype's.
    pub origin: DVec3,
    /// Normalised units in a unit of the prototype's space.
    pub unit: f64,
    /// Its copies, itself included.
    pub copies: Vec<Placed>,
}

/// A placed copy.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// Index of the leaf that it stands for.
    pub leaf: u32,
    /// From the prototype's space into normalised space, as an engine reads it.
    pub placement: Similarity,
    /// Largest distance of a corner from where the file has it, over the leaf's radius (the root
    /// mean square distance of its vertices from their centre).
    pub deviation: f64,
}

/// How much alike copies have to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alike {
    /// Largest [`Placed::deviation`] (no unit), but no less than what rounding to f32 does.
    pub tolerance: f64,
    /// Largest angle between a turned normal and the file's, degrees. Modellers lean the normals of
    /// leaves out of the crown for soft light: then equal shapes have different normals.
    pub normals_deg: f64,
    /// Copies that a prototype has at least.
    pub copies: usize,
}

/// Finds prototypes and their copies. Largest families first.
///
/// O(n log n) for recognition's classes; here each leaf is compared with at most 24 prototypes.
pub fn prototypes(tree: &Tree, alike: &Alike) -> Vec<Prototype> {
    let mut classes: Vec<Vec<u32>> = vec![Vec::new(); tree.leaf_classes.len()];
    for (leaf, class) in tree.leaves.iter().map(|l| l.class).enumerate() {
        classes[class as usize].push(leaf as u32);
    }
    classes.retain(|class| class.len() >= alike.copies);
    let mut found: Vec<Prototype> = classes
        .into_par_iter()
        .flat_map_iter(|class| families(tree, &class, alike))
        .collect();
    found.retain(|p| p.copies.len() >= alike.copies);
    found.sort_by_key(|p| (std::cmp::Reverse(p.copies.len()), p.leaf));
    found
}

/// The prototypes of one class.
fn families(tree: &Tree, class: &[u32], alike: &Alike) -> Vec<Prototype> {
    let mut shapes: Vec<Shape> = Vec::new();
    let mut found: Vec<Prototype> = Vec::new();
    for &leaf in class {
        let Some(shape) = Shape::of(&tree.model, &tree.leaves[leaf as usize].triangles) else {
            continue;
        };
        let copy = |(index, prototype): (usize, &Shape)| {
            let (placement, deviation) = prototype.placed_as(&shape, &tree.model, alike)?;
            let placed = Placed {
                leaf,
                placement,
                deviation,
            };
            Some((index, placed))
        };
        match shapes.iter().take(MOST_COMPARED).enumerate().find_map(copy) {
            Some((index, placed)) => {
                found[index].copies.push(placed);
                // Families grow in front of those that stay alone.
                if index > 0 && found[index].copies.len() > found[index - 1].copies.len() {
                    found.swap(index, index - 1);
                    shapes.swap(index, index - 1);
                }
            }
            None => {
                found.push(shape.prototype(leaf));
                shapes.push(shape);
            }
        }
    }
    found
}

/// A leaf's corners in its own space: centre at the origin, radius one.
struct Shape {
    /// Vertices of the model, by first use.
    vertices: Vec<u32>,
    /// Triangles over them, and the material of each.
    triangles: Vec<[u32; 3]>,
    materials: Vec<u32>,
    /// Normalised space.
    points: Vec<DVec3>,
    origin: DVec3,
    radius: f64,
}

impl Shape {
    fn of(model: &Model, triangles: &[u32]) -> Option<Self> {
        let mut vertices: Vec<u32> = Vec::new();
        let mut known: HashMap<u32, u32> = HashMap::new();
        let mut local = |vertex: u32| {
            *known.entry(vertex).or_insert_with(|| {
                vertices.push(vertex);
                vertices.len() as u32 - 1
            })
        };
        let corners = triangles
            .iter()
            .map(|&t| model.triangles[t as usize].map(&mut local))
            .collect();
        let material =
            |&t: &u32| model.objects[model.triangle_object[t as usize] as usize].material;
        let materials = triangles.iter().map(material).collect();
        let points: Vec<DVec3> = vertices
            .iter()
            .map(|&v| model.positions[v as usize].as_dvec3())
            .collect();
        let count = points.len() as f64;
        let origin = points.iter().sum::<DVec3>() / count;
        let square = points.iter().map(|p| p.distance_squared(origin));
        let radius = (square.sum::<f64>() / count).sqrt();
        (radius > 0.0).then_some(Self {
            vertices,
            triangles: corners,
            materials,
            points,
            origin,
            radius,
        })
    }

    /// The corners in the prototype's space, as a file holds them.
    fn local(&self) -> Vec<DVec3> {
        let unit = |p: &DVec3| ((*p - self.origin) / self.radius).as_vec3().as_dvec3();
        self.points.iter().map(unit).collect()
    }

    fn prototype(&self, leaf: u32) -> Prototype {
        let itself = Similarity {
            scale: self.radius,
            rotation: glam::DQuat::IDENTITY,
            translation: self.origin,
        };
        let placement = itself.rounded();
        Prototype {
            leaf,
            origin: self.origin,
            unit: self.radius,
            copies: vec![Placed {
                leaf,
                placement,
                deviation: deviation(&self.local(), &self.points, &placement) / self.radius,
            }],
        }
    }

    /// How this prototype is placed to be `leaf`, and its deviation; `None` where it can't be.
    fn placed_as(&self, leaf: &Self, model: &Model, alike: &Alike) -> Option<(Similarity, f64)> {
        let tolerated = (alike.tolerance * leaf.radius).max(GRAIN);
        if self.triangles != leaf.triangles
            || self.materials != leaf.materials
            || !self.reaches_as_far(leaf, tolerated)
        {
            return None;
        }
        let local = self.local();
        let placement = align(&local, &leaf.points)?.rounded();
        let off = deviation(&local, &leaf.points, &placement);
        let same = off <= tolerated
            && self.looks_like(
                leaf,
                model,
                &placement,
                alike.normals_deg.to_radians().cos() as f32,
            );
        same.then_some((placement, off / leaf.radius))
    }

    /// Whether corners are as far from the centre, at the other's size: true of all copies, and
    /// quicker to ask than an alignment.
    fn reaches_as_far(&self, leaf: &Self, tolerated: f64) -> bool {
        let scale = leaf.radius / self.radius;
        let mut pairs = self.points.iter().zip(&leaf.points);
        pairs.all(|(p, q)| {
            let (reach, wanted) = (p.distance(self.origin) * scale, q.distance(leaf.origin));
            (reach - wanted).abs() <= 4.0 * tolerated
        })
    }

    /// Whether texture coordinates, colours and turned normals agree.
    fn looks_like(
        &self,
        leaf: &Self,
        model: &Model,
        placement: &Similarity,
        least_cosine: f32,
    ) -> bool {
        let near =
            |a: &[f32], b: &[f32], most: f32| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= most);
        let turn = placement.rotation.as_quat();
        let mut pairs = self.vertices.iter().zip(&leaf.vertices);
        pairs.all(|(&a, &b)| {
            let (a, b) = (a as usize, b as usize);
            let uv = |set: &Vec<Vec2>| match (set.get(a), set.get(b)) {
                (Some(p), Some(q)) => near(&p.to_array(), &q.to_array(), SAME_UV),
                _ => true,
            };
            let color = match (model.colors.get(a), model.colors.get(b)) {
                (Some(p), Some(q)) => near(p, q, SAME_COLOR),
                _ => true,
            };
            let turned: Vec3 = turn * model.normals[a];
            // A hair under the cosine: normals are unit vectors only up to rounding.
            let normals = turned.dot(model.normals[b]) >= least_cosine - 1e-6;
            normals && color && model.uvs.iter().all(uv)
        })
    }
}

/// Largest distance of a placed corner from its target, in the target's units.
fn deviation(local: &[DVec3], target: &[DVec3], placement: &Similarity) -> f64 {
    let pairs = local.iter().zip(target);
    pairs
        .map(|(p, q)| placement.apply(*p).distance(*q))
        .fold(0.0, f64::max)
}
