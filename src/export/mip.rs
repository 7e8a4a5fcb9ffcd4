//! Halves images as a mip chain does.

use crate::botany::model::Image;
use crate::space::texture::{linear, srgb};

/// Halves an image (box filter; colour in linear light, weighted by alpha) until no side is
/// longer than `most` texels.
pub fn shrink(image: &mut Image, most: u32) {
    while image.width > most || image.height > most {
        *image = halved(image);
    }
}

fn halved(image: &Image) -> Image {
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
                    let value = linear(image.rgba[at + c]);
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
                rgba.push(srgb(value));
            }
            rgba.push((alpha / 4.0 * 255.0 + 0.5) as u8);
        }
    }
    Image {
        name: image.name.clone(),
        width: w,
        height: h,
        rgba,
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
            .concat(),
        };
        shrink(&mut image, 1);
        assert_eq!(image.rgba, [200, 100, 50, 128]);
    }
}
