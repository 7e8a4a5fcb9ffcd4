//! Plane billboards: the plane that lies closest to the foliage, or several of them (Kratt et
//! al. 2014, section 3.3, "plane fit" and the extension to several planes that they name).

use glam::{DVec3, Vec3};

use super::card::{Card, Outline};
use super::foliage::{Face, Foliage};
use crate::space::eigen::{Axes, Moments};

/// Rounds of assigning faces to planes and fitting again; most change is in the first three.
const ROUNDS: usize = 8;

/// One card in the least-squares plane of the foliage's area, trimmed to the outline; `None`
/// without faces. Foliage on a line gets a plane through that line, in one place any plane.
pub fn plane(foliage: &Foliage<'_>, outline: Outline) -> Option<Vec<Card>> {
    Some(vec![card_in(
        &foliage.moments().axes()?,
        foliage.vertices(),
        outline,
    )])
}

/// At most `count` cards: the foliage is cut into sections of equal area along its longest axis,
/// then faces move to the plane with the least squared distance and planes are fitted again
/// (Lloyd's method with planes for centres: Cohen-Steiner, Alliez and Desbrun 2004). Planes that
/// lose all their faces are dropped. `None` without faces.
pub fn planes(foliage: &Foliage<'_>, count: usize, outline: Outline) -> Option<Vec<Card>> {
    let axes = foliage.moments().axes()?;
    let mut owner = sections(foliage.faces, axes.axes[2], count.max(1));
    let moments: Vec<Moments> = foliage
        .faces
        .iter()
        .map(|f| Moments::of_triangle(f.corners, f64::from(f.area)))
        .collect();
    for _ in 0..ROUNDS {
        let fits = fit(&moments, &owner, count);
        let next: Vec<usize> = moments.iter().map(|m| nearest(m, &fits)).collect();
        if next == owner {
            break;
        }
        owner = next;
    }
    let cards = fit(&moments, &owner, count).into_iter().map(|(i, axes)| {
        let own = foliage.faces.iter().zip(&owner).filter(|&(_, &o)| o == i);
        card_in(&axes, own.flat_map(|(f, _)| f.corners), outline)
    });
    Some(cards.collect())
}

fn card_in(axes: &Axes, points: impl IntoIterator<Item = Vec3>, outline: Outline) -> Card {
    let [_, v, u] = axes.axes;
    Card::around(
        axes.centroid.as_vec3(),
        u.as_vec3(),
        v.as_vec3(),
        points,
        outline,
    )
}

/// For each face its section along `axis`, sections having about equal area.
fn sections(faces: &[Face], axis: DVec3, count: usize) -> Vec<usize> {
    let along = |i: usize| faces[i].center().as_dvec3().dot(axis);
    let mut order: Vec<usize> = (0..faces.len()).collect();
    order.sort_by(|&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
    let total: f64 = faces.iter().map(|f| f64::from(f.area)).sum();
    let mut section = vec![0; faces.len()];
    let mut before = 0.0;
    for i in order {
        let middle = before + f64::from(faces[i].area) / 2.0;
        section[i] = ((middle / total * count as f64) as usize).min(count - 1);
        before += f64::from(faces[i].area);
    }
    section
}

/// The least-squares planes of the sections that own faces, with their numbers.
fn fit(moments: &[Moments], owner: &[usize], count: usize) -> Vec<(usize, Axes)> {
    let mut sums = vec![Moments::default(); count.max(1)];
    for (moment, &i) in moments.iter().zip(owner) {
        sums[i] = sums[i].merged(moment);
    }
    let fitted = sums.iter().enumerate();
    fitted.filter_map(|(i, m)| Some((i, m.axes()?))).collect()
}

/// The plane with the least squared distance to the face; the first of equals.
fn nearest(face: &Moments, fits: &[(usize, Axes)]) -> usize {
    let error = |axes: &Axes| face.error_to_plane(axes.centroid, axes.normal());
    let best = fits
        .iter()
        .min_by(|a, b| error(&a.1).total_cmp(&error(&b.1)));
    best.map_or(0, |(i, _)| *i)
}

#[cfg(test)]
mod tests {
    use super::super::foliage::tests::patch;
    use super::*;

    #[test]
    fn a_tilted_patch_gets_its_own_plane_and_size() {
        let (a, b) = (Vec3::new(0.8, 0.6, 0.0) * 2.0, Vec3::Z);
        let faces = patch(Vec3::new(0.1, 0.2, 0.3), a, b);
        let foliage = Foliage {
            faces: &faces,
            connector: Vec3::ZERO,
        };
        let cards = plane(&foliage, Outline::Quad).unwrap();
        let [card] = &cards[..] else {
            panic!("{cards:?}")
        };
        assert!(card.normal().dot(Vec3::new(0.6, -0.8, 0.0)).abs() > 0.9999);
        assert!((card.area() - 2.0).abs() < 1e-4 && card.is_sound());
        assert!(foliage.vertices().all(|p| card.distance(p) < 1e-5));
    }

    #[test]
    fn two_patches_with_an_edge_between_them_get_two_planes() {
        let mut faces = patch(Vec3::ZERO, Vec3::X, Vec3::Z);
        faces.extend(patch(Vec3::X, Vec3::new(0.6, 0.8, 0.0), Vec3::Z));
        let foliage = Foliage {
            faces: &faces,
            connector: Vec3::ZERO,
        };
        let cards = planes(&foliage, 2, Outline::Quad).unwrap();
        assert_eq!(cards.len(), 2);
        for p in foliage.vertices() {
            assert!(cards.iter().any(|c| c.distance(p) < 1e-5), "{p}");
        }
    }

    #[test]
    fn degenerate_foliage_has_a_defined_answer() {
        let none = Foliage {
            faces: &[],
            connector: Vec3::ZERO,
        };
        assert!(plane(&none, Outline::Quad).is_none());
        assert!(planes(&none, 3, Outline::Quad).is_none());
        let sliver = patch(Vec3::ZERO, Vec3::X, Vec3::Y * 1e-6);
        let line = Foliage {
            faces: &sliver,
            connector: Vec3::ZERO,
        };
        for count in 1..4 {
            let cards = planes(&line, count, Outline::Triangle).unwrap();
            assert!(
                !cards.is_empty() && cards.iter().all(Card::is_sound),
                "{cards:?}"
            );
        }
    }
}
