//! Alpha test of a row of samples: a run at a time where alpha is the same all around.
//!
//! Most of a card lies in the open or well inside a leaf, and with several samples a pixel many
//! neighbours fall into one block of equal texels: one answer holds for all of them.

use super::texture::{Address, Level};
use super::triangle::Row;

/// Where a row of samples reads a texture.
pub(super) struct TexelRow<'a> {
    pub level: &'a Level,
    pub u: Row,
    pub v: Row,
    pub address: Address,
}

/// Whether all samples have this value.
#[inline]
pub(super) fn is_all<const VALUE: u8>(samples: &[u8]) -> bool {
    let (words, rest) = samples.as_chunks::<8>();
    words.iter().all(|&word| word == [VALUE; 8]) && rest.iter().all(|&s| s == VALUE)
}

/// How many samples from the first one on are known to be hit: inside a crown most are, and eight
/// are passed over at a time.
#[inline]
fn hit_from(samples: &[u8]) -> usize {
    let (words, rest) = samples.as_chunks::<8>();
    let full = words.iter().take_while(|&&word| word == [1; 8]).count();
    let next = words.get(full).map_or(rest, |word| word.as_slice());
    8 * full + next.iter().take_while(|&&s| s == 1).count()
}

/// Rounding of positions may move a sample by less than this part of a step.
const SLACK: f32 = 0.05;

impl TexelRow<'_> {
    /// Texels from a sample to the next, along both axes.
    #[inline]
    pub fn step(&self) -> [f32; 2] {
        [
            self.u.dx * self.level.width as f32,
            self.v.dx * self.level.height as f32,
        ]
    }

    /// Where a sample lies; see [`Level::place`].
    #[inline]
    pub fn place(&self, x: i32) -> ([i32; 2], [u32; 2]) {
        self.level
            .place([self.u.value(x), self.v.value(x)], self.address)
    }

    /// Sets the samples from `from` on that are not hit yet and whose alpha (in the units of
    /// [`Level::mixed`]) passes.
    #[inline]
    pub fn test(&self, from: i32, samples: &mut [u8], passes: impl Fn(f32) -> bool) {
        let level = self.level;
        let step = self.step();
        let mut i = 0;
        while i < samples.len() {
            if samples[i] != 0 {
                i += hit_from(&samples[i..]);
                continue;
            }
            let (texel, part) = self.place(from + i as i32);
            match level.block(texel) {
                Some(alpha) => {
                    let run = self.run(texel, part, step).min(samples.len() - i);
                    if passes((alpha as u32 * 65_536) as f32) {
                        samples[i..i + run].fill(1);
                    }
                    i += run;
                }
                None => {
                    samples[i] = u8::from(passes(level.mixed(texel, part, self.address)));
                    i += 1;
                }
            }
        }
    }

    /// How many samples from here on lie in the same block, this one included.
    #[inline]
    pub fn run(&self, texel: [i32; 2], part: [u32; 2], step: [f32; 2]) -> usize {
        let fast = |step: f32| step.abs() > 2.0;
        if !self.address.linear || fast(step[0]) || fast(step[1]) {
            return 1;
        }
        let (low, high) = self.level.block_around(texel);
        let steps = |axis: usize| {
            let (at, step) = (texel[axis] as f32 + part[axis] as f32 / 256.0, step[axis]);
            // Positions are rounded down to 256ths.
            let room = match step > 0.0 {
                true => high[axis] as f32 - at - 1.0 / 256.0,
                false => at - low[axis] as f32,
            };
            room / step.abs()
        };
        // Not a number where nothing moves on an edge: `max` and `min` take the other one.
        (steps(0).min(steps(1)) - SLACK).clamp(0.0, 1e6) as usize + 1
    }
}

#[cfg(test)]
mod tests {
    use crate::space::raster::texture::{Texture, Wrap};

    use super::*;

    #[test]
    fn runs_give_what_single_samples_give() {
        let (width, height) = (96u32, 80u32);
        // Discs of one alpha on another, with soft rims.
        let alpha = |x: u32, y: u32| {
            let (dx, dy) = ((x % 24) as f32 - 12.0, (y % 20) as f32 - 10.0);
            let rim = 8.0 - dx.hypot(dy);
            (rim.clamp(0.0, 1.0) * 200.0) as u8 + 20
        };
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| alpha(x, y)));
        let texture = Texture::from_alpha(width, height, texels.collect());
        let address = Address {
            wrap: [Wrap::Repeat, Wrap::Clamp],
            linear: true,
        };
        let mip = texture.mip(0.0);
        let (mut runs, mut hits) = (0, 0);
        for case in 0..400 {
            let random = |k: u32| ((case * 7 + k) as f32 * 0.618_034).fract() - 0.5;
            let texels_a_sample = [0.05, 0.25, 0.9, 3.0][case as usize % 4];
            let row = |k: u32, size: u32| Row {
                at: random(k) * 1.4 + 0.5,
                dx: random(k + 1) * 2.0 * texels_a_sample / size as f32,
                x0: 3.5,
            };
            // Some rows do not move along one axis, or run exactly along texels.
            let (mut u, v) = (row(0, width), row(2, height));
            if case % 5 == 0 {
                u.dx = 0.0;
                u.at = (case % 40) as f32 / width as f32;
            }
            let row = TexelRow {
                level: mip.level(),
                u,
                v,
                address,
            };
            let passes = |alpha: f32| alpha >= 128.0 * 65_536.0;
            let mut found = vec![0u8; 300];
            found[20] = 1;
            row.test(5, &mut found, passes);
            for (i, &found) in found.iter().enumerate() {
                let x = 5 + i as i32;
                let (texel, part) = row.level.place([u.value(x), v.value(x)], address);
                let wanted = i == 20 || passes(row.level.mixed(texel, part, address));
                assert_eq!(found == 1, wanted, "case {case}, sample {i}");
                let step = [u.dx * width as f32, v.dx * height as f32];
                let known = row.level.block(texel).is_some();
                runs += usize::from(known && row.run(texel, part, step) > 3);
                hits += usize::from(wanted);
            }
        }
        assert!(runs > 10_000 && hits > 10_000, "{runs} runs, {hits} hits");
    }
}
