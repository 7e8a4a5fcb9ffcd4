//! The polygons of a tree as they were read: one indexed triangle list in normalised space.

use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3};

/// The least height that sizes on the screen are stated by, normalised units: a picture of a carpet
/// at a height of 512 pixels would be as wide as its width is over its height.
const FLATTEST: f32 = 0.5;

/// A polygonal model in normalised space: centre at the origin, bounding-sphere radius one, y up.
///
/// The loader has already resolved or rejected every trouble of the file: all indices are in
/// range, all numbers are finite, no triangle is degenerate, normals have length one.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// The file's stem: "oak" for oak.glb.
    pub name: String,
    /// Where normalised space lies in the world.
    pub frame: Frame,
    /// Vertex positions in normalised space.
    pub positions: Vec<Vec3>,
    /// Vertex normals, unit length; as many as positions (made from faces where the file has none).
    pub normals: Vec<Vec3>,
    /// Texture coordinates by set; set 0 is as long as `positions` (zeros where the file has
    /// none), set 1 is empty or as long. KHR_texture_transform is already applied.
    pub uvs: [Vec<Vec2>; 2],
    /// Vertex colours, linear RGBA; empty or as many as positions.
    pub colors: Vec<[f32; 4]>,
    /// Counter-clockwise triangles.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle, the object that it came from.
    pub triangle_object: Vec<u32>,
    /// Mesh primitives placed by nodes (one for each node, primitive and instance).
    pub objects: Vec<Object>,
    /// Materials; never empty.
    pub materials: Vec<Material>,
    /// Decoded images.
    pub images: Vec<Image>,
    /// Trouble that was repaired or ignored, counted, each kind said once.
    pub warnings: Vec<String>,
    /// How far apart neighbouring positions of the file are where its numbers are coarsest, in world units: what
    /// f32 far from a mesh's origin, or integers, had lost before `pleach` read them.
    pub position_step: f64,
    /// Bytes of the file and its external buffers and images.
    pub file_bytes: u64,
}

/// The similarity between normalised space and the file's world: `world = center + radius * p`.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Frame {
    /// Centre of the bounding sphere, in world units (metres by the glTF specification).
    pub center: DVec3,
    /// Radius of the bounding sphere, in world units.
    pub radius: f64,
}

impl Default for Frame {
    fn default() -> Self {
        Self {
            center: DVec3::ZERO,
            radius: 1.0,
        }
    }
}

/// One primitive of one mesh, placed by one node or instance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Object {
    /// Name of the node, or of the mesh where the node has none; may be empty.
    pub name: String,
    /// Index of the mesh in the file.
    pub mesh: u32,
    /// Which of its node's instances (EXT_mesh_gpu_instancing) it is; 0 where the node has none.
    pub instance: u32,
    /// Index of the primitive in the mesh.
    pub primitive: u32,
    /// Index into [`Model::materials`].
    pub material: u32,
}

/// A metallic-roughness material with the textures that `pleach` carries through.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file; may be empty.
    pub name: String,
    /// Linear RGBA factor.
    pub base_color_factor: [f32; 4],
    /// sRGB colour with straight alpha.
    pub base_color: Option<TextureRef>,
    /// Metalness factor, 0 to 1.
    pub metallic_factor: f32,
    /// Roughness factor, 0 to 1.
    pub roughness_factor: f32,
    /// Linear; green is roughness, blue is metalness.
    pub metallic_roughness: Option<TextureRef>,
    /// Tangent-space normals.
    pub normal: Option<TextureRef>,
    /// Scale of the normal's x and y.
    pub normal_scale: f32,
    /// Linear; red is ambient occlusion.
    pub occlusion: Option<TextureRef>,
    /// Strength of the occlusion, 0 to 1.
    pub occlusion_strength: f32,
    /// Linear RGB factor.
    pub emissive_factor: [f32; 3],
    /// sRGB emission.
    pub emissive: Option<TextureRef>,
    /// What the file says of alpha (unreliable: see `organ`).
    pub alpha_mode: AlphaMode,
    /// Alpha below this is a hole (MASK); 0.5 where the file is silent.
    pub alpha_cutoff: f32,
    /// Whether back faces are drawn.
    pub double_sided: bool,
    /// KHR_materials_unlit.
    pub unlit: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color_factor: [1.0; 4],
            base_color: None,
            metallic_factor: 1.0,
            roughness_factor: 1.0,
            metallic_roughness: None,
            normal: None,
            normal_scale: 1.0,
            occlusion: None,
            occlusion_strength: 1.0,
            emissive_factor: [0.0; 3],
            emissive: None,
            alpha_mode: AlphaMode::Opaque,
            alpha_cutoff: 0.5,
            double_sided: false,
            unlit: false,
        }
    }
}

/// glTF's alphaMode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Alpha is tested against the cutoff.
    Mask,
    /// Alpha is blended.
    Blend,
}

/// A texture: an image, how it wraps, and which set of coordinates addresses it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureRef {
    /// Index into [`Model::images`].
    pub image: u32,
    /// Index into [`Model::uvs`].
    pub uv_set: u8,
    /// What happens outside 0..1 along u and v.
    pub wrap: [Wrap; 2],
    /// False: the sampler asks for NEAREST magnification.
    pub linear: bool,
}

/// A sampler's wrap mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Tiles, every second one mirrored.
    Mirror,
    /// The edge texel goes on.
    Clamp,
}

/// A decoded image.
#[derive(Clone, PartialEq, Eq, Default)]
pub struct Image {
    /// Name in the file; may be empty.
    pub name: String,
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// Straight (not premultiplied) RGBA, 4 bytes a texel, rows from the top; copies of an image
    /// share them.
    pub rgba: Arc<Vec<u8>>,
}

impl std::fmt::Debug for Image {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Image({} {}x{})", self.name, self.width, self.height)
    }
}

impl Model {
    /// The material of a triangle.
    pub fn material_of(&self, triangle: u32) -> &Material {
        let object = self.triangle_object[triangle as usize];
        &self.materials[self.objects[object as usize].material as usize]
    }

    /// The corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|i| self.positions[i as usize])
    }

    /// Keeps the triangles that `keep` says yes to; their vertices all stay.
    pub fn retain_triangles(&mut self, keep: impl Fn(u32) -> bool) {
        let mut numbers = 0..;
        self.triangles.retain(|_| numbers.next().is_some_and(&keep));
        let mut numbers = 0..;
        self.triangle_object
            .retain(|_| numbers.next().is_some_and(&keep));
    }

    /// Whether no light falls on it: all materials show their base colour as it is.
    pub fn is_unlit(&self) -> bool {
        !self.materials.is_empty() && self.materials.iter().all(|m| m.unlit)
    }

    /// Makes it one on which no light falls: what only light shows is forgotten.
    pub fn unlight(&mut self) {
        for material in &mut self.materials {
            *material = Material {
                metallic_roughness: None,
                normal: None,
                occlusion: None,
                emissive_factor: [0.0; 3],
                emissive: None,
                unlit: true,
                ..material.clone()
            };
        }
        let mut numbers = vec![None; self.images.len()];
        let mut kept = Vec::new();
        for texture in self
            .materials
            .iter_mut()
            .filter_map(|m| m.base_color.as_mut())
        {
            let old = texture.image as usize;
            texture.image = *numbers[old].get_or_insert_with(|| {
                kept.push(self.images[old].clone());
                kept.len() as u32 - 1
            });
        }
        self.images = kept;
    }

    /// Height of the tree (extent along y) in normalised units; a quarter of the diameter for what
    /// is flatter than that, such as leaves on the ground: sizes on the screen are stated by it.
    pub fn height(&self) -> f32 {
        let (mut low, mut high) = (f32::MAX, f32::MIN);
        for triangle in &self.triangles {
            for &i in triangle {
                let y = self.positions[i as usize].y;
                (low, high) = (low.min(y), high.max(y));
            }
        }
        (high - low).max(FLATTEST)
    }
}
