//! Where alpha is the same over whole blocks of texels.
//!
//! Leaves on a card are islands: most of its texels lie in the open or well inside a leaf. A map
//! of a 16th of the texels, which stays in the nearest cache, answers for all of those.

/// Edge of a block in texels, as a power of two.
const SHIFT: u32 = 2;
/// Edge of a block in texels.
pub(super) const BLOCK: i32 = 1 << SHIFT;
/// No single alpha.
const MIXED: u16 = 256;

/// For every block of an image the alpha that all its texels share, if they do.
#[derive(Clone, Debug, Default)]
pub(super) struct Blocks {
    across: usize,
    alpha: Vec<u16>,
}

impl Blocks {
    /// Looks for blocks of one alpha.
    pub fn new(width: u32, height: u32, alpha: &[u8]) -> Self {
        let (width, height) = (width as usize, height as usize);
        let (across, down) = (width.div_ceil(1 << SHIFT), height.div_ceil(1 << SHIFT));
        let mut blocks = Vec::with_capacity(across * down);
        for y in 0..down {
            for x in 0..across {
                // One texel more to the right and below: a sample mixes four neighbours.
                let columns = x << SHIFT..(((x + 1) << SHIFT) + 1).min(width);
                let mut rows = y << SHIFT..(((y + 1) << SHIFT) + 1).min(height);
                let first = alpha[rows.start * width + columns.start];
                let same = rows.all(|row| {
                    alpha[row * width + columns.start..row * width + columns.end]
                        .iter()
                        .all(|&a| a == first)
                });
                blocks.push(if same { first as u16 } else { MIXED });
            }
        }
        Self {
            across,
            alpha: blocks,
        }
    }

    /// The alpha of the texels `x`, `x + 1` in the rows `y`, `y + 1`, if the block knows it.
    #[inline]
    pub fn get(&self, x: i32, y: i32) -> Option<u8> {
        let block = (y as usize >> SHIFT) * self.across + (x as usize >> SHIFT);
        match self.alpha.get(block) {
            Some(&alpha) if alpha != MIXED => Some(alpha as u8),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_mixed_if_a_neighbour_of_its_last_texel_differs() {
        let mut alpha = vec![7u8; 64 * 64];
        alpha[20 * 64 + 16] = 9; // the first column of block 4, read together with column 15
        let blocks = Blocks::new(64, 64, &alpha);
        assert_eq!(blocks.get(3, 20), Some(7));
        assert_eq!(blocks.get(15, 20), None);
        assert_eq!(blocks.get(16, 20), None);
        assert_eq!(blocks.get(20, 20), Some(7));
        assert_eq!(blocks.get(15, 19), None);
        assert_eq!(blocks.get(15, 15), Some(7));
        assert_eq!(blocks.get(62, 62), Some(7));
    }
}
