//! Materials as glTF says them: what is as the specification presumes is left out.

use serde_json::{Value, json};

use super::{FileBuilder, find_or_push};
use crate::botany::model::{AlphaMode, Material, TextureRef, Wrap};

impl FileBuilder<'_> {
    fn texture(&mut self, texture: TextureRef, images: &[usize]) -> Value {
        let wrap = texture.wrap.map(|w| match w {
            Wrap::Repeat => 10497,
            Wrap::Mirror => 33648,
            Wrap::Clamp => 33071,
        });
        let mag = if texture.linear { 9729 } else { 9728 };
        let sampler =
            json!({ "magFilter": mag, "minFilter": 9987, "wrapS": wrap[0], "wrapT": wrap[1] });
        let sampler = find_or_push(&mut self.samplers, sampler);
        let entry = json!({ "sampler": sampler, "source": images[texture.image as usize] });
        let mut info = json!({ "index": find_or_push(&mut self.textures, entry) });
        if texture.uv_set > 0 {
            info["texCoord"] = json!(texture.uv_set);
        }
        info
    }

    pub(super) fn material(&mut self, m: &Material, images: &[usize]) -> Value {
        let mut pbr = json!({});
        if m.base_color_factor != [1.0; 4] {
            pbr["baseColorFactor"] = json!(m.base_color_factor);
        }
        if m.metallic_factor != 1.0 {
            pbr["metallicFactor"] = json!(m.metallic_factor);
        }
        if m.roughness_factor != 1.0 {
            pbr["roughnessFactor"] = json!(m.roughness_factor);
        }
        if let Some(t) = m.base_color {
            pbr["baseColorTexture"] = self.texture(t, images);
        }
        if let Some(t) = m.metallic_roughness {
            pbr["metallicRoughnessTexture"] = self.texture(t, images);
        }
        let mut out = json!({});
        if !m.name.is_empty() {
            out["name"] = json!(m.name);
        }
        out["pbrMetallicRoughness"] = pbr;
        if let Some(t) = m.normal {
            let mut info = self.texture(t, images);
            if m.normal_scale != 1.0 {
                info["scale"] = json!(m.normal_scale);
            }
            out["normalTexture"] = info;
        }
        if let Some(t) = m.occlusion {
            let mut info = self.texture(t, images);
            if m.occlusion_strength != 1.0 {
                info["strength"] = json!(m.occlusion_strength);
            }
            out["occlusionTexture"] = info;
        }
        if let Some(t) = m.emissive {
            out["emissiveTexture"] = self.texture(t, images);
        }
        if m.emissive_factor != [0.0; 3] {
            out["emissiveFactor"] = json!(m.emissive_factor);
        }
        match m.alpha_mode {
            AlphaMode::Opaque => {}
            AlphaMode::Mask => {
                out["alphaMode"] = json!("MASK");
                if m.alpha_cutoff != 0.5 {
                    out["alphaCutoff"] = json!(m.alpha_cutoff);
                }
            }
            AlphaMode::Blend => out["alphaMode"] = json!("BLEND"),
        }
        if m.double_sided {
            out["doubleSided"] = json!(true);
        }
        if m.unlit {
            self.unlit = true;
            out["extensions"] = json!({ "KHR_materials_unlit": {} });
        }
        out
    }
}
