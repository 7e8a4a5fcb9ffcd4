//! One mip of a texture, and how its texels are read.

use wide::f32x4;

use super::blocks::Blocks;
use super::srgb::lights;

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

/// The unit of mixed alpha: 255 levels of 256 x 256 weights are one.
pub(super) const UNIT: f32 = 1.0 / (255.0 * 65_536.0);

/// How a texture is read.
#[derive(Clone, Copy)]
pub(super) struct Address {
    pub wrap: [Wrap; 2],
    /// False: the nearest texel.
    pub linear: bool,
}

/// A mip.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub width: u32,
    pub height: u32,
    pub alpha: Vec<u8>,
    /// sRGB; empty where only alpha is wanted.
    pub rgb: Vec<[u8; 3]>,
    blocks: Blocks,
}

impl Level {
    pub fn new(width: u32, height: u32, alpha: Vec<u8>, rgb: Vec<[u8; 3]>) -> Self {
        Self {
            width,
            height,
            blocks: Blocks::new(width, height, &alpha),
            alpha,
            rgb,
        }
    }

    /// Finds the blocks of one alpha, after it changed.
    pub fn find_blocks(&mut self) {
        self.blocks = Blocks::new(self.width, self.height, &self.alpha);
    }

    /// Where `uv` lies: the texel to the left above, and how far from its middle in 256ths.
    #[inline]
    pub fn place(&self, [u, v]: [f32; 2], address: Address) -> ([i32; 2], [u32; 2]) {
        let (mut x, mut y) = (fixed(u, self.width), fixed(v, self.height));
        if !address.linear {
            // To the middle of the texel that holds the point: its neighbours weigh nothing.
            (x, y) = ((x + 128) & !255, (y + 128) & !255);
        }
        ([x >> 8, y >> 8], [(x & 255) as u32, (y & 255) as u32])
    }

    /// Whether a texel and its neighbours to the right and below are all inside.
    #[inline]
    pub fn holds(&self, [x, y]: [i32; 2]) -> bool {
        x >= 0 && y >= 0 && x + 1 < self.width as i32 && y + 1 < self.height as i32
    }

    /// A texel and its neighbours: left above, right above, left below, right below.
    #[inline]
    pub fn neighbours(&self, [x, y]: [i32; 2], address: Address) -> [usize; 4] {
        let width = self.width as usize;
        // Nearly every sample lies inside the image, and divisions are dear.
        if self.holds([x, y]) {
            let at = y as usize * width + x as usize;
            return [at, at + 1, at + width, at + width + 1];
        }
        let [left, right] = [x, x + 1].map(|x| address.wrap[0].apply(x, self.width));
        let [above, below] = [y, y + 1].map(|y| address.wrap[1].apply(y, self.height) * width);
        [above + left, above + right, below + left, below + right]
    }

    /// Alpha in units of 1 / (255 * 65536), exact in 24 bits. Weights have 256 steps, as on
    /// graphics processors.
    #[inline]
    pub fn alpha_at(&self, uv: [f32; 2], address: Address) -> f32 {
        let (texel, part) = self.place(uv, address);
        match self.block(texel) {
            Some(alpha) => (alpha as u32 * 65_536) as f32,
            None => self.mixed(texel, part, address),
        }
    }

    /// The alpha of a texel and its neighbours, where it is one and known to be.
    #[inline]
    pub fn block(&self, texel: [i32; 2]) -> Option<u8> {
        let inside = self.holds(texel);
        inside
            .then(|| self.blocks.get(texel[0], texel[1]))
            .flatten()
    }

    /// Alpha mixed from a texel and its neighbours, in units of 1 / (255 * 65536).
    #[inline]
    pub fn mixed(&self, texel: [i32; 2], [right, below]: [u32; 2], address: Address) -> f32 {
        // Not by `map`: it is called for most samples of all trees, and the compiler leaves that a call.
        let [a, b, c, d] = self.neighbours(texel, address);
        let alpha = |i: usize| u32::from(self.alpha[i]);
        let top = alpha(a) * (256 - right) + alpha(b) * right;
        let bottom = alpha(c) * (256 - right) + alpha(d) * right;
        (top * (256 - below) + bottom * below) as f32
    }

    /// Linear RGB; white where there is alpha alone.
    #[inline]
    pub fn rgb_at(&self, uv: [f32; 2], address: Address) -> [f32; 3] {
        if self.rgb.is_empty() {
            return [1.0; 3];
        }
        let (texel, [right, below]) = self.place(uv, address);
        let [right, below] = [right, below].map(|part| f32x4::splat(part as f32 / 256.0));
        let lights = lights();
        let light = |i: usize| {
            let [r, g, b] = self.rgb[i];
            let light = |byte: u8| lights[usize::from(byte)];
            f32x4::new([light(r), light(g), light(b), 0.0])
        };
        let [a, b, c, d] = self.neighbours(texel, address);
        let [a, b, c, d] = [light(a), light(b), light(c), light(d)];
        let (top, bottom) = (a + (b - a) * right, c + (d - c) * right);
        let [r, g, b, _] = (top + (bottom - top) * below).to_array();
        [r, g, b]
    }
}

/// Where a coordinate lies between texel centres, in 256ths of a texel, rounded down.
///
/// `floor` is a call into the C library on plain x86-64, and takes longer than all the rest.
#[inline]
fn fixed(coordinate: f32, size: u32) -> i32 {
    let position = (coordinate * size as f32 - 0.5) * 256.0;
    // Kept far from the ends of i32: neighbours of any texel can be counted.
    let whole = position.clamp(-1e9, 1e9) as i32;
    whole - (whole as f32 > position) as i32
}

impl Wrap {
    pub(super) fn apply(self, i: i32, size: u32) -> usize {
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
}
