//! A picture of samples that are hit or not, a word for each tile of 8 x 8.

use super::edges::TILE;
use super::pane::Pane;

/// Samples in tiles. Those beyond the picture's right and lower edge count as hit, so that a tile
/// that is full inside the picture is full.
pub(super) struct BitTiles {
    size: [i32; 2],
    across: i32,
    words: Vec<u64>,
}

impl BitTiles {
    /// From one byte a sample, 0 or 1, rows of `size[0]`.
    pub fn new(samples: &[u8], size: [i32; 2]) -> Self {
        let mut tiles = Self::empty(size);
        tiles.each_row(|word, shift, at| {
            for (x, &hit) in samples[at].iter().enumerate() {
                *word |= u64::from(hit) << (shift + x);
            }
        });
        tiles
    }

    /// A picture of nothing.
    pub fn empty(size: [i32; 2]) -> Self {
        let [across, down] = size.map(|s| (s + TILE - 1) / TILE);
        let mut tiles = Self {
            size,
            across,
            words: vec![0; across as usize * down as usize],
        };
        for y in 0..down {
            for x in 0..across {
                let outside = tiles.outside([x, y]);
                *tiles.at([x, y]) |= outside;
            }
        }
        tiles
    }

    /// All of it.
    pub fn whole(&self) -> Pane {
        Pane::of(self.size)
    }

    /// How many tiles there are.
    pub fn count(&self) -> usize {
        self.words.len()
    }

    /// The place of a tile among all, rows from the top.
    #[inline]
    pub fn number(&self, [x, y]: [i32; 2]) -> usize {
        (y * self.across + x) as usize
    }

    /// How many samples of the picture are hit.
    pub fn hits(&self) -> u64 {
        let (across, down) = (self.across, self.words.len() as i32 / self.across.max(1));
        let tiles = (0..down).flat_map(|y| (0..across).map(move |x| [x, y]));
        let hits = tiles.map(|tile| self.words[self.number(tile)] & !self.outside(tile));
        hits.map(|word| u64::from(word.count_ones())).sum()
    }

    /// The samples of a tile: bit `8 y + x`.
    #[inline]
    pub fn at(&mut self, tile: [i32; 2]) -> &mut u64 {
        let number = self.number(tile);
        &mut self.words[number]
    }

    /// Those of its samples that lie beyond the picture.
    #[inline]
    pub fn outside(&self, [x, y]: [i32; 2]) -> u64 {
        let [columns, rows] = [self.size[0] - x * TILE, self.size[1] - y * TILE];
        let mut inside = u64::MAX;
        if columns < TILE {
            inside = (1 << columns) - 1;
            (0..3).for_each(|k| inside |= inside << (TILE << k));
        }
        if rows < TILE {
            inside &= (1 << (TILE * rows)) - 1;
        }
        !inside
    }

    /// Writes one byte a sample.
    pub fn write(mut self, samples: &mut [u8]) {
        self.each_row(|word, shift, at| {
            for (x, hit) in samples[at].iter_mut().enumerate() {
                *hit = (*word >> (shift + x)) as u8 & 1;
            }
        });
    }

    /// Calls `row` for each row of each tile with its word, the place of its first bit, and its samples'
    /// places in a picture of rows.
    fn each_row(&mut self, mut row: impl FnMut(&mut u64, usize, std::ops::Range<usize>)) {
        let (width, tile) = (self.size[0] as usize, TILE as usize);
        if width == 0 {
            return;
        }
        for y in 0..self.size[1] as usize {
            let words = &mut self.words[y / tile * self.across as usize..];
            for (x, word) in (0..width).step_by(tile).zip(words) {
                let at = y * width + x..y * width + (x + tile).min(width);
                row(word, y % tile * tile, at);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_give_back_the_samples_and_are_full_where_the_picture_is() {
        for size in [[8, 8], [19, 13], [3, 2], [64, 9]] {
            let count = (size[0] * size[1]) as usize;
            let samples: Vec<u8> = (0..count).map(|i| u8::from(i * i % 7 < 3)).collect();
            let tiles = BitTiles::new(&samples, size);
            let hits: usize = samples.iter().map(|&s| usize::from(s)).sum();
            assert_eq!(tiles.hits(), hits as u64);
            let mut again = vec![9; count];
            tiles.write(&mut again);
            assert_eq!(again, samples, "{size:?}");
            let mut full = BitTiles::new(&vec![1; count], size);
            assert_eq!(full.hits(), count as u64);
            let last = size.map(|s| (s - 1) / TILE);
            assert_eq!(*full.at(last), !0, "{size:?}");
        }
    }
}
