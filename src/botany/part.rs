//! Welded connected parts: triangles that share an edge in space, whatever their indices say.
//!
//! Vertices are welded by position, since exporters split them at seams of texture or normal, and
//! triangle soup shares none at all. Parts grow over shared indices and over *edges* that share
//! positions, but not over mere points that do: the blades of a fan palm meet in one point and
//! are still leaves of their own, a hexagon in two pieces is one leaf, and leaflets that the file
//! itself ties to one stalk stay together. Different materials never join.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use glam::Vec3;
use rayon::prelude::*;

use super::model::Model;

/// Vertices closer than this (bounding-sphere radii) are one: a few steps of f32 at the radius,
/// three thousandths of a millimetre on a tree of 20 m. Ten times as much would close the tips of
/// twigs that taper to a point.
pub const WELD_TOLERANCE: f32 = 3e-7;

/// Scraps closer than this to other wood belong to it (bounding-sphere radii): a tenth of a
/// millimetre on a tree of 20 m.
pub const MEND_TOLERANCE: f32 = 1e-5;

/// The parts of a model.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    /// For each vertex of the model its welded point.
    pub vertex_point: Vec<u32>,
    /// Positions of welded points.
    pub points: Vec<Vec3>,
    /// Triangles over welded points, one for each triangle of the model.
    pub welded: Vec<[u32; 3]>,
    /// True for a triangle whose points an earlier triangle has too (the second side of a leaf).
    pub duplicate: Vec<bool>,
    /// For each triangle its part.
    pub triangle_part: Vec<u32>,
    /// For each part its triangles, ascending.
    pub triangles: Groups,
}

/// Lists in one array: group `i` is `items[starts[i]..starts[i + 1]]`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Groups {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Groups {
    /// Puts every index into the group that `labels` names; labels at or above `count` are left out.
    pub fn from_labels(labels: &[u32], count: usize) -> Self {
        let mut starts = vec![0u32; count + 1];
        for &label in labels.iter().filter(|&&l| (l as usize) < count) {
            starts[label as usize + 1] += 1;
        }
        for i in 0..count {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts[count] as usize];
        for (index, &label) in labels.iter().enumerate() {
            if (label as usize) < count {
                items[next[label as usize] as usize] = index as u32;
                next[label as usize] += 1;
            }
        }
        Self { starts, items }
    }

    /// Number of groups.
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Whether there is no group.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The members of group `i`, ascending.
    pub fn get(&self, i: usize) -> &[u32] {
        &self.items[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    /// All groups in order.
    pub fn iter(&self) -> impl Iterator<Item = &[u32]> {
        (0..self.len()).map(|i| self.get(i))
    }
}

/// Finds the parts of a model in O(n log n). Parts are numbered by their first triangle.
pub fn find(model: &Model) -> Parts {
    let (vertex_point, points) = weld(&model.positions, WELD_TOLERANCE);
    let welded: Vec<[u32; 3]> = model
        .triangles
        .iter()
        .map(|t| t.map(|i| vertex_point[i as usize]))
        .collect();
    let material = |t: u32| {
        let object = model.triangle_object[t as usize];
        model.objects[object as usize].material
    };
    let mut sets = DisjointSets::new(welded.len());
    join_indices(model, &material, &mut sets);
    let duplicate = join_duplicates(&welded, &material, &mut sets);
    join_edges(model, &points, &welded, &duplicate, &material, &mut sets);
    let (triangle_part, count) = sets.labels();
    let triangles = Groups::from_labels(&triangle_part, count);
    Parts {
        vertex_point,
        points,
        welded,
        duplicate,
        triangle_part,
        triangles,
    }
}

/// Unites triangles that share a vertex of the file.
fn join_indices(model: &Model, material: &impl Fn(u32) -> u32, sets: &mut DisjointSets) {
    let mut first = vec![u32::MAX; model.positions.len()];
    for (triangle, corners) in (0u32..).zip(&model.triangles) {
        for &vertex in corners {
            let seen = &mut first[vertex as usize];
            if *seen == u32::MAX {
                *seen = triangle;
            } else if material(*seen) == material(triangle) {
                sets.unite(*seen, triangle);
            }
        }
    }
}

/// Unites triangles over the same three points and marks all but the first.
fn join_duplicates(
    welded: &[[u32; 3]],
    material: &impl Fn(u32) -> u32,
    sets: &mut DisjointSets,
) -> Vec<bool> {
    let mut keys: Vec<([u32; 3], u32)> = (welded.iter().zip(0u32..))
        .map(|(t, i)| {
            let mut t = *t;
            t.sort_unstable();
            (t, i)
        })
        .collect();
    keys.par_sort_unstable();
    let mut duplicate = vec![false; welded.len()];
    for run in keys.chunk_by(|a, b| a.0 == b.0).filter(|r| r.len() > 1) {
        for &(_, triangle) in &run[1..] {
            duplicate[triangle as usize] = true;
            if material(triangle) == material(run[0].1) {
                sets.unite(triangle, run[0].1);
            }
        }
    }
    duplicate
}

/// Unites triangles over edges that two of them share; where more than two meet (a fork that
/// starts with its parent's own ring), those that share indices, or else the straightest pair.
fn join_edges(
    model: &Model,
    points: &[Vec3],
    welded: &[[u32; 3]],
    duplicate: &[bool],
    material: &impl Fn(u32) -> u32,
    sets: &mut DisjointSets,
) {
    let mut edges: Vec<(u64, u32)> = Vec::with_capacity(welded.len() * 3);
    for (index, t) in welded.iter().enumerate() {
        if duplicate[index] {
            continue;
        }
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            if a != b {
                edges.push((((a.min(b) as u64) << 32) | a.max(b) as u64, index as u32));
            }
        }
    }
    edges.par_sort_unstable();
    for run in edges.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, a), (_, b)] = *run {
            if material(a) == material(b) {
                sets.unite(a, b);
            }
        } else if run.len() > 2 && run.len() <= 16 {
            join_crowded(model, points, welded, run, material, sets);
        }
    }
}

/// An edge with three triangles or more.
fn join_crowded(
    model: &Model,
    points: &[Vec3],
    welded: &[[u32; 3]],
    run: &[(u64, u32)],
    material: &impl Fn(u32) -> u32,
    sets: &mut DisjointSets,
) {
    let (p, q) = ((run[0].0 >> 32) as u32, run[0].0 as u32);
    let indices = |t: u32| {
        let at = |point| {
            let corner = welded[t as usize].iter().position(|&w| w == point);
            model.triangles[t as usize][corner.unwrap_or(0)]
        };
        (at(p), at(q))
    };
    let away = |t: u32| {
        let axis = (points[q as usize] - points[p as usize]).normalize_or_zero();
        let third = welded[t as usize].iter().find(|&&w| w != p && w != q);
        let d = third.map_or(Vec3::ZERO, |&w| points[w as usize] - points[p as usize]);
        (d - axis * d.dot(axis)).normalize_or_zero()
    };
    let mut joined = false;
    let mut straightest: Option<(f32, u32, u32)> = None;
    for (i, &(_, a)) in run.iter().enumerate() {
        for &(_, b) in &run[i + 1..] {
            if material(a) != material(b) {
                continue;
            }
            if indices(a) == indices(b) {
                sets.unite(a, b);
                joined = true;
            }
            let cosine = away(a).dot(away(b));
            if straightest.is_none_or(|(best, ..)| cosine < best) {
                straightest = Some((cosine, a, b));
            }
        }
    }
    if let (false, Some((_, a, b))) = (joined, straightest) {
        sets.unite(a, b);
    }
}

/// Gives vertices that are closer than `tolerance` the same point; points are numbered by their
/// first vertex and lie on it.
pub fn weld(positions: &[Vec3], tolerance: f32) -> (Vec<u32>, Vec<Vec3>) {
    // Cells far larger than the tolerance: nearly every vertex has to look into one cell only.
    let cell = tolerance * 64.0;
    let key = |c: [i32; 3]| {
        let [x, y, z] = c.map(|v| (v as i64 + (1 << 20)) as u64 & 0x1f_ffff);
        x | y << 21 | z << 42
    };
    let mut heads: HashMap<u64, u32, BuildHasherDefault<Mix>> =
        HashMap::with_capacity_and_hasher(positions.len(), Default::default());
    let mut points: Vec<Vec3> = Vec::new();
    let mut next: Vec<u32> = Vec::new();
    let mut vertex_point = Vec::with_capacity(positions.len());
    for &p in positions {
        let low = ((p - tolerance) / cell).floor().as_ivec3();
        let high = ((p + tolerance) / cell).floor().as_ivec3();
        let mut found = u32::MAX;
        for x in low.x..=high.x {
            for y in low.y..=high.y {
                for z in low.z..=high.z {
                    let mut at = heads.get(&key([x, y, z])).copied().unwrap_or(u32::MAX);
                    while at != u32::MAX {
                        let near = points[at as usize].distance_squared(p) <= tolerance * tolerance;
                        if near && at < found {
                            found = at;
                        }
                        at = next[at as usize];
                    }
                }
            }
        }
        if found == u32::MAX {
            found = points.len() as u32;
            let head = heads
                .entry(key((p / cell).floor().as_ivec3().to_array()))
                .or_insert(u32::MAX);
            next.push(*head);
            *head = found;
            points.push(p);
        }
        vertex_point.push(found);
    }
    (vertex_point, points)
}

/// Joins what is left of twigs so thin that rounding tore them: the parts that `is_scrap` names
/// are joined to parts of the same kind (`kind`) that come within [`MEND_TOLERANCE`], and points
/// that close become one.
pub fn mend(parts: &mut Parts, is_scrap: &[bool], kind: &[u32]) {
    if !is_scrap.contains(&true) {
        return;
    }
    let torn = (is_scrap.iter().zip(kind))
        .filter_map(|(&scrap, &kind)| scrap.then_some(kind))
        .collect::<std::collections::BTreeSet<u32>>();
    let mut near: Vec<(i64, u32, u32)> = Vec::new();
    for (triangle, corners) in parts.welded.iter().enumerate() {
        let part = parts.triangle_part[triangle];
        if torn.contains(&kind[part as usize]) {
            for &p in corners {
                let x = (parts.points[p as usize].x as f64 / MEND_TOLERANCE as f64) as i64;
                near.push((x, p, part));
            }
        }
    }
    near.par_sort_unstable();
    near.dedup();
    let mut part_sets = DisjointSets::new(parts.triangles.len());
    let mut point_sets = DisjointSets::new(parts.points.len());
    for (at, &(x, p, part)) in near.iter().enumerate() {
        let position = parts.points[p as usize];
        let others = near[at + 1..].iter().take_while(|o| o.0 <= x + 1);
        // The limit keeps a wall of points in one plane from taking all day.
        for &(_, q, other) in others.take(512) {
            let scrap = is_scrap[part as usize] || is_scrap[other as usize];
            let apart = position.distance_squared(parts.points[q as usize]);
            if scrap
                && kind[part as usize] == kind[other as usize]
                && apart <= MEND_TOLERANCE * MEND_TOLERANCE
            {
                part_sets.unite(part, other);
                point_sets.unite(p, q);
            }
        }
    }
    for corners in &mut parts.welded {
        *corners = corners.map(|p| point_sets.root(p));
    }
    let (of_part, count) = part_sets.labels();
    for part in &mut parts.triangle_part {
        *part = of_part[*part as usize];
    }
    parts.triangles = Groups::from_labels(&parts.triangle_part, count);
}

/// Union by smaller index, so that a set's root is its first member.
#[derive(Clone, Debug)]
pub struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    /// `n` sets of one.
    pub fn new(n: usize) -> Self {
        Self {
            parent: (0..n as u32).collect(),
        }
    }

    /// The smallest member of the set that holds `i`.
    pub fn root(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            let up = self.parent[self.parent[i as usize] as usize];
            self.parent[i as usize] = up;
            i = up;
        }
        i
    }

    /// Makes the sets of `a` and `b` one.
    pub fn unite(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }

    /// Numbers the sets in the order of their first members.
    pub fn labels(mut self) -> (Vec<u32>, usize) {
        let mut count = 0;
        let mut labels = vec![0; self.parent.len()];
        for i in 0..self.parent.len() as u32 {
            let root = self.root(i);
            labels[i as usize] = if root == i {
                count += 1;
                count - 1
            } else {
                labels[root as usize]
            };
        }
        (labels, count as usize)
    }
}

/// A quick hash for keys that are already integers (used for look-ups, never for order).
#[derive(Default)]
pub struct Mix(u64);

impl Hasher for Mix {
    fn finish(&self) -> u64 {
        self.0
    }
    fn write(&mut self, bytes: &[u8]) {
        for &b in bytes {
            self.write_u64(b as u64);
        }
    }
    fn write_u64(&mut self, value: u64) {
        let mixed = (self.0 ^ value).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = mixed ^ (mixed >> 29);
    }
}
