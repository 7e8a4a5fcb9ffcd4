//! Colour spaces in which distances mean something: CIE L*a*b* and its linear relative.
//!
//! White is D65 as in FLIP: the sum of the columns of the matrix from linear sRGB.

/// Linear sRGB to XYZ over white (each row sums to 1).
const XYZ: [[f32; 3]; 3] = [
    [0.433_895_4, 0.376_242_37, 0.189_862_24],
    [0.212_636_82, 0.715_183, 0.072_180_2],
    [0.017_752_423, 0.109_465_63, 0.872_781_95],
];

/// Its inverse.
const RGB: [[f32; 3]; 3] = [
    [3.080_342, -1.537_399, -0.542_943],
    [-0.921_178_4, 1.875_93, 0.045_248_41],
    [0.052_881_293, -0.204_011_21, 1.151_129_9],
];

fn xyz(rgb: [f32; 3]) -> [f32; 3] {
    XYZ.map(|row| row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2])
}

/// Cube root of a positive number within two roundings: a guess by a third of the exponent, and
/// two steps of Halley's method, each of which triples the digits. A call into the C library
/// takes several times as long.
fn cube_root(x: f32) -> f32 {
    /// Of all numbers to start from the one that is least wrong (3 %).
    const GUESS: u32 = 0x2a51_4067;
    let step = |y: f32| {
        let cube = y * y * y;
        y * ((cube + 2.0 * x) / (2.0 * cube + x))
    };
    step(step(f32::from_bits(x.to_bits() / 3 + GUESS)))
}

/// CIE L*a*b* of linear RGB.
pub fn lab(rgb: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] = xyz(rgb).map(|t| {
        if t > DELTA * DELTA * DELTA {
            cube_root(t)
        } else {
            t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// L*a*b* without its roots: lightness, red-green, blue-yellow, linear in light.
pub fn opponent(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = xyz(rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The inverse of [`opponent`].
pub fn rgb_of_opponent([l, rg, by]: [f32; 3]) -> [f32; 3] {
    let y = (l + 16.0) / 116.0;
    let (x, z) = (y + rg / 500.0, y - by / 200.0);
    RGB.map(|row| row[0] * x + row[1] * y + row[2] * z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_has_lightness_100_and_no_colour_and_green_is_where_the_tables_have_it() {
        let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.1);
        assert!(near(lab([1.0; 3]), [100.0, 0.0, 0.0]));
        assert!(near(lab([0.0; 3]), [0.0; 3]));
        // sRGB (0, 255, 0) under D65.
        assert!(
            near(lab([0.0, 1.0, 0.0]), [87.73, -86.18, 83.18]),
            "{:?}",
            lab([0.0, 1.0, 0.0])
        );
    }

    #[test]
    fn cube_roots_are_those_of_the_c_library() {
        for i in 1..100_000 {
            let x = i as f32 * 1.3e-5;
            let off = (cube_root(x) - x.cbrt()).abs() / x.cbrt();
            assert!(off < 3e-7, "{x}: {off}");
        }
    }

    #[test]
    fn the_way_there_and_back_is_none() {
        let back = rgb_of_opponent(opponent([0.2, 0.7, 0.1]));
        assert!(
            (back[0] - 0.2).abs() < 1e-5
                && (back[1] - 0.7).abs() < 1e-5
                && (back[2] - 0.1).abs() < 1e-5
        );
    }
}
