//! sRGB and linear light.

use std::sync::LazyLock;

/// Linear light of an sRGB byte.
static DECODE: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0)));

/// Linear light of all sRGB bytes: who looks up several asks once.
#[inline]
pub(super) fn lights() -> &'static [f32; 256] {
    &DECODE
}

/// Linear light (0 to 1) of an sRGB value (0 to 1), IEC 61966-2-1.
pub fn linear_from_srgb(value: f32) -> f32 {
    if value <= 0.040_45 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

/// sRGB value (0 to 1) of linear light (0 to 1).
pub fn srgb_from_linear(value: f32) -> f32 {
    if value <= 0.003_130_8 {
        value * 12.92
    } else {
        1.055 * value.powf(1.0 / 2.4) - 0.055
    }
}
