//! Charts: where each card lies in texel space.
//!
//! A triangular card is sheared to a right triangle, so that two of them share one rectangle of
//! the atlas; the corner that is nearest to a right angle keeps the shear small. Every chart has a
//! gutter around its outline, in texels, so that neighbours do not bleed into each other.

use glam::{Vec2, Vec3};

use crate::cloud::card::Card;

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
    /// True where only the texels with x/w + y/h < 1 belong to the chart.
    pub half: bool,
    /// Upper left texel in the atlas.
    pub place: [u32; 2],
    /// True where the chart lies turned by 180 degrees in its rectangle.
    pub turned: bool,
}

impl Chart {
    /// Lays out a card at `density` texels a normalised unit with a gutter of `pad` texels.
    pub fn new(card: &Card, density: f32, pad: f32) -> Self {
        if card.outline.len() == 3 {
            Self::triangle(card, density, pad)
        } else {
            Self::rectangle(card, density, pad)
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
        let half_w = (pad + w * (1.0 + pad * slope + pad / h)).ceil() + 1.0;
        let half_h = (pad + h * (1.0 + pad * slope + pad / w)).ceil() + 1.0;
        let (full_w, full_h) = ((w + 2.0 * pad).ceil(), (h + 2.0 * pad).ceil());
        let half = half_w * half_h < 2.0 * full_w * full_h;
        let size = if half {
            [half_w as u32, half_h as u32]
        } else {
            [full_w as u32, full_h as u32]
        };
        Self::affine(card, c, a - c, b - c, [w, h], Vec2::splat(pad), size, half)
    }

    fn rectangle(card: &Card, density: f32, pad: f32) -> Self {
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
            false,
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
        half: bool,
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
            half,
            place: [0, 0],
            turned: false,
        }
    }

    /// Local texel coordinates of a point (projected along the normal).
    pub fn texel(&self, p: Vec3) -> Vec2 {
        let d = p - self.origin;
        self.base + Vec2::new(d.dot(self.to_x), d.dot(self.to_y))
    }

    /// Whether the local texel (x, y) belongs to this chart.
    pub fn owns(&self, x: u32, y: u32) -> bool {
        let (w, h) = (self.size[0] as f32, self.size[1] as f32);
        !self.half || (x as f32 + 0.5) / w + (y as f32 + 0.5) / h < 1.0
    }

    /// How many texels of each row belong to the chart; they are the first ones.
    pub fn row_lengths(&self) -> Vec<u32> {
        let length = |y| (0..self.size[0]).take_while(|&x| self.owns(x, y)).count() as u32;
        (0..self.size[1]).map(length).collect()
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
