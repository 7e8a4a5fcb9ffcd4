//! Primitives: accessors become the triangles of one part in its own space.

use glam::{DVec3, Vec2, Vec3};

use super::accessor::Integers;
use super::buffer::{Asset, BROKEN};
use super::json::Primitive;
use super::material::{Materials, UvSource};
use super::scene::Placement;
use super::triangle::{self, face_normals, has_area, renumber};
use super::warning::Warnings;
use crate::Result;

/// The triangles of one primitive, in the mesh's space. All vertices are used by a triangle.
pub(super) struct Part {
    pub primitive: usize,
    pub material: u32,
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    /// One list for each slot that the material uses; empty where it doesn't.
    pub uvs: [Vec<Vec2>; 2],
    pub colors: Vec<[f32; 4]>,
    pub triangles: Vec<[u32; 3]>,
    /// The grid that the file's numbers lie on, along each axis, in the mesh's unit.
    pub step: DVec3,
}

/// Parts of each mesh; empty for meshes that no placement uses.
pub(super) type Parts = Vec<Vec<Part>>;

/// Reads every mesh that is placed, once.
pub(super) fn read_all(
    asset: &Asset,
    placements: &[Placement],
    materials: &Materials,
    warnings: &mut Warnings,
) -> Result<Parts> {
    let mut wanted = vec![false; asset.json.meshes.len()];
    placements.iter().for_each(|p| wanted[p.mesh] = true);
    let mut indices_left = asset.limits.triangles.saturating_mul(3);
    let mut out = Vec::with_capacity(wanted.len());
    for (m, mesh) in asset.json.meshes.iter().enumerate() {
        let mut parts = Vec::new();
        if wanted[m] {
            let name = mesh.name.as_deref().map(|n| format!(" ({n})"));
            for (p, primitive) in mesh.primitives.iter().enumerate() {
                let place = format!("mesh {m}{}, primitive {p}", name.as_deref().unwrap_or(""));
                let reader = Reader {
                    asset,
                    primitive,
                    place,
                };
                parts.extend(reader.read(p, materials, &mut indices_left, warnings)?);
            }
        }
        out.push(parts);
    }
    Ok(out)
}

struct Reader<'a> {
    asset: &'a Asset<'a>,
    primitive: &'a Primitive,
    place: String,
}

impl Reader<'_> {
    /// `None` where the primitive is no surface.
    fn read(
        &self,
        index: usize,
        materials: &Materials,
        indices_left: &mut usize,
        warnings: &mut Warnings,
    ) -> Result<Option<Part>> {
        let mode = self.primitive.mode.unwrap_or(4);
        if mode < 4 {
            let what = "a primitive of lines or points is skipped; only triangles are baked: convert curves to meshes before the export";
            warnings.say(what, &self.place);
            return Ok(None);
        }
        self.check_readable(warnings)?;
        let Some(&position) = self.primitive.attributes.get("POSITION") else {
            warnings.say("a primitive without POSITION is skipped", &self.place);
            return Ok(None);
        };
        let vertex_count = self.asset.count(position, &self.at("POSITION"))?;

        // 1. Triangles, by the file's vertex numbers.
        let flat = self.flat_indices(position, vertex_count, indices_left)?;
        let mut triangles = self.triangles(mode, &flat, warnings)?;
        drop(flat);

        // 2. Only vertices in use are read: primitives often share one large buffer.
        let used = renumber(&mut triangles);
        let place = self.at("POSITION");
        let positions = self
            .asset
            .floats(position, &used, Integers::AsSaid, &place)?;
        let positions: Vec<Vec3> = positions.into_iter().map(Vec3::from_array).collect();

        // 3. Triangles without an area, then the vertices that only they used.
        let before = triangles.len();
        triangles.retain(|&t| has_area(t, &positions));
        let dropped = (before - triangles.len()) as u64;
        warnings.count(DEGENERATE, dropped, &self.place);
        let kept = renumber(&mut triangles);
        let used: Vec<u32> = kept.iter().map(|&k| used[k as usize]).collect();
        let positions: Vec<Vec3> = kept.iter().map(|&k| positions[k as usize]).collect();
        let step = self.asset.step(position, &positions, &place)?;

        // 4. The other attributes.
        let normals = self.normals(&used, &positions, &triangles, warnings)?;
        let uvs = self.uvs(
            &used,
            materials.uv_sources(self.primitive.material),
            warnings,
        )?;
        let colors = self.colors(&used)?;
        Ok(Some(Part {
            primitive: index,
            material: materials.index(self.primitive.material),
            positions,
            normals,
            uvs,
            colors,
            triangles,
            step,
        }))
    }

    fn at(&self, attribute: &str) -> String {
        format!("{}, {attribute}", self.place)
    }

    fn check_readable(&self, warnings: &mut Warnings) -> Result<()> {
        let draco = self.primitive.extensions.draco.is_some();
        let position = self.primitive.attributes.get("POSITION");
        let accessor = position.and_then(|&a| self.asset.json.accessors.get(a));
        if draco && accessor.is_none_or(|a| a.buffer_view.is_none()) {
            return Err(self.asset.fault(
                &self.place,
                "the geometry is compressed with Draco, which pleach does not read",
                "decompress it (gltf-transform copy in.glb out.glb), or export without Draco; meshopt compression is read",
            ));
        }
        if !self.primitive.targets.is_empty() {
            let what = "morph targets are ignored: the mesh is read in its base shape";
            warnings.say(what, &self.place);
        }
        Ok(())
    }

    /// The primitive's indices, checked; counted against the limit before they are read.
    fn flat_indices(
        &self,
        position: usize,
        vertex_count: usize,
        indices_left: &mut usize,
    ) -> Result<Vec<u32>> {
        let accessor = self.primitive.indices;
        let count = match accessor {
            None => vertex_count,
            Some(a) => self.asset.count(a, &self.at("indices"))?,
        };
        if count > *indices_left || vertex_count > u32::MAX as usize {
            let most = self.asset.limits.triangles;
            let what = format!("the file has more than the limit of {most} triangles");
            return Err(self.asset.fault(
                &self.place,
                what,
                "split the scene: one tree a file; or raise triangles in the recipe's limits",
            ));
        }
        *indices_left -= count;
        let Some(accessor) = accessor else {
            return Ok((0..vertex_count as u32).collect());
        };
        let place = self.at("indices");
        let flat = self.asset.indices(accessor, &place)?;
        if let Some(i) = flat.iter().position(|&v| v as usize >= vertex_count) {
            return Err(self.asset.fault(
                format!("{place}, accessor {accessor}, index {i}"),
                format!("it names vertex {} of {vertex_count}", flat[i]),
                BROKEN,
            ));
        }
        self.check_wrap(accessor, position, vertex_count)?;
        Ok(flat)
    }

    /// 16-bit indices reach 65,536 vertices. Where a primitive has more, and nobody else reaches
    /// them, the exporter (EZ-Tree 1.1 does) has cut the upper bits off and the triangles are noise.
    fn check_wrap(&self, accessor: usize, position: usize, vertex_count: usize) -> Result<()> {
        let bits = match self.asset.accessor(accessor, &self.place)?.component_type {
            5121 => 8,
            5123 => 16,
            _ => return Ok(()),
        };
        if vertex_count <= 1 << bits {
            return Ok(());
        }
        let reaches = |p: &Primitive| {
            let indices = p.indices.and_then(|i| self.asset.json.accessors.get(i));
            p.attributes.get("POSITION") == Some(&position)
                && indices.is_none_or(|a| a.component_type == 5125)
        };
        let mut primitives = self.asset.json.meshes.iter().flat_map(|m| &m.primitives);
        if primitives.any(reaches) {
            return Ok(());
        }
        Err(self.asset.fault(
            self.at("indices"),
            format!("{vertex_count} vertices with indices of {bits} bits: the indices have wrapped and the triangles are noise"),
            "export with 32-bit indices, or fewer branches and leaves (EZ-Tree: below 65,536 vertices for each of branches and leaves)",
        ))
    }

    /// Lists, strips and fans become a list; triangles that repeat a vertex are left out.
    fn triangles(&self, mode: u32, flat: &[u32], warnings: &mut Warnings) -> Result<Vec<[u32; 3]>> {
        let Some(all) = triangle::list(mode, flat) else {
            let what = format!("the primitive mode is {mode}");
            return Err(self.asset.fault(&self.place, what, BROKEN));
        };
        if mode == 4 && !flat.len().is_multiple_of(3) {
            let what = "the last indices of a primitive make no whole triangle and are ignored";
            warnings.say(what, &self.place);
        }
        let before = all.len();
        let distinct = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        let kept: Vec<_> = all.into_iter().filter(distinct).collect();
        // In a strip, repeated vertices are how it is joined, not a fault.
        if mode == 4 {
            warnings.count(DEGENERATE, (before - kept.len()) as u64, &self.place);
        }
        Ok(kept)
    }

    fn normals(
        &self,
        used: &[u32],
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        warnings: &mut Warnings,
    ) -> Result<Vec<Vec3>> {
        let Some(&accessor) = self.primitive.attributes.get("NORMAL") else {
            return Ok(face_normals(positions, triangles));
        };
        let place = self.at("NORMAL");
        let read = self
            .asset
            .floats::<3>(accessor, used, Integers::Normalized, &place)?;
        let mut normals: Vec<Vec3> = read
            .into_iter()
            .map(|n| Vec3::from_array(n).as_dvec3().normalize_or_zero().as_vec3())
            .collect();
        let missing = normals.iter().filter(|n| **n == Vec3::ZERO).count();
        if missing > 0 {
            let what = "a normal of length zero is replaced by that of its faces";
            warnings.count(what, missing as u64, &place);
            let faces = face_normals(positions, triangles);
            for (normal, face) in normals.iter_mut().zip(faces) {
                if *normal == Vec3::ZERO {
                    *normal = face;
                }
            }
        }
        Ok(normals)
    }

    fn uvs(
        &self,
        used: &[u32],
        sources: &[UvSource],
        warnings: &mut Warnings,
    ) -> Result<[Vec<Vec2>; 2]> {
        let mut out = [Vec::new(), Vec::new()];
        for (slot, source) in out.iter_mut().zip(sources) {
            let name = format!("TEXCOORD_{}", source.set);
            let Some(&accessor) = self.primitive.attributes.get(&name) else {
                if source.textured {
                    let what = "a textured primitive has no texture coordinates; its texture is read at (0, 0)";
                    warnings.say(what, &self.at(&name));
                }
                continue;
            };
            let place = self.at(&name);
            let read = self
                .asset
                .floats::<2>(accessor, used, Integers::AsSaid, &place)?;
            let moved: Vec<Vec2> = read.into_iter().map(|uv| source.apply(uv)).collect();
            if let Some(i) = moved.iter().position(|uv| !uv.is_finite()) {
                let place = format!("{place}, accessor {accessor}, index {}", used[i]);
                let what = "its KHR_texture_transform leads out of the numbers";
                return Err(self.asset.fault(place, what, BROKEN));
            }
            *slot = moved;
        }
        Ok(out)
    }

    fn colors(&self, used: &[u32]) -> Result<Vec<[f32; 4]>> {
        let Some(&accessor) = self.primitive.attributes.get("COLOR_0") else {
            return Ok(Vec::new());
        };
        let place = self.at("COLOR_0");
        if self.asset.components(accessor, &place)? == 3 {
            let rgb = self
                .asset
                .floats::<3>(accessor, used, Integers::Normalized, &place)?;
            return Ok(rgb.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect());
        }
        self.asset
            .floats::<4>(accessor, used, Integers::Normalized, &place)
    }
}

/// What is said of triangles without an area.
pub(super) const DEGENERATE: &str = "a triangle without an area is dropped";
