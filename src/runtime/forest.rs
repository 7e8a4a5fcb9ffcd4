//! Many trees: a cut through each, kept by splits and merges between frames.

use glam::Vec4;

use super::active_cut::{Changes, Clock, Looking};
use super::hierarchy::Hierarchy;
use super::place::{Place, Pyramid, View};
use super::pool::{Pool, Slot};
use super::visibility::Visibility;

/// How a sub-tree is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// By its billboards, with all that it carries.
    Billboard,
    /// By its own triangles: it carries nothing else.
    Geometry,
}

/// One thing to draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drawn {
    /// Index of the tree.
    pub tree: u32,
    /// Index of the node in the species' [`Hierarchy`].
    pub node: u32,
    /// How.
    pub form: Form,
    /// 1: all of it. Less: the node fades in over its children, which are drawn in full; a page
    /// dithers this share of its pixels.
    pub fade: f32,
}

/// Trees of a few species. For several threads, make one forest for each thread from a part of the
/// trees: [`Visibility`] and cuts are then its own.
#[derive(Clone, Debug)]
pub struct Forest<V> {
    species: Vec<Hierarchy>,
    places: Vec<Place>,
    /// How visible sub-trees are.
    pub visibility: V,
    /// Share of its switch distance over which a node fades in over its children; 0 for none.
    pub fade: f32,
    clock: Clock,
    /// For each tree its bounding sphere in the world: centre and radius.
    spheres: Vec<Vec4>,
    /// For each tree whether its cut rests on what is hidden.
    asked: Vec<bool>,
    /// For each tree the path at which its first node is due.
    due: Vec<f32>,
    slots: Vec<Slot>,
    pool: Pool,
    spare: (Vec<u32>, Vec<f32>),
}

impl<V: Visibility> Forest<V> {
    /// All trees as coarse as they get. A place's species that doesn't exist is taken as the last.
    pub fn new(species: Vec<Hierarchy>, places: &[Place], visibility: V) -> Self {
        let last = species.len().saturating_sub(1) as u32;
        let places: Vec<Place> = places
            .iter()
            .map(|p| Place {
                species: p.species.min(last),
                ..*p
            })
            .filter(|_| !species.is_empty())
            .collect();
        let (pool, slots) = Pool::new(places.len());
        let most = species.iter().map(|s| s.nodes().len()).max().unwrap_or(0);
        let sphere = |p: &Place| {
            let (center, radius) = species[p.species as usize].sphere();
            p.to_world(center).extend(radius * p.scale)
        };
        Self {
            spheres: places.iter().map(sphere).collect(),
            asked: vec![false; places.len()],
            due: vec![0.0; places.len()],
            species,
            places,
            visibility,
            fade: 0.1,
            clock: Clock::default(),
            slots,
            pool,
            spare: (Vec::with_capacity(most), Vec::with_capacity(most)),
        }
    }

    /// Follows the camera. Allocates only while lists grow to a size that they never had before.
    pub fn update(&mut self, view: &View) -> Changes {
        let epoch = self.visibility.epoch(view.eye);
        let (all, hidden) = self.clock.tick(view, epoch);
        let path = self.clock.path;
        let mut changes = Changes::default();
        for tree in 0..self.due.len() {
            let anew = all || (hidden && self.asked[tree]);
            if anew || self.due[tree] <= path {
                changes += self.refresh(tree, view, path, anew);
            }
        }
        changes
    }

    fn refresh(&mut self, tree: usize, view: &View, path: f32, all: bool) -> Changes {
        let (place, range) = (&self.places[tree], Pool::range(self.slots[tree]));
        let hierarchy = &self.species[place.species as usize];
        let mut looking = Looking::new(hierarchy, &mut self.visibility, place, view, path);
        let (nodes, dues) = (&self.pool.nodes[range.clone()], &mut self.pool.dues[range]);
        if !all && let Some(due) = looking.still(nodes, dues) {
            self.due[tree] = due;
            self.asked[tree] |= looking.asked;
            return Changes {
                looked_at: looking.looked_at,
                ..Changes::default()
            };
        }
        let (new_nodes, new_dues) = (&mut self.spare.0, &mut self.spare.1);
        let changes = looking.rebuild((nodes, dues), all, (new_nodes, new_dues));
        self.asked[tree] = looking.asked || (self.asked[tree] && !all);
        self.due[tree] = new_dues.iter().fold(f32::INFINITY, |a, &b| a.min(b));
        self.slots[tree] = self
            .pool
            .replace(tree as u32, self.slots[tree], new_nodes, new_dues);
        changes
    }

    /// Appends what is to be drawn of all trees that may be in the picture, by tree, seen from where
    /// the cuts were last updated.
    pub fn collect(&mut self, view: &View, out: &mut Vec<Drawn>) {
        if !view.sees() {
            return;
        }
        let (pyramid, path) = (Pyramid::new(view), self.clock.path);
        for (tree, (&sphere, &slot)) in self.spheres.iter().zip(&self.slots).enumerate() {
            if !pyramid.meets(sphere.truncate(), sphere.w) {
                continue;
            }
            let range = Pool::range(slot);
            let (nodes, dues) = (&self.pool.nodes[range.clone()], &self.pool.dues[range]);
            // Most trees are far: one billboard.
            if let [0] = nodes {
                out.push(Drawn {
                    tree: tree as u32,
                    node: 0,
                    form: Form::Billboard,
                    fade: 1.0,
                });
                continue;
            }
            let place = &self.places[tree];
            let hierarchy = &self.species[place.species as usize];
            let mut looking = Looking::new(hierarchy, &mut self.visibility, place, view, path);
            looking.collect(tree as u32, nodes, dues, self.fade, out);
        }
    }

    /// The trees.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// The species.
    pub fn species(&self) -> &[Hierarchy] {
        &self.species
    }
}
