//! Textures with box-filtered mips, made as engines make them.
//!
//! Every level is the box average of the one before, rounded to 8 bits: colours averaged as light
//! (decoded from sRGB, not weighted by alpha), alpha as it is. Alpha lies in planes of its own, so
//! that it can be replaced and drawn without touching colours.

use super::level::{Address, Level, UNIT};
use super::mips;

/// An image with its mips.
#[derive(Clone, Debug)]
pub struct Texture {
    levels: Vec<Level>,
}

impl Texture {
    /// From straight RGBA with sRGB colours, rows from the top; all mips down to one texel.
    ///
    /// # Panics
    /// If `rgba` is not `width * height * 4` bytes long, or the image is empty.
    pub fn from_rgba(width: u32, height: u32, rgba: &[u8]) -> Self {
        let (alpha, rgb) = parted(width, height, rgba);
        Self::new(width, height, alpha, rgb)
    }

    /// As [`Texture::from_rgba`], the base level alone: it is read from any distance.
    ///
    /// # Panics
    /// If `rgba` is not `width * height * 4` bytes long, or the image is empty.
    pub fn base_of_rgba(width: u32, height: u32, rgba: &[u8]) -> Self {
        let (alpha, rgb) = parted(width, height, rgba);
        assert!(!alpha.is_empty());
        Self {
            levels: vec![Level::new(width, height, alpha, rgb)],
        }
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
        let mut levels = vec![Level::new(width, height, alpha, rgb)];
        while let Some(finer) = levels.last()
            && (finer.width > 1 || finer.height > 1)
        {
            levels.push(mips::halved(finer));
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
        self.levels[0].find_blocks();
        for i in 1..self.levels.len() {
            let (finer, rest) = self.levels.split_at_mut(i);
            let (finer, coarser) = (&finer[i - 1], &mut rest[0]);
            mips::halve_alpha(finer, coarser.width, coarser.height, &mut coarser.alpha);
            coarser.find_blocks();
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

    /// The levels that a level of detail lies between, 0 being the base.
    pub(super) fn mip(&self, lod: f32) -> Mip<'_> {
        let last = self.levels.len() - 1;
        let low = (lod.max(0.0) as usize).min(last);
        let part = if low == last {
            0.0
        } else {
            lod.max(0.0) - low as f32
        };
        Mip {
            finer: &self.levels[low],
            coarser: (part > 0.0).then(|| (&self.levels[low + 1], part)),
        }
    }
}

/// Alpha and colours.
fn parted(width: u32, height: u32, rgba: &[u8]) -> (Vec<u8>, Vec<[u8; 3]>) {
    assert_eq!(rgba.len(), width as usize * height as usize * 4);
    let (texels, _) = rgba.as_chunks::<4>();
    let alpha = texels.iter().map(|t| t[3]).collect();
    let rgb = texels.iter().map(|t| [t[0], t[1], t[2]]).collect();
    (alpha, rgb)
}

/// A texture at one level of detail.
#[derive(Clone, Copy)]
pub(super) struct Mip<'a> {
    finer: &'a Level,
    /// The next level and its weight.
    coarser: Option<(&'a Level, f32)>,
}

impl<'a> Mip<'a> {
    /// The finer of its two levels.
    pub fn level(&self) -> &'a Level {
        self.finer
    }

    /// Whether it is one level, nothing mixed in from the next.
    pub fn is_single(&self) -> bool {
        self.coarser.is_none()
    }

    /// Alpha (0 to 1) at `uv`.
    #[inline]
    pub fn alpha(&self, uv: [f32; 2], address: Address) -> f32 {
        let fine = self.finer.alpha_at(uv, address);
        let fixed = match self.coarser {
            None => fine,
            Some((level, part)) => fine + (level.alpha_at(uv, address) - fine) * part,
        };
        fixed * UNIT
    }

    /// Linear RGB at `uv`; white where the texture has alpha alone.
    pub fn rgb(&self, uv: [f32; 2], address: Address) -> [f32; 3] {
        let fine = self.finer.rgb_at(uv, address);
        match self.coarser {
            None => fine,
            Some((level, part)) => {
                let coarse = level.rgb_at(uv, address);
                std::array::from_fn(|i| fine[i] + (coarse[i] - fine[i]) * part)
            }
        }
    }
}
