//! Halves images as a mip chain does.

use std::sync::Arc;

use crate::botany::model::Image;
use crate::space::texture::{linear, srgb};

/// Halves an image by a box filter: colours in linear light, weighted by alpha; other numbers (normals,
/// roughness) as they are.
pub fn halve(image: &mut Image, colored: bool) {
    *image = if colored {
        halved(image, linear, srgb)
    } else {
        halved(image, |v| f32::from(v) / 255.0, |v| (v * 255.0 + 0.5) as u8)
    };
}

fn halved(image: &Image, decode: impl Fn(u8) -> f32, encode: impl Fn(f32) -> u8) -> Image {
    let (w, h) = ((image.width / 2).max(1), (image.height / 2).max(1));
    let mut rgba = Vec::with_capacity((w * h * 4) as usize);
    for y in 0..h {
        for x in 0..w {
            let (mut color, mut alpha, mut plain) = ([0.0f32; 3], 0.0f32, [0.0f32; 3]);
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let sx = (2 * x + dx).min(image.width - 1);
                let sy = (2 * y + dy).min(image.height - 1);
                let at = (sy as usize * image.width as usize + sx as usize) * 4;
                let a = f32::from(image.rgba[at + 3]) / 255.0;
                for c in 0..3 {
                    let value = decode(image.rgba[at + c]);
                    color[c] += value * a;
                    plain[c] += value;
                }
                alpha += a;
            }
            for c in 0..3 {
                let value = if alpha > 0.0 {
                    color[c] / alpha
                } else {
                    plain[c] / 4.0
                };
                rgba.push(encode(value));
            }
            rgba.push((alpha / 4.0 * 255.0 + 0.5) as u8);
        }
    }
    Image {
        name: image.name.clone(),
        width: w,
        height: h,
        rgba: Arc::new(rgba),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transparent_texels_do_not_darken_the_mean() {
        let mut image = Image {
            name: String::new(),
            width: 2,
            height: 2,
            rgba: [
                [200, 100, 50, 255],
                [0, 0, 0, 0],
                [200, 100, 50, 255],
                [0, 0, 0, 0],
            ]
            .concat()
            .into(),
        };
        halve(&mut image, true);
        assert_eq!(image.rgba[..], [200, 100, 50, 128]);
    }

    #[test]
    fn normals_are_averaged_as_numbers_and_colours_as_light() {
        let texel = |v: u8| [v, v, v, 255];
        let image = |colored: bool| {
            let mut image = Image {
                name: String::new(),
                width: 2,
                height: 1,
                rgba: Arc::new([texel(0), texel(200)].concat()),
            };
            halve(&mut image, colored);
            image.rgba[0]
        };
        assert_eq!(image(false), 100);
        // Half the light of 200 (0.578 linear) is 0.289: sRGB 146.
        assert_eq!(image(true), 146);
    }
}
