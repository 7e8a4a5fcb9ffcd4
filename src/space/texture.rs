//! Reading textures: wrap modes, nearest texels, the alpha test that applies.

use std::sync::LazyLock;

use glam::Vec2;

use crate::botany::model::{AlphaMode, Image, Material, Wrap};

/// The alpha under which a material is a hole: its cutoff for MASK, 0.5 for BLEND (a blended leaf
/// is baked as a cut one), none (0) for OPAQUE.
pub fn cutoff(material: &Material) -> f32 {
    match material.alpha_mode {
        AlphaMode::Opaque => 0.0,
        AlphaMode::Mask => material.alpha_cutoff,
        AlphaMode::Blend => 0.5,
    }
}

/// The texel that holds `uv`, straight RGBA.
pub fn nearest(image: &Image, wrap: [Wrap; 2], uv: Vec2) -> [u8; 4] {
    let x = wrap_texel(uv.x, image.width, wrap[0]);
    let y = wrap_texel(uv.y, image.height, wrap[1]);
    let at = (y as usize * image.width as usize + x as usize) * 4;
    [
        image.rgba[at],
        image.rgba[at + 1],
        image.rgba[at + 2],
        image.rgba[at + 3],
    ]
}

fn wrap_texel(coordinate: f32, size: u32, wrap: Wrap) -> u32 {
    let turned = match wrap {
        Wrap::Repeat => coordinate - below(coordinate),
        Wrap::Mirror => {
            let t = (coordinate * 0.5 - below(coordinate * 0.5)) * 2.0;
            if t > 1.0 { 2.0 - t } else { t }
        }
        Wrap::Clamp => coordinate.clamp(0.0, 1.0),
    };
    ((turned * size as f32) as u32).min(size - 1)
}

/// `floor` is a call into the C library on plain x86-64; numbers of 2^23 and more are whole.
fn below(x: f32) -> f32 {
    if x.abs() < 8_388_608.0 {
        let whole = x as i32 as f32;
        whole - f32::from(u8::from(whole > x))
    } else {
        x
    }
}

/// sRGB byte to linear.
pub fn linear(byte: u8) -> f32 {
    static TABLE: LazyLock<[f32; 256]> =
        LazyLock::new(|| std::array::from_fn(|byte| decoded(byte as u8)));
    TABLE[usize::from(byte)]
}

fn decoded(byte: u8) -> f32 {
    let c = f32::from(byte) / 255.0;
    if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

/// Linear to sRGB byte.
pub fn srgb(c: f32) -> u8 {
    let c = c.clamp(0.0, 1.0);
    let s = if c <= 0.003_130_8 {
        c * 12.92
    } else {
        1.055 * c.powf(1.0 / 2.4) - 0.055
    };
    (s * 255.0 + 0.5) as u8
}
