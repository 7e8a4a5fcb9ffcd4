//! What a level draws, ready to be written: surfaces of one material each, from a model's own
//! triangles or from simplified wood.

use std::collections::BTreeMap;
use std::ops::Range;

use glam::{Vec2, Vec3};

use crate::botany::model::{Image, Material, Model, TextureRef};
use crate::detail::wood::WoodMesh;

/// A mesh with one material.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// "foliage", "wood", or what the source called it.
    pub name: String,
    /// Normalised positions.
    pub positions: Vec<Vec3>,
    /// Unit normals.
    pub normals: Vec<Vec3>,
    /// Tangents with handedness; empty or one each vertex.
    pub tangents: Vec<[f32; 4]>,
    /// Two sets of texture coordinates; each empty or one each vertex.
    pub uvs: [Vec<Vec2>; 2],
    /// Linear vertex colours; empty or one each vertex.
    pub colors: Vec<[f32; 4]>,
    /// Counter-clockwise triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Index into the scene's materials.
    pub material: u32,
}

impl Surface {
    /// Bytes that it takes in a file, at most: tangents are made for it there where a normal map needs them.
    pub fn bytes(&self) -> usize {
        let [first, second] = &self.uvs;
        size_of_val(&self.positions[..])
            + size_of_val(&self.normals[..])
            + self.positions.len() * size_of::<[f32; 4]>()
            + size_of_val(&first[..])
            + size_of_val(&second[..])
            + size_of_val(&self.colors[..])
            + size_of_val(&self.triangles[..])
    }
}

/// All that one file shows.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Meshes; one draw call each.
    pub surfaces: Vec<Surface>,
    /// Materials that surfaces refer to.
    pub materials: Vec<Material>,
    /// Images that materials refer to.
    pub images: Vec<Image>,
}

impl Scene {
    /// For each image whether it holds colours (sRGB) and not normals or other numbers.
    pub fn colored_images(&self) -> Vec<bool> {
        let mut out = vec![false; self.images.len()];
        let colors = self.materials.iter().map(|m| [m.base_color, m.emissive]);
        for texture in colors.flatten().flatten() {
            out[texture.image as usize] = true;
        }
        out
    }

    /// Number of triangles.
    pub fn triangles(&self) -> u64 {
        self.surfaces.iter().map(|s| s.triangles.len() as u64).sum()
    }
}

/// The chosen triangles of a model as surfaces, one for each material, with only the images used.
pub fn scene_of_model(model: &Model, triangles: impl Iterator<Item = u32>) -> Scene {
    let mut assembly = Assembly::new(model, model.positions.len());
    assembly.triangles(triangles);
    assembly.finish()
}

/// What [`scene_of_model`] gives for all triangles, without its surfaces: materials and images.
pub fn materials_of_model(model: &Model) -> Scene {
    let mut seen = vec![false; model.materials.len()];
    let first_of_material = |&t: &u32| {
        let object = &model.objects[model.triangle_object[t as usize] as usize];
        !std::mem::replace(&mut seen[object.material as usize], true)
    };
    let all = 0..model.triangles.len() as u32;
    let mut scene = scene_of_model(model, all.filter(first_of_material));
    scene.surfaces.clear();
    scene
}

/// As [`scene_of_model`], for several groups of triangles: which surfaces each has become.
pub fn scene_of_groups<'t>(
    model: &Model,
    groups: impl Iterator<Item = &'t [u32]>,
) -> (Scene, Vec<Range<usize>>) {
    let mut assembly = Assembly::new(model, model.positions.len());
    let surfaces = groups
        .map(|group| {
            let before = assembly.scene.surfaces.len();
            assembly.triangles(group.iter().copied());
            before..assembly.scene.surfaces.len()
        })
        .collect();
    (assembly.finish(), surfaces)
}
/// Simplified wood as surfaces, one for each material of the model that it uses.
pub fn scene_of_wood(model: &Model, mesh: &WoodMesh) -> Scene {
    let mut assembly = Assembly::new(model, mesh.positions.len());
    let materials = mesh.triangle_material.iter().copied();
    for (material, triangles) in by_material(materials.zip(0..)) {
        let mut copy = assembly.material(material);
        // Thin twigs are ribbons of one sheet.
        copy.double_sided = true;
        for texture in textures_of(&mut copy).into_iter().flatten() {
            // Tubes carry the one set of coordinates that the base colour uses.
            texture.uv_set = 0;
        }
        let corners = triangles.iter().map(|&t| mesh.triangles[t as usize]);
        assembly.surface("wood".into(), copy, corners, |surface, at| {
            surface.positions.push(mesh.positions[at]);
            surface.normals.push(mesh.normals[at]);
            surface.uvs[0].push(mesh.uvs[at]);
        });
    }
    assembly.finish()
}

/// The textures of a material, to renumber them.
pub fn textures_of(m: &mut Material) -> [Option<&mut TextureRef>; 5] {
    [
        m.base_color.as_mut(),
        m.metallic_roughness.as_mut(),
        m.normal.as_mut(),
        m.occlusion.as_mut(),
        m.emissive.as_mut(),
    ]
}

/// Triangles sorted by material, in their order.
fn by_material(triangles: impl Iterator<Item = (u32, u32)>) -> BTreeMap<u32, Vec<u32>> {
    let mut out: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (material, triangle) in triangles {
        out.entry(material).or_default().push(triangle);
    }
    out
}

/// Collects surfaces with their materials and images, each numbered as it is first used.
struct Assembly<'a> {
    model: &'a Model,
    scene: Scene,
    /// New number of each of the model's images that is used.
    images: BTreeMap<u32, u32>,
    /// New number of each vertex in the surface at hand; one buffer for all surfaces, because a
    /// file may have thousands of materials.
    renumbered: Vec<u32>,
}

impl<'a> Assembly<'a> {
    fn new(model: &'a Model, vertices: usize) -> Self {
        Self {
            model,
            scene: Scene::default(),
            images: BTreeMap::new(),
            renumbered: vec![u32::MAX; vertices],
        }
    }

    /// A copy of the model's material that refers to the scene's images.
    fn material(&mut self, material: u32) -> Material {
        let mut copy = self.model.materials[material as usize].clone();
        for texture in textures_of(&mut copy).into_iter().flatten() {
            let next = self.images.len() as u32;
            let number = *self.images.entry(texture.image).or_insert(next);
            if number == next {
                let image = &self.model.images[texture.image as usize];
                self.scene.images.push(image.clone());
            }
            texture.image = number;
        }
        copy
    }

    /// Adds a surface for each material of some of the model's triangles.
    fn triangles(&mut self, triangles: impl Iterator<Item = u32>) {
        let model = self.model;
        let material = |t: u32| model.objects[model.triangle_object[t as usize] as usize].material;
        for (material, triangles) in by_material(triangles.map(|t| (material(t), t))) {
            let copy = self.material(material);
            let name = copy.name.clone();
            let corners = triangles.iter().map(|&t| model.triangles[t as usize]);
            self.surface(name, copy, corners, |surface, at| {
                surface.positions.push(model.positions[at]);
                surface.normals.push(model.normals[at]);
                for set in 0..2 {
                    surface.uvs[set].extend(model.uvs[set].get(at));
                }
                surface.colors.extend(model.colors.get(at));
            });
        }
    }

    /// Adds a surface; `push` appends one vertex of the source to it.
    fn surface(
        &mut self,
        name: String,
        material: Material,
        triangles: impl Iterator<Item = [u32; 3]> + Clone,
        push: impl Fn(&mut Surface, usize),
    ) {
        let mut surface = Surface {
            name,
            material: self.scene.materials.len() as u32,
            ..Surface::default()
        };
        for corners in triangles.clone() {
            let corners = corners.map(|i| {
                if self.renumbered[i as usize] == u32::MAX {
                    self.renumbered[i as usize] = surface.positions.len() as u32;
                    push(&mut surface, i as usize);
                }
                self.renumbered[i as usize]
            });
            surface.triangles.push(corners);
        }
        for i in triangles.flatten() {
            self.renumbered[i as usize] = u32::MAX;
        }
        self.scene.materials.push(material);
        self.scene.surfaces.push(surface);
    }

    fn finish(self) -> Scene {
        self.scene
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::botany::model::Object;

    /// Two triangles that share two vertices and have materials and images of their own.
    fn two_materials() -> Model {
        let material = |image| Material {
            base_color: Some(TextureRef {
                image,
                uv_set: 0,
                wrap: Default::default(),
                linear: true,
            }),
            ..Material::default()
        };
        let image = |name: &str| Image {
            name: name.into(),
            ..Image::default()
        };
        let object = |material| Object {
            material,
            ..Object::default()
        };
        Model {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            normals: vec![Vec3::Z; 4],
            uvs: [vec![Vec2::ZERO; 4], Vec::new()],
            triangles: vec![[0, 1, 2], [1, 3, 2]],
            triangle_object: vec![0, 1],
            objects: vec![object(1), object(0)],
            materials: vec![material(1), material(0)],
            images: vec![image("first"), image("second")],
            ..Model::default()
        }
    }

    #[test]
    fn materials_alone_are_those_of_all_surfaces() {
        let mut model = two_materials();
        model.triangles.extend([[0, 3, 1], [2, 1, 3]]);
        model.triangle_object.extend([1, 0]);
        let (all, alone) = (scene_of_model(&model, 0..4), materials_of_model(&model));
        assert_eq!(alone.materials, all.materials);
        assert_eq!(alone.images, all.images);
        assert_eq!((alone.surfaces.len(), alone.materials.len()), (0, 2));
    }

    #[test]
    fn surfaces_have_their_own_vertices_and_images() {
        let model = two_materials();
        let scene = scene_of_model(&model, 0..2);
        assert_eq!(scene.triangles(), 2);
        for (surface, t) in scene.surfaces.iter().zip([1, 0]) {
            assert_eq!(surface.triangles, [[0, 1, 2]]);
            assert_eq!(surface.positions, model.corners(t));
            assert_eq!(surface.bytes(), 3 * (12 + 12 + 16 + 8) + 12);
            let material = &scene.materials[surface.material as usize];
            let image = material.base_color.map(|b| b.image).unwrap_or(u32::MAX);
            let name = &scene.images[image as usize].name;
            assert_eq!(name, if t == 0 { "first" } else { "second" });
        }
    }

    #[test]
    fn images_that_nothing_uses_stay_behind() {
        let scene = scene_of_model(&two_materials(), 1..2);
        assert_eq!((scene.images.len(), scene.materials.len()), (1, 1));
        assert_eq!(scene.images[0].name, "second");
    }
}
