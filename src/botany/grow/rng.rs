//! Random quantities and transcendental functions that are the same on every machine.
//!
//! Sines and powers use only +, -, *, /, which IEEE 754 fixes to the
//! last bit; the standard library's call the platform's libm, which it does not.

use std::f64::consts::{FRAC_PI_2, LN_2, SQRT_2};

use glam::Vec3;

pub(super) use crate::space::random::Rng;

/// A value and how far it varies to either side.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Vary(pub f32, pub f32);

impl Rng {
    /// The value, varied.
    pub fn vary(&mut self, value: Vary) -> f32 {
        value.0 + value.1 * self.sway()
    }

    /// A vector in the cube from -1 to 1.
    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.sway(), self.sway(), self.sway())
    }
}

/// Sine and cosine of an angle in degrees: reduction to a quarter turn, then Taylor's series
/// (error below 1e-12 there).
pub(super) fn sin_cos(degrees: f32) -> (f32, f32) {
    let x = f64::from(degrees).to_radians();
    let quarter = (x / FRAC_PI_2).round();
    let r = x - quarter * FRAC_PI_2;
    let rr = r * r;
    let (mut sin, mut cos) = (0.0, 0.0);
    for k in (1..=8).rev() {
        let n = f64::from(2 * k);
        sin = -rr / (n * (n + 1.0)) * (1.0 + sin);
        cos = -rr / (n * (n - 1.0)) * (1.0 + cos);
    }
    let (sin, cos) = (r * (1.0 + sin), 1.0 + cos);
    let (sin, cos) = match (quarter as i64).rem_euclid(4) {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    };
    (sin as f32, cos as f32)
}

/// `base` to the power of `exponent`, for a base above zero (zero gives zero).
pub(super) fn pow(base: f32, exponent: f32) -> f32 {
    if base <= 0.0 {
        return 0.0;
    }
    exp2(f64::from(exponent) * log2(f64::from(base))) as f32
}

/// Binary logarithm of a normal number: exponent bits, then the series of artanh.
fn log2(x: f64) -> f64 {
    let bits = x.to_bits();
    let mut exponent = ((bits >> 52) & 0x7ff) as f64 - 1023.0;
    let mut mantissa = f64::from_bits((bits & 0x000f_ffff_ffff_ffff) | 0x3ff0_0000_0000_0000);
    if mantissa > SQRT_2 {
        mantissa *= 0.5;
        exponent += 1.0;
    }
    let t = (mantissa - 1.0) / (mantissa + 1.0);
    let mut sum = 0.0;
    for k in (0..12).rev() {
        sum = sum * t * t + 1.0 / f64::from(2 * k + 1);
    }
    exponent + 2.0 * t * sum / LN_2
}

/// Two to the power of `x`, clamped to what a double holds.
fn exp2(x: f64) -> f64 {
    let x = x.clamp(-1000.0, 1000.0);
    let whole = x.round();
    let r = (x - whole) * LN_2;
    let mut sum = 1.0;
    for k in (1..=14).rev() {
        sum = 1.0 + sum * r / f64::from(k);
    }
    sum * f64::from_bits(((whole as i64 + 1023) as u64) << 52)
}

/// Turns `v` about the unit vector `axis` (Rodrigues).
pub(super) fn rotate(v: Vec3, axis: Vec3, degrees: f32) -> Vec3 {
    let (sin, cos) = sin_cos(degrees);
    v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_libm() {
        for i in -2000..2000 {
            let x = i as f32 * 0.731;
            let (sin, cos) = sin_cos(x);
            assert!((f64::from(sin) - f64::from(x).to_radians().sin()).abs() < 1e-7);
            assert!((f64::from(cos) - f64::from(x).to_radians().cos()).abs() < 1e-7);
        }
        for i in 1..400 {
            let (base, exponent) = (i as f32 * 0.05, (i % 23) as f32 * 0.3 - 3.0);
            let expected = f64::from(base).powf(f64::from(exponent));
            assert!((f64::from(pow(base, exponent)) / expected - 1.0).abs() < 1e-6);
        }
        assert_eq!(pow(0.0, 2.0), 0.0);
    }
}
