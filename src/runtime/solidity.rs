//! How solid a cell is: the share of rays that its polygons stop (El-Sana and others 2001, section 4.1).

use glam::{IVec3, Vec2, Vec3};

use super::cells::Cells;
use super::place::Place;

/// Samples along the edge of a cell's face.
const SIDE: usize = 16;
/// 64-bit words of a cell's three faces.
const WORDS: usize = 3 * SIDE * SIDE / 64;

/// Solidity by face projection (equation 1): the union of the areas that a cell's polygons cover on
/// three of its faces, over the area of those faces.
///
/// `passes(triangle, v, w)` says whether a triangle is there at the point with the weights v and w of its
/// second and third corner: leaves have holes where their texture is transparent. Areas are
/// sampled at 16 x 16 points a face; a line through such a point meets the triangle in one cell at
/// most, so that nothing needs to be clipped.
pub fn by_faces(
    cells: &mut Cells,
    triangles: &[[Vec3; 3]],
    passes: impl Fn(usize, f32, f32) -> bool,
) {
    let mut masks = vec![0u64; cells.solidity().len() * WORDS];
    for (t, corners) in triangles.iter().enumerate() {
        // In units of cells, so that every face has the same samples.
        let at = corners.map(|p| (p - cells.low()) / cells.edge());
        for axis in 0..3 {
            mark(cells, axis, at, &mut masks, |v, w| passes(t, v, w));
        }
    }
    // A face counts by its area.
    let edge = cells.edge();
    let area = Vec3::new(edge.y * edge.z, edge.z * edge.x, edge.x * edge.y);
    let whole = area.element_sum() * (SIDE * SIDE) as f32;
    for (index, mask) in masks.chunks_exact(WORDS).enumerate() {
        let covered = |axis: usize| -> f32 {
            let words = &mask[axis * WORDS / 3..(axis + 1) * WORDS / 3];
            area[axis] * words.iter().map(|w| w.count_ones()).sum::<u32>() as f32
        };
        cells.set_index(index, (covered(0) + covered(1) + covered(2)) / whole);
    }
}

/// Marks the samples of the faces across `axis` that a triangle covers.
fn mark(
    cells: &Cells,
    axis: usize,
    at: [Vec3; 3],
    masks: &mut [u64],
    passes: impl Fn(f32, f32) -> bool,
) {
    let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
    let flat = at.map(|p| Vec2::new(p[a], p[b]) * SIDE as f32);
    let double_area = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]);
    if double_area.abs() < 1e-9 {
        return;
    }
    let most = Vec2::new(cells.count()[a] as f32, cells.count()[b] as f32) * SIDE as f32;
    let low = flat[0].min(flat[1]).min(flat[2]).max(Vec2::ZERO);
    let high = flat[0].max(flat[1]).max(flat[2]).min(most);
    for y in low.y as usize..high.y.ceil().max(0.0) as usize {
        for x in low.x as usize..high.x.ceil().max(0.0) as usize {
            let q = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) - flat[0];
            let v = q.perp_dot(flat[2] - flat[0]) / double_area;
            let w = (flat[1] - flat[0]).perp_dot(q) / double_area;
            if v < 0.0 || w < 0.0 || v + w > 1.0 || !passes(v, w) {
                continue;
            }
            let depth = at[0][axis] + v * (at[1] - at[0])[axis] + w * (at[2] - at[0])[axis];
            let mut cell = IVec3::ZERO;
            cell[axis] = (depth.floor() as i32).clamp(0, cells.count()[axis] - 1);
            (cell[a], cell[b]) = ((x / SIDE) as i32, (y / SIDE) as i32);
            if let Some(index) = cells.index(cell) {
                let bit = axis * SIDE * SIDE + (y % SIDE) * SIDE + x % SIDE;
                masks[index * WORDS + bit / 64] |= 1 << (bit % 64);
            }
        }
    }
}

/// Solidity by ray shooting (equation 3): the share of rays through the cell's bounding sphere that
/// don't pass the cell. One random ray starts in each of `rays` regions of equal area on half of
/// the sphere; it is aimed at a random point of the cell, since a ray that misses the cell says
/// nothing about it.
///
/// `passes` is as in [`by_faces`].
pub fn by_rays(
    cells: &mut Cells,
    triangles: &[[Vec3; 3]],
    rays: u32,
    passes: impl Fn(usize, f32, f32) -> bool,
) {
    let mut inside = vec![Vec::new(); cells.solidity().len()];
    for (t, corners) in triangles.iter().enumerate() {
        let low = corners[0].min(corners[1]).min(corners[2]);
        let high = corners[0].max(corners[1]).max(corners[2]);
        let last = cells.count() - 1;
        let from = cells.cell_of(low).clamp(IVec3::ZERO, last);
        let to = cells.cell_of(high).clamp(IVec3::ZERO, last);
        for z in from.z..=to.z {
            for y in from.y..=to.y {
                for x in from.x..=to.x {
                    if let Some(index) = cells.index(IVec3::new(x, y, z)) {
                        inside[index].push(t as u32);
                    }
                }
            }
        }
    }
    let count = cells.count();
    for (index, members) in inside.iter().enumerate() {
        let i = index as i32;
        let cell = IVec3::new(i % count.x, i / count.x % count.y, i / (count.x * count.y));
        let mut random = Random(index as u64);
        let stopped = (0..rays).filter(|&ray| {
            let (from, way) = shoot(cells, cell, ray, rays, &mut random);
            let low = cells.middle(cell) - 0.5 * cells.edge();
            members.iter().any(|&t| {
                let hit = intersect(triangles[t as usize], from, way);
                hit.is_some_and(|(at, v, w)| {
                    // What lies in the neighbour's half of the triangle is the neighbour's.
                    let p = (from + way * at - low) / cells.edge();
                    let here =
                        p.cmpge(Vec3::splat(-1e-4)).all() && p.cmple(Vec3::splat(1.0001)).all();
                    here && passes(t as usize, v, w)
                })
            })
        });
        let share = stopped.count() as f32 / rays.max(1) as f32;
        cells.set_index(index, share);
    }
}

/// A ray from the bounding sphere of a cell into the cell: start and unit direction.
fn shoot(cells: &Cells, cell: IVec3, ray: u32, rays: u32, random: &mut Random) -> (Vec3, Vec3) {
    // Regions of equal area: bands of equal height, the golden angle apart (a spiral), jittered.
    let height = (ray as f32 + random.next()) / rays as f32;
    let angle = (ray as f32 + random.next() - 0.5) * 2.399_963;
    let across = (1.0 - height * height).sqrt();
    let on_sphere = Vec3::new(across * angle.cos(), height, across * angle.sin());
    let from = cells.middle(cell) + on_sphere * (0.5 * cells.edge().length());
    let inside = Vec3::new(random.next(), random.next(), random.next()) - 0.5;
    let to = cells.middle(cell) + inside * cells.edge();
    (from, (to - from).normalize_or(-on_sphere))
}

/// Where a ray meets a triangle: distance and weights of corners 1 and 2 (Moller and Trumbore 1997).
fn intersect([a, b, c]: [Vec3; 3], from: Vec3, way: Vec3) -> Option<(f32, f32, f32)> {
    let (ab, ac) = (b - a, c - a);
    let across = way.cross(ac);
    let det = ab.dot(across);
    if det.abs() <= 1e-12 * ab.length() * ac.length() {
        return None;
    }
    let to = from - a;
    let v = to.dot(across) / det;
    let turned = to.cross(ab);
    let w = way.dot(turned) / det;
    let distance = ac.dot(turned) / det;
    (v >= 0.0 && w >= 0.0 && v + w <= 1.0 && distance >= 0.0).then_some((distance, v, w))
}

/// SplitMix64 (Steele, Lea and Flood 2014): the same rays on every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    }
}

/// Adds a tree's cells to those of a forest. Solidities are turned into extinction a metre, spread
/// over the forest's (larger) cells by volume, and back: a ray that crosses two half-empty trees in
/// one cell is stopped as often as by both.
///
/// `extinction` is one sum for each cell of the forest, zero at first; [`Cells`] are set from it.
pub fn splat(forest: &mut Cells, extinction: &mut [f32], tree: &Cells, place: &Place) {
    let (edge, count) = (tree.edge(), tree.count());
    let length = edge.element_sum() / 3.0 * place.scale;
    let volume = edge.element_product() * place.scale.powi(3);
    let own = forest.edge();
    let (own_length, own_volume) = (own.element_sum() / 3.0, own.element_product());
    for z in 0..count.z {
        for y in 0..count.y {
            for x in 0..count.x {
                let cell = IVec3::new(x, y, z);
                let solid = tree.solidity_at(cell).min(MOST_SOLID);
                if solid <= 0.0 {
                    continue;
                }
                let at = forest.cell_of(place.to_world(tree.middle(cell)));
                if let Some(index) = forest.index(at) {
                    extinction[index] += -(1.0 - solid).ln() / length * volume / own_volume;
                    forest.set_index(index, 1.0 - (-extinction[index] * own_length).exp());
                }
            }
        }
    }
}

/// Extinction has no number for a solidity of one.
const MOST_SOLID: f32 = 0.999;

#[cfg(test)]
mod tests {
    use super::*;

    fn one_cell() -> Cells {
        Cells::new(Vec3::ZERO, Vec3::ONE, [1, 1, 1])
    }

    /// The rectangle from a over b and over c.
    fn sheet(a: Vec3, b: Vec3, c: Vec3) -> [[Vec3; 3]; 2] {
        [[a, b, b + c - a], [a, b + c - a, c]]
    }

    #[test]
    fn a_sheet_across_one_axis_covers_one_face_of_three() {
        let mut cells = one_cell();
        let wall = sheet(
            Vec3::X * 0.3,
            Vec3::new(0.3, 1.0, 0.0),
            Vec3::new(0.3, 0.0, 1.0),
        );
        by_faces(&mut cells, &wall, |_, _, _| true);
        assert!((cells.solidity()[0] - 1.0 / 3.0).abs() < 1e-6);
        // The same sheet twice covers no more: it is a union.
        by_faces(&mut cells, &[wall, wall].concat(), |_, _, _| true);
        assert!((cells.solidity()[0] - 1.0 / 3.0).abs() < 1e-6);
        by_faces(&mut cells, &wall, |_, _, _| false);
        assert_eq!(cells.solidity()[0], 0.0);
    }

    #[test]
    fn a_sheet_belongs_to_the_cells_that_it_crosses() {
        let mut cells = Cells::new(Vec3::ZERO, Vec3::new(2.0, 1.0, 1.0), [2, 1, 1]);
        let wall = sheet(
            Vec3::X * 1.5,
            Vec3::new(1.5, 1.0, 0.0),
            Vec3::new(1.5, 0.0, 1.0),
        );
        by_faces(&mut cells, &wall, |_, _, _| true);
        assert_eq!(cells.solidity()[0], 0.0);
        assert!((cells.solidity()[1] - 1.0 / 3.0).abs() < 1e-6);
        by_rays(&mut cells, &wall, 256, |_, _, _| true);
        assert_eq!(cells.solidity()[0], 0.0);
        assert!(cells.solidity()[1] > 0.3, "{:?}", cells.solidity());
    }

    #[test]
    fn a_closed_box_stops_every_ray_and_an_empty_cell_none() {
        let corner = |i: usize| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32);
        let faces = [
            [0, 1, 2],
            [4, 5, 6],
            [0, 1, 4],
            [2, 3, 6],
            [0, 2, 4],
            [1, 3, 5],
        ];
        let walls: Vec<[Vec3; 3]> = faces
            .iter()
            .flat_map(|&[a, b, c]| sheet(corner(a), corner(b), corner(c)))
            .collect();
        let mut cells = one_cell();
        by_rays(&mut cells, &walls, 500, |_, _, _| true);
        assert!(cells.solidity()[0] > 0.99, "{:?}", cells.solidity());
        by_rays(&mut cells, &[], 500, |_, _, _| true);
        assert_eq!(cells.solidity()[0], 0.0);
        by_faces(&mut cells, &walls, |_, _, _| true);
        assert_eq!(cells.solidity()[0], 1.0);
    }

    #[test]
    fn a_tree_splat_into_cells_of_its_own_size_keeps_its_solidity() {
        let mut tree = Cells::new(Vec3::ZERO, Vec3::splat(2.0), [2, 2, 2]);
        tree.set(IVec3::new(1, 0, 1), 0.4);
        let mut forest = Cells::new(Vec3::ZERO, Vec3::splat(4.0), [4, 4, 4]);
        let mut extinction = vec![0.0; 64];
        splat(
            &mut forest,
            &mut extinction,
            &tree,
            &Place::at(Vec3::new(2.0, 0.0, 0.0)),
        );
        assert!((forest.solidity_at(IVec3::new(3, 0, 1)) - 0.4).abs() < 1e-6);
        assert_eq!(forest.solidity().iter().filter(|s| **s > 0.0).count(), 1);
        // Two trees in one place let 0.6 * 0.6 of the rays pass.
        splat(
            &mut forest,
            &mut extinction,
            &tree,
            &Place::at(Vec3::new(2.0, 0.0, 0.0)),
        );
        assert!((forest.solidity_at(IVec3::new(3, 0, 1)) - 0.64).abs() < 1e-6);
    }
}
