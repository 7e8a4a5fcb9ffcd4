//! Materials in use, and which texture coordinates each of their textures reads.

use glam::{DVec2, Vec2};

use super::buffer::{Asset, BROKEN};
use super::image::{self, Support};
use super::json::{self, TextureInfo};
use super::scene::Placement;
use super::warning::Warnings;
use crate::Result;
use crate::botany::model::{AlphaMode, Material, TextureRef, Wrap};

/// Texture coordinates of one slot of the model: a set of the file, transformed.
#[derive(Clone, PartialEq)]
pub(super) struct UvSource {
    /// Number in TEXCOORD_n.
    pub set: usize,
    /// Whether a texture reads it.
    pub textured: bool,
    offset: DVec2,
    rotation: f64,
    scale: DVec2,
}

impl UvSource {
    /// The set as it is in the file.
    fn plain(set: usize, textured: bool) -> Self {
        let (offset, scale) = (DVec2::ZERO, DVec2::ONE);
        Self {
            set,
            textured,
            offset,
            rotation: 0.0,
            scale,
        }
    }

    fn of(info: &TextureInfo) -> Self {
        let Some(t) = &info.extensions.transform else {
            return Self::plain(info.tex_coord, true);
        };
        Self {
            set: t.tex_coord.unwrap_or(info.tex_coord),
            textured: true,
            offset: t.offset.unwrap_or([0.0; 2]).into(),
            rotation: t.rotation.unwrap_or(0.0),
            scale: t.scale.unwrap_or([1.0; 2]).into(),
        }
    }

    /// KHR_texture_transform: scaled, turned counter-clockwise as seen (v points down), moved.
    ///
    /// The matrix printed in the extension turns the other way; its text, its example (the lower
    /// left quadrant) and all viewers agree on this one.
    pub fn apply(&self, uv: [f32; 2]) -> Vec2 {
        if self.offset == DVec2::ZERO && self.scale == DVec2::ONE && self.rotation == 0.0 {
            return uv.into();
        }
        let p = DVec2::from_array(uv.map(f64::from)) * self.scale;
        let (sin, cos) = self.rotation.sin_cos();
        let turned = DVec2::new(cos * p.x + sin * p.y, -sin * p.x + cos * p.y);
        (turned + self.offset).as_vec2()
    }
}

/// The materials that placed primitives use, in the file's order.
pub(super) struct Materials {
    pub list: Vec<Material>,
    /// The file's images in use; [`TextureRef::image`] counts in this list.
    pub images: Vec<usize>,
    uv: Vec<Vec<UvSource>>,
    /// New index by the file's; the last entry is the default material.
    renumbered: Vec<u32>,
}

impl Materials {
    /// Reads the materials of all primitives that are placed.
    pub fn new(asset: &Asset, placements: &[Placement], warnings: &mut Warnings) -> Result<Self> {
        let json = asset.json;
        let used = used(asset, placements)?;
        let mut out = Self {
            list: Vec::new(),
            images: Vec::new(),
            uv: Vec::new(),
            renumbered: vec![0; used.len()],
        };
        let default = json::Material::default();
        let mut image_slots = vec![u32::MAX; json.images.len()];
        for (i, _) in used.iter().enumerate().filter(|(_, used)| **used) {
            out.renumbered[i] = out.list.len() as u32;
            let source = json.materials.get(i).unwrap_or(&default);
            let mut reader = Reader {
                asset,
                warnings,
                images: &mut out.images,
                image_slots: &mut image_slots,
                uv: Vec::new(),
                place: place(i, source),
            };
            let material = reader.read(source)?;
            let mut uv = reader.uv;
            if uv.is_empty() {
                uv.push(UvSource::plain(0, false));
            }
            out.uv.push(uv);
            out.list.push(material);
        }
        Ok(out)
    }

    /// Index into the list, for a primitive's `material`.
    pub fn index(&self, material: Option<usize>) -> u32 {
        self.renumbered[material.unwrap_or(self.renumbered.len() - 1)]
    }

    /// What fills the slots of texture coordinates: one or two entries.
    pub fn uv_sources(&self, material: Option<usize>) -> &[UvSource] {
        &self.uv[self.index(material) as usize]
    }
}

/// Which of the file's materials placed primitives name; the last entry is the default material.
fn used(asset: &Asset, placements: &[Placement]) -> Result<Vec<bool>> {
    let default = asset.json.materials.len();
    let mut used = vec![false; default + 1];
    let mut mesh_done = vec![false; asset.json.meshes.len()];
    for placement in placements {
        if std::mem::replace(&mut mesh_done[placement.mesh], true) {
            continue;
        }
        let mesh = &asset.json.meshes[placement.mesh];
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            if let Some(index) = primitive.material.filter(|&m| m >= default) {
                let place = format!("mesh {}, primitive {p}", placement.mesh);
                let what = format!("there is no material {index}");
                return Err(asset.fault(place, what, BROKEN));
            }
            used[primitive.material.unwrap_or(default)] = true;
        }
    }
    if !used.contains(&true) {
        used[default] = true;
    }
    Ok(used)
}

fn place(index: usize, material: &json::Material) -> String {
    match &material.name {
        Some(name) => format!("material {index} ({name})"),
        None => format!("material {index}"),
    }
}

struct Reader<'a, 'b> {
    asset: &'a Asset<'b>,
    warnings: &'a mut Warnings,
    images: &'a mut Vec<usize>,
    /// Place in `images` by the file's index; `u32::MAX` where it is not in use.
    image_slots: &'a mut [u32],
    uv: Vec<UvSource>,
    place: String,
}

impl Reader<'_, '_> {
    fn read(&mut self, source: &json::Material) -> Result<Material> {
        let pbr = &source.pbr_metallic_roughness;
        let mut material = Material {
            name: source.name.clone().unwrap_or_default(),
            base_color_factor: pbr.base_color_factor.unwrap_or([1.0; 4]),
            metallic_factor: pbr.metallic_factor.unwrap_or(1.0),
            roughness_factor: pbr.roughness_factor.unwrap_or(1.0),
            emissive_factor: source.emissive_factor.unwrap_or([0.0; 3]),
            alpha_mode: match source.alpha_mode.as_deref() {
                None | Some("OPAQUE") => AlphaMode::Opaque,
                Some("MASK") => AlphaMode::Mask,
                Some("BLEND") => AlphaMode::Blend,
                Some(_) => {
                    self.warnings
                        .say("an unknown alphaMode is read as OPAQUE", &self.place);
                    AlphaMode::Opaque
                }
            },
            alpha_cutoff: source.alpha_cutoff.unwrap_or(0.5),
            double_sided: source.double_sided,
            unlit: source.extensions.unlit.is_some(),
            ..Material::default()
        };
        let mut base = pbr.base_color_texture.as_deref();
        if let (Some(sg), None) = (&source.extensions.specular_glossiness, base) {
            let what =
                "KHR_materials_pbrSpecularGlossiness is read as its diffuse colour and roughness";
            self.warnings.say(what, &self.place);
            base = sg.diffuse_texture.as_deref();
            material.base_color_factor = sg.diffuse_factor.unwrap_or([1.0; 4]);
            material.metallic_factor = 0.0;
            material.roughness_factor = 1.0 - sg.glossiness_factor.unwrap_or(1.0);
        }
        // The order decides who gets a slot of texture coordinates: colour first.
        material.base_color = self.texture(base, "baseColorTexture")?;
        material.normal = self.texture(source.normal_texture.as_deref(), "normalTexture")?;
        let metallic = pbr.metallic_roughness_texture.as_deref();
        material.metallic_roughness = self.texture(metallic, "metallicRoughnessTexture")?;
        material.occlusion =
            self.texture(source.occlusion_texture.as_deref(), "occlusionTexture")?;
        material.emissive = self.texture(source.emissive_texture.as_deref(), "emissiveTexture")?;
        let normal = source.normal_texture.as_deref();
        material.normal_scale = normal.and_then(|t| t.scale).unwrap_or(1.0);
        let occlusion = source.occlusion_texture.as_deref();
        material.occlusion_strength = occlusion.and_then(|t| t.strength).unwrap_or(1.0);
        self.clamp(&mut material)?;
        Ok(material)
    }

    /// Factors lie in 0..1 by the specification; numbers too large for f32 became infinite.
    fn clamp(&mut self, m: &mut Material) -> Result<()> {
        let free = [m.normal_scale, m.alpha_cutoff];
        if free.iter().any(|x| !x.is_finite()) {
            let what = "a number is too large";
            return Err(self.asset.fault(&self.place, what, BROKEN));
        }
        let mut outside = m.alpha_cutoff < 0.0;
        m.alpha_cutoff = m.alpha_cutoff.max(0.0);
        let mut unit = |x: &mut f32| {
            outside |= !(0.0..=1.0).contains(x);
            *x = if x.is_nan() { 1.0 } else { x.clamp(0.0, 1.0) };
        };
        m.base_color_factor.iter_mut().for_each(&mut unit);
        m.emissive_factor.iter_mut().for_each(&mut unit);
        for x in [
            &mut m.metallic_factor,
            &mut m.roughness_factor,
            &mut m.occlusion_strength,
        ] {
            unit(x);
        }
        if outside {
            let what = "a material's factor outside 0..1 is clamped";
            self.warnings.say(what, &self.place);
        }
        Ok(())
    }

    fn texture(&mut self, info: Option<&TextureInfo>, slot: &str) -> Result<Option<TextureRef>> {
        let Some(info) = info else {
            return Ok(None);
        };
        let place = format!("{}, {slot}", self.place);
        let Some(texture) = self.asset.json.textures.get(info.index) else {
            let what = format!("there is no texture {}", info.index);
            return Err(self.asset.fault(place, what, BROKEN));
        };
        let image = match image::choose(self.asset, texture, &place)? {
            Support::Read(image) => image,
            Support::Unreadable(what) if slot == "baseColorTexture" => {
                let help = "convert the textures to PNG, JPEG or WebP (gltf-transform png in.glb out.glb) and try again";
                return Err(self.asset.fault(place, what, help));
            }
            Support::Unreadable(what) => {
                self.warnings.say(
                    &format!(
                        "a texture is left out: {what}; convert it to PNG, JPEG or WebP to keep it"
                    ),
                    &place,
                );
                return Ok(None);
            }
        };
        let Some(uv_set) = self.slot(UvSource::of(info)) else {
            let what = "a texture with a third mapping is left out: pleach carries two sets of texture coordinates a material";
            self.warnings.say(what, &place);
            return Ok(None);
        };
        let sampler = match texture.sampler {
            None => &json::Sampler::default(),
            Some(s) => self.asset.json.samplers.get(s).ok_or_else(|| {
                self.asset
                    .fault(place, format!("there is no sampler {s}"), BROKEN)
            })?,
        };
        let slot = &mut self.image_slots[image];
        if *slot == u32::MAX {
            *slot = self.images.len() as u32;
            self.images.push(image);
        }
        Ok(Some(TextureRef {
            image: *slot,
            uv_set,
            wrap: [wrap(sampler.wrap_s), wrap(sampler.wrap_t)],
            linear: sampler.mag_filter != Some(9728),
        }))
    }

    fn slot(&mut self, source: UvSource) -> Option<u8> {
        if let Some(i) = self.uv.iter().position(|s| *s == source) {
            return Some(i as u8);
        }
        if self.uv.len() == 2 {
            return None;
        }
        self.uv.push(source);
        Some(self.uv.len() as u8 - 1)
    }
}

fn wrap(mode: Option<u32>) -> Wrap {
    match mode {
        Some(33071) => Wrap::Clamp,
        Some(33648) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}
