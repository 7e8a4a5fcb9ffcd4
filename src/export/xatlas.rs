//! Packs charts by their outlines with xatlas: they keep their shape and lie in each other's gaps.
//!
//! The library wants care. Of UV meshes it leaves a field unset that its Rust side then reads, so
//! outlines go in as a mesh in space, each in a layer of its own. It turns charts by 90 degrees
//! only, so every other triangle goes in upside down, or none would nest. It makes square pages;
//! two of them side by side are a page of 2 : 1.

use glam::Vec2;
use xatlas_rs_v2::{ChartOptions, IndexData, MeshData, MeshDecl, PackOptions, Xatlas};

use crate::space::hull;

/// Where the outlines lie.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Packed {
    /// Corners of each outline in texels of the page.
    pub corners: Vec<Vec<Vec2>>,
    /// Size of the page in texels; powers of two.
    pub size: [u32; 2],
}

/// All places are tried where charts times texels are fewer than this (a second or so), else some
/// thousands at random.
const THOROUGH: f64 = 5e7;

/// Distance of two layers: more than any two corners that the library would take for one.
const LAYER: f32 = 4.0;

/// Places convex outlines, in texels, at least `2 * pad` texels from each other and `pad` from the
/// border of the page. `None` where the page would be wider than `most`.
pub fn pack(outlines: &[Vec<Vec2>], pad: u32, most: u32) -> Option<Packed> {
    if outlines.is_empty() {
        return Some(Packed {
            corners: Vec::new(),
            size: [16, 16],
        });
    }
    let mesh = Mesh::new(outlines);
    let area: f64 = outlines.iter().map(|o| f64::from(hull::area(o))).sum();
    let longest = outlines.iter().map(|o| longest(o)).fold(1.0, f32::max);
    let needed = longest.ceil() as u32 + 2 + 2 * pad;
    let mut side = 16u32;
    while 2.0 * f64::from(side) * f64::from(side) <= area || side < needed {
        side *= 2;
    }
    while side <= most {
        if let Some(packed) = mesh.pack(pad, side) {
            return (packed.size[0] <= most).then_some(packed);
        }
        side *= 2;
    }
    None
}

/// Longer side of the smallest rectangle around an outline: its largest extent once it is turned.
fn longest(outline: &[Vec2]) -> f32 {
    2.0 * hull::min_rect(outline).half.max_element()
}

/// All outlines as one mesh: a fan each.
struct Mesh {
    positions: Vec<f32>,
    indices: Vec<u32>,
    faces: u32,
    /// Number of corners of each outline.
    corners: Vec<usize>,
}

impl Mesh {
    fn new(outlines: &[Vec<Vec2>]) -> Self {
        let mut out = Self {
            positions: Vec::new(),
            indices: Vec::new(),
            faces: 0,
            corners: outlines.iter().map(Vec::len).collect(),
        };
        let turned = every_other(outlines);
        for (layer, (outline, turned)) in outlines.iter().zip(turned).enumerate() {
            let base = out.positions.len() as u32 / 3;
            for &p in outline {
                let p = if turned { -p } else { p };
                out.positions.extend([p.x, p.y, LAYER * layer as f32]);
            }
            for i in 2..outline.len() as u32 {
                out.indices.extend([base, base + i - 1, base + i]);
                out.faces += 1;
            }
        }
        out
    }

    /// One page of `side` x `side`, or two beside each other; `None` where more are needed.
    fn pack(&self, pad: u32, side: u32) -> Option<Packed> {
        let declared = MeshDecl {
            vertex_position_data: MeshData::Contiguous(&self.positions),
            index_data: Some(IndexData::U32(&self.indices)),
            face_count: self.faces,
            ..MeshDecl::default()
        };
        let tried = f64::from(side) * f64::from(side) * self.corners.len() as f64;
        let mut atlas = Xatlas::new();
        atlas.add_mesh(&declared).ok()?;
        atlas.add_mesh_join();
        atlas.compute_charts(&ChartOptions::default());
        atlas.pack_charts(&PackOptions {
            padding: pad,
            texels_per_unit: 1.0,
            // The library adds the padding to the page and takes it off the border again.
            resolution: side.checked_sub(2 * pad).filter(|&r| r > 0)?,
            bilinear: false,
            brute_force: tried < THOROUGH,
            rotate_charts_to_axis: false,
            ..PackOptions::default()
        });
        let pages = atlas.atlas_count();
        if pages == 0 || pages > 2 {
            return None;
        }
        let mut flat = vec![None; self.positions.len() / 3];
        for vertex in atlas.meshes().iter().flat_map(|m| &m.vertex_array) {
            let page = u32::try_from(vertex.atlas_index).ok()?;
            let corner = Vec2::new((page * side) as f32, 0.0) + Vec2::from(vertex.uv) + pad as f32;
            *flat.get_mut(vertex.xref as usize)? = Some(corner);
        }
        let mut flat = flat.into_iter();
        let corners = self.corners.iter();
        Some(Packed {
            corners: corners
                .map(|&count| flat.by_ref().take(count).collect())
                .collect::<Option<_>>()?,
            size: [side * pages, side],
        })
    }
}

/// Every other outline in the order in which the library places them, the longest border first.
fn every_other(outlines: &[Vec<Vec2>]) -> Vec<bool> {
    let size = |o: &[Vec2]| {
        let low = o.iter().fold(Vec2::MAX, |m, &p| m.min(p));
        let high = o.iter().fold(Vec2::MIN, |m, &p| m.max(p));
        (high - low).element_sum()
    };
    let mut order: Vec<usize> = (0..outlines.len()).collect();
    order.sort_by(|&a, &b| size(&outlines[b]).total_cmp(&size(&outlines[a])));
    let mut turned = vec![false; outlines.len()];
    for &i in order.iter().skip(1).step_by(2) {
        turned[i] = true;
    }
    turned
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of 5 to 60 texels, the longest side along x.
    fn triangles(count: u32) -> Vec<Vec<Vec2>> {
        let unit = |i: u32| (i.wrapping_mul(0x9e37_79b9) >> 16) as f32 / 65_536.0;
        let triangle = |i: u32| {
            let (w, h) = (10.0 + 50.0 * unit(3 * i + 1), 5.0 + 25.0 * unit(3 * i + 2));
            vec![
                Vec2::ZERO,
                Vec2::new(w, 0.0),
                Vec2::new(w * unit(3 * i + 7), h),
            ]
        };
        (0..count).map(triangle).collect()
    }

    /// Least distance of two convex outlines that don't cross.
    fn gap(a: &[Vec2], b: &[Vec2]) -> f32 {
        let counter_clockwise = |o: &[Vec2]| {
            let mut o = o.to_vec();
            if (o[1] - o[0]).perp_dot(o[2] - o[0]) < 0.0 {
                o.reverse();
            }
            o
        };
        let (a, b) = (counter_clockwise(a), counter_clockwise(b));
        let to = |o: &[Vec2], corners: &[Vec2]| {
            let gaps = corners.iter().map(|&p| hull::distance(o, p));
            gaps.fold(f32::MAX, f32::min)
        };
        to(&a, &b).min(to(&b, &a))
    }

    #[test]
    fn outlines_keep_their_shape_and_their_gutters() {
        let outlines = triangles(60);
        for pad in [1, 3] {
            let packed = pack(&outlines, pad, 8192).expect("a page");
            assert!(packed.size.iter().all(|s| s.is_power_of_two()));
            let pad = pad as f32;
            for (corners, outline) in packed.corners.iter().zip(&outlines) {
                for i in 0..3 {
                    // Widened to whole texels along x and y, by less than one each.
                    let before = outline[(i + 1) % 3].distance(outline[i]);
                    let after = corners[(i + 1) % 3].distance(corners[i]);
                    assert!((before - after).abs() < 1.5, "{outline:?} {corners:?}");
                    let border = Vec2::new(packed.size[0] as f32, packed.size[1] as f32) - pad;
                    assert!(corners[i].min_element() >= pad && corners[i].cmple(border).all());
                }
            }
            for i in 0..60 {
                for j in 0..i {
                    let gap = gap(&packed.corners[i], &packed.corners[j]);
                    assert!(gap >= 2.0 * pad - 1e-3, "{i} and {j}: {gap}");
                }
            }
        }
    }

    #[test]
    fn a_page_is_the_same_twice_and_two_halves_make_one() {
        let outlines = triangles(300);
        let packed = pack(&outlines, 1, 8192);
        assert_eq!(packed, pack(&outlines, 1, 8192));
        let [w, h] = packed.expect("a page").size;
        assert!(w == h || w == 2 * h, "{w} x {h}");
        // Two strips of 100 x 1 don't fit beside what fills 128 x 128.
        let square = |side: f32| [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)];
        let square: Vec<Vec2> = square(100.0).into_iter().map(Vec2::from).collect();
        let packed = pack(&[square.clone(), square], 1, 8192).expect("a page");
        assert_eq!(packed.size, [256, 128]);
    }

    #[test]
    fn what_fits_on_no_page_is_refused() {
        let square = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)];
        let square: Vec<Vec2> = square.into_iter().map(Vec2::from).collect();
        assert!(pack(&vec![square; 9], 1, 256).is_none());
        assert_eq!(pack(&[], 1, 256).expect("an empty page").size, [16, 16]);
    }
}
