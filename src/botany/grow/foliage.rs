//! Hangs leaves on stems: one prototype, placed many times, so that leaves are congruent.

use glam::{Vec2, Vec3};

use super::mesh::Mesh;
use super::outline::{Sprig, edges};
use super::rng::{Rng, rotate};
use super::species::{LeafKind, Outline, Species};
use super::stem::{Stem, across};
use super::{Foliage, TrueLeaf};

/// A leaf: the prototype, mirrored or not, scaled, turned and moved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    pub chain: u32,
    /// Where it is attached, metres.
    pub origin: Vec3,
    /// Unit vectors: across, from stalk to tip, out of the face.
    pub axes: [Vec3; 3],
    /// Length of the leaf, metres.
    pub scale: f32,
    /// Left and right swapped.
    pub mirrored: bool,
}

impl Placement {
    /// From the prototype's space to the world.
    pub fn map(&self, p: Vec3) -> Vec3 {
        let x = if self.mirrored { -p.x } else { p.x };
        self.origin + (self.axes[0] * x + self.axes[1] * p.y + self.axes[2] * p.z) * self.scale
    }

    fn turn(&self, n: Vec3) -> Vec3 {
        let x = if self.mirrored { -n.x } else { n.x };
        self.axes[0] * x + self.axes[1] * n.y + self.axes[2] * n.z
    }

    /// A copy of the prototype in the world. Normals lean from the leaf's face towards
    /// `outwards` by `round`, as modellers do to give a crown soft light.
    pub fn place(&self, prototype: &Mesh, mesh: &mut Mesh, outwards: Vec3, round: f32) {
        let base = mesh.positions.len() as u32;
        for i in 0..prototype.positions.len() {
            let normal = self.turn(prototype.normals[i]);
            mesh.vertex(
                self.map(prototype.positions[i]),
                normal.lerp(outwards, round).normalize_or(normal),
                prototype.uvs[i],
            );
        }
        for &[a, b, c] in &prototype.triangles {
            let [a, b, c] = [a, b, c].map(|i| i + base);
            mesh.triangles
                .push(if self.mirrored { [a, c, b] } else { [a, b, c] });
        }
    }
}

/// The truth of a leaf.
pub(super) fn truth(prototype: &Mesh, placement: &Placement) -> TrueLeaf {
    let (mut sum, mut total) = (glam::DVec3::ZERO, 0.0);
    for triangle in &prototype.triangles {
        let [a, b, c] = triangle.map(|i| prototype.positions[i as usize].as_dvec3());
        let area = (b - a).cross(c - a).length();
        sum += (a + b + c) * (area / 3.0);
        total += area;
    }
    TrueLeaf {
        chain: placement.chain,
        center: placement.map((sum / total).as_vec3()).to_array(),
    }
}

/// The geometry of one leaf of length one.
pub(super) fn prototype(sprig: &Sprig, foliage: Foliage) -> Mesh {
    let mut mesh = Mesh::default();
    match foliage {
        Foliage::Quads => card(&mut mesh, sprig, Vec3::X),
        Foliage::Crossed => {
            card(&mut mesh, sprig, Vec3::X);
            card(&mut mesh, sprig, Vec3::Z);
        }
        Foliage::Polygons => polygons(&mut mesh, sprig),
    }
    mesh
}

fn uv(sprig: &Sprig, p: Vec2) -> Vec2 {
    let q = (p - sprig.low) / (sprig.high - sprig.low);
    Vec2::new(q.x, 1.0 - q.y)
}

fn card(mesh: &mut Mesh, sprig: &Sprig, side: Vec3) {
    let (low, high) = (sprig.low, sprig.high);
    let normal = side.cross(Vec3::Y);
    let corners = [
        low,
        Vec2::new(high.x, low.y),
        high,
        Vec2::new(low.x, high.y),
    ];
    let corner = corners.map(|p| mesh.vertex(side * p.x + Vec3::Y * p.y, normal, uv(sprig, p)));
    mesh.quad(corner);
}

/// Leaf-shaped polygons without need of alpha, joined by the stalk into one piece.
fn polygons(mesh: &mut Mesh, sprig: &Sprig) {
    let samples: &[f32] = match sprig.outline {
        Outline::Lobed => &[0.09, 0.2, 0.31, 0.42, 0.53, 0.64, 0.75, 0.87],
        Outline::Ovate => &[0.12, 0.3, 0.5, 0.75],
        Outline::Lance | Outline::Blade => &[0.15, 0.45, 0.75],
        Outline::Needle => &[0.5],
    };
    let flat = |mesh: &mut Mesh, p: Vec2| mesh.vertex(p.extend(0.0), Vec3::Z, uv(sprig, p));
    let mut foot: Option<u32> = (sprig.stalk > 0.0).then(|| flat(mesh, Vec2::ZERO));
    for leaf in &sprig.leaves {
        let base = flat(mesh, leaf.base);
        if let Some(below) = foot.replace(base) {
            // A sliver of stalk: without it each leaf would be a piece of its own.
            let beside = leaf.base + Vec2::new(0.012, 0.0);
            let beside = flat(mesh, beside);
            mesh.triangles.push([below, beside, base]);
        }
        let mut last: Option<[u32; 2]> = None;
        for &t in samples {
            let [r, l] = edges(sprig.outline, t).map(|p| flat(mesh, leaf.map(p)));
            match last {
                None => mesh.triangles.push([base, r, l]),
                Some([r0, l0]) => mesh.quad([l0, r0, r, l]),
            }
            last = Some([r, l]);
        }
        let tip = flat(mesh, leaf.base + leaf.axis);
        if let Some([r, l]) = last {
            mesh.triangles.push([l, r, tip]);
        }
    }
}

/// Hangs `count` leaves on the leafy parts of the stems, evenly along their common length.
pub(super) fn hang(
    species: &Species,
    kind: &LeafKind,
    stems: &[Stem],
    count: u32,
    size: f32,
) -> Vec<Placement> {
    let leafy = |stem: &Stem| {
        let from = species.levels[stem.level].leaves_from * stem.length;
        let (start, end) = stem.extent();
        (start.max(from), end)
    };
    let total: f64 = stems
        .iter()
        .map(leafy)
        .map(|(a, b)| f64::from((b - a).max(0.0)))
        .sum();
    let center = crown_center(stems);
    let mut leaves = Vec::with_capacity(count as usize);
    let (mut passed, mut hung) = (0.0f64, 0u32);
    for (chain, stem) in stems.iter().enumerate() {
        let (low, high) = leafy(stem);
        if high <= low {
            continue;
        }
        passed += f64::from(high - low);
        let due = (f64::from(count) * passed / total).round() as u32;
        let own = due - hung;
        hung = due;
        let mut rng = Rng::new(stem.seed, 3);
        let mut azimuth = 360.0 * rng.unit() * f32::from(kind.rotate.0 < 179.0);
        for i in 0..own {
            azimuth += rng.vary(kind.rotate);
            let jitter = 0.4 * rng.sway();
            // The last leaf ends the twig.
            let last = i + 1 == own && high >= stem.length * 0.99;
            let share = if last {
                1.0
            } else {
                (i as f32 + 0.5 + jitter) / own as f32
            };
            let along = low + (high - low) * share;
            let tilt = if last { 0.15 } else { 1.0 } * rng.vary(kind.angle);
            let at = Hold {
                along,
                tilt,
                azimuth,
                center,
            };
            leaves.push(hold(kind, stem, chain as u32, &at, size, &mut rng));
        }
    }
    leaves
}

/// Where and at which angles a leaf leaves its stem.
struct Hold {
    along: f32,
    tilt: f32,
    azimuth: f32,
    center: Vec3,
}

fn hold(
    kind: &LeafKind,
    stem: &Stem,
    chain: u32,
    at: &Hold,
    size: f32,
    rng: &mut Rng,
) -> Placement {
    let (position, direction, radius) = stem.at(at.along);
    let lean = rotate(across(direction), direction, at.azimuth);
    let mut tip = rotate(direction, direction.cross(lean), at.tilt);
    tip = rotate(tip, across(tip), -kind.droop * tip.cross(Vec3::Y).length());
    let outwards = (position - at.center).normalize_or(Vec3::Y);
    let target =
        (outwards * 0.6 + Vec3::Y * 0.8) * kind.facing + rng.vector() * (1.0 - 0.6 * kind.facing);
    let face = (target - tip * target.dot(tip)).normalize_or(across(tip));
    Placement {
        chain,
        origin: position + lean * (0.7 * radius),
        axes: [tip.cross(face), tip, face],
        scale: (size * rng.vary(kind.length)).max(1e-4),
        mirrored: rng.bits() & 1 == 1,
    }
}

/// Middle of the wood, a little below: seen from there, leaves face the sky.
pub(super) fn crown_center(stems: &[Stem]) -> Vec3 {
    let points = || stems.iter().flat_map(|s| s.points.iter());
    let sum: glam::DVec3 = points().map(|p| p.as_dvec3()).sum();
    let mean = (sum / points().count().max(1) as f64).as_vec3();
    let top = points().fold(0.0f32, |a, p| a.max(p.y));
    Vec3::new(mean.x, mean.y - 0.15 * top, mean.z)
}
