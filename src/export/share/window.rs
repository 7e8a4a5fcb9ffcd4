//! Windows: pieces of a page that a card shows instead of texels of its own.

use glam::{Vec2, Vec3};

use super::look::Look;
use crate::export::chart::{Chart, Shape};

/// Where on a page a card lies, moved, turned and, seen from behind, mirrored; scaled only where a tile is known or likely
/// to show the same in another size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// The card's middle, texels.
    pub middle: Vec2,
    /// Cosine and sine of the turn.
    pub turn: Vec2,
    /// Whether the card is turned over first.
    pub mirrored: bool,
    /// Texels of the page in a texel of the card's own.
    pub scale: f32,
    /// Mean squared difference from what the card should look like.
    pub difference: f32,
}

/// Axes of two planes that show the same are longer and nearer to a right angle than this share.
const STRETCH: f32 = 0.85;

impl Window {
    /// Where a point of the card's plane, in texels from its middle, lies on the page.
    pub(super) fn place(&self, mut q: Vec2) -> Vec2 {
        if self.mirrored {
            q.y = -q.y;
        }
        self.middle + self.turn.rotate(q) * self.scale
    }

    /// The window through which a card shows a tile, where `onto` moves points of the card's plane to that of the
    /// tile's; `None` where these planes differ too much.
    pub fn onto(
        look: &Look,
        density: f32,
        tile: &Chart,
        onto: impl Fn(Vec3) -> Vec3,
    ) -> Option<Self> {
        let at = |p: Vec3| tile.atlas_point(onto(p));
        let middle = at(look.center);
        let [x, y] = look
            .axes
            .map(|axis| at(look.center + axis / density) - middle);
        let square = x.length() * y.length();
        let like = x.length().min(y.length()) > STRETCH * x.length().max(y.length())
            && x.perp_dot(y).abs() > STRETCH * square;
        (like && square > 0.0).then(|| Self {
            middle,
            turn: x.normalize(),
            mirrored: x.perp_dot(y) < 0.0,
            scale: square.sqrt(),
            difference: 0.0,
        })
    }

    /// The chart of a card that shows this window; `before` is its own.
    pub fn chart(&self, before: &Chart, look: &Look, density: f32) -> Chart {
        let mut corners = before.corners.clone();
        let [tangent, mut bitangent] = look.axes;
        let mut normal = before.normal;
        if self.mirrored {
            corners.reverse();
            (normal, bitangent) = (-normal, -bitangent);
        }
        let turn = self.turn * density * self.scale;
        let to_x = tangent * turn.x - bitangent * turn.y;
        let to_y = tangent * turn.y + bitangent * turn.x;
        let place = |p: Vec3| {
            let d = p - look.center;
            self.middle + Vec2::new(d.dot(to_x), d.dot(to_y))
        };
        let low = corners.iter().fold(Vec2::MAX, |m, &c| m.min(place(c)));
        let high = corners.iter().fold(Vec2::MIN, |m, &c| m.max(place(c)));
        let low = low.floor().max(Vec2::ZERO);
        Chart {
            tangent: to_x.normalize_or(tangent),
            corners,
            normal,
            origin: look.center,
            to_x,
            to_y,
            base: self.middle - low,
            size: (high - low)
                .to_array()
                .map(|side| side.ceil().max(1.0) as u32),
            shape: Shape::Window,
            place: [low.x as u32, low.y as u32],
            turned: false,
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use glam::Vec3;

    use super::super::fitted::Seen;
    use super::super::look::Page;
    use super::*;

    const SIDE: u32 = 64;

    /// Blobs some texels wide, of which no two are alike.
    pub fn page() -> Page {
        let seen = |x: f32, y: f32| {
            let wave = (0.31 * x + 0.002 * x * y).sin() + (0.27 * y - 0.003 * x * x).cos();
            Seen {
                opacity: if wave > 0.2 { 1.0 } else { 0.0 },
                color: Vec3::new(x / SIDE as f32, 0.5, y / SIDE as f32) * 0.2,
            }
        };
        let texels = (0..SIDE * SIDE).map(|i| seen((i % SIDE) as f32, (i / SIDE) as f32));
        Page {
            size: [SIDE; 2],
            texels: texels.collect(),
            owned: (0..SIDE * SIDE).collect(),
        }
    }

    /// A triangle in a plane of its own.
    pub fn before() -> Chart {
        let normal = Vec3::new(0.36, 0.48, 0.8);
        let tangent = Vec3::new(0.8, -0.6, 0.0);
        let [a, b] = [tangent, normal.cross(tangent)];
        let corners = [(-1.0, -1.0), (1.2, -0.8), (0.1, 1.0)];
        Chart {
            corners: corners.map(|(x, y)| a * x + b * y).to_vec(),
            normal,
            tangent,
            origin: Vec3::ZERO,
            to_x: a,
            to_y: b,
            base: Vec2::ZERO,
            size: [1, 1],
            shape: Shape::Whole,
            place: [0, 0],
            turned: false,
        }
    }

    /// The look of a card that shows `window` of the page.
    pub fn cut_out(window: &Window, page: &Page, chart: &Chart, density: f32) -> Look {
        let axes = [chart.tangent, chart.normal.cross(chart.tangent)];
        let center = chart.corners.iter().sum::<Vec3>() / 3.0;
        let flat = |p: Vec3| Vec2::from(axes.map(|a| (p - center).dot(a))) * density;
        let outline: Vec<Vec2> = chart.corners.iter().map(|&c| flat(c)).collect();
        let grid = (-14..14).flat_map(|y| (-14..14).map(move |x| Vec2::new(x as f32, y as f32)));
        let inside = grid.filter(|&q| crate::space::hull::holds(&outline, q, 0.0));
        let points = inside.map(|q| {
            let p = window.place(q);
            (q, page.texels[(p.y as u32 * SIDE + p.x as u32) as usize])
        });
        Look {
            center,
            axes,
            points: points.collect(),
            outline,
        }
    }

    #[test]
    fn a_window_keeps_the_cards_place_size_and_sides() {
        let (chart, density) = (before(), 9.0);
        for mirrored in [false, true] {
            let window = Window {
                middle: Vec2::new(30.0, 34.0),
                turn: Vec2::from_angle(0.7),
                mirrored,
                scale: 1.0,
                difference: 0.0,
            };
            let look = cut_out(&window, &page(), &chart, density);
            let copy = window.chart(&chart, &look, density);
            for &corner in &chart.corners {
                assert!(copy.corners.contains(&corner));
            }
            assert_eq!(
                copy.normal,
                if mirrored {
                    -chart.normal
                } else {
                    chart.normal
                }
            );
            // Corners go round the front as before, and the page's axes are the frame of normals.
            let [a, b, c] = [0, 1, 2].map(|i| copy.corners[i]);
            assert!((b - a).cross(c - b).dot(copy.normal) > 0.0);
            let at = |p: Vec3| copy.atlas_point(p);
            let right = at(a + copy.tangent) - at(a);
            let down = at(a + copy.normal.cross(copy.tangent)) - at(a);
            assert!((right - Vec2::X * density).length() < 1e-4, "{right}");
            assert!((down - Vec2::Y * density).length() < 1e-4, "{down}");
            assert!((at(look.center) - window.middle).length() < 1e-4);
            for &corner in &copy.corners {
                let local = copy.texel(corner);
                assert!(local.min_element() >= -1e-4);
                assert!(local.x <= copy.size[0] as f32 && local.y <= copy.size[1] as f32);
                assert!((copy.point(local) - corner).length() < 1e-5);
            }
        }
    }

    #[test]
    fn a_card_shows_a_tile_that_is_known_to_show_the_same_turned_scaled_and_from_behind() {
        let (tile, density) = (before(), 9.0);
        let mut tile = Chart {
            base: Vec2::splat(20.0),
            ..tile
        };
        (tile.to_x, tile.to_y) = (tile.to_x * 2.0 * density, tile.to_y * 2.0 * density);
        let turn = glam::Quat::from_rotation_y(0.8) * glam::Quat::from_rotation_x(0.3);
        for behind in [false, true] {
            // The same card elsewhere, of half the size.
            let away = |p: Vec3| Vec3::new(3.0, 1.0, -2.0) + turn * p * 0.5;
            let back = |p: Vec3| turn.inverse() * (p - Vec3::new(3.0, 1.0, -2.0)) * 2.0;
            let mut own = before();
            own.corners = tile.corners.iter().map(|&c| away(c)).collect();
            (own.normal, own.tangent) = (turn * own.normal, turn * own.tangent);
            if behind {
                own.corners.reverse();
                own.normal = -own.normal;
            }
            let mut look = cut_out(
                &Window {
                    middle: Vec2::splat(30.0),
                    turn: Vec2::X,
                    mirrored: false,
                    scale: 1.0,
                    difference: 0.0,
                },
                &page(),
                &own,
                density,
            );
            look.points.clear();
            let window = Window::onto(&look, density, &tile, back).unwrap();
            assert_eq!(window.mirrored, behind);
            // Twice as many texels a unit, and twice as large.
            assert!((window.scale - 4.0).abs() < 1e-4, "{}", window.scale);
            let copy = window.chart(&own, &look, density);
            for &corner in &own.corners {
                let (shown, wanted) = (copy.atlas_point(corner), tile.atlas_point(back(corner)));
                assert!((shown - wanted).length() < 1e-3, "{shown} {wanted}");
            }
            // A plane that is seen nearly edge on shows nothing of the kind.
            let askew = |p: Vec3| {
                let p = back(p);
                p - tile.tangent * p.dot(tile.tangent) * 0.7
            };
            assert_eq!(Window::onto(&look, density, &tile, askew), None);
        }
    }
}
