//! Colours bled into transparent texels, so that no fringe shows in any mip.
//!
//! Push-pull: a pyramid of coverage-weighted means is built, and every texel without content takes
//! the value of the finest level that has some. The colour then varies as slowly as the mips do.

use glam::Vec3;
use rayon::prelude::*;

/// A colour (or another number) with its weight, 0 (empty) to 1 (full).
pub type Weighted = (Vec3, f32);

/// Fills texels of weight zero from their neighbourhood: row by row, as `get` reads (it is given a texel's place among
/// all, too) and `set` writes them. Values are from -1 to 1.
pub fn bleed<T: Send + Sync>(
    texels: &mut [T],
    [w, h]: [u32; 2],
    get: impl Fn(usize, &T) -> Weighted + Copy + Sync,
    set: impl Fn(&mut T, Vec3) + Copy + Sync,
) {
    if w <= 1 && h <= 1 {
        return;
    }
    let (width, half) = (w as usize, [w.div_ceil(2), h.div_ceil(2)]);
    let across = half[0] as usize;
    let mut means = vec![Mean::default(); across * half[1] as usize];
    let coarse = means.par_chunks_mut(across).enumerate();
    coarse
        .zip(texels.par_chunks(2 * width))
        .for_each(|((y, means), texels)| {
            let get = |at: usize| get(2 * y * width + at, &texels[at]);
            for (x, mean) in means.iter_mut().enumerate() {
                let columns = 2 * x..(2 * x + 2).min(width);
                let rows = (0..texels.len()).step_by(width);
                let four = rows.flat_map(|row| columns.clone().map(move |x| get(row + x)));
                *mean = Mean::of(four);
            }
        });
    let some = |m: &Mean| m.known;
    if !means.iter().all(some) && means.iter().any(some) {
        bleed(&mut means, half, Mean::weighted, Mean::put);
    }
    let rows = texels.par_chunks_mut(width).enumerate();
    rows.for_each(|(y, texels)| {
        let means = &means[(y / 2) * across..][..across];
        for (x, texel) in texels.iter_mut().enumerate() {
            if get(y * width + x, texel).1 <= 0.0 {
                set(texel, means[x / 2].value());
            }
        }
    });
}

/// The weighted mean of some texels in half the bytes of numbers: pages are large.
#[derive(Clone, Copy, Default)]
struct Mean {
    /// In 32,767ths: a step is a tenth of the least step of sRGB.
    value: [i16; 3],
    /// Whether any of them weighs anything.
    known: bool,
}

impl Mean {
    fn of(texels: impl Iterator<Item = Weighted>) -> Self {
        let none = (Vec3::ZERO, 0.0);
        let add = |(sum, mass): Weighted, (value, weight)| (sum + value * weight, mass + weight);
        let (sum, mass) = texels.fold(none, add);
        let mut out = Self::default();
        if mass > 0.0 {
            out.put(sum / mass);
            out.known = true;
        }
        out
    }

    fn weighted(_: usize, mean: &Self) -> Weighted {
        (mean.value(), f32::from(u8::from(mean.known)))
    }

    fn value(&self) -> Vec3 {
        Vec3::from(self.value.map(|v| f32::from(v) / 32_767.0))
    }

    fn put(&mut self, value: Vec3) {
        let number = |v: f32| nearest(v.clamp(-1.0, 1.0) * 32_767.0) as i16;
        self.value = value.to_array().map(number);
    }
}

/// The nearest whole number; `round` is a call into the C library on plain x86-64.
pub fn nearest(number: f32) -> i32 {
    (number + 0.5f32.copysign(number)) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bled(texels: &mut [Weighted], size: [u32; 2]) {
        bleed(
            texels,
            size,
            |_, texel| *texel,
            |texel, value| texel.0 = value,
        );
    }

    #[test]
    fn means_are_weighted_and_as_fine_as_a_page_needs() {
        let mean = Mean::of([(Vec3::X, 0.75), (-Vec3::Y, 0.25), (Vec3::Z, 0.0)].into_iter());
        let off = mean.value() - Vec3::new(0.75, -0.25, 0.0);
        assert!(off.abs().max_element() < 0.5 / 32_767.0 && mean.known);
        assert!(!Mean::of([(Vec3::X, 0.0)].into_iter()).known);
        assert_eq!(size_of::<Mean>(), 8);
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
