//! How bark lies on a chain: texture coordinates as a function of arc length and angle.
//!
//! Bark nearly always runs once or a few times around a branch in one coordinate and along it in
//! the other. Both are fitted from the chain's own triangles, so a tube with other rings and
//! sides shows the same bark at the same place and scale. Where the fit fails (unwrapped
//! patches, planar projections), new vertices take the coordinates of the nearest old one.

use std::f64::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::path::Path;
use crate::botany::Tree;

/// The bark of one chain.
pub(super) struct Bark {
    /// Index into the model's materials.
    pub material: u32,
    /// Angle about the path, from `Path::across`, where the texture's seam lies.
    pub seam: f64,
    mapping: Mapping,
}

enum Mapping {
    /// One coordinate goes around, the other along.
    Wrapped {
        /// 0: u goes around and v along; 1: the other way.
        around: usize,
        /// The coordinate around, at the seam.
        start: f64,
        /// Its change once around.
        turn: f64,
        /// The coordinate along, at each point of the path.
        along: Vec<f64>,
    },
    /// Positions with coordinates by arc length, to look up the nearest.
    Nearest(Vec<(f64, Vec3, Vec2)>),
}

/// A corner of a triangle on the unrolled bark.
#[derive(Clone, Copy)]
struct Corner {
    along: f64,
    angle: f64,
    uv: [f64; 2],
}

/// Sums over a chain's triangles, weighted by area.
#[derive(Default)]
struct Gradients {
    weight: f64,
    /// Absolute change of u and v per radian.
    around: [f64; 2],
    /// Absolute change of u and v per length.
    along: [f64; 2],
    /// (change of u, v once around, weight).
    turns: [Vec<(f64, f64)>; 2],
}

/// A coordinate counts as fitted when its root mean square residual is below this part of a tile.
const GOOD_FIT: f64 = 0.12;

impl Bark {
    /// Fits the mapping of a chain.
    pub fn fit(tree: &Tree, path: &Path, triangles: &[u32], slots: &[u32]) -> Self {
        let material = main_material(tree, triangles);
        let corners = unrolled(tree, path, triangles, slots, uv_set(tree, material));
        let wrapped = fit_wrapped(path, &corners);
        let (seam, mapping) = wrapped.unwrap_or_else(|| (0.0, nearest(tree, triangles, &corners)));
        Self {
            material,
            seam,
            mapping,
        }
    }

    /// The coordinates at a point of the path, `fraction` of the way around from the seam.
    pub fn uv(&self, path: &Path, knot: u32, fraction: f64, position: Vec3) -> Vec2 {
        match &self.mapping {
            Mapping::Wrapped {
                around,
                start,
                turn,
                along,
            } => {
                let across = (start + turn * fraction) as f32;
                let along = along[knot as usize] as f32;
                match around {
                    0 => Vec2::new(across, along),
                    _ => Vec2::new(along, across),
                }
            }
            Mapping::Nearest(known) => nearest_uv(known, path.along[knot as usize], position),
        }
    }
}

/// Which set of texture coordinates a material's bark uses.
pub(super) fn uv_set(tree: &Tree, material: u32) -> usize {
    let texture = tree.model.materials[material as usize].base_color;
    match texture {
        Some(texture) if texture.uv_set == 1 && !tree.model.uvs[1].is_empty() => 1,
        _ => 0,
    }
}

/// The material with the most triangles; of equals the first.
fn main_material(tree: &Tree, triangles: &[u32]) -> u32 {
    let mut seen: Vec<(u32, u32)> = Vec::new();
    for &t in triangles {
        let object = tree.model.triangle_object[t as usize] as usize;
        let material = tree.model.objects[object].material;
        match seen.iter_mut().find(|(m, _)| *m == material) {
            Some((_, count)) => *count += 1,
            None => seen.push((material, 1)),
        }
    }
    let most = seen.iter().map(|s| s.1).max().unwrap_or(0);
    seen.iter().find(|s| s.1 == most).map_or(0, |s| s.0)
}

fn unrolled(
    tree: &Tree,
    path: &Path,
    triangles: &[u32],
    slots: &[u32],
    set: usize,
) -> Vec<[Corner; 3]> {
    let model = &tree.model;
    let corner = |vertex: u32, near: usize| {
        let (along, angle) = path.locate(model.positions[vertex as usize].as_dvec3(), near);
        let uv = model.uvs[set].get(vertex as usize).copied();
        let uv = uv.unwrap_or_default();
        Corner {
            along,
            angle,
            uv: [f64::from(uv.x), f64::from(uv.y)],
        }
    };
    let unroll = |&t: &u32| {
        let slot = slots[tree.wood_node[t as usize] as usize] as usize;
        let near = path.slot_to_point[slot] as usize;
        let mut corners = model.triangles[t as usize].map(|v| corner(v, near));
        for i in 1..3 {
            let turn = corners[i].angle - corners[0].angle;
            corners[i].angle -= TAU * (turn / TAU).round();
        }
        corners
    };
    triangles.iter().map(unroll).collect()
}

/// The seam's angle and the mapping, or `None` where bark is not wrapped.
fn fit_wrapped(path: &Path, corners: &[[Corner; 3]]) -> Option<(f64, Mapping)> {
    let sums = gradients(corners);
    if sums.weight <= 0.0 {
        return None;
    }
    let u_around = sums.around[0] * sums.along[1] >= sums.around[1] * sums.along[0];
    let (around, along) = if u_around { (0, 1) } else { (1, 0) };
    let median = weighted_median(&sums.turns[around])?;
    let turn = nearly_whole(median);
    if turn.abs() < 0.02 {
        return None;
    }
    let (start, seam, spread) = seam(corners, around, turn);
    // Twisted or displaced bark still tiles at its scale, if most of its triangles agree on it.
    if spread > GOOD_FIT && agreement(&sums.turns[around], median) < 0.5 {
        return None;
    }
    let rate = sums.along[along] / sums.weight;
    let along = along_the_path(path, corners, along, rate);
    Some((
        seam,
        Mapping::Wrapped {
            around,
            start,
            turn,
            along,
        },
    ))
}

/// Gradients of the coordinates on the unrolled surface.
fn gradients(corners: &[[Corner; 3]]) -> Gradients {
    let mut sums = Gradients::default();
    for [a, b, c] in corners {
        let (s1, s2) = (b.along - a.along, c.along - a.along);
        let (t1, t2) = (b.angle - a.angle, c.angle - a.angle);
        let area = (t1 * s2 - t2 * s1) / 2.0;
        // Triangles that look around a bend or across the axis tell nothing of the mapping.
        if area.abs() <= 1e-12 || t1.abs().max(t2.abs()).max((t1 - t2).abs()) > 0.9 * PI {
            continue;
        }
        sums.weight += area.abs();
        for k in 0..2 {
            let (d1, d2) = (b.uv[k] - a.uv[k], c.uv[k] - a.uv[k]);
            let by_angle = (d1 * s2 - d2 * s1) / (2.0 * area);
            let by_along = (t1 * d2 - t2 * d1) / (2.0 * area);
            sums.around[k] += area.abs() * by_angle.abs();
            sums.along[k] += area.abs() * by_along.abs();
            sums.turns[k].push((by_angle * TAU, area.abs()));
        }
    }
    sums
}

fn weighted_median(values: &[(f64, f64)]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = sorted.iter().map(|v| v.1).sum::<f64>() / 2.0;
    let mut sum = 0.0;
    let found = sorted.iter().find(|v| {
        sum += v.1;
        sum >= half
    });
    found.map(|v| v.0)
}

/// Whole turns join at the seam without a step; a polygon's sides are flat, so its angles (and
/// with them the slope) are a little uneven.
fn nearly_whole(turn: f64) -> f64 {
    let whole = turn.round();
    match whole != 0.0 && (turn - whole).abs() < 0.2 * whole.abs() {
        true => whole,
        false => turn,
    }
}

/// The share of the area whose change once around is within a third of the median's.
fn agreement(turns: &[(f64, f64)], median: f64) -> f64 {
    let near = |t: &&(f64, f64)| (t.0 - median).abs() < median.abs() / 3.0;
    let agreed: f64 = turns.iter().filter(near).map(|t| t.1).sum();
    agreed / turns.iter().map(|t| t.1).sum::<f64>()
}

/// The coordinate around at the seam, the angle of the seam, and how far (in turns, one standard
/// deviation) the corners' coordinates are from it.
fn seam(corners: &[[Corner; 3]], around: usize, turn: f64) -> (f64, f64, f64) {
    // The coordinate at angle zero, as a phase: whole tiles do not matter.
    let phase = |c: &Corner| (c.uv[around] - turn * c.angle / TAU) * TAU;
    let (mut sin, mut cos, mut count) = (0.0, 0.0, 0.0);
    for corner in corners.iter().flatten() {
        sin += phase(corner).sin();
        cos += phase(corner).cos();
        count += 1.0;
    }
    let concentration = (sin * sin + cos * cos).sqrt() / count;
    // Circular statistics: a spread sigma (radians) leaves a mean vector of exp(-sigma^2 / 2).
    let sigma = (-2.0 * concentration.max(1e-300).ln()).max(0.0).sqrt();
    let zero = sin.atan2(cos) / TAU;
    let start = match turn == turn.round() {
        true => 0.0,
        // A part of a turn is a strip of an atlas: it begins where the chain's own does.
        false => corners
            .iter()
            .flatten()
            .map(|c| c.uv[around])
            .fold(f64::INFINITY, f64::min),
    };
    (start, (start - zero) / turn * TAU, sigma / TAU)
}

/// The coordinate along at each point of the path.
fn along_the_path(path: &Path, corners: &[[Corner; 3]], channel: usize, rate: f64) -> Vec<f64> {
    let table = mean_by_point(path, corners, channel);
    let change: f64 = table.windows(2).map(|p| (p[1] - p[0]).abs()).sum();
    let net = table[table.len() - 1] - table[0];
    let steep = rate * path.length();
    // Running one way, and as fast as the triangles say: the table is the mapping.
    if net.abs() > 0.9 * change && change > 0.8 * steep && change < 1.25 * steep {
        return table;
    }
    // Else every ring starts anew or turns back (0, 1, 0, 1): go on at the same scale.
    let sign = if net < 0.0 { -1.0 } else { 1.0 };
    let run = path.along.iter().map(|s| table[0] + sign * rate * s);
    run.collect()
}

/// Mean coordinate of the corners around each point; gaps are filled from their neighbours.
fn mean_by_point(path: &Path, corners: &[[Corner; 3]], channel: usize) -> Vec<f64> {
    // A hat-weighted local line through the corners near each point.
    let count = path.points.len();
    let mut sums = vec![[0.0f64; 5]; count];
    for corner in corners.iter().flatten() {
        let after = path.along.partition_point(|&s| s < corner.along);
        let (low, high) = (after.saturating_sub(1), after.min(count - 1));
        for (i, sum) in sums.iter_mut().enumerate().take(high + 1).skip(low) {
            let offset = corner.along - path.along[i];
            let gap = path.along[high] - path.along[low];
            let w = match gap > 0.0 {
                true => (1.0 - offset.abs() / gap).max(0.0) + 1e-3,
                false => 1.0,
            };
            let value = corner.uv[channel];
            let terms = [1.0, offset, offset * offset, value, value * offset];
            for (sum, term) in sum.iter_mut().zip(terms) {
                *sum += w * term;
            }
        }
    }
    let at = |[w, x, xx, y, xy]: [f64; 5]| {
        let spread = xx * w - x * x;
        match spread > 1e-9 * w * xx {
            true => (y * xx - xy * x) / spread,
            false => y / w,
        }
    };
    let mut table: Vec<_> = sums.iter().map(|&s| (s[0] > 0.0).then(|| at(s))).collect();
    for i in 1..count {
        table[i] = table[i].or(table[i - 1]);
    }
    for i in (0..count - 1).rev() {
        table[i] = table[i].or(table[i + 1]);
    }
    table.into_iter().map(|v| v.unwrap_or(0.0)).collect()
}

/// All vertices of the chain by arc length.
fn nearest(tree: &Tree, triangles: &[u32], corners: &[[Corner; 3]]) -> Mapping {
    let mut known: Vec<(u32, f64, Vec2)> = Vec::new();
    for (&t, corners) in triangles.iter().zip(corners) {
        for (&vertex, corner) in tree.model.triangles[t as usize].iter().zip(corners) {
            let uv = Vec2::new(corner.uv[0] as f32, corner.uv[1] as f32);
            known.push((vertex, corner.along, uv));
        }
    }
    known.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    known.dedup_by_key(|k| k.0);
    let place = |(vertex, along, uv)| (along, tree.model.positions[vertex as usize], uv);
    Mapping::Nearest(known.into_iter().map(place).collect())
}

/// The nearest vertex among the 128 that come next along the path.
fn nearest_uv(known: &[(f64, Vec3, Vec2)], along: f64, position: Vec3) -> Vec2 {
    let at = known.partition_point(|k| k.0 < along);
    let near = &known[at.saturating_sub(64)..(at + 64).min(known.len())];
    let distance = |k: &&(f64, Vec3, Vec2)| k.1.distance_squared(position);
    near.iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .map_or(Vec2::ZERO, |k| k.2)
}
