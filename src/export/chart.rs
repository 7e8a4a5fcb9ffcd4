//! Charts: where each card lies in texel space.
//!
//! For the rectangle packer a triangular card is sheared to a right triangle, so that two of them
//! share one rectangle of the atlas; the corner that is nearest to a right angle keeps the shear
//! small. Where all angles are far from it (slivers), a rectangle of its own is smaller. A packer
//! of outlines ([`Chart::placed`]) leaves cards in their shape and turns them. Every chart has a
//! gutter around its outline, in texels, so that neighbours do not bleed into each other.

use glam::{Vec2, Vec3};

use crate::cloud::card::Card;
use crate::space::hull;

/// Which texels of its rectangle belong to a chart.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// All.
    Whole,
    /// Those with x/w + y/h < 1: two such charts share a rectangle.
    Half,
    /// Those that are marked, row by row.
    Mask(Vec<bool>),
    /// None: the card shows texels of other charts.
    Window,
}

/// A card's place in texel space.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Corners of the card, counter-clockwise seen from the front, normalised tree space.
    pub corners: Vec<Vec3>,
    /// Unit normal of the front side.
    pub normal: Vec3,
    /// Unit tangent: the direction of texel x on the card.
    pub tangent: Vec3,
    /// Local texel coordinates of `origin + ...`: x = (p - origin) . to_x + base.x, likewise y.
    pub origin: Vec3,
    /// Gradient of texel x over space.
    pub to_x: Vec3,
    /// Gradient of texel y over space.
    pub to_y: Vec3,
    /// Local texel coordinates of `origin`.
    pub base: Vec2,
    /// Local size in texels.
    pub size: [u32; 2],
    /// Which of its texels belong to the chart.
    pub shape: Shape,
    /// Upper left texel in the atlas.
    pub place: [u32; 2],
    /// True where the chart lies turned by 180 degrees in its rectangle.
    pub turned: bool,
}

impl Chart {
    /// Lays out a card at `density` texels a normalised unit with a gutter of `pad` texels.
    pub fn new(card: &Card, density: f32, pad: f32) -> Self {
        let whole = Self::rectangle(card, density, pad);
        if card.outline.len() != 3 {
            return whole;
        }
        let half = Self::triangle(card, density, pad);
        let texels = |chart: &Self| chart.size[0] * chart.size[1];
        if texels(&half) < 2 * texels(&whole) {
            half
        } else {
            whole
        }
    }

    fn triangle(card: &Card, density: f32, pad: f32) -> Self {
        let o = &card.outline;
        let cosine = |i: usize| {
            let (a, b) = (o[(i + 1) % 3] - o[i], o[(i + 2) % 3] - o[i]);
            (a.dot(b) / (a.length() * b.length()).max(1e-30)).abs()
        };
        let mut best = 0;
        for i in 1..3 {
            if cosine(i) < cosine(best) {
                best = i;
            }
        }
        let (c, mut a, mut b) = (o[best], o[(best + 1) % 3], o[(best + 2) % 3]);
        if (b - c).length_squared() > (a - c).length_squared() {
            (a, b) = (b, a);
        }
        let texels = |d: Vec2| (d.length() * density).max(1.0);
        let (w, h) = (texels(a - c), texels(b - c));
        // Gutter of a right triangle: both legs and the hypotenuse move out by `pad`.
        let slope = (1.0 / (w * w) + 1.0 / (h * h)).sqrt();
        let size = [
            (pad + w * (1.0 + pad * slope + pad / h)).ceil() as u32 + 1,
            (pad + h * (1.0 + pad * slope + pad / w)).ceil() as u32 + 1,
        ];
        Self::affine(
            card,
            c,
            a - c,
            b - c,
            [w, h],
            Vec2::splat(pad),
            size,
            Shape::Half,
        )
    }

    /// The chart of the card's bounding rectangle along its longest edge.
    pub fn rectangle(card: &Card, density: f32, pad: f32) -> Self {
        let o = &card.outline;
        let (mut low, mut high) = (Vec2::MAX, Vec2::MIN);
        // The longer edge direction of the outline is the rectangle's x.
        let edge = (0..o.len())
            .map(|i| o[(i + 1) % o.len()] - o[i])
            .fold(Vec2::ZERO, |a, b| {
                if b.length_squared() > a.length_squared() * 1.0001 {
                    b
                } else {
                    a
                }
            });
        let x = edge.normalize_or(Vec2::X);
        let y = x.perp();
        for p in o {
            let local = Vec2::new(p.dot(x), p.dot(y));
            (low, high) = (low.min(local), high.max(local));
        }
        let extent = (high - low).max(Vec2::splat(1e-9));
        let legs = [(extent.x * density).max(1.0), (extent.y * density).max(1.0)];
        let size = [
            (legs[0] + 2.0 * pad).ceil() as u32,
            (legs[1] + 2.0 * pad).ceil() as u32,
        ];
        let corner = x * low.x + y * low.y;
        Self::affine(
            card,
            corner,
            x * extent.x,
            y * extent.y,
            legs,
            Vec2::splat(pad),
            size,
            Shape::Whole,
        )
    }

    /// The chart whose texel axes run along `a` (to `legs[0]` texels) and `b` (to `legs[1]`).
    #[expect(
        clippy::too_many_arguments,
        reason = "one call for each shape; a struct would only rename them"
    )]
    fn affine(
        card: &Card,
        corner: Vec2,
        a: Vec2,
        b: Vec2,
        legs: [f32; 2],
        base: Vec2,
        size: [u32; 2],
        shape: Shape,
    ) -> Self {
        let determinant = a.perp_dot(b);
        let determinant = if determinant.abs() < 1e-30 {
            1e-30
        } else {
            determinant
        };
        // Rows of the inverse of [a b]: s = (p - corner) x b / det, t = a x (p - corner) / det.
        let s = Vec2::new(b.y, -b.x) / determinant * legs[0];
        let t = Vec2::new(-a.y, a.x) / determinant * legs[1];
        let in_space = |d: Vec2| card.u * d.x + card.v * d.y;
        Self {
            corners: card.corners().collect(),
            normal: card.normal(),
            tangent: in_space(a.normalize_or(Vec2::X)),
            origin: card.origin + in_space(corner),
            to_x: in_space(s),
            to_y: in_space(t),
            base,
            size,
            shape,
            place: [0, 0],
            turned: false,
        }
    }

    /// The chart of a card whose corners a packer has put at `corners`, in texels of a page of the
    /// given size, affinely; it owns the texels within `pad` of its outline.
    pub fn placed(card: &Card, corners: &[Vec2], pad: f32, page: [u32; 2]) -> Self {
        let page = Vec2::new(page[0] as f32, page[1] as f32);
        let low = corners.iter().fold(page, |m, &c| m.min(c)) - pad;
        let high = corners.iter().fold(Vec2::ZERO, |m, &c| m.max(c)) + pad;
        let (low, high) = (low.floor().max(Vec2::ZERO), high.ceil().min(page));
        let [w, h] = [(high.x - low.x) as u32, (high.y - low.y) as u32];
        let mut outline: Vec<Vec2> = corners.iter().map(|&c| c - low).collect();
        let base = outline[0];
        let (p, q) = (outline[1] - base, outline[2] - base);
        let [o, a, b] = [0, 1, 2].map(|i| card.outline[i]);
        let (a, b) = (a - o, b - o);
        if p.perp_dot(q) < 0.0 {
            outline.reverse();
        }
        let owned = (0..w * h).map(|i| {
            let center = Vec2::new((i % w) as f32 + 0.5, (i / w) as f32 + 0.5);
            hull::distance(&outline, center) < pad + 0.499
        });
        let owned = owned.collect();
        // On the card, where texel x grows and y stays: weights of a and b that cancel y.
        let (x, y) = (Vec2::new(p.x, q.x), Vec2::new(p.y, q.y));
        let along = (a * y.y - b * y.x) * x.perp_dot(y).signum();
        let in_space = |d: Vec2| card.u * d.x + card.v * d.y;
        let unit = Self::affine(card, o, a, b, [1.0, 1.0], base, [w, h], Shape::Mask(owned));
        Self {
            tangent: in_space(along.normalize_or(Vec2::X)),
            to_x: unit.to_x * x.x + unit.to_y * x.y,
            to_y: unit.to_x * y.x + unit.to_y * y.y,
            place: [low.x as u32, low.y as u32],
            ..unit
        }
    }

    /// The chart of the same card seen from behind: its texels lie where those of the front do, so
    /// that both sides have one outline and one alpha.
    pub fn back(&self) -> Self {
        Self {
            corners: self.corners.iter().rev().copied().collect(),
            normal: -self.normal,
            ..self.clone()
        }
    }

    /// Moves the card towards where its front looks, by a length in normalised units.
    pub fn lift(&mut self, length: f32) {
        let step = self.normal * length;
        self.corners.iter_mut().for_each(|corner| *corner += step);
        self.origin += step;
    }

    /// Local texel coordinates of a point (projected along the normal).
    pub fn texel(&self, p: Vec3) -> Vec2 {
        let d = p - self.origin;
        self.base + Vec2::new(d.dot(self.to_x), d.dot(self.to_y))
    }

    /// The point of the card's plane at local texel coordinates.
    pub fn point(&self, texel: Vec2) -> Vec3 {
        let axes = [self.tangent, self.normal.cross(self.tangent)];
        let [x, y] = [self.to_x, self.to_y].map(|to| Vec2::from(axes.map(|axis| to.dot(axis))));
        let d = texel - self.base;
        // Rows of the inverse of [x; y].
        let determinant = x.perp_dot(y);
        let q = Vec2::new(d.x * y.y - d.y * x.y, d.y * x.x - d.x * y.x) / determinant;
        self.origin + axes[0] * q.x + axes[1] * q.y
    }

    /// Whether the local texel (x, y) belongs to this chart.
    pub fn owns(&self, x: u32, y: u32) -> bool {
        let [w, h] = self.size;
        match &self.shape {
            Shape::Whole => true,
            Shape::Half => (x as f32 + 0.5) / w as f32 + (y as f32 + 0.5) / (h as f32) < 1.0,
            Shape::Mask(owned) => owned[(y * w + x) as usize],
            Shape::Window => false,
        }
    }

    /// How many texels of each row the card may show: up to the last one that belongs to the chart,
    /// and all of a window's.
    pub fn row_lengths(&self) -> Vec<u32> {
        let [width, height] = self.size;
        let length = |y| match self.shape {
            Shape::Whole | Shape::Window => width,
            _ => (0..width)
                .rev()
                .find(|&x| self.owns(x, y))
                .map_or(0, |x| x + 1),
        };
        (0..height).map(length).collect()
    }

    /// Left, top, width and height of its rectangle in the atlas, texels.
    pub fn rectangle_in_atlas(&self) -> [u32; 4] {
        [self.place[0], self.place[1], self.size[0], self.size[1]]
    }

    /// Where the local texel (x, y) lies in the atlas.
    pub fn in_atlas(&self, x: u32, y: u32) -> [u32; 2] {
        if self.turned {
            [
                self.place[0] + self.size[0] - 1 - x,
                self.place[1] + self.size[1] - 1 - y,
            ]
        } else {
            [self.place[0] + x, self.place[1] + y]
        }
    }

    /// Continuous atlas texel coordinates of a point on the card.
    pub fn atlas_point(&self, p: Vec3) -> Vec2 {
        let local = self.texel(p);
        let place = Vec2::new(self.place[0] as f32, self.place[1] as f32);
        if self.turned {
            place + Vec2::new(self.size[0] as f32, self.size[1] as f32) - local
        } else {
            place + local
        }
    }
}
