//! Alpha test of a tile of samples: those of a row are placed in the texture four at a time.

use wide::{f32x4, i32x4};

use super::camera::floor;
use super::level::{Address, Level};
use super::triangle::Plane;

/// Where the samples of a tile read a texture. The same as sample by sample, to the bit.
pub(super) struct Patch<'a> {
    pub level: &'a Level,
    pub address: Address,
    /// Both texture coordinates, times the divisor.
    pub uv: [Plane; 2],
    /// What they are divided by; `None`: by nothing.
    pub divisor: Option<Plane>,
    /// The tile's first sample.
    pub first: [i32; 2],
}

impl Patch<'_> {
    /// Which of the `open` samples (bit `8 y + x`) have an alpha, in the units of [`Level::mixed`], that passes.
    #[inline]
    pub fn test(&self, open: u64, passes: impl Fn(f32) -> bool) -> u64 {
        let mut passed = 0;
        self.each(open, |sample, texel, part| {
            let alpha = match self.level.block(texel) {
                Some(alpha) => (u32::from(alpha) * 65_536) as f32,
                None => self.level.mixed(texel, part, self.address),
            };
            passed |= u64::from(passes(alpha)) << sample;
        });
        passed
    }

    /// Calls `found` with each of the `open` samples and its place, as [`Level::place`] gives it.
    #[inline]
    pub fn each(&self, open: u64, mut found: impl FnMut(u32, [i32; 2], [u32; 2])) {
        let column = |x: i32| (self.first[0] + x) as f32 - self.uv[0].x0();
        let four = |x: i32| f32x4::new([column(x), column(x + 1), column(x + 2), column(x + 3)]);
        let columns = [four(0), four(4)];
        for y in open.trailing_zeros() / 8..8 - open.leading_zeros() / 8 {
            let mut row = (open >> (8 * y)) as u8;
            if row == 0 {
                continue;
            }
            let [us, vs] = self.row(self.first[1] + y as i32, columns);
            while row != 0 {
                let x = row.trailing_zeros();
                row &= row - 1;
                let (u, v) = (us[x as usize], vs[x as usize]);
                let part = [(u & 255) as u32, (v & 255) as u32];
                found(8 * y + x, [u >> 8, v >> 8], part);
            }
        }
    }

    /// Both coordinates of a row of samples in 256ths of a texel, rounded down; `columns` are counted
    /// from the planes' corner.
    #[inline]
    fn row(&self, y: i32, columns: [f32x4; 2]) -> [[i32; 8]; 2] {
        let values = |plane: &Plane| {
            let (left, dx) = (f32x4::splat(plane.left(y)), f32x4::splat(plane.dx));
            [left + dx * columns[0], left + dx * columns[1]]
        };
        let divisor = self.divisor.as_ref().map(values);
        // Written out: of closures that make arrays the compiler makes calls.
        let along = |plane: &Plane, size: u32| {
            let [mut left, mut right] = values(plane);
            if let Some(divisor) = divisor {
                (left, right) = (left / divisor[0], right / divisor[1]);
            }
            let (scale, half) = (f32x4::splat(size as f32 * 256.0), f32x4::splat(128.0));
            let [a, b, c, d] = self.rounded(left * scale - half).to_array();
            let [e, f, g, h] = self.rounded(right * scale - half).to_array();
            [a, b, c, d, e, f, g, h]
        };
        let [u, v] = &self.uv;
        [along(u, self.level.width), along(v, self.level.height)]
    }

    #[inline]
    fn rounded(&self, at: f32x4) -> i32x4 {
        // Kept far from the ends of i32: neighbours of any texel can be counted.
        let at = at.fast_max(f32x4::splat(-1e9)).fast_min(f32x4::splat(1e9));
        let down = floor(at);
        match self.address.linear {
            true => down,
            // To the middle of the texel that holds the point: its neighbours weigh nothing.
            false => (down + i32x4::splat(128)) & i32x4::splat(!255),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::raster::level::Wrap;
    use crate::space::raster::texture::Texture;

    #[test]
    fn a_tile_reads_what_single_samples_read() {
        let (width, height) = (96u32, 80u32);
        // Discs of one alpha on another, with soft rims.
        let alpha = |x: u32, y: u32| {
            let (dx, dy) = ((x % 24) as f32 - 12.0, (y % 20) as f32 - 10.0);
            let rim = 8.0 - dx.hypot(dy);
            (rim.clamp(0.0, 1.0) * 200.0) as u8 + 20
        };
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| alpha(x, y)));
        let texture = Texture::from_alpha(width, height, texels.collect());
        let (mut hits, mut asked) = (0, 0);
        for case in 0..400u32 {
            let random = |k: u32| ((case * 9 + k) as f32 * 0.618_034).fract() - 0.5;
            let texels_a_sample = [0.05, 0.25, 0.9, 3.0][case as usize % 4];
            let plane = |k: u32, at: f32, size: f32| {
                let step = |k: u32| random(k) * 2.0 * texels_a_sample / size;
                Plane::new(at, [step(k), step(k + 1)], [3.5, -2.25])
            };
            let flat = case % 3 == 0;
            let (at_u, at_v) = ((random(0) + 0.5) * 1.2, random(1));
            let patch = Patch {
                level: texture.mip(0.0).level(),
                address: Address {
                    wrap: [Wrap::Repeat, Wrap::Clamp],
                    linear: case % 5 != 0,
                },
                uv: [plane(2, at_u, width as f32), plane(4, at_v, height as f32)],
                divisor: (!flat).then(|| Plane::new(1.0, [4e-3, -3e-3], [3.5, -2.25])),
                first: [case as i32 % 40, case as i32 % 30],
            };
            let open = 0x8142_2418_ffff_0f0f_u64.rotate_left(case);
            let passes = |alpha: f32| alpha >= 128.0 * 65_536.0;
            let found = patch.test(open, passes);
            assert_eq!(found & !open, 0);
            for sample in (0..64).filter(|s| open >> s & 1 == 1) {
                let [x, y] = [sample % 8, sample / 8];
                let (x, y) = (patch.first[0] + x, patch.first[1] + y);
                let divisor = patch.divisor.map_or(1.0, |q| q.value(x, y));
                let uv = patch.uv.map(|plane| plane.value(x, y) / divisor);
                let (texel, part) = patch.level.place(uv, patch.address);
                let wanted = passes(patch.level.mixed(texel, part, patch.address));
                assert_eq!(
                    found >> sample & 1 == 1,
                    wanted,
                    "case {case}, sample {sample}"
                );
                hits += u32::from(wanted);
                asked += 1;
            }
        }
        assert!(hits > 2000 && hits < asked - 2000, "{hits} of {asked}");
    }
}
