//! Colours bled into transparent texels, so that no fringe shows in any mip.
//!
//! Push-pull: a pyramid of coverage-weighted means is built, and every texel without content takes
//! the value of the finest level that has some. The colour then varies as slowly as the mips do.

use glam::Vec3;
use rayon::prelude::*;

/// A colour (or another number) with its weight, 0 (empty) to 1 (full).
pub type Weighted = (Vec3, f32);

/// Fills texels of weight zero from their neighbourhood: row by row, as `get` reads and `set` writes
/// them.
pub fn bleed<T: Send + Sync>(
    texels: &mut [T],
    [w, h]: [u32; 2],
    get: impl Fn(&T) -> Weighted + Copy + Sync,
    set: impl Fn(&mut T, Vec3) + Copy + Sync,
) {
    if w <= 1 && h <= 1 {
        return;
    }
    let (width, half) = (w as usize, [w.div_ceil(2), h.div_ceil(2)]);
    let across = half[0] as usize;
    let mut means: Vec<Weighted> = vec![(Vec3::ZERO, 0.0); across * half[1] as usize];
    let coarse = means.par_chunks_mut(across);
    coarse
        .zip(texels.par_chunks(2 * width))
        .for_each(|(means, texels)| mean_of_rows(means, texels.chunks(width), get));
    let empty = |m: &Weighted| m.1 <= 0.0;
    if means.iter().any(empty) && !means.iter().all(empty) {
        bleed(&mut means, half, whole, put);
    }
    let rows = texels.par_chunks_mut(width).enumerate();
    rows.for_each(|(y, texels)| {
        let means = &means[(y / 2) * across..][..across];
        for (x, texel) in texels.iter_mut().enumerate() {
            if get(texel).1 <= 0.0 {
                set(texel, means[x / 2].0);
            }
        }
    });
}

fn whole(texel: &Weighted) -> Weighted {
    *texel
}

fn put(texel: &mut Weighted, value: Vec3) {
    texel.0 = value;
}

/// The weighted means of two rows' texels, two by two; their weight is 1, or 0 where nothing is.
fn mean_of_rows<'t, T: 't>(
    means: &mut [Weighted],
    rows: impl Iterator<Item = &'t [T]>,
    get: impl Fn(&T) -> Weighted,
) {
    for row in rows {
        for (x, texel) in row.iter().enumerate() {
            let (value, weight) = get(texel);
            means[x / 2].0 += value * weight;
            means[x / 2].1 += weight;
        }
    }
    for (mean, mass) in means.iter_mut().filter(|(_, mass)| *mass > 0.0) {
        *mean /= *mass;
        *mass = 1.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bled(texels: &mut [Weighted], size: [u32; 2]) {
        bleed(texels, size, whole, put);
    }

    #[test]
    fn empty_texels_take_the_nearest_colour_and_full_ones_keep_theirs() {
        let mut texels = vec![(Vec3::ZERO, 0.0); 64];
        texels[0] = (Vec3::X, 1.0);
        texels[63] = (Vec3::Y, 0.25);
        bled(&mut texels, [8, 8]);
        let values: Vec<Vec3> = texels.iter().map(|t| t.0).collect();
        assert_eq!((values[0], values[63]), (Vec3::X, Vec3::Y));
        assert_eq!(
            (values[1], values[9], values[18]),
            (Vec3::X, Vec3::X, Vec3::X)
        );
        assert_eq!((values[62], values[45]), (Vec3::Y, Vec3::Y));
    }

    #[test]
    fn an_empty_page_stays_as_it_is() {
        let mut texels = vec![(Vec3::ZERO, 0.0); 6];
        bled(&mut texels, [3, 2]);
        assert!(texels.iter().all(|t| t.0 == Vec3::ZERO));
    }
}
