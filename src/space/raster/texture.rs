//! Textures with box-filtered mips, made as engines make them.
//!
//! Every level is the box average of the one before, rounded to 8 bits: colours averaged as light
//! (decoded from sRGB, not weighted by alpha), alpha as it is. Alpha lies in planes of its own, so
//! that it can be replaced and drawn without touching colours.

use std::sync::LazyLock;

use super::shade::{linear_from_srgb, srgb_from_linear};

/// A sampler's wrap mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Tiles, every second one mirrored.
    Mirror,
    /// The edge texel goes on.
    Clamp,
}

/// An image with its mips.
#[derive(Clone, Debug)]
pub struct Texture {
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    width: u32,
    height: u32,
    alpha: Vec<u8>,
    /// sRGB; empty where only alpha is wanted.
    rgb: Vec<[u8; 3]>,
}

impl Texture {
    /// From straight RGBA with sRGB colours, rows from the top; all mips down to one texel.
    ///
    /// # Panics
    /// If `rgba` is not `width * height * 4` bytes long, or the image is empty.
    pub fn from_rgba(width: u32, height: u32, rgba: &[u8]) -> Self {
        assert_eq!(rgba.len(), width as usize * height as usize * 4);
        let (texels, _) = rgba.as_chunks::<4>();
        let alpha = texels.iter().map(|t| t[3]).collect();
        let rgb = texels.iter().map(|t| [t[0], t[1], t[2]]).collect();
        Self::new(width, height, alpha, rgb)
    }

    /// Alpha alone: enough for [`coverage`](super::coverage), a quarter of the work.
    ///
    /// # Panics
    /// If `alpha` is not `width * height` bytes long, or the image is empty.
    pub fn from_alpha(width: u32, height: u32, alpha: Vec<u8>) -> Self {
        Self::new(width, height, alpha, Vec::new())
    }

    fn new(width: u32, height: u32, alpha: Vec<u8>, rgb: Vec<[u8; 3]>) -> Self {
        assert!(width > 0 && height > 0);
        assert_eq!(alpha.len(), width as usize * height as usize);
        let mut levels = vec![Level {
            width,
            height,
            alpha,
            rgb,
        }];
        while let Some(finer) = levels.last()
            && (finer.width > 1 || finer.height > 1)
        {
            levels.push(finer.halved());
        }
        Self { levels }
    }

    /// Replaces alpha and remakes its mips; colours stay.
    ///
    /// # Panics
    /// If `alpha` does not have as many bytes as the base level has texels.
    pub fn set_alpha(&mut self, alpha: &[u8]) {
        assert_eq!(alpha.len(), self.levels[0].alpha.len());
        self.levels[0].alpha.copy_from_slice(alpha);
        for i in 1..self.levels.len() {
            let (finer, rest) = self.levels.split_at_mut(i);
            let (finer, coarser) = (&finer[i - 1], &mut rest[0]);
            halve_alpha(finer, coarser.width, coarser.height, &mut coarser.alpha);
        }
    }

    /// Width and height of the base level, in texels.
    pub fn size(&self) -> (u32, u32) {
        (self.levels[0].width, self.levels[0].height)
    }

    /// Number of levels.
    pub fn level_count(&self) -> usize {
        self.levels.len()
    }

    /// Width, height and alpha of a level, 0 being the base.
    pub fn alpha_level(&self, level: usize) -> (u32, u32, &[u8]) {
        let level = &self.levels[level];
        (level.width, level.height, &level.alpha)
    }

    /// Alpha (0 to 1) at `uv`, `lod` levels above the base, between levels where it is fractional.
    pub(super) fn alpha(&self, uv: [f32; 2], lod: f32, wrap: [Wrap; 2], linear: bool) -> f32 {
        self.blend(lod, |level| {
            if linear {
                level.bilinear(uv, wrap, |i| level.alpha[i] as f32)
            } else {
                level.alpha[level.nearest(uv, wrap)] as f32
            }
        }) / 255.0
    }

    /// Linear RGB at `uv`; white where the texture has alpha alone.
    pub(super) fn rgb(&self, uv: [f32; 2], lod: f32, wrap: [Wrap; 2], linear: bool) -> [f32; 3] {
        if self.levels[0].rgb.is_empty() {
            return [1.0; 3];
        }
        let decode = &*DECODE;
        std::array::from_fn(|channel| {
            self.blend(lod, |level| {
                if linear {
                    level.bilinear(uv, wrap, |i| decode[level.rgb[i][channel] as usize])
                } else {
                    decode[level.rgb[level.nearest(uv, wrap)][channel] as usize]
                }
            })
        })
    }

    fn blend(&self, lod: f32, value: impl Fn(&Level) -> f32) -> f32 {
        let last = self.levels.len() - 1;
        if lod <= 0.0 {
            return value(&self.levels[0]);
        }
        let low = lod as usize;
        if low >= last {
            return value(&self.levels[last]);
        }
        let part = lod - low as f32;
        let near = value(&self.levels[low]);
        if part == 0.0 {
            return near;
        }
        near + (value(&self.levels[low + 1]) - near) * part
    }
}

/// Linear light of an sRGB byte.
static DECODE: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0)));

/// sRGB byte of linear light in 4096 steps of its square root (fine where sRGB is steep).
static ENCODE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let encode = |i: usize| {
        let root = i as f32 / 4095.0;
        (srgb_from_linear(root * root) * 255.0 + 0.5) as u8
    };
    (0..4096).map(encode).collect()
});

impl Level {
    fn halved(&self) -> Self {
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let count = width as usize * height as usize;
        let mut alpha = vec![0; count];
        halve_alpha(self, width, height, &mut alpha);
        let mut rgb = Vec::new();
        if !self.rgb.is_empty() {
            let (decode, encode) = (&*DECODE, &*ENCODE);
            rgb.reserve_exact(count);
            for_each_box(self, width, height, |indices| {
                rgb.push(std::array::from_fn(|channel| {
                    let sum: f32 = indices
                        .iter()
                        .map(|&i| decode[self.rgb[i][channel] as usize])
                        .sum();
                    let mean = sum / indices.len() as f32;
                    encode[(mean.sqrt() * 4095.0 + 0.5) as usize]
                }));
            });
        }
        Self {
            width,
            height,
            alpha,
            rgb,
        }
    }

    fn nearest(&self, [u, v]: [f32; 2], wrap: [Wrap; 2]) -> usize {
        let x = wrap[0].apply((u * self.width as f32).floor() as i32, self.width);
        let y = wrap[1].apply((v * self.height as f32).floor() as i32, self.height);
        y * self.width as usize + x
    }

    fn bilinear(&self, [u, v]: [f32; 2], wrap: [Wrap; 2], texel: impl Fn(usize) -> f32) -> f32 {
        let (x, y) = (u * self.width as f32 - 0.5, v * self.height as f32 - 0.5);
        let (low_x, low_y) = (x.floor(), y.floor());
        let (part_x, part_y) = (x - low_x, y - low_y);
        let [left, right] = wrap[0].pair(low_x as i32, self.width);
        let [above, below] = wrap[1].pair(low_y as i32, self.height);
        let (above, below) = (above * self.width as usize, below * self.width as usize);
        let (a, b) = (texel(above + left), texel(above + right));
        let (c, d) = (texel(below + left), texel(below + right));
        let (top, bottom) = (a + (b - a) * part_x, c + (d - c) * part_x);
        top + (bottom - top) * part_y
    }
}

fn halve_alpha(finer: &Level, width: u32, height: u32, out: &mut [u8]) {
    let mut out = out.iter_mut();
    for_each_box(finer, width, height, |indices| {
        let sum: u32 = indices.iter().map(|&i| finer.alpha[i] as u32).sum();
        let count = indices.len() as u32;
        if let Some(out) = out.next() {
            *out = ((sum + count / 2) / count) as u8;
        }
    });
}

/// The texels of the finer level under each texel of the coarser one, row by row. An odd edge
/// loses its last texel to the box beside it (three texels instead of two).
fn for_each_box(finer: &Level, width: u32, height: u32, mut each: impl FnMut(&[usize])) {
    let mut indices = Vec::with_capacity(9);
    let range = |i: u32, coarse: u32, fine: u32| {
        let from = (i * 2).min(fine - 1);
        let to = if i + 1 == coarse { fine } else { i * 2 + 2 };
        from..to
    };
    for y in 0..height {
        for x in 0..width {
            indices.clear();
            for fine_y in range(y, height, finer.height) {
                let row = fine_y as usize * finer.width as usize;
                indices.extend(range(x, width, finer.width).map(|fine_x| row + fine_x as usize));
            }
            each(&indices);
        }
    }
}

impl Wrap {
    fn apply(self, i: i32, size: u32) -> usize {
        let size = size as i32;
        let wrapped = match self {
            Self::Repeat => i.rem_euclid(size),
            Self::Clamp => i.clamp(0, size - 1),
            Self::Mirror => {
                let i = i.rem_euclid(2 * size);
                if i < size { i } else { 2 * size - 1 - i }
            }
        };
        wrapped as usize
    }

    fn pair(self, i: i32, size: u32) -> [usize; 2] {
        // Nearly every sample lies inside the image, and divisions are dear.
        if i >= 0 && i + 1 < size as i32 {
            [i as usize, i as usize + 1]
        } else {
            [self.apply(i, size), self.apply(i.saturating_add(1), size)]
        }
    }
}
