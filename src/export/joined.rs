//! Surfaces of one material as one: engines draw each primitive with a call of its own.

use std::borrow::Cow;

use super::surface::Surface;

/// Which attributes a surface has: those of one primitive have all of them or none.
fn layout(s: &Surface) -> [bool; 4] {
    let [first, second] = &s.uvs;
    [
        s.tangents.is_empty(),
        first.is_empty(),
        second.is_empty(),
        s.colors.is_empty(),
    ]
}

/// Surfaces without the empty ones, in the order in which their materials come first; those with the same number
/// (`numbers` of their materials in the file) and the same attributes are joined.
pub fn joined<'s>(surfaces: &'s [Surface], numbers: &[usize]) -> Vec<Cow<'s, Surface>> {
    let mut out: Vec<Cow<Surface>> = Vec::new();
    for surface in surfaces.iter().filter(|s| !s.triangles.is_empty()) {
        let number = numbers[surface.material as usize];
        let alike = |s: &&mut Cow<Surface>| {
            numbers[s.material as usize] == number && layout(s) == layout(surface)
        };
        match out.iter_mut().find(alike) {
            Some(first) => append(first.to_mut(), surface),
            None => out.push(Cow::Borrowed(surface)),
        }
    }
    out
}

fn append(to: &mut Surface, from: &Surface) {
    let first = to.positions.len() as u32;
    to.positions.extend_from_slice(&from.positions);
    to.normals.extend_from_slice(&from.normals);
    to.tangents.extend_from_slice(&from.tangents);
    for (to, from) in to.uvs.iter_mut().zip(&from.uvs) {
        to.extend_from_slice(from);
    }
    to.colors.extend_from_slice(&from.colors);
    let moved = from
        .triangles
        .iter()
        .map(|t| t.map(|corner| first + corner));
    to.triangles.extend(moved);
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;

    /// A triangle at `x`.
    fn triangle(x: f32, material: u32) -> Surface {
        Surface {
            positions: vec![Vec3::X * x, Vec3::Y, Vec3::Z],
            normals: vec![Vec3::Y; 3],
            uvs: [vec![Vec2::splat(x); 3], Vec::new()],
            triangles: vec![[0, 1, 2]],
            material,
            ..Surface::default()
        }
    }

    #[test]
    fn what_has_one_material_and_the_same_attributes_is_one() {
        let mut colored = triangle(5.0, 0);
        colored.colors = vec![[1.0; 4]; 3];
        let surfaces = [
            triangle(1.0, 0),
            triangle(2.0, 1),
            Surface::default(),
            triangle(3.0, 2),
            colored,
            triangle(4.0, 0),
        ];
        // Materials 0 and 2 became one in the file.
        let out = joined(&surfaces, &[7, 8, 7]);
        let corners: Vec<Vec<f32>> = out
            .iter()
            .map(|s| s.triangles.iter().map(|t| s.positions[t[0] as usize].x))
            .map(Iterator::collect)
            .collect();
        assert_eq!(corners, [vec![1.0, 3.0, 4.0], vec![2.0], vec![5.0]]);
        assert_eq!(out[0].triangles, [[0, 1, 2], [3, 4, 5], [6, 7, 8]]);
        let uvs: Vec<f32> = out[0].uvs[0].iter().map(|uv| uv.x).collect();
        assert_eq!(uvs, [1.0, 1.0, 1.0, 3.0, 3.0, 3.0, 4.0, 4.0, 4.0]);
        assert_eq!((out[0].normals.len(), out[2].colors.len()), (9, 3));
        // What needs no joining is not copied.
        assert!(matches!(out[1], Cow::Borrowed(_)));
    }
}
