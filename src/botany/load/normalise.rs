//! Placed parts become one model in normalised space.
//!
//! World positions are computed in f64 and never stored: the bounds are a first pass over them,
//! the model the second, so a tree 10^7 m from the origin loses nothing that the file still had.

use glam::{DMat3, DMat4, DVec3, Vec2, Vec3};

use super::buffer::Asset;
use super::primitive::{DEGENERATE, Part, Parts};
use super::scene::Placement;
use super::warning::Warnings;
use crate::Result;
use crate::botany::model::{Frame, Model, Object};

/// Doubled area (radius one) below which a triangle has none: products of steps of the f32 grid.
const LEAST_AREA: f64 = 1e-15;

/// Least radius in world units; below it, divisions by it leave the numbers.
const LEAST_RADIUS: f64 = 1e-60;

/// Share of the radius from which a file's grid shows: a seventh of a pixel where a tree is 512 pixels high.
const COARSE: f64 = 1.0 / 2048.0;

/// Builds the model, without materials and images.
pub(super) fn assemble(
    asset: &Asset,
    placements: Vec<Placement>,
    mut parts: Parts,
    warnings: &mut Warnings,
) -> Result<Model> {
    let totals = totals(asset, &placements, &parts)?;
    let mut model = Model {
        frame: frame(asset, &placements, &parts)?,
        ..Model::default()
    };
    model.position_step = step(&placements, &parts);
    if model.position_step > COARSE * model.frame.radius {
        let what = format!(
            "positions are stored to {:.1e} of the tree's radius only: the shape between is lost; in the tool that \
             wrote the file, move the tree to the origin of its mesh (the node may be anywhere)",
            model.position_step / model.frame.radius
        );
        warnings.say(&what, "");
    }
    totals.reserve(&mut model);
    // A mesh is freed after its last placement, so that a tree without instances is in memory
    // once, not twice.
    let mut last = vec![usize::MAX; parts.len()];
    for (i, placement) in placements.iter().enumerate() {
        last[placement.mesh] = i;
    }
    for (i, placement) in placements.iter().enumerate() {
        for part in &parts[placement.mesh] {
            let dropped = append(&mut model, placement, part, &totals);
            warnings.count(DEGENERATE, dropped, &placement.name);
        }
        if last[placement.mesh] == i {
            parts[placement.mesh] = Vec::new();
        }
    }
    if model.triangles.is_empty() {
        return Err(nothing(asset));
    }
    Ok(model)
}

fn nothing(asset: &Asset) -> crate::Error {
    asset.fault(
        "scene",
        "it shows no triangles",
        "check that the tree is a mesh (not a curve) and in the exported scene",
    )
}

/// Sizes of the model before it is built.
#[derive(Default)]
struct Totals {
    triangles: usize,
    vertices: usize,
    colored: bool,
    second_uv: bool,
}

impl Totals {
    fn reserve(&self, model: &mut Model) {
        let vertices = self.vertices;
        model.positions.reserve_exact(vertices);
        model.normals.reserve_exact(vertices);
        model.uvs[0].reserve_exact(vertices);
        model.uvs[1].reserve_exact(if self.second_uv { vertices } else { 0 });
        model
            .colors
            .reserve_exact(if self.colored { vertices } else { 0 });
        model.triangles.reserve_exact(self.triangles);
        model.triangle_object.reserve_exact(self.triangles);
    }
}

fn totals(asset: &Asset, placements: &[Placement], parts: &Parts) -> Result<Totals> {
    let mut totals = Totals::default();
    for part in placements.iter().flat_map(|p| &parts[p.mesh]) {
        totals.triangles = totals.triangles.saturating_add(part.triangles.len());
        totals.vertices = totals.vertices.saturating_add(part.positions.len());
        totals.colored |= !part.colors.is_empty();
        totals.second_uv |= !part.uvs[1].is_empty();
        let most = asset.limits.triangles;
        if totals.triangles > most || totals.vertices > u32::MAX as usize {
            let what = format!("the scene has more than the limit of {most} triangles");
            return Err(asset.fault(
                "scene",
                what,
                "split the scene: one tree a file; or raise triangles in the recipe's limits",
            ));
        }
    }
    Ok(totals)
}

/// Centre of the bounding box, and the largest distance from it.
fn frame(asset: &Asset, placements: &[Placement], parts: &Parts) -> Result<Frame> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for_each_point(placements, parts, |p| {
        (low, high) = (low.min(p), high.max(p));
    });
    if low.x > high.x {
        return Err(nothing(asset));
    }
    let center = low + 0.5 * (high - low);
    // What is not a number passes by min and max unseen.
    let (mut radius, mut finite) = (0.0f64, true);
    for_each_point(placements, parts, |p| {
        radius = radius.max((p - center).length());
        finite &= p.is_finite();
    });
    finite &= center.is_finite() && radius.is_finite();
    if !finite || radius < LEAST_RADIUS {
        let what = format!("the tree reaches from {low} to {high}");
        return Err(asset.fault("scene", what, "apply transforms before the export"));
    }
    Ok(Frame { center, radius })
}

/// The coarsest grid that positions of the file lie on, in the world: the diagonal of its cells.
fn step(placements: &[Placement], parts: &Parts) -> f64 {
    let steps = placements.iter().flat_map(|placement| {
        let turn = DMat3::from_mat4(placement.world_from_mesh);
        let axes = [turn.x_axis, turn.y_axis, turn.z_axis].map(DVec3::length);
        let along = DVec3::from_array(axes);
        parts[placement.mesh]
            .iter()
            .map(move |part| (part.step * along).length())
    });
    steps.fold(0.0, f64::max)
}

fn for_each_point(placements: &[Placement], parts: &Parts, mut act: impl FnMut(DVec3)) {
    for placement in placements {
        let matrix = placement.world_from_mesh;
        // An object scaled to nothing (a hidden one) is nowhere.
        let axes = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
        if axes.iter().all(|a| a.truncate() == DVec3::ZERO) {
            continue;
        }
        for p in parts[placement.mesh]
            .iter()
            .flat_map(|part| &part.positions)
        {
            act(matrix.transform_point3(p.as_dvec3()));
        }
    }
}

/// Adds one placed part; returns how many triangles lost their area.
fn append(model: &mut Model, placement: &Placement, part: &Part, totals: &Totals) -> u64 {
    let Frame { center, radius } = model.frame;
    let base = model.positions.len() as u32;
    let matrix = placement.world_from_mesh;
    let place = |p: &Vec3| ((matrix.transform_point3(p.as_dvec3()) - center) / radius).as_vec3();
    model.positions.extend(part.positions.iter().map(place));

    // Triangles; a mirror turns them round (glTF 2.0, section 3.7.4).
    let mirrored = matrix.determinant() < 0.0;
    let object = model.objects.len() as u32;
    let before = model.triangles.len();
    for &[a, b, c] in &part.triangles {
        let t = if mirrored { [a, c, b] } else { [a, b, c] }.map(|i| base + i);
        let [a, b, c] = t.map(|i| model.positions[i as usize].as_dvec3());
        if (b - a).cross(c - a).length() > LEAST_AREA {
            model.triangles.push(t);
        }
    }
    let kept = model.triangles.len() - before;
    if kept == 0 {
        model.positions.truncate(base as usize);
        return part.triangles.len() as u64;
    }
    model.triangle_object.resize(model.triangles.len(), object);
    model.objects.push(Object {
        name: placement.name.to_string(),
        mesh: placement.mesh as u32,
        instance: placement.instance,
        primitive: part.primitive as u32,
        material: part.material,
    });

    let turn = normal_matrix(matrix);
    let normal = |n: &Vec3| {
        (turn * n.as_dvec3())
            .try_normalize()
            .map_or(*n, |n| n.as_vec3())
    };
    model.normals.extend(part.normals.iter().map(normal));
    let total = model.positions.len();
    for (slot, list) in model.uvs.iter_mut().enumerate() {
        if slot == 0 || totals.second_uv {
            list.extend_from_slice(&part.uvs[slot]);
            list.resize(total, Vec2::ZERO);
        }
    }
    if totals.colored {
        model.colors.extend_from_slice(&part.colors);
        model.colors.resize(total, [1.0; 4]);
    }
    (part.triangles.len() - kept) as u64
}

/// Inverse transpose up to scale: the cofactors, which a flattened matrix has too.
fn normal_matrix(matrix: DMat4) -> DMat3 {
    let m = DMat3::from_mat4(matrix);
    // Scaled first: cofactors of tiny matrices would underflow.
    let largest = m.to_cols_array().iter().fold(0.0f64, |a, x| a.max(x.abs()));
    let m = if largest > 0.0 {
        m * (1.0 / largest)
    } else {
        m
    };
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if m.determinant() < 0.0 {
        cofactors * -1.0
    } else {
        cofactors
    }
}
