//! A shaded picture and its bytes.

use glam::Vec3;

use super::srgb::srgb_from_linear;

/// Pixels of a shaded drawing, rows from the top.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Share of the pixel that is covered, 0 to 1.
    pub coverage: Vec<f32>,
    /// Mean linear colour of what covers the pixel (not multiplied by coverage).
    pub color: Vec<[f32; 3]>,
    /// Mean normal in model space, unit length, zero where nothing is.
    pub normal: Vec<Vec3>,
    /// Nearness of the nearest sample; see [`Items::near`](super::Items::near).
    pub near: Vec<f32>,
}

impl Picture {
    /// sRGB RGBA over a background (sRGB), blended as light.
    pub fn over(&self, background: [u8; 3]) -> Vec<u8> {
        let ground = background.map(|b| super::linear_from_srgb(b as f32 / 255.0));
        let mut bytes = Vec::with_capacity(self.coverage.len() * 4);
        for (color, &cover) in self.color.iter().zip(&self.coverage) {
            for channel in 0..3 {
                let light = color[channel] * cover + ground[channel] * (1.0 - cover);
                bytes.push((srgb_from_linear(light.min(1.0)) * 255.0 + 0.5) as u8);
            }
            bytes.push(255);
        }
        bytes
    }
}
