//! Directions on an octahedron that is folded out into a square.

use glam::{Vec2, Vec2Swizzles, Vec3};

/// Unit vector of a cell (rows from the first) of `grid` x `grid`: corners of the square are cells,
/// too. The whole sphere, or its upper half (the square turned by 45 degrees).
pub fn direction(cell: u32, grid: u32, sphere: bool) -> Vec3 {
    let at = Vec2::new((cell % grid) as f32, (cell / grid) as f32);
    let square = at / (grid - 1) as f32 * 2.0 - 1.0;
    let flat = if sphere {
        square
    } else {
        Vec2::new(square.x + square.y, square.x - square.y) * 0.5
    };
    let height = 1.0 - flat.x.abs() - flat.y.abs();
    let folded = if height < 0.0 {
        (1.0 - flat.yx().abs()) * sign(flat)
    } else {
        flat
    };
    Vec3::new(folded.x, height, folded.y).normalize_or(Vec3::Y)
}

/// Where a unit vector lies on the square, in cells; of the upper half below the horizon: on it.
fn position(direction: Vec3, grid: u32, sphere: bool) -> Vec2 {
    let mut d = direction;
    if !sphere {
        d.y = d.y.max(0.0);
    }
    d /= (d.x.abs() + d.y.abs() + d.z.abs()).max(1e-6);
    let flat = Vec2::new(d.x, d.z);
    let square = match (sphere, d.y < 0.0) {
        (false, _) => Vec2::new(flat.x + flat.y, flat.x - flat.y),
        (true, false) => flat,
        (true, true) => (1.0 - flat.yx().abs()) * sign(flat),
    };
    (square.clamp(Vec2::NEG_ONE, Vec2::ONE) * 0.5 + 0.5) * (grid - 1) as f32
}

/// The corners of the triangle of cells around a direction, and their weights (sum one).
pub fn nearest_three(towards_eye: Vec3, grid: u32, sphere: bool) -> [(u32, f32); 3] {
    let at = position(towards_eye, grid, sphere);
    let low = at.floor().min(Vec2::splat((grid - 2) as f32));
    let part = at - low;
    let cell = |x: f32, y: f32| (low.y + y) as u32 * grid + (low.x + x) as u32;
    // The cell's square is cut along the diagonal from its first corner.
    let (side, [x, y]) = if part.x > part.y {
        (part.x - part.y, [1.0, 0.0])
    } else {
        (part.y - part.x, [0.0, 1.0])
    };
    [
        (cell(0.0, 0.0), 1.0 - part.max_element()),
        (cell(x, y), side),
        (cell(1.0, 1.0), part.min_element()),
    ]
}

/// Plus or minus one; of zero plus one.
fn sign(v: Vec2) -> Vec2 {
    Vec2::new(1.0f32.copysign(v.x), 1.0f32.copysign(v.y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cells_own_direction_shows_that_cell_alone() {
        for sphere in [false, true] {
            for cell in 0..256 {
                let d = direction(cell, 16, sphere);
                assert!((d.length() - 1.0).abs() < 1e-5 && (sphere || d.y > -1e-6));
                let shown = nearest_three(d, 16, sphere);
                let alike: f32 = shown
                    .iter()
                    .filter(|s| direction(s.0, 16, sphere).dot(d) > 0.9999)
                    .map(|s| s.1)
                    .sum();
                assert!(alike > 0.99, "cell {cell}: {shown:?}");
            }
        }
    }

    #[test]
    fn weights_sum_to_one_and_cells_are_near() {
        for i in 0..500 {
            // Points of a spiral over the sphere.
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / 500.0;
            let (sin, cos) = (2.4 * i as f32).sin_cos();
            let flat = (1.0 - y * y).sqrt();
            let d = Vec3::new(sin * flat, y, cos * flat);
            for sphere in [false, true] {
                if !sphere && d.y < 0.0 {
                    continue;
                }
                let shown = nearest_three(d, 16, sphere);
                let sum: f32 = shown.iter().map(|s| s.1).sum();
                assert!((sum - 1.0).abs() < 1e-5);
                // The map stretches by up to a factor of three: a cell is up to half a radian wide.
                let near = |s: &(u32, f32)| s.1 < 1e-3 || direction(s.0, 16, sphere).dot(d) > 0.85;
                assert!(shown.iter().all(near), "{d}: {shown:?}");
            }
        }
    }
}
