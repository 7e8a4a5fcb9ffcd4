//! Occlusion, roughness and metalness of a page, in as many bytes as differ.

use glam::Vec3;
use rayon::prelude::*;

use super::edge::bleed;
use super::maps::Maps;
use super::texel::byte;

/// Of each texel what its third image shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Orms {
    /// There is no such image.
    #[default]
    None,
    /// Roughness; nothing occludes, and metalness is the same everywhere.
    Rough {
        /// In 255ths.
        roughness: Vec<u8>,
        /// In 255ths.
        metalness: u8,
    },
    /// All three; the fourth byte is nothing yet.
    All(Vec<[u8; 4]>),
}

impl Orms {
    /// So many of nothing.
    pub fn empty(count: usize, maps: Maps) -> Self {
        match maps {
            Maps::Unlit | Maps::Even { .. } => Self::None,
            Maps::Rough { metalness } => Self::Rough {
                roughness: vec![0; count],
                metalness: byte(metalness),
            },
            Maps::All => Self::All(vec![[0; 4]; count]),
        }
    }

    /// Occlusion, roughness and metalness of one; none where none is kept.
    pub fn at(&self, at: usize) -> [u8; 3] {
        match self {
            Self::None => [0; 3],
            Self::Rough {
                roughness,
                metalness,
            } => [255, roughness[at], *metalness],
            Self::All(all) => [all[at][0], all[at][1], all[at][2]],
        }
    }

    /// Replaces one.
    pub fn set(&mut self, at: usize, [o, r, m]: [u8; 3]) {
        match self {
            Self::None => {}
            Self::Rough { roughness, .. } => roughness[at] = r,
            Self::All(all) => all[at] = [o, r, m, 0],
        }
    }

    /// Fills texels that nothing covers from the neighbourhood.
    pub fn bleed(&mut self, size: [u32; 2], coverage: impl Fn(usize) -> f32 + Copy + Sync) {
        let share = |byte: u8| f32::from(byte) / 255.0;
        match self {
            Self::None => {}
            Self::Rough { roughness, .. } => {
                let get = |at: usize, &r: &u8| (Vec3::splat(share(r)), coverage(at));
                bleed(roughness, size, get, |texel, r| *texel = byte(r.x));
            }
            Self::All(all) => {
                let get = |at: usize, &[o, r, m, _]: &[u8; 4]| {
                    (Vec3::from([o, r, m].map(share)), coverage(at))
                };
                bleed(all, size, get, |texel, orm| {
                    let [o, r, m] = orm.to_array().map(byte);
                    *texel = [o, r, m, 0];
                });
            }
        }
    }

    /// RGBA; they are no more.
    pub fn take(&mut self) -> Vec<u8> {
        match std::mem::take(self) {
            Self::None => Vec::new(),
            Self::Rough {
                roughness,
                metalness,
            } => {
                let pixel = |r: u8| [255, r, metalness, 255];
                let pixels: Vec<[u8; 4]> = roughness.into_par_iter().map(pixel).collect();
                pixels.into_flattened()
            }
            Self::All(mut all) => {
                all.par_iter_mut().for_each(|pixel| pixel[3] = 255);
                all.into_flattened()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roughness_alone_is_as_all_three_where_the_others_are_the_same() {
        let [mut all, mut rough] = [Maps::All, Maps::Rough { metalness: 0.2 }].map(|maps| {
            let mut orms = Orms::empty(6, maps);
            orms.set(1, [255, 100, 51]);
            orms.set(5, [255, 200, 51]);
            orms
        });
        assert_eq!(rough.at(5), [255, 200, 51]);
        let covered = |at: usize| [0.0, 1.0, 0.0, 0.0, 0.0, 0.5][at];
        all.bleed([3, 2], covered);
        rough.bleed([3, 2], covered);
        let pixels = rough.take();
        assert_eq!(pixels, all.take());
        assert_eq!(pixels[..8], [255, 100, 51, 255, 255, 100, 51, 255]);
        assert_eq!((all, rough), (Orms::None, Orms::None));
    }
}
