//! The leaves of a tree as the run time sees them, and drawings of some of them.

use glam::Vec3;

use crate::botany::tree::{Organ, Tree};
use crate::report::Drawable;
use crate::runtime::{Chosen, Item};
use crate::space::raster::{Camera, Geometry, Items, Sampling, Scene, draw};

/// Leaves in groups; with groups of one leaf each, leaves.
pub struct Leaves<'t> {
    /// The tree.
    pub tree: &'t Tree,
    /// What the budget is spent on.
    pub items: Vec<Item>,
    /// For each item its leaves, in the order in which a part of the group is drawn.
    pub members: Vec<Vec<u32>>,
}

impl<'t> Leaves<'t> {
    /// Groups of at most `size` leaves that hang beside each other on one branch.
    pub fn new(tree: &'t Tree, size: usize) -> Self {
        let mut members = Vec::new();
        for subtree in &tree.subtrees {
            members.extend(subtree.leaves.chunks(size.max(1)).map(<[u32]>::to_vec));
        }
        let items = members.iter().map(|group| item(tree, group)).collect();
        Self {
            tree,
            items,
            members,
        }
    }

    /// Number of leaves.
    pub fn count(&self) -> u32 {
        self.items.iter().map(|i| i.leaves).sum()
    }

    /// For each triangle its item, or `u32::MAX` for wood.
    pub fn item_of_triangle(&self) -> Vec<u32> {
        let mut out = vec![u32::MAX; self.tree.model.triangles.len()];
        for (item, group) in self.members.iter().enumerate() {
            for &leaf in group {
                for &t in &self.tree.leaves[leaf as usize].triangles {
                    out[t as usize] = item as u32;
                }
            }
        }
        out
    }

    /// Area that an item shows from a direction (unit vector) if nothing hides it.
    pub fn projected_area(&self, item: usize, to_eye: Vec3) -> f32 {
        let triangles = self.members[item]
            .iter()
            .flat_map(|&leaf| &self.tree.leaves[leaf as usize].triangles);
        triangles
            .map(|&t| {
                let [a, b, c] = self.tree.model.corners(t);
                0.5 * (b - a).cross(c - a).dot(to_eye).abs()
            })
            .sum()
    }

    /// Triangles of the wood and of what is chosen, in the model's order.
    pub fn triangles(&self, chosen: &[Chosen]) -> Vec<u32> {
        let model = &self.tree.model;
        let mut keep: Vec<bool> = self.tree.organ.iter().map(|&o| o == Organ::Wood).collect();
        for c in chosen {
            for &leaf in &self.members[c.item as usize][..c.leaves as usize] {
                for &t in &self.tree.leaves[leaf as usize].triangles {
                    keep[t as usize] = true;
                }
            }
        }
        (0..model.triangles.len() as u32)
            .filter(|&t| keep[t as usize])
            .collect()
    }
}

/// A group's middle and main normal.
fn item(tree: &Tree, group: &[u32]) -> Item {
    let (mut center, mut area) = (Vec3::ZERO, 0.0);
    // Normals have no sign: their main direction is that of the sum of their outer products.
    let mut spread = glam::Mat3::ZERO;
    for &leaf in group {
        let leaf = &tree.leaves[leaf as usize];
        center += leaf.center * leaf.area;
        area += leaf.area;
        for &t in &leaf.triangles {
            let [a, b, c] = tree.model.corners(t);
            let normal = (b - a).cross(c - a);
            let length = normal.length().max(1e-30);
            spread +=
                glam::Mat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z)
                    * (1.0 / length);
        }
    }
    let mut normal = Vec3::new(0.62, 0.54, 0.57);
    for _ in 0..32 {
        normal = (spread * normal).normalize_or(normal);
    }
    Item {
        center: center / area.max(1e-30),
        normal,
        leaves: group.len() as u32,
    }
}

/// Draws some of a model's triangles; items name triangles of the model.
pub fn draw_some(
    drawable: &Drawable,
    triangles: &[u32],
    camera: &Camera,
    sampling: Sampling,
) -> Partial {
    let whole = drawable.scene();
    let geometry = whole.geometry;
    let partial = Partial {
        triangles: triangles
            .iter()
            .map(|&t| geometry.triangles[t as usize])
            .collect(),
        material: match geometry.triangle_material {
            [] => Vec::new(),
            all => triangles.iter().map(|&t| all[t as usize]).collect(),
        },
        items: Items {
            width: 0,
            height: 0,
            side: 1,
            triangle: Vec::new(),
            near: Vec::new(),
        },
    };
    let items = draw(&partial.scene(&whole), camera, sampling);
    Partial { items, ..partial }
}

/// A drawing of a part of a model.
pub struct Partial {
    triangles: Vec<[u32; 3]>,
    material: Vec<u32>,
    /// What is seen; items count the drawn triangles alone.
    pub items: Items,
}

impl Partial {
    /// The part as a scene.
    pub fn scene<'a>(&'a self, whole: &Scene<'a>) -> Scene<'a> {
        Scene {
            geometry: Geometry {
                triangles: &self.triangles,
                triangle_material: &self.material,
                ..whole.geometry
            },
            ..*whole
        }
    }
}
