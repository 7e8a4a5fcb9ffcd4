//! How much of the foliage a set of cards shows (Kratt et al. 2014, section 3.4).
//!
//! A vertex is valid within `epsilon` of the cards, a face if all its vertices are. Each face is
//! projected on its nearest card, and
//!
//! ```text
//! C(P) = max(0, sum of valid projected areas - sum of invalid projected areas)
//! ```
//!
//! Distances are to the cards' outlines, not to their endless planes: a section of a strip must
//! not vouch for foliage that another section shows.

use super::card::Card;
use super::foliage::{Face, Foliage};

/// What a set of cards shows of its foliage; areas in normalised units squared.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Coverage {
    /// Projected area of valid faces.
    pub valid: f64,
    /// Projected area of invalid faces.
    pub invalid: f64,
    /// `A`: surface area of all faces, not projected.
    pub total: f64,
    /// Surface area of valid faces, not projected.
    pub within: f64,
    /// Area-weighted mean of squared distances to the nearest card, in normalised units squared.
    /// It tells candidates apart where all faces are invalid or all are valid.
    pub mean_square: f64,
}

impl Coverage {
    /// `C(P)`, between 0 and `total`.
    pub fn covered(&self) -> f64 {
        (self.valid - self.invalid).max(0.0)
    }

    /// `A - C(P)`: area that is missed, between 0 and `total`.
    pub fn missed(&self) -> f64 {
        (self.total - self.covered()).max(0.0)
    }

    /// `quality(P) = sigma(P) * C(P)`, as the paper prints it.
    pub fn quality(&self, sigma: f64) -> f64 {
        sigma * self.covered()
    }

    /// `sigma(P) * (A - C(P))`: what cuts minimise. An error where `sigma` is small (deep in the
    /// crown) matters less, which is the paper's intention; by the printed quality alone, hidden
    /// parts would be the last to become billboards.
    pub fn weighted_error(&self, sigma: f64) -> f64 {
        sigma * self.missed()
    }

    /// Root of the area-weighted mean squared distance to the nearest card, normalised units.
    pub fn rms_distance(&self) -> f64 {
        self.mean_square.sqrt()
    }
}

/// World size of a pixel at a distance, in the unit of the distance: `2 d tan(fov / 2) / height`.
/// `fov_y` is the vertical field of view in radians, `height_px` the screen's height.
pub fn pixel_size(distance: f64, fov_y: f64, height_px: u32) -> f64 {
    2.0 * distance.max(0.0) * (fov_y / 2.0).tan() / f64::from(height_px.max(1))
}

/// The tolerance `epsilon` for a level that is seen from `distance` on: `pixels` times the size
/// of a pixel there. This is how the distance drives the whole process.
pub fn epsilon(distance: f64, fov_y: f64, height_px: u32, pixels: f64) -> f64 {
    pixel_size(distance, fov_y, height_px) * pixels
}

/// Measures cards against the foliage that they stand for. Without cards nothing is covered and
/// the mean square is infinite; without faces all is zero.
pub fn coverage(foliage: &Foliage<'_>, cards: &[Card], epsilon: f64) -> Coverage {
    let mut sum = Coverage::default();
    let mut square = 0.0;
    for face in foliage.faces {
        let area = f64::from(face.area);
        sum.total += area;
        let Some(card) = nearest(face, cards) else {
            continue;
        };
        let projected = face.projected(card.normal());
        if is_valid(face, card, cards, epsilon) {
            sum.valid += projected;
            sum.within += area;
        } else {
            sum.invalid += projected;
        }
        // Each sample to its own nearest card: a long face may lie along several sections.
        let apart = |p| {
            let distances = cards.iter().map(|card| f64::from(card.distance(p)));
            distances.fold(f64::MAX, f64::min).powi(2)
        };
        square += face
            .samples()
            .iter()
            .map(|&(p, weight)| weight * apart(p))
            .sum::<f64>();
    }
    sum.mean_square = match (cards.is_empty(), sum.total > 0.0) {
        (_, false) => 0.0,
        (true, true) => f64::INFINITY,
        (false, true) => square / sum.total,
    };
    sum
}

/// The card with the least distance to the face's centre; the first of equals.
fn nearest<'a>(face: &Face, cards: &'a [Card]) -> Option<&'a Card> {
    let center = face.center();
    match cards {
        [only] => Some(only),
        _ => cards
            .iter()
            .min_by(|a, b| a.distance(center).total_cmp(&b.distance(center))),
    }
}

/// Whether every vertex lies within `epsilon` of some card; the nearest of the centre first, as
/// it mostly is the nearest of all.
fn is_valid(face: &Face, nearest: &Card, cards: &[Card], epsilon: f64) -> bool {
    face.corners.iter().all(|&corner| {
        let near = |card: &Card| f64::from(card.distance(corner)) <= epsilon;
        near(nearest) || (cards.len() > 1 && cards.iter().any(near))
    })
}

#[cfg(test)]
mod tests {
    use super::super::foliage::tests::patch;
    use super::*;
    use glam::{Vec2, Vec3};

    fn ground() -> Card {
        Card::rectangle(Vec3::ZERO, Vec3::Z, Vec3::X, Vec2::splat(5.0))
    }

    /// Worked by hand: a flat patch of area 2 on the card, and one of area 1 at a height of 0.5,
    /// tilted so that its shadow is 0.6.
    #[test]
    fn two_patches_worked_by_hand() {
        let mut faces = patch(Vec3::ZERO, Vec3::X * 2.0, Vec3::Z);
        faces.extend(patch(Vec3::Y * 0.5, Vec3::new(0.6, 0.8, 0.0), Vec3::Z));
        let foliage = Foliage {
            faces: &faces,
            connector: Vec3::ZERO,
        };
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} is not {b}");
        // Epsilon 0.1: the tilted patch is invalid. C = 2 - 0.6.
        let c = coverage(&foliage, &[ground()], 0.1);
        close(c.valid, 2.0);
        close(c.invalid, 0.6);
        close(c.total, 3.0);
        close(c.within, 2.0);
        close(c.covered(), 1.4);
        close(c.missed(), 1.6);
        close(c.quality(0.5), 0.7);
        close(c.weighted_error(0.5), 0.8);
        // Heights run evenly from 0.5 to 1.3: mean square (1.3^3 - 0.5^3) / (3 * 0.8), a third of it.
        close(c.mean_square, (1.3f64.powi(3) - 0.125) / 2.4 / 3.0);
        // Epsilon 2: all valid. C = 2.6, and what the tilt hides is still missed.
        let c = coverage(&foliage, &[ground()], 2.0);
        close(c.covered(), 2.6);
        close(c.missed(), 0.4);
    }

    #[test]
    fn more_invalid_than_valid_is_clamped_to_zero() {
        let faces = patch(Vec3::Y, Vec3::X, Vec3::Z);
        let foliage = Foliage {
            faces: &faces,
            connector: Vec3::ZERO,
        };
        let c = coverage(&foliage, &[ground()], 0.1);
        assert_eq!((c.covered(), c.missed()), (0.0, c.total));
    }

    #[test]
    fn a_face_counts_on_its_nearest_card() {
        let wall = Card::rectangle(Vec3::X * 3.0, Vec3::Y, Vec3::Z, Vec2::splat(5.0));
        // Upright patch on the wall: on the ground alone it shows nothing.
        let faces = patch(Vec3::X * 3.0, Vec3::Y, Vec3::Z);
        let foliage = Foliage {
            faces: &faces,
            connector: Vec3::ZERO,
        };
        assert!(coverage(&foliage, &[ground()], 2.0).covered() < 1e-6);
        assert!((coverage(&foliage, &[ground(), wall], 0.1).covered() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn nothing_covers_nothing() {
        let faces = patch(Vec3::ZERO, Vec3::X, Vec3::Z);
        let some = Foliage {
            faces: &faces,
            connector: Vec3::ZERO,
        };
        let c = coverage(&some, &[], 1.0);
        assert_eq!((c.covered(), c.mean_square), (0.0, f64::INFINITY));
        assert!((c.missed() - 1.0).abs() < 1e-6);
        let none = Foliage {
            faces: &[],
            connector: Vec3::ZERO,
        };
        assert_eq!(coverage(&none, &[ground()], 1.0), Coverage::default());
    }

    #[test]
    fn a_pixel_has_the_size_of_its_share_of_the_screen() {
        // 90 degrees: the screen is twice as high as it is far.
        let fov = std::f64::consts::FRAC_PI_2;
        assert!((pixel_size(50.0, fov, 1000) - 0.1).abs() < 1e-12);
        assert!((epsilon(50.0, fov, 1000, 1.5) - 0.15).abs() < 1e-12);
        assert_eq!(pixel_size(-1.0, fov, 0), 0.0);
    }
}
