//! Many trees: a cut through each, kept by splits and merges between frames.

use super::active_cut::Clock;
use super::drawn::Drawn;
use super::hierarchy::Hierarchy;
use super::looking::{Changes, First, List, Looking, collect_still, is_closed, least};
use super::place::{Place, Pyramid, Spheres, View};
use super::pool::{Pool, Slot};
use super::visibility::Visibility;

/// Trees of a few species. For several threads, make one forest for each thread from a part of the
/// trees, every second one for each of two, so that what is near is shared alike: [`Visibility`] and
/// cuts are then its own.
#[derive(Clone, Debug)]
pub struct Forest<V> {
    species: Vec<Hierarchy>,
    places: Vec<Place>,
    /// How visible sub-trees are.
    pub visibility: V,
    /// Share of its switch distance over which a node fades in over its children; 0 for none.
    pub fade: f32,
    clock: Clock,
    /// For each tree its bounding sphere in the world.
    spheres: Spheres,
    /// For each tree whether it may be in the picture.
    inside: Vec<bool>,
    /// For each tree whether its cut rests on what is hidden.
    asked: Vec<bool>,
    /// For each tree the path at which its first node is due.
    due: Vec<f32>,
    /// For each tree the path at which its first node may begin to fade.
    fades: Vec<f32>,
    slots: Vec<Slot>,
    pool: Pool,
    spare: List,
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
            (p.to_world(center), radius * p.scale)
        };
        Self {
            spheres: Spheres::new(places.iter().map(sphere)),
            inside: vec![false; places.len()],
            asked: vec![false; places.len()],
            due: vec![0.0; places.len()],
            fades: vec![0.0; places.len()],
            species,
            places,
            visibility,
            fade: 0.1,
            clock: Clock::default(),
            slots,
            pool,
            spare: List::with_capacity(most),
        }
    }

    /// Follows the camera. Allocates only while lists grow to a size that they never had before.
    pub fn update(&mut self, view: &View) -> Changes {
        let epoch = self.visibility.epoch(view.eye);
        let (all, hidden) = self.clock.tick(view, self.fade, epoch);
        let path = self.clock.path;
        let mut changes = Changes::default();
        // Most trees are due in no frame: they are passed over in groups.
        const TOGETHER: usize = 32;
        for start in (0..self.due.len()).step_by(TOGETHER) {
            let end = (start + TOGETHER).min(self.due.len());
            if !all && !hidden && least(&self.due[start..end]) > path {
                continue;
            }
            for tree in start..end {
                let anew = all || (hidden && self.asked[tree]);
                if anew || self.due[tree] <= path {
                    changes += self.refresh(tree, view, path, anew);
                }
            }
        }
        changes
    }

    fn refresh(&mut self, tree: usize, view: &View, path: f32, all: bool) -> Changes {
        let (place, range) = (&self.places[tree], Pool::range(self.slots[tree]));
        let hierarchy = &self.species[place.species as usize];
        let marks = (path, self.fade);
        let mut looking = Looking::new(hierarchy, &mut self.visibility, place, view, marks);
        let (nodes, dues, fades) = self.pool.list(range);
        // Most trees are far and stay one billboard.
        if let [root] = nodes
            && is_closed(*root)
            && let Some(due) = looking.closed()
        {
            (dues[0], fades[0]) = (due, f32::INFINITY);
            (self.due[tree], self.fades[tree]) = (due, f32::INFINITY);
            self.asked[tree] = looking.asked || (self.asked[tree] && !all);
            return Changes {
                looked_at: 1,
                ..Changes::default()
            };
        }
        if !all && looking.still(nodes, dues, fades) {
            self.asked[tree] |= looking.asked;
            let looked_at = looking.looked_at;
            let first = First::of(dues, fades);
            (self.due[tree], self.fades[tree]) = (first.due, first.fades);
            return Changes {
                looked_at,
                ..Changes::default()
            };
        }
        let changes = looking.rebuild((nodes, dues, fades), all, &mut self.spare);
        self.asked[tree] = looking.asked || (self.asked[tree] && !all);
        let first = First::of(&self.spare.dues, &self.spare.fades);
        (self.due[tree], self.fades[tree]) = (first.due, first.fades);
        self.slots[tree] = self
            .pool
            .replace(tree as u32, self.slots[tree], &self.spare);
        changes
    }

    /// Appends what is to be drawn of all trees that may be in the picture, by tree, seen from where
    /// the cuts were last updated.
    pub fn collect(&mut self, view: &View, out: &mut Vec<Drawn>) {
        if !view.sees() {
            return;
        }
        let (pyramid, path) = (Pyramid::new(view), self.clock.path);
        pyramid.meets_all(&self.spheres, &mut self.inside);
        for (tree, (&inside, &slot)) in self.inside.iter().zip(&self.slots).enumerate() {
            if !inside {
                continue;
            }
            let range = Pool::range(slot);
            let nodes = &self.pool.nodes[range.clone()];
            if self.fades[tree] >= path {
                collect_still(tree as u32, nodes, out);
                continue;
            }
            let place = &self.places[tree];
            let hierarchy = &self.species[place.species as usize];
            let marks = (path, self.fade);
            let mut looking = Looking::new(hierarchy, &mut self.visibility, place, view, marks);
            looking.collect(tree as u32, nodes, &self.pool.fades[range], out);
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
