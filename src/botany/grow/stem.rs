//! Grows the wood: stems as centre lines with radii, after Weber and Penn 1995 ("Creation and
//! Rendering of Realistic Trees", SIGGRAPH), sections 4.1 to 4.6.
//!
//! Two departures: the arms of a fork share the parent's cross-section (Leonardo's rule), so that
//! it is known which arm goes on and which is the child; attraction to the sky acts on all levels.

use std::collections::VecDeque;

use glam::Vec3;

use super::rng::{Rng, pow, rotate};
use super::species::{Level, Species};

/// Radius of the arm that goes on and of the arm that leaves, over that before the fork.
const FORK_RADII: [f32; 2] = [0.82, 0.64];

/// No wood hangs lower than this, metres.
const GROUND_CLEARANCE: f32 = 0.15;

/// A branch: its centre line with what leaves and bark need to know.
#[derive(Clone, Debug)]
pub(super) struct Stem {
    pub parent: Option<u32>,
    pub order: u32,
    pub level: usize,
    /// Centre line from base to tip, metres.
    pub points: Vec<Vec3>,
    /// Radius at each point, metres.
    pub radii: Vec<f32>,
    /// Distance of each point from the stem's base along it (a fork's arm counts on), metres.
    pub along: Vec<f32>,
    /// Length that it was meant to have, metres.
    pub length: f32,
    /// Radius at its base, before forks took their share, metres.
    pub base_radius: f32,
    /// Length over the longest of its level.
    pub vigor: f32,
    pub seed: u64,
}

impl Stem {
    /// Position, direction and radius at a distance from the base.
    pub fn at(&self, along: f32) -> (Vec3, Vec3, f32) {
        let last = self.points.len() - 1;
        let i = self.along.partition_point(|&a| a <= along).clamp(1, last) - 1;
        let step = (self.along[i + 1] - self.along[i]).max(1e-9);
        let t = ((along - self.along[i]) / step).clamp(0.0, 1.0);
        let direction = (self.points[i + 1] - self.points[i]).normalize_or(Vec3::Y);
        (
            self.points[i].lerp(self.points[i + 1], t),
            direction,
            self.radii[i] + (self.radii[i + 1] - self.radii[i]) * t,
        )
    }

    /// Distance of its first and last point from the stem's base.
    pub fn extent(&self) -> (f32, f32) {
        (self.along[0], self.along[self.along.len() - 1])
    }
}

/// A unit vector across `direction`, horizontal where it can be.
pub(super) fn across(direction: Vec3) -> Vec3 {
    let side = direction.cross(Vec3::Y);
    if side.length_squared() > 1e-6 {
        side.normalize()
    } else {
        direction.cross(Vec3::Z).normalize_or(Vec3::X)
    }
}

/// Where and how a stem begins.
struct Bud {
    parent: Option<u32>,
    order: u32,
    level: usize,
    position: Vec3,
    direction: Vec3,
    length: f32,
    base_radius: f32,
    /// Share of the base radius that forks have left.
    share: f32,
    vigor: f32,
    /// Segments that were grown before the fork that it comes from.
    first_segment: u32,
    seed: u64,
}

/// Grows all stems; a parent comes before its children. `branch_scale` multiplies the number of
/// branches of each level.
pub(super) fn grow(species: &Species, branch_scale: &[f32], seed: u64) -> Vec<Stem> {
    let mut rng = Rng::new(seed, 0);
    let height = rng.vary(species.height);
    let length = height * rng.vary(species.levels[0].length);
    let mut stems: Vec<Stem> = Vec::new();
    let mut buds = VecDeque::from([Bud {
        parent: None,
        order: 0,
        level: 0,
        position: Vec3::ZERO,
        direction: Vec3::Y,
        length,
        base_radius: length * species.ratio,
        share: 1.0,
        vigor: 1.0,
        first_segment: 0,
        seed: rng.bits(),
    }]);
    while let Some(bud) = buds.pop_front() {
        let index = stems.len() as u32;
        let Some(stem) = extend(species, &bud, index, &mut buds) else {
            continue;
        };
        if let Some(&scale) = branch_scale.get(stem.level + 1) {
            branch(species, &stem, index, scale, &mut buds);
        }
        stems.push(stem);
    }
    stems
}

/// Grows one stem segment by segment; forks leave buds.
fn extend(species: &Species, bud: &Bud, index: u32, buds: &mut VecDeque<Bud>) -> Option<Stem> {
    let level = &species.levels[bud.level];
    let mut rng = Rng::new(bud.seed, 1);
    let step = bud.length / level.segments as f32;
    let (mut position, mut direction, mut share) = (bud.position, bud.direction, bud.share);
    let mut stem = Stem {
        parent: bud.parent,
        order: bud.order,
        level: bud.level,
        points: vec![position],
        radii: vec![radius(species, bud, bud.first_segment as f32, share)],
        along: vec![bud.first_segment as f32 * step],
        length: bud.length,
        base_radius: bud.base_radius,
        vigor: bud.vigor,
        seed: bud.seed,
    };
    let mut debt = rng.unit();
    for segment in bud.first_segment..level.segments {
        // A fresh bud leaves in its own direction; bends begin with the second segment.
        if segment > bud.first_segment {
            direction = bend(level, direction, segment, &mut rng);
        }
        position += direction * step;
        if position.y < GROUND_CLEARANCE && bud.level > 0 {
            break;
        }
        let grown = segment + 1;
        let done = grown as f32 / level.segments as f32;
        let from = if bud.level == 0 { species.bare } else { 0.2 };
        if done >= from && grown + 1 < level.segments {
            debt += level.forks / (level.segments as f32 * (1.0 - from)).max(1.0);
            if debt >= 1.0 {
                debt -= 1.0;
                let arm = fork(level, bud, index, position, &mut direction, &mut rng);
                buds.push_back(Bud {
                    share: share * FORK_RADII[1],
                    first_segment: grown,
                    ..arm
                });
                share *= FORK_RADII[0];
            }
        }
        // The flare needs points close to the ground.
        let parts: &[f32] = if bud.level == 0 && segment == 0 {
            &[0.85, 0.65, 0.4, 0.0]
        } else {
            &[0.0]
        };
        for &part in parts {
            let grown = grown as f32 - part;
            stem.points.push(position - direction * (step * part));
            stem.radii.push(radius(species, bud, grown, share));
            stem.along.push(grown * step);
        }
    }
    (stem.points.len() > 1).then_some(stem)
}

/// The direction of the next segment.
fn bend(level: &Level, direction: Vec3, segment: u32, rng: &mut Rng) -> Vec3 {
    let n = level.segments as f32;
    let half = (n * 0.5).max(1.0);
    let side = across(direction);
    let curve = if 2 * segment < level.segments {
        level.curve / half
    } else {
        level.curve_back / half
    };
    // `across` is direction x up: a positive turn about it lifts.
    let sky = direction.cross(Vec3::Y).length();
    let mut out = rotate(direction, side, curve + level.lift * sky / n);
    out = rotate(out, side, level.crook * rng.sway() / n);
    out = rotate(out, side.cross(direction), level.crook * rng.sway() / n);
    out.normalize()
}

/// Splits the direction in two; returns the bud of the arm that leaves.
fn fork(
    level: &Level,
    bud: &Bud,
    index: u32,
    position: Vec3,
    direction: &mut Vec3,
    rng: &mut Rng,
) -> Bud {
    let angle = rng.vary(level.fork_angle);
    let axis = rotate(across(*direction), *direction, 360.0 * rng.unit());
    let arm = rotate(*direction, axis, 0.6 * angle);
    *direction = rotate(*direction, axis, -0.4 * angle);
    Bud {
        parent: Some(index),
        order: bud.order + 1,
        position,
        direction: arm,
        seed: rng.bits(),
        ..*bud
    }
}

/// Radius after `grown` segments: taper, flare at the ground, what forks have left.
fn radius(species: &Species, bud: &Bud, grown: f32, share: f32) -> f32 {
    let level = &species.levels[bud.level];
    let z = grown / level.segments as f32;
    let mut radius = bud.base_radius * share * (1.0 - level.taper * z).max(0.06);
    if bud.level == 0 {
        let y = (1.0 - 8.0 * z).max(0.0);
        radius *= 1.0 + species.flare * (pow(100.0, y) - 1.0) / 99.0;
    }
    radius
}

/// Leaves buds for the children along a stem.
fn branch(species: &Species, stem: &Stem, index: u32, scale: f32, buds: &mut VecDeque<Bud>) {
    let level = &species.levels[stem.level + 1];
    let mut rng = Rng::new(stem.seed, 2);
    let own = &species.levels[stem.level];
    let bare = if stem.level == 0 {
        species.bare
    } else {
        own.bare
    };
    let foot = bare * stem.length;
    let (start, end) = stem.extent();
    let low = start.max(foot);
    let usable = (stem.length - foot).max(1e-6);
    let full = level.branches
        * scale
        * if stem.level == 0 {
            1.0
        } else {
            0.2 + 0.8 * stem.vigor
        };
    let count = (full * (end - low).max(0.0) / usable + rng.unit() * 0.999) as u32;
    let mut azimuth = 360.0 * rng.unit() * f32::from(stem.level == 0 || level.rotate.0 < 179.0);
    let whorls = count.div_ceil(level.whorl).max(1) as f32;
    for i in 0..count {
        let whorl = i / level.whorl;
        let jitter = if level.whorl > 1 {
            0.0
        } else {
            0.35 * rng.sway()
        };
        let along = low + (end - low) * 0.98 * (whorl as f32 + 0.55 + jitter) / whorls;
        azimuth += rng.vary(level.rotate);
        let height = 1.0 - (along - foot) / usable;
        let limit = level.length.0;
        let length = rng.vary(level.length)
            * if stem.level == 0 {
                stem.length * species.shape.ratio(height.clamp(0.0, 1.0))
            } else {
                stem.length - 0.6 * along
            };
        let (position, direction, radius) = stem.at(along);
        let t = 1.0 - height.clamp(0.0, 1.0);
        let tilt = level.angle.0 + (level.angle.1 - level.angle.0) * t + level.angle.2 * rng.sway();
        let lean = rotate(across(direction), direction, azimuth);
        let seed = rng.bits();
        if length < 1e-3 {
            continue;
        }
        let thin = stem.base_radius * pow(length / stem.length, species.ratio_power);
        buds.push_back(Bud {
            parent: Some(index),
            order: stem.order + 1,
            level: stem.level + 1,
            position,
            direction: rotate(direction, direction.cross(lean), tilt),
            length,
            base_radius: thin.min(0.75 * radius),
            share: 1.0,
            vigor: (length / (limit * stem.length)).min(1.0),
            first_segment: 0,
            seed,
        });
    }
}
