//! Which piece goes on where wood forks, and what is a branch at all.

use std::f32::consts::FRAC_PI_2;

use glam::Vec3;

use super::pieces::Piece;
use crate::botany::part::WELD_TOLERANCE;

/// A side branch shorter than this many radii of its parent is a bump, not a branch.
const SHORTEST_IN_RADII: f32 = 1.2;
/// What is nowhere thicker than this (bounding-sphere radii) is a sliver that collapsed triangles
/// have left: points nearer than a tenth of it are one.
const SLIVER: f32 = 10.0 * WELD_TOLERANCE;
/// Over this length from a fork its arms and the wood before it are compared, in radii of that wood.
const COMPARED_IN_RADII: f32 = 4.0;
/// What is so many times thicker than the wood at a fork is what carries that wood, not the same stem.
const OTHER_WOOD: f32 = 1.8;
/// How far from a fork clean wood is looked for, in radii of the wood before it.
const LOOK_IN_RADII: f32 = 16.0;
/// What is shorter than this many radii beyond a fork hardly goes on.
const STUMP_IN_RADII: f32 = 3.0;
/// A stem ends at a fork where its best arm has lost so much: the share of its radius that it
/// keeps, less its angle in right angles (a palm's stem ends among its fronds).
const END: f32 = 0.2;
/// It also ends where its best arm keeps less than this share of its radius ...
const LEADER: f32 = 0.6;
/// ... and another one has this share of that arm's radius: nothing leads.
const RIVAL: f32 = 0.75;
/// Branches that part within so many radii of the wood that carries them have no common base.
const COMMON_BASE_IN_RADII: f32 = 1.0;
/// Nor if they part within so many radii of their own.
const COMMON_BASE_IN_OWN_RADII: f32 = 1.0;
/// Below a fork level sets hold both arms, over this many radii of the thinner one.
const SHARED_IN_RADII: f32 = 2.5;
/// A branch thinner than this share of its parent moves the middle of their common level set little.
const THIN: f32 = 0.2;

/// For each piece the one above that carries its stem on; `None` at a tip, and where a stem ends
/// in a fork.
pub fn continuations(pieces: &[Piece]) -> Vec<Option<u32>> {
    let mut next: Vec<Option<u32>> = vec![None; pieces.len()];
    // From the tips down, so that the arms of a fork are known.
    for p in (0..pieces.len()).rev() {
        next[p] = match pieces[p].children[..] {
            [] => None,
            [only] => Some(only),
            _ => continuation(pieces, &next, p as u32),
        };
    }
    next
}

/// What wood is like on one side of a fork.
#[derive(Clone, Copy, Debug, Default)]
struct Arm {
    /// Unit vector, away from the fork.
    direction: Vec3,
    radius: f32,
}

/// A place on a way: whether its level set holds this wood alone, its middle, its radius.
type Place = (bool, Vec3, f32);

impl Arm {
    /// The arm of a fork that starts with a piece; `radius` is that of the wood before it.
    fn above(pieces: &[Piece], next: &[Option<u32>], start: u32, radius: f32) -> Self {
        let up = std::iter::successors(Some(start), |&p| next[p as usize]);
        let way = within(pieces, up, LOOK_IN_RADII * radius);
        let shared = shared(pieces, &way);
        Self::along(&places(pieces, &way, &shared), COMPARED_IN_RADII * radius)
    }

    /// The wood below a fork, looked at from there; `side` is the radius of the thinner arm.
    fn below(pieces: &[Piece], fork: u32, side: f32) -> Self {
        let here = &pieces[fork as usize];
        let thickest = OTHER_WOOD * here.radius;
        let down = std::iter::successors(Some(fork), |&p| pieces[p as usize].parent)
            .take_while(|&p| pieces[p as usize].radius <= thickest);
        let mut way = within(pieces, down, LOOK_IN_RADII * here.radius);
        way.reverse();
        let mut shared = shared(pieces, &way);
        let from = here.extent.high - SHARED_IN_RADII * side;
        for (&p, shared) in way.iter().zip(&mut shared) {
            *shared |= pieces[p as usize].extent.high > from;
        }
        let mut places = places(pieces, &way, &shared);
        places.reverse();
        Self::along(&places, COMPARED_IN_RADII * here.radius)
    }

    /// Along the places that follow a fork, over the first `length` of clean wood.
    fn along(places: &[Place], length: f32) -> Self {
        let clean: Vec<Place> = places.iter().copied().filter(|p| p.0).collect();
        let span = |places: &[Place]| match (places.first(), places.last()) {
            (Some(a), Some(b)) => a.1.distance(b.1),
            _ => 0.0,
        };
        let places = if span(&clean) > 0.4 * span(places).min(length) {
            &clean
        } else {
            places
        };
        let Some(first) = places.first() else {
            return Self::default();
        };
        let mut last = *first;
        for pair in places.windows(2) {
            let left = length - last.1.distance(first.1);
            let step = pair[0].1.distance(pair[1].1);
            let share = (left / step.max(1e-12)).clamp(0.0, 1.0);
            last.1 = pair[0].1.lerp(pair[1].1, share);
            last.2 = pair[0].2 + (pair[1].2 - pair[0].2) * share;
            if share < 1.0 {
                break;
            }
        }
        Self {
            direction: (last.1 - first.1).normalize_or_zero(),
            radius: 0.5 * (first.2 + last.2),
        }
    }
}

/// The pieces of a way that lie within a length.
fn within(pieces: &[Piece], way: impl Iterator<Item = u32>, length: f32) -> Vec<u32> {
    let mut gone = 0.0;
    let mut out: Vec<u32> = Vec::new();
    for p in way {
        if let Some(&last) = out.last() {
            let [a, b] = [last, p].map(|p| pieces[p as usize].position);
            gone += a.distance(b);
            if gone > length {
                break;
            }
        }
        out.push(p);
    }
    out
}

fn places(pieces: &[Piece], way: &[u32], shared: &[bool]) -> Vec<Place> {
    let place = |(&p, &shared): (&u32, &bool)| {
        let piece = &pieces[p as usize];
        (!shared, piece.position, piece.radius)
    };
    let mut out: Vec<Place> = way.iter().zip(shared).map(place).collect();
    if let Some(tip) = way.last().map(|&p| &pieces[p as usize])
        && tip.children.is_empty()
    {
        out.push((true, tip.end.0, tip.end.1));
    }
    out
}

/// For each piece of a way (upwards) whether its level set holds something of a branch that
/// leaves the way farther up.
pub fn shared(pieces: &[Piece], way: &[u32]) -> Vec<bool> {
    let mut out = vec![false; way.len()];
    for (i, pair) in way.windows(2).enumerate() {
        let piece = &pieces[pair[0] as usize];
        if piece.children.len() < 2 {
            continue;
        }
        let on = pieces[pair[1] as usize].radius;
        let side = (piece.children.iter().filter(|&&c| c != pair[1]))
            .map(|&c| &pieces[c as usize])
            .filter(|c| c.reach > SHORTEST_IN_RADII * c.radius)
            .map(|c| c.radius)
            .fold(0.0, f32::max);
        if side < THIN * on {
            continue;
        }
        let from = piece.extent.high - SHARED_IN_RADII * side.min(on);
        for j in (0..=i).rev() {
            if pieces[way[j] as usize].extent.high <= from {
                break;
            }
            out[j] = true;
        }
    }
    out
}

/// The child that carries a chain on: thick, straight ahead, and no stump.
fn continuation(pieces: &[Piece], next: &[Option<u32>], at: u32) -> Option<u32> {
    let here = &pieces[at as usize];
    let children = &here.children;
    let radius = here.radius;
    let arms: Vec<Arm> = (children.iter())
        .map(|&c| Arm::above(pieces, next, c, radius))
        .collect();
    let mut radii: Vec<f32> = arms.iter().map(|a| a.radius).collect();
    radii.sort_unstable_by(|a, b| b.total_cmp(a));
    let before = Arm::below(pieces, at, radii[1]);
    let thickest = arms.iter().map(|a| a.radius).fold(1e-12, f32::max);
    let bend = |arm: &Arm| {
        let angle = (-before.direction).angle_between(arm.direction);
        if angle.is_finite() {
            angle / FRAC_PI_2
        } else {
            0.0
        }
    };
    let score = |i: usize| {
        let reach = pieces[children[i] as usize].reach;
        let stump = (reach / (STUMP_IN_RADII * radius)).min(1.0);
        arms[i].radius / thickest - bend(&arms[i]) + stump
    };
    let best =
        (0..children.len()).max_by(|&a, &b| score(a).total_cmp(&score(b)).then(b.cmp(&a)))?;
    if pieces[children[best] as usize].thickness < SLIVER {
        return Some(children[best]);
    }
    let kept = arms[best].radius / before.radius.max(1e-12);
    let is_rival = |i: usize| i != best && arms[i].radius >= RIVAL * arms[best].radius;
    let leads = kept >= LEADER || !(0..arms.len()).any(is_rival);
    (leads && kept - bend(&arms[best]) >= END).then(|| children[best])
}

/// The branches that leave a piece of a chain by one of its children; none where that is a bump.
pub fn branches(pieces: &[Piece], piece: u32, child: u32) -> Vec<u32> {
    let here = &pieces[piece as usize];
    let mut out = Vec::new();
    let mut open = vec![child];
    while let Some(start) = open.pop() {
        let there = &pieces[start as usize];
        let short = there.reach <= SHORTEST_IN_RADII * here.radius.max(there.thickness);
        if short || there.thickness < SLIVER {
            continue;
        }
        match common_base(pieces, start, here.radius) {
            Some(end) => open.extend(pieces[end as usize].children.iter().rev()),
            None => out.push(start),
        }
    }
    out
}

/// The piece where two branches part that have no more than their foot in common; `radius` is
/// that of the wood that carries them.
fn common_base(pieces: &[Piece], start: u32, radius: f32) -> Option<u32> {
    let mut at = start;
    let mut gone = 0.0;
    loop {
        let piece = &pieces[at as usize];
        let long = |&&c: &&u32| {
            let child = &pieces[c as usize];
            child.reach > SHORTEST_IN_RADII * piece.radius.max(child.radius)
        };
        let arms: Vec<u32> = piece.children.iter().filter(long).copied().collect();
        match arms[..] {
            [] => return None,
            [on] => {
                gone += piece.position.distance(pieces[on as usize].position);
                let own = COMMON_BASE_IN_OWN_RADII * pieces[on as usize].radius;
                if gone > own.min(COMMON_BASE_IN_RADII * radius) {
                    return None;
                }
                at = on;
            }
            _ => return Some(at),
        }
    }
}
