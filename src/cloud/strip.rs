//! Plane strip: one connected band of quads along curved foliage (Kratt et al. 2014, section 3.3).
//!
//! The axis is that of the two-cross. The foliage is cut along it into a fixed number of sections,
//! and each section's plane is constrained to pass through the end edge of the section before. As
//! section boundaries are parallel planes, so are all those edges: a strip is a cylinder over a
//! polyline, and all that is free is the roll about the axis and one height for each edge.
//!
//! The paper fits one section after the other. Then a section pays for the end of the one before,
//! and errors swing from side to side. Here the heights are solved together, by least squares
//! over the whole polyline (a tridiagonal system): the same constraint, the least error.

use std::f64::consts::PI;

use glam::{DVec3, Vec2};

use super::card::Card;
use super::cross::main_axis;
use super::foliage::Foliage;
use crate::space::hull::thickened;
use crate::space::polyline::{Polyline, Sample};

/// Rolls of the coarse search, 11 degrees apart.
const ROLLS: usize = 16;
/// Halvings of that step in the fine search: to 0.2 degrees.
const ROLL_HALVINGS: usize = 6;
/// The roll is searched for on at most this many samples, evenly picked; all count in the fit.
const MOST_SEARCHED: usize = 4096;

/// How a strip is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sections {
    /// Sections to begin with, 1 or more.
    pub count: usize,
    /// Neighbouring sections merge while the root mean squared distance of the foliage from the
    /// strip (measured across the axis) stays within this, normalised units.
    pub merge_error: f64,
}

impl Default for Sections {
    fn default() -> Self {
        Self {
            count: 6,
            merge_error: 0.0,
        }
    }
}

/// A band of connected quads, from the connector's end to the other; `None` where there are no
/// faces or they have no extent along the axis.
pub fn strip(foliage: &Foliage<'_>, sections: Sections) -> Option<Vec<Card>> {
    let (center, axis) = main_axis(foliage)?;
    let samples: Vec<(DVec3, f64)> = foliage
        .faces
        .iter()
        .flat_map(|face| face.samples())
        .map(|(p, weight)| (p.as_dvec3() - center, weight))
        .collect();
    let along = samples.iter().map(|(p, _)| p.dot(axis));
    let (start, end) = along.fold((f64::MAX, f64::MIN), |(a, b), t| (a.min(t), b.max(t)));
    if end - start <= f64::from(f32::EPSILON) {
        return None;
    }
    let count = sections.count.max(1);
    let knots: Vec<f64> = (0..=count)
        .map(|i| start + (end - start) * i as f64 / count as f64)
        .collect();
    let up = best_roll(&samples, axis, &knots);
    let flat = profile_of(&samples, axis, up);
    let profile = Polyline::fit(&flat, knots).merged(&flat, sections.merge_error);
    Some(cards(foliage, center, axis, up, &profile))
}

/// The direction across the axis whose polyline lies closest: a coarse search over the half turn
/// after which a strip repeats itself, then a fine one around the best.
fn best_roll(samples: &[(DVec3, f64)], axis: DVec3, knots: &[f64]) -> DVec3 {
    let stride = samples.len().div_ceil(MOST_SEARCHED);
    let few: Vec<(DVec3, f64)> = samples.iter().copied().step_by(stride).collect();
    let (e, f) = axis.any_orthonormal_pair();
    let direction = |angle: f64| e * angle.cos() + f * angle.sin();
    let error = |angle: f64| {
        let flat = profile_of(&few, axis, direction(angle));
        Polyline::fit(&flat, knots.to_vec()).error(&flat)
    };
    let mut step = PI / ROLLS as f64;
    let mut best = (error(0.0), 0.0);
    // The first of equals, with a margin above rounding.
    let attempt = |angle: f64, best: (f64, f64)| {
        let next = error(angle);
        if next < best.0 * (1.0 - 1e-9) {
            (next, angle)
        } else {
            best
        }
    };
    for roll in 1..ROLLS {
        best = attempt(roll as f64 * step, best);
    }
    for _ in 0..ROLL_HALVINGS {
        step /= 2.0;
        let middle = best.1;
        best = attempt(middle - step, best);
        best = attempt(middle + step, best);
    }
    direction(best.1)
}

/// The foliage in the strip's profile plane.
fn profile_of(samples: &[(DVec3, f64)], axis: DVec3, up: DVec3) -> Vec<Sample> {
    let flat = samples.iter().map(|(p, weight)| Sample {
        along: p.dot(axis),
        height: p.dot(up),
        weight: *weight,
    });
    flat.collect()
}

/// One quad for each section. Each edge is as wide as the wider of the sections that share it, so
/// that every vertex lies over the band.
fn cards(
    foliage: &Foliage<'_>,
    center: DVec3,
    axis: DVec3,
    up: DVec3,
    profile: &Polyline,
) -> Vec<Card> {
    let side = up.cross(axis);
    let knots = &profile.knots;
    let last = knots.len() - 2;
    // Sideways extent of each section; lengthwise extent of the feet on the end sections' planes.
    let mut extents = vec![(f64::MAX, f64::MIN); last + 1];
    let (mut before, mut after) = (0.0f64, 0.0f64);
    for p in foliage.vertices() {
        let p = p.as_dvec3() - center;
        let (t, h, s) = (p.dot(axis), p.dot(up), p.dot(side));
        let (i, _) = profile.place(t);
        extents[i] = (extents[i].0.min(s), extents[i].1.max(s));
        // The foot of p on section i: how far it moves along the axis.
        let k = profile.slope(i);
        let foot = t + k * (h - profile.height(t)) / (1.0 + k * k);
        if i == 0 {
            before = before.max(knots[0] - foot);
        }
        if i == last {
            after = after.max(foot - knots[last + 1]);
        }
    }
    let edges: Vec<(f64, f64)> = (0..=last + 1)
        .map(|i| widest(extents.get(i.wrapping_sub(1)), extents.get(i)))
        .collect();
    let card = |i: usize| {
        let (run, k) = (knots[i + 1] - knots[i], profile.slope(i));
        let start = center + axis * knots[i] + up * profile.heights[i];
        let stretch = (1.0 + k * k).sqrt();
        let from = if i == 0 { -before * stretch } else { 0.0 };
        let to = (run + if i == last { after } else { 0.0 }) * stretch;
        let corner = |x: f64, y: f64| Vec2::new(x as f32, y as f32);
        Card {
            origin: start.as_vec3(),
            u: ((axis + up * k) / stretch).as_vec3(),
            v: side.as_vec3(),
            outline: vec![
                corner(from, edges[i].0),
                corner(to, edges[i + 1].0),
                corner(to, edges[i + 1].1),
                corner(from, edges[i].1),
            ],
        }
    };
    (0..=last).map(card).collect()
}

/// The extent of an edge between two sections, padded where the foliage has no width.
fn widest(a: Option<&(f64, f64)>, b: Option<&(f64, f64)>) -> (f64, f64) {
    let none = (f64::MAX, f64::MIN);
    let (a, b) = (a.unwrap_or(&none), b.unwrap_or(&none));
    let (low, high) = (a.0.min(b.0), a.1.max(b.1));
    if low > high {
        // Between two empty sections.
        let half = f64::from(thickened(Vec2::ZERO).x) / 2.0;
        return (-half, half);
    }
    let least = f64::from(thickened(Vec2::splat((high - low) as f32)).x);
    let pad = (least - (high - low)).max(0.0) / 2.0;
    (low - pad, high + pad)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::card::Outline;
    use super::super::coverage::coverage;
    use super::super::foliage::Face;
    use super::super::foliage::tests::patch;
    use super::super::plane::plane;
    use super::*;

    /// A band 0.2 wide over a quarter circle of radius one in the plane z = 0, from the top.
    fn arc(steps: usize) -> Vec<Face> {
        let at = |i: usize| {
            let (sin, cos) = (i as f32 / steps as f32 * std::f32::consts::FRAC_PI_2).sin_cos();
            Vec3::new(sin, cos, -0.1)
        };
        (0..steps)
            .flat_map(|i| patch(at(i), at(i + 1) - at(i), Vec3::Z * 0.2))
            .collect()
    }

    fn foliage(faces: &[Face]) -> Foliage<'_> {
        Foliage {
            faces,
            connector: Vec3::Y,
        }
    }

    fn sections(count: usize) -> Sections {
        Sections {
            count,
            merge_error: 0.0,
        }
    }

    #[test]
    fn a_bent_frond_of_two_flat_halves_is_met_exactly() {
        let slope = Vec3::new(1.0, 0.5, 0.0);
        let mut faces = patch(Vec3::ZERO, slope, Vec3::Z);
        faces.extend(patch(slope, Vec3::new(1.0, -0.5, 0.0), Vec3::Z));
        let frond = Foliage {
            faces: &faces,
            connector: Vec3::new(-0.1, 0.25, 0.5),
        };
        let cards = strip(&frond, sections(2)).unwrap();
        assert_eq!(cards.len(), 2);
        let c = coverage(&frond, &cards, 1e-4);
        assert!(c.rms_distance() < 1e-4 && c.missed() < 1e-3, "{c:?}");
    }

    #[test]
    fn sections_share_their_edges_and_hold_every_vertex() {
        let faces = arc(40);
        for count in 1..7 {
            let cards = strip(&foliage(&faces), sections(count)).unwrap();
            assert_eq!(cards.len(), count);
            assert!(cards.iter().all(Card::is_sound), "{cards:?}");
            for pair in cards.windows(2) {
                let (a, b): (Vec<Vec3>, Vec<Vec3>) =
                    (pair[0].corners().collect(), pair[1].corners().collect());
                assert!((a[1] - b[0]).length() < 1e-6 && (a[2] - b[3]).length() < 1e-6);
            }
            // Over the band: no farther from its quads than from their planes, nearly.
            let beside = foliage(&faces).vertices().map(|p| {
                let near = cards.iter().map(|c| c.distance(p)).fold(f32::MAX, f32::min);
                let flat = cards
                    .iter()
                    .map(|c| c.height(p).abs())
                    .fold(f32::MAX, f32::min);
                near - flat
            });
            assert!(beside.fold(0.0, f32::max) < 0.05);
        }
    }

    #[test]
    fn more_sections_come_closer_and_beat_the_plane() {
        let faces = arc(40);
        let error = |cards: &[Card]| coverage(&foliage(&faces), cards, 0.01).rms_distance();
        let flat = error(&plane(&foliage(&faces), Outline::Quad).unwrap());
        let mut before = flat;
        for count in [2, 4, 8] {
            let next = error(&strip(&foliage(&faces), sections(count)).unwrap());
            // An arc's distance from its chord falls with the square of the sections.
            assert!(next < before / 2.2, "{count}: {next} after {before}");
            before = next;
        }
    }

    #[test]
    fn neighbours_merge_up_to_the_threshold() {
        let faces = arc(40);
        let merge = |merge_error| {
            let cards = strip(
                &foliage(&faces),
                Sections {
                    count: 8,
                    merge_error,
                },
            );
            let cards = cards.unwrap();
            let error = coverage(&foliage(&faces), &cards, 0.1).rms_distance();
            (cards.len(), error)
        };
        assert_eq!(merge(0.0).0, 8);
        let (some, error) = merge(0.02);
        assert!((2..6).contains(&some) && error <= 0.0201, "{some} {error}");
        assert_eq!(merge(10.0).0, 1);
        // A flat leaf needs one section at any tolerance above rounding.
        let flat = patch(Vec3::ZERO, Vec3::X * 3.0, Vec3::Z);
        let one = Sections {
            count: 5,
            merge_error: 1e-6,
        };
        let leaf = Foliage {
            faces: &flat,
            connector: Vec3::new(-0.5, 0.0, 0.5),
        };
        assert_eq!(strip(&leaf, one).unwrap().len(), 1);
    }

    #[test]
    fn gaps_and_nothing_have_a_defined_answer() {
        assert!(strip(&foliage(&[]), Sections::default()).is_none());
        let mut gap = patch(Vec3::ZERO, Vec3::X * 0.1, Vec3::Z * 0.1);
        gap.extend(patch(Vec3::X * 9.0, Vec3::X * 0.1, Vec3::Z * 0.1));
        let cards = strip(&foliage(&gap), sections(6)).unwrap();
        assert!(cards.iter().all(Card::is_sound), "{cards:?}");
    }
}
