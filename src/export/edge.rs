//! Colours bled into transparent texels, so that no fringe shows in any mip.
//!
//! Push-pull: a pyramid of coverage-weighted means is built, and every texel without content takes
//! the value of the finest level that has some. The colour then varies as slowly as the mips do.

use glam::Vec3;

/// Fills texels of weight zero from their neighbourhood. `values` is row by row, `weights` are 0
/// (empty) to 1 (full).
pub fn bleed(values: &mut [Vec3], weights: &[f32], [w, h]: [u32; 2]) {
    if w <= 1 && h <= 1 {
        return;
    }
    let half = [w.div_ceil(2), h.div_ceil(2)];
    let count = (half[0] * half[1]) as usize;
    let (mut means, mut mass) = (vec![Vec3::ZERO; count], vec![0.0f32; count]);
    for y in 0..h {
        for x in 0..w {
            let from = (y * w + x) as usize;
            let to = ((y / 2) * half[0] + x / 2) as usize;
            means[to] += values[from] * weights[from];
            mass[to] += weights[from];
        }
    }
    for (mean, mass) in means.iter_mut().zip(&mut mass) {
        if *mass > 0.0 {
            *mean /= *mass;
            *mass = 1.0;
        }
    }
    if mass.contains(&0.0) && mass.iter().any(|&m| m > 0.0) {
        bleed(&mut means, &mass, half);
    }
    for y in 0..h {
        for x in 0..w {
            let at = (y * w + x) as usize;
            if weights[at] <= 0.0 {
                values[at] = means[((y / 2) * half[0] + x / 2) as usize];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn empty_texels_take_the_nearest_colour_and_full_ones_keep_theirs() {
        let mut values = vec![Vec3::ZERO; 64];
        let mut weights = vec![0.0; 64];
        (values[0], weights[0]) = (Vec3::X, 1.0);
        (values[63], weights[63]) = (Vec3::Y, 0.25);
        bleed(&mut values, &weights, [8, 8]);
        assert_eq!((values[0], values[63]), (Vec3::X, Vec3::Y));
        assert_eq!(
            (values[1], values[9], values[18]),
            (Vec3::X, Vec3::X, Vec3::X)
        );
        assert_eq!((values[62], values[45]), (Vec3::Y, Vec3::Y));
    }

    #[test]
    fn an_empty_page_stays_as_it_is() {
        let mut values = vec![Vec3::ZERO; 6];
        bleed(&mut values, &[0.0; 6], [3, 2]);
        assert!(values.iter().all(|&v| v == Vec3::ZERO));
    }
}
