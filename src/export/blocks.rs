//! Pages of several bakes in one: blocks whose sides are powers of two, each on a multiple of its
//! sides, so that no mip down to a block's own last one mixes it with its neighbours.

/// Places blocks of `sizes` (texels, powers of two); returns their left upper corners and the size
/// of the page, powers of two as well.
pub fn place(sizes: &[[u32; 2]]) -> (Vec<[u32; 2]>, [u32; 2]) {
    let area: u64 = sizes
        .iter()
        .map(|s| u64::from(s[0]) * u64::from(s[1]))
        .sum();
    let widest = sizes.iter().map(|s| s[0]).max().unwrap_or(1);
    let side = (area as f64).sqrt().ceil() as u32;
    let width = side.next_power_of_two().max(widest).max(1);
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    // High ones first: each shelf is as high as its first block, and all shelves before were higher.
    order.sort_by_key(|&i| (std::cmp::Reverse([sizes[i][1], sizes[i][0]]), i));
    let mut places = vec![[0; 2]; sizes.len()];
    let (mut x, mut y, mut shelf) = (0u32, 0u32, 0u32);
    for i in order {
        let [w, h] = sizes[i];
        x = x.next_multiple_of(w.max(1));
        if shelf == 0 || x + w > width {
            (x, y, shelf) = (0, y + shelf, h);
        }
        places[i] = [x, y];
        x += w;
    }
    (places, [width, (y + shelf).next_power_of_two().max(1)])
}

/// Copies rows of RGBA texels into a page.
pub fn copy(page: &mut [u8], page_width: u32, block: &[u8], [w, h]: [u32; 2], [x, y]: [u32; 2]) {
    let row = w as usize * 4;
    for (line, texels) in block.chunks_exact(row).take(h as usize).enumerate() {
        let at = ((y as usize + line) * page_width as usize + x as usize) * 4;
        page[at..at + row].copy_from_slice(texels);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_lie_apart_on_multiples_of_their_sides() {
        let sizes: Vec<[u32; 2]> = (0..60u32)
            .map(|i| [1 << (3 + i * 7 % 5), 1 << (3 + i * 5 % 4)])
            .collect();
        let (places, page) = place(&sizes);
        assert!(page.iter().all(|s| s.is_power_of_two()));
        let mut taken = vec![0u8; (page[0] * page[1]) as usize];
        for (&[x, y], &[w, h]) in places.iter().zip(&sizes) {
            assert!(x % w == 0 && y % h == 0 && x + w <= page[0] && y + h <= page[1]);
            for row in y..y + h {
                for column in x..x + w {
                    taken[(row * page[0] + column) as usize] += 1;
                }
            }
        }
        assert!(taken.iter().all(|&t| t <= 1), "blocks overlap");
        let used = taken.iter().filter(|&&t| t == 1).count();
        assert!(4 * used > taken.len(), "{used} of {}", taken.len());
    }

    #[test]
    fn nothing_and_one_block_have_a_page() {
        assert_eq!(place(&[]), (Vec::new(), [1, 1]));
        assert_eq!(place(&[[64, 32]]), (vec![[0, 0]], [64, 32]));
    }

    #[test]
    fn rows_land_where_they_belong() {
        let mut page = vec![0; 4 * 4 * 4];
        copy(&mut page, 4, &[7; 16], [2, 2], [2, 1]);
        let set: Vec<usize> = (0..16).filter(|&i| page[4 * i] == 7).collect();
        assert_eq!(set, [6, 7, 10, 11]);
    }
}
