//! Leaves out of foliage parts, and which leaves are congruent.
//!
//! A leaf is one part of foliage, or several whose centres coincide (crossed quads). Congruent
//! leaves are found by a signature that no rotation, translation or uniform scale changes, in
//! O(n log n), and verified by the distances between their points.

use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::model::Model;
use super::part::{DisjointSets, Groups, Mix, Parts};
use super::tree::{Leaf, LeafClass, NO_NODE, Organ, TriangleList};

/// Centres closer than this share of the mean radius belong to one leaf.
const SAME_CENTER: f64 = 0.05;
/// Share of pieces with a partner from which on leaves count as crossed.
const CROSSED_SHARE: f64 = 0.25;
/// Relative difference of signatures up to which leaves may be congruent.
const SAME_SHAPE: f64 = 4e-3;
/// Classes of like signature that one leaf is compared with before it founds its own.
const MAX_COMPARED: usize = 6;
/// Width of a cell of signatures; at least twice the tolerance of the largest invariants.
const CELL: f64 = 8.0 * SAME_SHAPE;

/// The leaves of a model and their classes.
#[derive(Clone, Debug, Default)]
pub struct Leaves {
    /// One entry a leaf, by first triangle.
    pub leaves: Vec<Leaf>,
    /// Classes by first member.
    pub classes: Vec<LeafClass>,
}

/// Measures of a shape that similarity transforms don't change (but for `center` and `radius`).
#[derive(Clone, Copy, Debug, Default)]
pub struct Signature {
    /// Triangles, second sides included.
    pub triangles: usize,
    /// Area-weighted centre.
    pub center: DVec3,
    /// One-sided area, normalised units squared.
    pub area: f64,
    /// Root mean square distance of corners from the centre.
    pub radius: f64,
    /// Area over radius squared, mean distance, mean fourth power and largest distance of
    /// corners over the radius.
    pub invariants: [f64; 4],
}

impl Signature {
    /// A key for rough counting of copies.
    pub fn coarse_key(&self) -> [i64; 4] {
        let rough = |v: f64| (v * 50.0).round() as i64;
        let [a, b, _, d] = self.invariants;
        [self.triangles as i64, rough(a), rough(b), rough(d)]
    }

    fn resembles(&self, other: &Self, tolerance: f64) -> bool {
        self.triangles == other.triangles
            && (self.invariants.iter().zip(&other.invariants))
                .all(|(a, b)| (a - b).abs() <= tolerance * (a.abs() + b.abs()))
    }
}

/// The signature of some triangles.
pub fn signature(parts: &Parts, triangles: &[u32]) -> Signature {
    let corners = |t: u32| parts.welded[t as usize].map(|p| parts.points[p as usize].as_dvec3());
    let (mut area, mut center, mut plain) = (0.0, DVec3::ZERO, DVec3::ZERO);
    for &t in triangles {
        let [a, b, c] = corners(t);
        plain += a + b + c;
        if !parts.duplicate[t as usize] {
            let size = (b - a).cross(c - a).length() / 2.0;
            area += size;
            center += (a + b + c) / 3.0 * size;
        }
    }
    let count = triangles.len() as f64 * 3.0;
    let center = if area > 0.0 {
        center / area
    } else {
        plain / count
    };
    let (mut second, mut first, mut fourth, mut largest) = (0.0, 0.0, 0.0, 0.0f64);
    for corner in triangles.iter().flat_map(|&t| corners(t)) {
        let square = corner.distance_squared(center);
        second += square;
        first += square.sqrt();
        fourth += square * square;
        largest = largest.max(square);
    }
    let radius = (second / count).sqrt();
    let unit = radius.max(1e-30);
    Signature {
        triangles: triangles.len(),
        center,
        area,
        radius,
        invariants: [
            area / (unit * unit),
            first / count / unit,
            fourth / count / unit.powi(4),
            largest.sqrt() / unit,
        ],
    }
}

/// Collects the leaves of all foliage parts.
pub fn find(model: &Model, parts: &Parts, organs: &[Organ]) -> Leaves {
    let foliage: Vec<usize> = (0..organs.len())
        .filter(|&p| organs[p] == Organ::Foliage)
        .collect();
    let pieces: Vec<Signature> = foliage
        .par_iter()
        .map(|&p| signature(parts, parts.triangles.get(p)))
        .collect();
    let (label, count) = unite_concentric(&pieces).labels();
    let groups = Groups::from_labels(&label, count);
    let mut leaves: Vec<(Leaf, Signature)> = (0..count)
        .into_par_iter()
        .map(|g| {
            let members = groups.get(g).iter().map(|&piece| foliage[piece as usize]);
            let mut triangles: TriangleList = members
                .flat_map(|p| parts.triangles.get(p).iter().copied())
                .collect();
            triangles.sort_unstable();
            let sign = signature(parts, &triangles);
            let leaf = Leaf {
                triangles,
                class: 0,
                center: sign.center.as_vec3(),
                area: sign.area as f32,
                node: NO_NODE,
            };
            (leaf, sign)
        })
        .collect();
    leaves.sort_by_key(|(leaf, _)| leaf.triangles[0]);
    let (mut leaves, signatures): (Vec<Leaf>, Vec<Signature>) = leaves.into_iter().unzip();
    let classes = sort_into_classes(model, parts, &mut leaves, &signatures);
    Leaves { leaves, classes }
}

/// Joins pieces of about the same size and centre: the quads of a cross. Crosses are a habit of
/// whoever made the file; where only a few pieces have a partner they met by chance.
fn unite_concentric(pieces: &[Signature]) -> DisjointSets {
    let apart = DisjointSets::new(pieces.len());
    let mut sets = apart.clone();
    let mut paired = vec![false; pieces.len()];
    let mut by_x: Vec<u32> = (0..pieces.len() as u32).collect();
    let center = |i: u32| pieces[i as usize].center;
    by_x.par_sort_unstable_by(|&a, &b| center(a).x.total_cmp(&center(b).x).then(a.cmp(&b)));
    for (at, &a) in by_x.iter().enumerate() {
        let reach = pieces[a as usize].radius * SAME_CENTER;
        // A million leaves in one point must not take a day: only the next few are looked at.
        for &b in by_x[at + 1..].iter().take(256) {
            if center(b).x - center(a).x > reach {
                break;
            }
            let (ra, rb) = (pieces[a as usize].radius, pieces[b as usize].radius);
            if center(a).distance(center(b)) <= reach.min(rb * SAME_CENTER)
                && (ra - rb).abs() <= 0.2 * ra.max(rb)
            {
                sets.unite(a, b);
                paired[a as usize] = true;
                paired[b as usize] = true;
            }
        }
    }
    let share = paired.iter().filter(|p| **p).count() as f64 / pieces.len().max(1) as f64;
    if share >= CROSSED_SHARE { sets } else { apart }
}

/// The step in which positions were rounded (centimetres of a tree far from the origin,
/// quantised attributes), normalised units; 0 where none can be made out.
fn grain(points: &[Vec3]) -> f64 {
    // Among n free numbers between -1 and 1 the smallest gap is about 2 / n^2.
    if points.len() < 2000 {
        return 0.0;
    }
    let expected = 2.0 / (points.len() as f64).powi(2);
    let smallest = (0..3).map(|axis| {
        let mut values: Vec<f32> = points.iter().map(|p| p[axis]).collect();
        values.par_sort_unstable_by(f32::total_cmp);
        let gaps = values.windows(2).map(|w| w[1] - w[0]);
        gaps.filter(|&g| g > 0.0).fold(f32::MAX, f32::min) as f64
    });
    let step = smallest.fold(f64::MAX, f64::min);
    if step < 1.0 && step > (1000.0 * expected).max(1e-6) {
        step
    } else {
        0.0
    }
}

/// Gives every leaf its class. Leaves are compared only with classes in the neighbouring cells
/// of a hash over the first two invariants.
fn sort_into_classes(
    model: &Model,
    parts: &Parts,
    leaves: &mut [Leaf],
    signatures: &[Signature],
) -> Vec<LeafClass> {
    let grain = grain(&parts.points);
    let mut classes: Vec<LeafClass> = Vec::new();
    let mut cells: HashMap<u64, Vec<u32>, BuildHasherDefault<Mix>> = HashMap::default();
    for index in 0..leaves.len() {
        let sign = &signatures[index];
        let [x, y] = [sign.invariants[0], sign.invariants[1]].map(|v| v / CELL);
        let noise = grain / sign.radius.max(1e-30);
        let tolerance = SAME_SHAPE + 1.5 * noise;
        // Invariants of a leaf are at most about 2.2, hence the difference that is tolerated.
        let reach = (4.4 * tolerance / CELL).min(24.0);
        let key = |i: i64, j: i64| {
            (i as u64 & 0xff_ffff) | (j as u64 & 0xff_ffff) << 24 | (sign.triangles as u64) << 48
        };
        let mut found: Option<u32> = None;
        let mut compared = 0;
        for i in (x - reach).floor() as i64..=(x + reach).floor() as i64 {
            for j in (y - reach).floor() as i64..=(y + reach).floor() as i64 {
                let Some(list) = cells.get(&key(i, j)) else {
                    continue;
                };
                for &class in list {
                    let other = classes[class as usize].prototype as usize;
                    if compared >= MAX_COMPARED
                        || found.is_some_and(|f| class >= f)
                        || !sign.resembles(&signatures[other], tolerance)
                    {
                        continue;
                    }
                    compared += 1;
                    if congruent(
                        model,
                        parts,
                        (&leaves[index], sign),
                        (&leaves[other], &signatures[other]),
                        0.02 + 2.0 * noise,
                    ) {
                        found = Some(class);
                    }
                }
            }
        }
        let class = found.unwrap_or_else(|| {
            classes.push(LeafClass {
                prototype: index as u32,
                count: 0,
            });
            let class = classes.len() as u32 - 1;
            let cell = key(x.floor() as i64, y.floor() as i64);
            cells.entry(cell).or_default().push(class);
            class
        });
        classes[class as usize].count += 1;
        leaves[index].class = class;
    }
    classes
}

/// Whether two leaves of like signature are equal up to a similarity: distances between their
/// corners agree in the order of the file, or else in sorted order. Material and texture
/// coordinates have to agree too, or the leaves would look different.
fn congruent(
    model: &Model,
    parts: &Parts,
    (a, sign_a): (&Leaf, &Signature),
    (b, sign_b): (&Leaf, &Signature),
    tolerance: f64,
) -> bool {
    let material = |t: u32| model.objects[model.triangle_object[t as usize] as usize].material;
    if material(a.triangles[0]) != material(b.triangles[0]) {
        return false;
    }
    let relative = |leaf: &Leaf, sign: &Signature| -> Vec<Vec3> {
        (leaf.triangles.iter())
            .flat_map(|&t| parts.welded[t as usize])
            .map(|p| {
                ((parts.points[p as usize].as_dvec3() - sign.center) / sign.radius.max(1e-30))
                    .as_vec3()
            })
            .collect()
    };
    let (pa, pb) = (relative(a, sign_a), relative(b, sign_b));
    let stride = pa.len().div_ceil(24).max(1);
    let distances = |points: &[Vec3]| -> Vec<f32> {
        let picked: Vec<Vec3> = points.iter().copied().step_by(stride).collect();
        (picked.iter().enumerate())
            .flat_map(|(i, p)| picked[i + 1..].iter().map(|q| p.distance(*q)))
            .collect()
    };
    let close = |a: &[f32], b: &[f32]| {
        a.iter()
            .zip(b)
            .all(|(x, y)| (x - y).abs() <= tolerance as f32)
    };
    let (mut da, mut db) = (distances(&pa), distances(&pb));
    let in_order = close(&da, &db);
    if !in_order {
        if stride > 1 {
            return false;
        }
        da.sort_by(f32::total_cmp);
        db.sort_by(f32::total_cmp);
        if !close(&da, &db) {
            return false;
        }
    }
    same_texture(model, a, b)
}

fn same_texture(model: &Model, a: &Leaf, b: &Leaf) -> bool {
    let bounds = |leaf: &Leaf| {
        let uvs = (leaf.triangles.iter())
            .flat_map(|&t| model.triangles[t as usize])
            .map(|i| model.uvs[0].get(i as usize).copied().unwrap_or_default());
        uvs.fold((glam::Vec2::MAX, glam::Vec2::MIN), |(low, high), uv| {
            (low.min(uv), high.max(uv))
        })
    };
    let ((low_a, high_a), (low_b, high_b)) = (bounds(a), bounds(b));
    low_a.abs_diff_eq(low_b, 4e-3) && high_a.abs_diff_eq(high_b, 4e-3)
}
