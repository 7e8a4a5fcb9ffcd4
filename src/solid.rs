//! Trees as grids of cells that know how solid they are.

use glam::{Vec2, Vec3};

use crate::botany::Model;
use crate::export::project::AlphaTest;
use crate::runtime::{Cells, by_faces, by_rays};

/// The cells of a model in its normalised space, `longest` of them along its longest side; solid by
/// face projection, or by so many rays a cell (El-Sana and others 2001, section 4.1).
pub fn cells(model: &Model, longest: u32, rays: Option<u32>) -> Cells {
    let all = 0..model.triangles.len() as u32;
    let triangles: Vec<[Vec3; 3]> = all.clone().map(|t| model.corners(t)).collect();
    let points = || triangles.iter().flatten();
    let low = points().fold(Vec3::MAX, |a, &p| a.min(p));
    let high = points().fold(Vec3::MIN, |a, &p| a.max(p));
    let mut cells = Cells::cubic(low, high, longest);
    let tests: Vec<AlphaTest> = all.map(|t| AlphaTest::of(model, t)).collect();
    let passes = |t: usize, v: f32, w: f32| tests[t].passes(Vec2::new(v, w));
    match rays {
        None => by_faces(&mut cells, &triangles, passes),
        Some(rays) => by_rays(&mut cells, &triangles, rays, passes),
    }
    cells
}
