//! Meshes of chains: rings of corners about the fitted centre lines.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec2, Vec3};

use super::curve::Shape;
use super::fit::Ring;
use super::path::Path;
use super::{ChainWood, Wood, bark};

/// Wood of one level, as one indexed triangle list.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WoodMesh {
    /// Positions, normalised units.
    pub positions: Vec<Vec3>,
    /// Unit normals.
    pub normals: Vec<Vec3>,
    /// Texture coordinates (of the set that the bark's base colour uses).
    pub uvs: Vec<Vec2>,
    /// Counter-clockwise triangles.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle, its index into the model's materials.
    pub triangle_material: Vec<u32>,
}

/// Corners of one ring: centre, unit vectors across, direction, radius of the corners.
struct Corners {
    center: DVec3,
    axes: [DVec3; 2],
    forward: DVec3,
    radius: f64,
}

/// How a turn of the golden section spreads the ribbons' faces over all directions.
const GOLDEN_TURN: f64 = 0.618_033_988_749_894_9;

/// Radii of the carrier by which a foot is moved at most.
const FARTHEST_FOOT: f64 = 1.5;

impl Wood<'_> {
    /// Appends a chain drawn as one of its options; `radius_scale` thickens it (1: the original's
    /// surface).
    pub fn build_tube(&self, chain: u32, option: usize, radius_scale: f32, out: &mut WoodMesh) {
        let foot = self.chains[chain as usize]
            .tube
            .as_ref()
            .map(|(path, _)| path.base);
        self.append(chain, option, radius_scale, foot, out);
    }

    /// All wood of a level: every chain as chosen (`None`: drawn elsewhere, on a card), what is
    /// left out made up for in the width of its neighbours, and the loose triangles.
    pub fn build(&self, chosen: &[Option<usize>], radius_scale: f32) -> WoodMesh {
        let mut mesh = WoodMesh::default();
        let widening = self.widening(chosen);
        for (chain, option) in chosen.iter().enumerate() {
            let Some(option) = *option else { continue };
            let scale = radius_scale * widening[chain];
            let foot = self.foot_on_drawn_carrier(chain, chosen);
            self.append(chain as u32, option, scale, foot, &mut mesh);
        }
        self.build_loose(&mut mesh);
        mesh
    }

    /// Where a chain starts so that no gap opens: the simplified carrier runs elsewhere than the
    /// original did.
    ///
    /// A foot moves only where the carrier still passes near it: on far levels carriers run many
    /// radii off, and twigs that follow them cost more silhouette (F1 .67 to .63 on an oak at 3 %)
    /// than gaps of a pixel.
    fn foot_on_drawn_carrier(&self, chain: usize, chosen: &[Option<usize>]) -> Option<DVec3> {
        let base = self.chains[chain].tube.as_ref()?.0.base;
        let drawn = self.tree.skeleton.chains[chain].parent.and_then(|carrier| {
            let options = &self.chains[carrier as usize].curve.options;
            chosen[carrier as usize].map(|option| &options[option].shape)
        });
        let Some(Shape::Tube { rings, .. }) = drawn else {
            return Some(base);
        };
        let on_segment = |pair: &[Ring]| {
            let along = pair[1].center - pair[0].center;
            let t = (base - pair[0].center).dot(along) / along.length_squared();
            let t = if t.is_finite() {
                t.clamp(0.0, 1.0)
            } else {
                0.0
            };
            let radius = pair[0].radius + t * (pair[1].radius - pair[0].radius);
            (pair[0].center + along * t, radius)
        };
        let nearest = rings.windows(2).map(on_segment).min_by(|a, b| {
            let distance = |p: &(DVec3, f64)| p.0.distance_squared(base);
            distance(a).total_cmp(&distance(b))
        });
        match nearest {
            // Half the radius lies inside whatever the number of sides: no deeper than that.
            Some((axis, radius)) => {
                let (distance, inside) = (axis.distance(base), 0.5 * radius);
                match (inside..FARTHEST_FOOT * radius).contains(&distance) {
                    true => Some(axis.lerp(base, inside / distance)),
                    false => Some(base),
                }
            }
            None => Some(base),
        }
    }

    fn append(
        &self,
        chain: u32,
        option: usize,
        scale: f32,
        foot: Option<DVec3>,
        out: &mut WoodMesh,
    ) {
        let wood = &self.chains[chain as usize];
        match (&wood.curve.options[option].shape, &wood.tube) {
            (
                Shape::Tube {
                    sides,
                    rings,
                    two_faces,
                },
                Some((path, bark)),
            ) => {
                let roll = match sides {
                    2 => f64::from(chain) * GOLDEN_TURN * PI,
                    _ => 0.0,
                };
                let zero = bark.seam + roll;
                let scale = surface_scale(path, rings, *sides, zero) * f64::from(scale);
                let mut corners = corners(path, rings, *sides, scale);
                corners[0].center = foot.unwrap_or(path.base);
                append_tube(wood, rings, &corners, *sides, zero, *two_faces, out);
            }
            (Shape::Absent, _) => {}
            _ => self.append_original(wood, scale, out),
        }
    }

    /// Appends the wood that hangs on no skeleton node, unchanged.
    pub fn build_loose(&self, out: &mut WoodMesh) {
        self.append_triangles(&self.loose, |_, p| p, out);
    }

    fn append_original(&self, wood: &ChainWood, radius_scale: f32, out: &mut WoodMesh) {
        let Some((path, _)) = wood.tube.as_ref().filter(|_| radius_scale != 1.0) else {
            return self.append_triangles(&wood.triangles, |_, p| p, out);
        };
        let widen = |triangle: u32, position: Vec3| {
            let slot = self.slots[self.tree.wood_node[triangle as usize] as usize] as usize;
            let axis = path.nearest(position.as_dvec3(), path.slot_to_point[slot] as usize);
            let out = position - axis.as_vec3();
            axis.as_vec3() + out * radius_scale
        };
        self.append_triangles(&wood.triangles, widen, out);
    }

    fn append_triangles(
        &self,
        triangles: &[u32],
        place: impl Fn(u32, Vec3) -> Vec3,
        out: &mut WoodMesh,
    ) {
        let model = &self.tree.model;
        let mut vertices: Vec<(u32, u32)> = triangles
            .iter()
            .flat_map(|&t| model.triangles[t as usize].map(|v| (v, t)))
            .collect();
        vertices.sort_unstable();
        vertices.dedup_by_key(|v| v.0);
        let first = out.positions.len() as u32;
        for &(vertex, triangle) in &vertices {
            let v = vertex as usize;
            let object = &model.objects[model.triangle_object[triangle as usize] as usize];
            let set = bark::uv_set(self.tree, object.material);
            out.positions.push(place(triangle, model.positions[v]));
            out.normals.push(model.normals[v]);
            let uv = model.uvs[set].get(v).copied();
            out.uvs.push(uv.unwrap_or_default());
        }
        for &t in triangles {
            let object = &model.objects[model.triangle_object[t as usize] as usize];
            let index = |v: u32| first + vertices.partition_point(|x| x.0 < v) as u32;
            out.triangles.push(model.triangles[t as usize].map(index));
            out.triangle_material.push(object.material);
        }
    }
}

/// Radius of the corners for a ring whose circle has the radius one: equal perimeter.
fn corner_radius(sides: u32) -> f64 {
    match sides {
        // A ribbon's two faces together are as wide as the circumference.
        2 => PI / 2.0,
        _ => PI / (f64::from(sides) * (PI / f64::from(sides)).sin()),
    }
}

fn corners(path: &Path, rings: &[Ring], sides: u32, scale: f64) -> Vec<Corners> {
    let direction = |i: usize| {
        (rings[i + 1].center - rings[i].center)
            .try_normalize()
            .unwrap_or_else(|| path.tangent(rings[i].knot as usize))
    };
    let last = rings.len() - 1;
    let frame = |(i, ring): (usize, &Ring)| {
        let sum = direction(i.saturating_sub(1)) + direction(i.min(last - 1));
        let forward = sum.try_normalize().unwrap_or_else(|| direction(0));
        let zero = path.across[ring.knot as usize];
        let zero = (zero - forward * zero.dot(forward))
            .try_normalize()
            .unwrap_or_else(|| forward.any_orthonormal_vector());
        Corners {
            center: ring.center,
            axes: [zero, forward.cross(zero)],
            forward,
            radius: ring.radius * corner_radius(sides) * scale,
        }
    };
    rings.iter().enumerate().map(frame).collect()
}

impl Corners {
    fn out(&self, angle: f64) -> DVec3 {
        self.axes[0] * angle.cos() + self.axes[1] * angle.sin()
    }

    fn at(&self, angle: f64) -> DVec3 {
        self.center + self.out(angle) * self.radius
    }
}

/// The scale of the radii that gives the drawn triangles the surface of the original ones:
/// chords are shorter than what they cut off, and mitres are narrower.
fn surface_scale(path: &Path, rings: &[Ring], sides: u32, zero: f64) -> f64 {
    let mut scale = 1.0;
    for _ in 0..3 {
        let drawn = drawn_surface(&corners(path, rings, sides, scale), sides, zero);
        scale *= (path.area / drawn).clamp(0.5, 2.0);
    }
    match scale.is_finite() {
        true => scale.clamp(0.25, 4.0),
        false => 1.0,
    }
}

fn drawn_surface(corners: &[Corners], sides: u32, zero: f64) -> f64 {
    let triangle = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - a).length() / 2.0;
    let step = TAU / f64::from(sides);
    let mut sum = 0.0;
    for pair in corners.windows(2) {
        for i in 0..sides {
            let (left, right) = (zero + f64::from(i) * step, zero + f64::from(i + 1) * step);
            let quad = [
                pair[0].at(left),
                pair[0].at(right),
                pair[1].at(right),
                pair[1].at(left),
            ];
            sum += triangle(quad[0], quad[1], quad[2]) + triangle(quad[0], quad[2], quad[3]);
        }
    }
    sum
}

fn append_tube(
    wood: &ChainWood,
    rings: &[Ring],
    corners: &[Corners],
    sides: u32,
    zero: f64,
    two_faces: bool,
    out: &mut WoodMesh,
) {
    let Some((path, bark)) = &wood.tube else {
        return;
    };
    let columns: u32 = if sides == 2 { 1 } else { sides };
    let first = out.positions.len() as u32;
    let before = out.triangles.len();
    for (j, (ring, corner)) in rings.iter().zip(corners).enumerate() {
        let point = corner.radius == 0.0;
        // A point has one vertex for each side, in the side's middle: each keeps its own bark.
        let (count, shift) = if point {
            (columns, 0.5)
        } else {
            (columns + 1, 0.0)
        };
        let slope = slope(corners, j);
        for i in 0..count {
            let fraction = (f64::from(i) + shift) / f64::from(sides);
            let angle = zero + TAU * fraction;
            let position = corner.at(angle).as_vec3();
            let side = match (sides, point) {
                // A ribbon is lit as a half round: its edges look outwards.
                (2, false) => corner.out(angle) + corner.out(zero + PI / 2.0),
                _ => corner.out(angle),
            };
            let normal = (side.normalize_or_zero() - corner.forward * slope).normalize_or_zero();
            out.positions.push(position);
            out.normals.push(normal.as_vec3());
            out.uvs.push(bark.uv(path, ring.knot, fraction, position));
        }
    }
    for j in 0..corners.len() as u32 - 1 {
        let low = first + j * (columns + 1);
        let high = low + columns + 1;
        let point = corners[j as usize + 1].radius == 0.0;
        for i in 0..columns {
            let (a, b, c) = (low + i, low + i + 1, high + i);
            out.triangles.push([a, b, c]);
            if !point {
                out.triangles.push([b, c + 1, c]);
            }
        }
    }
    if two_faces {
        append_back(first, before, out);
    }
    out.triangle_material
        .resize(out.triangles.len(), bark.material);
}

/// Change of the radius along the tube at a ring.
fn slope(corners: &[Corners], j: usize) -> f64 {
    let (a, b) = (
        &corners[j.saturating_sub(1)],
        &corners[(j + 1).min(corners.len() - 1)],
    );
    let length = a.center.distance(b.center);
    match length > 0.0 {
        true => ((b.radius - a.radius) / length).clamp(-1.0, 1.0),
        false => 0.0,
    }
}

/// Repeats the vertices and triangles from `first` and `before` on with the other face up.
fn append_back(first: u32, before: usize, out: &mut WoodMesh) {
    let (start, end) = (first as usize, out.positions.len());
    out.positions.extend_from_within(start..end);
    out.uvs.extend_from_within(start..end);
    for i in start..end {
        out.normals.push(-out.normals[i]);
    }
    let shift = (end - start) as u32;
    for t in before..out.triangles.len() {
        let [a, b, c] = out.triangles[t];
        out.triangles.push([a + shift, c + shift, b + shift]);
    }
}
