//! Which billboards stand for a group of leaves: all generators try, the judge picks one.

use std::cmp::Ordering;

use serde::{Deserialize, Serialize};

use crate::cloud::cross::cross;
use crate::cloud::plane::plane;
use crate::cloud::strip::{Sections, strip};
use crate::cloud::{Card, Coverage, Foliage, Outline, coverage};

/// Sections of a strip merge up to a root mean squared distance of this many `epsilon`. The
/// farthest vertex of an arc is about 2.2 times as far from its chord as the mean, and that has
/// to be within `epsilon`.
const MERGE_TO_EPSILON: f64 = 0.3;

/// What made a group's representation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Generator {
    /// The leaves themselves.
    Geometry,
    /// One least-squares plane.
    Plane,
    /// Two orthogonal cards on the group's axis.
    Cross,
    /// A connected band along the group's axis.
    Strip,
}

/// A representation with its cost and error; areas in normalised units squared.
#[derive(Clone, Debug, PartialEq)]
pub struct Representation {
    /// Who made it.
    pub generator: Generator,
    /// Its cards; none where the leaves stay as they are.
    pub cards: Vec<Card>,
    /// Triangles that it costs.
    pub triangles: usize,
    /// What it shows of the group.
    pub coverage: Coverage,
    /// Mean visibility of the group's points.
    pub sigma: f64,
}

/// What candidates are made and judged by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// Distance within which a vertex is valid, normalised units.
    pub epsilon: f64,
    /// Largest [`Representation::judged_error`] that passes, 0 to 1.
    pub tolerance: f64,
    /// Outline of planes and crosses; strips are quads.
    pub outline: Outline,
    /// Whether crosses are tried where a plane fails.
    pub crosses: bool,
    /// Sections that a strip begins with; under 2: no strip is tried.
    pub strip_sections: usize,
}

impl Representation {
    /// `sigma * (A - C)`: what cuts minimise.
    pub fn error(&self) -> f64 {
        self.coverage.weighted_error(self.sigma)
    }

    /// `sigma * C`, as the paper prints it.
    pub fn quality(&self) -> f64 {
        self.coverage.quality(self.sigma)
    }

    /// `sigma * A * (mean squared distance)`: tells equals apart.
    pub fn spread(&self) -> f64 {
        self.sigma * self.coverage.total * self.coverage.mean_square
    }

    /// The error that is held against the tolerance: `sigma * (1 - C / A)`, with areas as they
    /// are instead of projected.
    ///
    /// With projected ones, leaves that stand askew to every plane would miss half their area at
    /// best, also to a viewer at infinity, and be split down to single leaves; and against the
    /// projected area of all faces instead of `A`, leaves square to their only plane would not
    /// count at all.
    pub fn judged_error(&self) -> f64 {
        let Coverage { within, total, .. } = self.coverage;
        if total > 0.0 {
            self.sigma * (1.0 - (2.0 * within - total).max(0.0) / total)
        } else {
            0.0
        }
    }
}

/// What stands for a group, and whether it passes; `None` where the group has no faces. `sigma` is
/// the group's mean visibility.
pub fn represent(
    foliage: &Foliage<'_>,
    sigma: f64,
    judgement: &Judgement,
) -> Option<(Representation, bool)> {
    let flat = plane_candidate(foliage, sigma, judgement)?;
    // Nothing else costs as little: where the plane passes, no other candidate is made.
    if flat.judged_error() <= judgement.tolerance {
        return Some((flat, true));
    }
    let mut all = solid_candidates(foliage, sigma, judgement);
    all.push(flat);
    let (chosen, passes) = choose(&all, judgement.tolerance)?;
    Some((chosen.clone(), passes))
}

/// The plane alone: the cheapest representation.
pub fn plane_candidate(
    foliage: &Foliage<'_>,
    sigma: f64,
    judgement: &Judgement,
) -> Option<Representation> {
    let cards = plane(foliage, judgement.outline)?;
    Some(billboards(
        Generator::Plane,
        cards,
        foliage,
        sigma,
        judgement,
    ))
}

/// Cross and strip, where they can be made.
fn solid_candidates(
    foliage: &Foliage<'_>,
    sigma: f64,
    judgement: &Judgement,
) -> Vec<Representation> {
    let sections = Sections {
        count: judgement.strip_sections,
        merge_error: judgement.epsilon * MERGE_TO_EPSILON,
    };
    // A strip of one section is a plane with less freedom.
    let band = match judgement.strip_sections {
        0 | 1 => None,
        _ => strip(foliage, sections).filter(|cards| cards.len() > 1),
    };
    let crossed = judgement.crosses.then(|| cross(foliage, judgement.outline));
    let made = [
        (Generator::Cross, crossed.flatten()),
        (Generator::Strip, band),
    ];
    made.into_iter()
        .filter_map(|(g, cards)| Some(billboards(g, cards?, foliage, sigma, judgement)))
        .collect()
}

fn billboards(
    generator: Generator,
    cards: Vec<Card>,
    foliage: &Foliage<'_>,
    sigma: f64,
    judgement: &Judgement,
) -> Representation {
    Representation {
        generator,
        triangles: cards.iter().map(Card::triangles).sum(),
        coverage: coverage(foliage, &cards, judgement.epsilon),
        cards,
        sigma,
    }
}

/// The leaves themselves: they show all of their area, at their own cost.
pub fn geometry(foliage: &Foliage<'_>, sigma: f64) -> Representation {
    let area = foliage.area();
    Representation {
        generator: Generator::Geometry,
        cards: Vec::new(),
        triangles: foliage.faces.len(),
        coverage: Coverage {
            valid: area,
            total: area,
            within: area,
            ..Coverage::default()
        },
        sigma,
    }
}

/// The candidate to take, and whether it passes: the cheapest that passes (the better of equals),
/// else the one that shows the most visible area for its triangles.
fn choose(candidates: &[Representation], tolerance: f64) -> Option<(&Representation, bool)> {
    let passing = candidates
        .iter()
        .filter(|r| r.judged_error() <= tolerance)
        .min_by(|a, b| thrifty(a, b));
    let value = |r: &Representation| r.quality() / r.triangles.max(1) as f64;
    let most = || {
        candidates
            .iter()
            .min_by(|a, b| value(b).total_cmp(&value(a)).then(closer(a, b)))
    };
    passing
        .map(|r| (r, true))
        .or_else(|| Some((most()?, false)))
}

/// Orders by triangles, then by error.
fn thrifty(a: &Representation, b: &Representation) -> Ordering {
    let cost = a.triangles.cmp(&b.triangles);
    cost.then(a.error().total_cmp(&b.error()))
        .then(closer(a, b))
}

/// Orders representations of equal worth: by distance for their triangles, then by maker.
fn closer(a: &Representation, b: &Representation) -> Ordering {
    let price = |r: &Representation| r.spread() * r.triangles as f64;
    price(a)
        .total_cmp(&price(b))
        .then((a.triangles, a.generator).cmp(&(b.triangles, b.generator)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::foliage::tests::patch;
    use glam::Vec3;

    fn judgement(epsilon: f64) -> Judgement {
        Judgement {
            epsilon,
            tolerance: 0.1,
            outline: Outline::Quad,
            crosses: true,
            strip_sections: 4,
        }
    }

    fn chosen(faces: &[crate::cloud::Face], epsilon: f64) -> (Generator, bool) {
        let foliage = Foliage {
            faces,
            connector: Vec3::new(-0.1, 0.0, 0.5),
        };
        let (best, passes) = represent(&foliage, 1.0, &judgement(epsilon)).unwrap();
        (best.generator, passes)
    }

    #[test]
    fn a_flat_leaf_is_a_plane() {
        let flat = patch(Vec3::ZERO, Vec3::X, Vec3::Z);
        assert_eq!(chosen(&flat, 0.01), (Generator::Plane, true));
    }

    #[test]
    fn crossed_leaves_are_a_cross_until_they_are_small() {
        let mut faces = patch(Vec3::new(0.0, -0.5, 0.5), Vec3::X, Vec3::Y);
        faces.extend(patch(Vec3::new(0.0, 0.0, 0.0), Vec3::X, Vec3::Z));
        assert_eq!(chosen(&faces, 0.01), (Generator::Cross, true));
        // A viewer so far that half a unit is within tolerance takes one plane.
        assert_eq!(chosen(&faces, 0.6), (Generator::Plane, true));
    }

    #[test]
    fn an_arched_frond_is_a_strip() {
        let at = |i: usize| {
            let x = i as f32 / 20.0;
            Vec3::new(x, 0.8 * x * (1.0 - x), 0.4)
        };
        let faces: Vec<_> = (0..20)
            .flat_map(|i| patch(at(i), at(i + 1) - at(i), Vec3::Z * 0.2))
            .collect();
        assert_eq!(chosen(&faces, 0.02), (Generator::Strip, true));
        assert_eq!(chosen(&faces, 0.5), (Generator::Plane, true));
    }

    #[test]
    fn hidden_groups_pass_and_seen_ones_do_not() {
        let faces = [
            patch(Vec3::ZERO, Vec3::X, Vec3::Z),
            patch(Vec3::Y, Vec3::X, Vec3::Z),
        ]
        .concat();
        let foliage = Foliage {
            faces: &faces,
            connector: Vec3::ZERO,
        };
        let plane = |sigma| plane_candidate(&foliage, sigma, &judgement(0.01)).unwrap();
        // No vertex is near the plane between the leaves: C = 0, the whole area is missed.
        let (seen, hidden) = (plane(1.0), plane(0.05));
        assert_eq!((seen.judged_error(), seen.quality()), (1.0, 0.0));
        assert!((seen.error() - 2.0).abs() < 1e-6);
        assert!((hidden.error() - 0.1).abs() < 1e-6 && hidden.judged_error() <= 0.1);
    }

    #[test]
    fn nothing_has_no_candidates() {
        let none = Foliage {
            faces: &[],
            connector: Vec3::ZERO,
        };
        assert!(represent(&none, 1.0, &judgement(0.1)).is_none());
        assert!(choose(&[], 0.1).is_none());
        assert_eq!(geometry(&none, 1.0).judged_error(), 0.0);
    }
}
