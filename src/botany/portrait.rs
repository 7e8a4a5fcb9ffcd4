//! Pictures of what was recognised: organs, branches by order, and what hangs on which branch.

use glam::Vec3;
use tiny_skia::{Color, LineCap, Paint, PathBuilder, Pixmap, Stroke, Transform};

use super::tree::{NO_NODE, Organ, Tree};
use crate::space::raster::{Camera, EMPTY, Geometry, Items, Material, Mips, Sampling, Scene, draw};
use crate::{Error, Result};

/// Height of a picture, pixels.
const HEIGHT: u32 = 900;
/// Widest single view, pixels.
const WIDEST: u32 = 1200;
/// Colours of branch orders, trunk first; the last one goes on.
const ORDER_COLORS: [[u8; 3]; 6] = [
    [120, 60, 20],
    [214, 39, 40],
    [31, 119, 180],
    [44, 160, 44],
    [148, 103, 189],
    [230, 120, 10],
];

/// Name and PNG of each picture; each shows the tree from the front and from the right.
///
/// # Errors
/// Where a picture can't be encoded, which would be a fault of ours.
pub fn all(tree: &Tree) -> Result<Vec<(&'static str, Vec<u8>)>> {
    let views: Vec<View> = [Vec3::NEG_Z, Vec3::NEG_X]
        .into_iter()
        .map(|forward| View::new(tree, forward))
        .collect();
    let branch = first_order_branches(tree);
    Ok(vec![
        (
            "organs",
            paint(&views, |v| v.shade(tree, &organ_color(tree)))?,
        ),
        ("skeleton", paint(&views, |v| v.skeleton(tree))?),
        (
            "branches",
            paint(&views, |v| v.shade(tree, &|t| branch[t as usize]))?,
        ),
    ])
}

fn organ_color(tree: &Tree) -> impl Fn(u32) -> [f32; 3] {
    |t| match tree.organ[t as usize] {
        Organ::Wood => [0.55, 0.32, 0.14],
        Organ::Foliage => [0.25, 0.62, 0.2],
    }
}

/// For each triangle the colour of the main branch that carries it; stems and what hangs on
/// nothing are grey.
fn first_order_branches(tree: &Tree) -> Vec<[f32; 3]> {
    let chains = &tree.skeleton.chains;
    let mut main: Vec<Option<u32>> = Vec::with_capacity(chains.len());
    for (index, chain) in chains.iter().enumerate() {
        let up = chain.parent.and_then(|p| main[p as usize]);
        main.push(up.or((chain.order == 1).then_some(index as u32)));
    }
    let color = |node: u32| -> [f32; 3] {
        let chain = tree.skeleton.nodes.get(node as usize).map(|n| n.chain);
        match chain.and_then(|c| main[c as usize]) {
            // Steps of the golden ratio around the colour wheel keep neighbours apart.
            Some(branch) => hue((branch as f32 * 0.618_034).fract()),
            None => [0.5; 3],
        }
    };
    let mut colors: Vec<[f32; 3]> = tree.wood_node.iter().map(|&n| color(n)).collect();
    for leaf in &tree.leaves {
        for &t in &leaf.triangles {
            colors[t as usize] = color(leaf.node);
        }
    }
    colors
}

fn hue(h: f32) -> [f32; 3] {
    [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|shift| {
        let d = ((h + shift).fract() * 6.0 - 3.0).abs() - 1.0;
        0.15 + 0.75 * d.clamp(0.0, 1.0)
    })
}

/// One view of the tree: which triangle is seen at each pixel.
struct View {
    camera: Camera,
    middle: Vec3,
    pixels_per_unit: f32,
    items: Items,
}

impl View {
    fn new(tree: &Tree, forward: Vec3) -> Self {
        let model = &tree.model;
        let right = forward.cross(Vec3::Y);
        let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
        for p in &model.positions {
            (low, high) = (low.min(*p), high.max(*p));
        }
        let extent = (high - low).max(Vec3::splat(1e-3));
        let across = extent.dot(right.abs());
        let scale = ((HEIGHT as f32 - 40.0) / extent.y).min((WIDEST as f32 - 40.0) / across);
        let width = (across * scale).ceil() as u32 + 40;
        let middle = (low + high) / 2.0;
        let camera = Camera::orthographic(forward, Vec3::Y, middle, scale, width, HEIGHT);
        let scene = Scene {
            geometry: Geometry {
                positions: &model.positions,
                normals: &model.normals,
                uvs: [&[], &[]],
                colors: &[],
                triangles: &model.triangles,
                triangle_material: &[],
            },
            materials: &[Material {
                double_sided: true,
                ..Material::default()
            }],
            textures: &[],
        };
        let sampling = Sampling {
            side: 2,
            mips: Mips::Base,
        };
        Self {
            camera,
            middle,
            pixels_per_unit: scale,
            items: draw(&scene, &camera, sampling),
        }
    }

    /// The picture with a colour for each triangle, lit from the eye.
    fn picture(&self, color: impl Fn(u32) -> [f32; 3]) -> Option<Pixmap> {
        let (width, height, side) = (self.items.width, self.items.height, self.items.side);
        let mut pixmap = Pixmap::new(width, height)?;
        let share = 1.0 / (side * side) as f32;
        for (index, pixel) in pixmap.pixels_mut().iter_mut().enumerate() {
            let (x, y) = (index as u32 % width, index as u32 / width);
            let mut sum = [0.0f32; 3];
            for j in 0..side {
                for i in 0..side {
                    let at = (y * side + j) * width * side + x * side + i;
                    let triangle = self.items.triangle[at as usize];
                    let c = if triangle == EMPTY {
                        [1.0; 3]
                    } else {
                        color(triangle)
                    };
                    for k in 0..3 {
                        sum[k] += c[k] * share;
                    }
                }
            }
            let [r, g, b] = sum.map(|v| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8);
            *pixel = tiny_skia::ColorU8::from_rgba(r, g, b, 255).premultiply();
        }
        Some(pixmap)
    }

    fn shade(&self, tree: &Tree, color: &impl Fn(u32) -> [f32; 3]) -> Option<Pixmap> {
        self.picture(|t| {
            let [a, b, c] = tree.model.corners(t);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let light = 0.45 + 0.55 * normal.dot(self.camera.forward).abs();
            color(t).map(|v| v * light)
        })
    }

    fn skeleton(&self, tree: &Tree) -> Option<Pixmap> {
        let grey = |t: u32| match tree.organ[t as usize] {
            Organ::Wood => [0.72; 3],
            Organ::Foliage => [0.88; 3],
        };
        let mut pixmap = self.picture(grey)?;
        // Thin branches first, so that the trunk stays visible.
        let mut chains: Vec<usize> = (0..tree.skeleton.chains.len()).collect();
        chains.sort_by_key(|&c| std::cmp::Reverse(tree.skeleton.chains[c].order));
        for chain in chains {
            self.draw_chain(tree, chain, &mut pixmap);
        }
        Some(pixmap)
    }

    fn draw_chain(&self, tree: &Tree, chain: usize, pixmap: &mut Pixmap) {
        let chain = &tree.skeleton.chains[chain];
        let node = |n: u32| &tree.skeleton.nodes[n as usize];
        let mut path = PathBuilder::new();
        let first = node(chain.nodes[0]);
        let start = if first.parent == NO_NODE {
            first
        } else {
            node(first.parent)
        };
        let (x, y) = self.project(start.position);
        path.move_to(x, y);
        for &n in &chain.nodes {
            let (x, y) = self.project(node(n).position);
            path.line_to(x, y);
        }
        let [r, g, b] = ORDER_COLORS[(chain.order as usize).min(ORDER_COLORS.len() - 1)];
        let mut paint = Paint::default();
        paint.set_color(Color::from_rgba8(r, g, b, 255));
        paint.anti_alias = true;
        let mean =
            chain.nodes.iter().map(|&n| node(n).radius).sum::<f32>() / chain.nodes.len() as f32;
        let stroke = Stroke {
            width: (mean * self.pixels_per_unit).clamp(0.7, 4.0),
            line_cap: LineCap::Round,
            ..Stroke::default()
        };
        if let Some(path) = path.finish() {
            pixmap.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
        }
        // A dot where the branch begins.
        let (x, y) = self.project(first.position);
        if let Some(dot) = PathBuilder::from_circle(x, y, stroke.width.max(1.4)) {
            pixmap.fill_path(
                &dot,
                &paint,
                tiny_skia::FillRule::Winding,
                Transform::identity(),
                None,
            );
        }
    }

    fn project(&self, p: Vec3) -> (f32, f32) {
        let d = (p - self.middle) * self.pixels_per_unit;
        (
            d.dot(self.camera.right) + self.items.width as f32 / 2.0,
            self.items.height as f32 / 2.0 - d.dot(self.camera.up),
        )
    }
}

/// All views side by side as a PNG.
fn paint(views: &[View], draw: impl Fn(&View) -> Option<Pixmap>) -> Result<Vec<u8>> {
    let fault = |what: &str| Error::Internal {
        step: "inspect",
        what: format!("a picture can't be {what}"),
    };
    let width = views.iter().map(|v| v.items.width).sum();
    let mut sheet = Pixmap::new(width, HEIGHT).ok_or_else(|| fault("allocated"))?;
    let mut left = 0;
    for view in views {
        let picture = draw(view).ok_or_else(|| fault("allocated"))?;
        let paint = tiny_skia::PixmapPaint::default();
        sheet.draw_pixmap(
            left,
            0,
            picture.as_ref(),
            &paint,
            Transform::identity(),
            None,
        );
        left += picture.width() as i32;
    }
    let mut png = Vec::new();
    use image::ImageEncoder as _;
    image::codecs::png::PngEncoder::new(&mut png)
        .write_image(sheet.data(), width, HEIGHT, image::ExtendedColorType::Rgba8)
        .map_err(|_| fault("encoded"))?;
    Ok(png)
}
