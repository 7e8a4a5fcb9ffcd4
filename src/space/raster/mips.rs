//! Box-filtered mips: each texel is the mean of the texels of the finer level under it.

use std::sync::LazyLock;

use super::level::Level;
use super::srgb::{lights, srgb_from_linear};

/// sRGB byte of linear light in 4096 steps of its square root (fine where sRGB is steep).
static ENCODE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let encode = |i: usize| {
        let root = i as f32 / 4095.0;
        (srgb_from_linear(root * root) * 255.0 + 0.5) as u8
    };
    (0..4096).map(encode).collect()
});

/// The next coarser level: half the size, rounded down, at least one texel.
pub(super) fn halved(finer: &Level) -> Level {
    let (width, height) = ((finer.width / 2).max(1), (finer.height / 2).max(1));
    let mut alpha = vec![0; width as usize * height as usize];
    halve_alpha(finer, width, height, &mut alpha);
    let rgb = if finer.rgb.is_empty() {
        Vec::new()
    } else {
        halve_rgb(finer, width, height)
    };
    Level::new(width, height, alpha, rgb)
}

/// Averages alpha as it is, rounded.
pub(super) fn halve_alpha(finer: &Level, width: u32, height: u32, out: &mut [u8]) {
    let row = finer.width as usize;
    if finer.width == width * 2 && finer.height == height * 2 {
        // Even sizes, nearly always: two rows to one, without lists of indices.
        let pairs = finer.alpha.chunks_exact(2 * row);
        for (out, pair) in out.chunks_exact_mut(width as usize).zip(pairs) {
            let ((above, _), (below, _)) =
                (pair[..row].as_chunks::<2>(), pair[row..].as_chunks::<2>());
            for ((out, a), b) in out.iter_mut().zip(above).zip(below) {
                let sum = a[0] as u32 + a[1] as u32 + b[0] as u32 + b[1] as u32;
                *out = ((sum + 2) / 4) as u8;
            }
        }
        return;
    }
    let mut out = out.iter_mut();
    for_each_box(finer, width, height, |indices| {
        let sum: u32 = indices.iter().map(|&i| finer.alpha[i] as u32).sum();
        let count = indices.len() as u32;
        if let Some(out) = out.next() {
            *out = ((sum + count / 2) / count) as u8;
        }
    });
}

/// Averages light: decoded from sRGB, not weighted by alpha, encoded again.
fn halve_rgb(finer: &Level, width: u32, height: u32) -> Vec<[u8; 3]> {
    let (encode, lights) = (&*ENCODE, lights());
    let mut out = Vec::with_capacity(width as usize * height as usize);
    for_each_box(finer, width, height, |indices| {
        out.push(std::array::from_fn(|channel| {
            let sum: f32 = indices
                .iter()
                .map(|&i| lights[finer.rgb[i][channel] as usize])
                .sum();
            let mean = sum / indices.len() as f32;
            encode[(mean.sqrt() * 4095.0 + 0.5) as usize]
        }));
    });
    out
}

/// The texels of the finer level under each texel of the coarser one, row by row. An odd edge
/// gives its last texel to the box beside it (three texels instead of two).
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
