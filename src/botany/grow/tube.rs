//! Bark as tubes: each stem a tube of its own whose base lies inside its parent.

use glam::{Vec2, Vec3};

use super::mesh::Mesh;
use super::rng::sin_cos;
use super::species::Species;
use super::stem::{Stem, across};

/// A cross-section: centre, the two axes across, radius, and how far along the stem it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring {
    pub center: Vec3,
    pub axes: [Vec3; 2],
    pub radius: f32,
    pub along: f32,
    /// Cosine-free slope of the surface: change of radius over change of length.
    pub slope: f32,
}

/// The shape of a stem's surface: sides, lobes and bark tiles around it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    pub sides: u32,
    lobes: (u32, f32),
    tiles: f32,
    tile_length: f32,
}

impl Surface {
    /// How a stem of a species looks.
    pub fn new(species: &Species, stem: &Stem) -> Self {
        let sides = species.levels[stem.level].sides;
        let around = 2.0 * std::f32::consts::PI * stem.radii[stem.radii.len() / 3];
        let tiles = (around / species.bark.tile).round().max(1.0);
        Self {
            sides,
            lobes: if stem.level == 0 {
                species.lobes
            } else {
                (0, 0.0)
            },
            tiles,
            // One tile is as long as it is wide.
            tile_length: (around / tiles).max(1e-4),
        }
    }

    /// Point and normal at `side` of a ring.
    pub fn point(&self, ring: &Ring, side: u32) -> (Vec3, Vec3) {
        let angle = 360.0 * (side % self.sides) as f32 / self.sides as f32;
        let (sin, cos) = sin_cos(angle);
        let out = ring.axes[0] * cos + ring.axes[1] * sin;
        let lobe = 1.0 + self.lobes.1 * sin_cos(self.lobes.0 as f32 * angle).0;
        let forward = ring.axes[0].cross(ring.axes[1]);
        let normal = (out - forward * ring.slope).normalize();
        (ring.center + out * (ring.radius * lobe), normal)
    }

    /// Texture coordinates at `side` of a ring.
    pub fn uv(&self, ring: &Ring, side: u32) -> Vec2 {
        Vec2::new(
            self.tiles * side as f32 / self.sides as f32,
            -ring.along / self.tile_length,
        )
    }

    /// Adds a ring's vertices; the first is repeated at the seam.
    pub fn add_ring(&self, mesh: &mut Mesh, ring: &Ring) -> u32 {
        let first = mesh.positions.len() as u32;
        for side in 0..=self.sides {
            let (position, normal) = self.point(ring, side);
            mesh.vertex(position, normal, self.uv(ring, side));
        }
        first
    }

    /// Closes the tip with a fan over a ring that begins at vertex `first`.
    pub fn add_tip(&self, mesh: &mut Mesh, ring: &Ring, first: u32) {
        let forward = ring.axes[0].cross(ring.axes[1]);
        let uv = self.uv(ring, self.sides / 2) - Vec2::new(0.0, ring.radius / self.tile_length);
        let apex = mesh.vertex(ring.center + forward * ring.radius, forward, uv);
        for side in 0..self.sides {
            mesh.triangles.push([first + side, first + side + 1, apex]);
        }
    }
}

/// The rings of a stem at its points; axes are carried along without twist. The first axis looks
/// towards `seam`.
pub(super) fn rings(stem: &Stem, seam: Option<Vec3>) -> Vec<Ring> {
    let n = stem.points.len();
    let tangent = |i: usize| {
        let (a, b) = (
            stem.points[i.saturating_sub(1)],
            stem.points[(i + 1).min(n - 1)],
        );
        (b - a).normalize_or(Vec3::Y)
    };
    let towards = |seam: Vec3| {
        let away = seam - stem.points[0];
        (away - tangent(0) * away.dot(tangent(0))).try_normalize()
    };
    let mut u = seam.and_then(towards).unwrap_or(across(tangent(0)));
    (0..n)
        .map(|i| {
            let t = tangent(i);
            u = (u - t * u.dot(t)).normalize_or(across(t));
            let (a, b) = (i.saturating_sub(1), (i + 1).min(n - 1));
            let slope = (stem.radii[b] - stem.radii[a]) / (stem.along[b] - stem.along[a]).max(1e-6);
            Ring {
                center: stem.points[i],
                axes: [u, t.cross(u)],
                radius: stem.radii[i],
                along: stem.along[i],
                slope,
            }
        })
        .collect()
}

/// The ring at a distance from the stem's base.
pub(super) fn ring_at(rings: &[Ring], along: f32) -> Ring {
    let i = rings.partition_point(|r| r.along <= along);
    let (a, b) = match (rings.get(i.wrapping_sub(1)), rings.get(i)) {
        (Some(a), Some(b)) => (a, b),
        (Some(a), None) => return *a,
        _ => return rings[0],
    };
    let t = (along - a.along) / (b.along - a.along).max(1e-9);
    let [ta, tb] = [a, b].map(|r| r.axes[0].cross(r.axes[1]));
    let forward = ta.lerp(tb, t).normalize_or(ta);
    let u = a.axes[0].lerp(b.axes[0], t);
    let u = (u - forward * u.dot(forward)).normalize_or(a.axes[0]);
    Ring {
        center: a.center.lerp(b.center, t),
        axes: [u, forward.cross(u)],
        radius: a.radius + (b.radius - a.radius) * t,
        along,
        slope: a.slope + (b.slope - a.slope) * t,
    }
}

/// A stem as a tube, open where it is embedded, closed at the tip.
pub(super) fn tube(species: &Species, stem: &Stem) -> Mesh {
    let surface = Surface::new(species, stem);
    let mut mesh = Mesh::default();
    let rings = rings(stem, None);
    let mut below: Option<u32> = None;
    for ring in &rings {
        let first = surface.add_ring(&mut mesh, ring);
        if let Some(below) = below {
            for side in 0..surface.sides {
                let (a, b) = (below + side, first + side);
                mesh.quad([a, a + 1, b + 1, b]);
            }
        }
        below = Some(first);
    }
    if let (Some(ring), Some(first)) = (rings.last(), below) {
        surface.add_tip(&mut mesh, ring, first);
    }
    mesh
}
