//! Maps that are coarser than colours.
//!
//! A card's outline and colour are what is seen of it; its normals and its occlusion, roughness and
//! metalness only shade it. With a quarter as many texels along a line the three images of a page take
//! little more than a third of the bytes (1 + 1/16 + 1/16 for 3), and silhouettes stay as they are to the
//! last pixel.

use std::sync::Arc;

use glam::Vec3;
use rayon::prelude::*;

use crate::botany::model::Image;

/// Halves each side of the maps of light of a page (base colour, normals, others; as many as it has) so many times.
/// Where they may be coarser at all, a map that is the same everywhere is one texel.
pub fn coarsen_light(page: &mut [Image], halvings: u32) {
    if halvings > 0 {
        page.iter_mut().skip(1).for_each(shrink_if_same);
    }
    for _ in 0..halvings {
        for (number, map) in page.iter_mut().enumerate().skip(1) {
            *map = match number {
                1 => halved_normals(map),
                _ => halved(map),
            };
        }
    }
}

/// Makes an image whose texels are all the same one texel.
fn shrink_if_same(image: &mut Image) {
    let mut texels = image.rgba.chunks_exact(4);
    let Some(first) = texels.next() else {
        return;
    };
    if texels.all(|texel| texel == first) {
        (image.width, image.height, image.rgba) = (1, 1, Arc::new(first.to_vec()));
    }
}

/// A map of half the width and height: each texel the mean of four. A side of one texel stays.
pub fn halved(image: &Image) -> Image {
    mean(image, |texels| {
        let sum = texels.iter().fold([0u32; 4], |sum, t| {
            std::array::from_fn(|k| sum[k] + u32::from(t[k]))
        });
        sum.map(|s| ((s + 2) / 4) as u8)
    })
}

/// A map of normals of half the width and height: each the direction of the mean of four.
pub fn halved_normals(image: &Image) -> Image {
    mean(image, |texels| {
        let normal =
            |t: &[u8; 4]| Vec3::from([t[0], t[1], t[2]].map(|c| f32::from(c) / 127.5 - 1.0));
        let sum: Vec3 = texels.iter().map(normal).sum();
        // What is left where they cancel is rounding: the card's own normal.
        let direction = match sum.length() < 0.4 {
            true => Vec3::Z,
            false => sum.normalize(),
        };
        let mean = direction * 0.5 + 0.5;
        let [x, y, z] = mean.to_array().map(|c| (c * 255.0 + 0.5) as u8);
        [x, y, z, 255]
    })
}

/// An image of half the width and height whose texels `of` makes of those that lie there.
fn mean(image: &Image, of: impl Fn([[u8; 4]; 4]) -> [u8; 4] + Sync) -> Image {
    let [width, height] = [image.width, image.height].map(|side| (side / 2).max(1));
    // A side of one texel: the same texel twice.
    let texel = |x: u32, y: u32| {
        let [x, y] = [x.min(image.width - 1), y.min(image.height - 1)];
        let at = (y * image.width + x) as usize * 4;
        [0, 1, 2, 3].map(|k| image.rgba[at + k])
    };
    let mut rgba = vec![0; (width * height * 4) as usize];
    let rows = rgba.par_chunks_mut(4 * width as usize);
    (0..height).into_par_iter().zip(rows).for_each(|(y, row)| {
        for (x, out) in (0..).zip(row.chunks_mut(4)) {
            let (u, v) = (2 * x, 2 * y);
            let [left, right] = [u, u + 1].map(|u| [texel(u, v), texel(u, v + 1)]);
            out.copy_from_slice(&of([left[0], right[0], left[1], right[1]]));
        }
    });
    Image {
        name: image.name.clone(),
        width,
        height,
        rgba: Arc::new(rgba),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, texels: &[[u8; 4]]) -> Image {
        Image {
            name: "map".into(),
            width,
            height,
            rgba: Arc::new(texels.concat()),
        }
    }

    #[test]
    fn a_texel_is_the_mean_of_four() {
        let four = [
            [0, 10, 100, 255],
            [1, 20, 100, 255],
            [2, 30, 100, 255],
            [4, 41, 100, 255],
        ];
        let eight = [
            four[0], four[1], [7; 4], [9; 4], four[2], four[3], [7; 4], [9; 4],
        ];
        let half = halved(&image(4, 2, &eight));
        assert_eq!((half.width, half.height), (2, 1));
        // (0 + 1 + 2 + 4) / 4 = 1.75, (10 + 20 + 30 + 41) / 4 = 25.25.
        assert_eq!(half.rgba[..], [2, 25, 100, 255, 8, 8, 8, 8]);
        // One row: pairs of it.
        let row = halved(&image(4, 1, &eight[..4]));
        assert_eq!((row.width, row.height), (2, 1));
        assert_eq!(row.rgba[..2], [1, 15]);
        assert_eq!(halved(&image(1, 1, &four[..1])).rgba[..], four[0]);
    }

    #[test]
    fn what_is_the_same_everywhere_takes_one_texel() {
        let shrunk = |texels: &[[u8; 4]], [width, height]: [u32; 2]| {
            let mut image = image(width, height, texels);
            shrink_if_same(&mut image);
            image
        };
        let mut texels = [[7, 8, 9, 255]; 8];
        let same = shrunk(&texels, [4, 2]);
        assert_eq!((same.width, same.height), (1, 1));
        assert_eq!((&same.rgba[..], &*same.name), (&[7, 8, 9, 255][..], "map"));
        texels[7][2] = 10;
        let other = shrunk(&texels, [4, 2]);
        assert_eq!((other.width, other.height, other.rgba.len()), (4, 2, 32));
        assert_eq!(shrunk(&[], [0, 0]).width, 0);
    }

    #[test]
    fn light_becomes_coarser_and_colours_stay() {
        let map = |first, rest| {
            let mut texels = [rest; 32];
            texels[0] = first;
            image(8, 4, &texels)
        };
        let page = [
            map([1, 2, 3, 4], [1, 2, 3, 4]),
            map([128, 128, 255, 255], [255, 128, 128, 255]),
            map([5, 6, 7, 255], [5, 6, 7, 255]),
        ];
        let sizes = |halvings| {
            let mut page = page.clone();
            coarsen_light(&mut page, halvings);
            assert_eq!(page[2].rgba[..4], [5, 6, 7, 255]);
            page.map(|i| [i.width, i.height])
        };
        assert_eq!(sizes(0), [[8, 4]; 3]);
        assert_eq!(sizes(1), [[8, 4], [4, 2], [1, 1]]);
        assert_eq!(sizes(2), [[8, 4], [2, 1], [1, 1]]);
        let mut unlit = [page[0].clone()];
        coarsen_light(&mut unlit, 2);
        assert_eq!(unlit[0].width, 8);
        let [color, normals, _] = page;
        let mut even = [color, normals];
        coarsen_light(&mut even, 2);
        assert_eq!(even.map(|i| [i.width, i.height]), [[8, 4], [2, 1]]);
    }

    #[test]
    fn normals_stay_of_unit_length_and_between_those_they_are_made_of() {
        // Along x and along z, twice each: halfway between.
        let (x, z) = ([255, 128, 128, 255], [128, 128, 255, 255]);
        let half = halved_normals(&image(2, 2, &[x, z, z, x]));
        let n = Vec3::from(
            [half.rgba[0], half.rgba[1], half.rgba[2]].map(|c| f32::from(c) / 127.5 - 1.0),
        );
        assert!((n.length() - 1.0).abs() < 0.01, "{n}");
        assert!((n.x - n.z).abs() < 0.01 && n.y.abs() < 0.01, "{n}");
        // Opposite ones cancel: the card's own.
        let up = halved_normals(&image(2, 1, &[[255, 128, 128, 255], [0, 128, 128, 255]]));
        assert_eq!(up.rgba[2], 255);
    }
}
