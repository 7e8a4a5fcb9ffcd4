//! Many trees: a cut through each, kept by splits and merges between frames.

use super::active_cut::Clock;
use super::drawn::Drawn;
use super::hierarchy::Hierarchy;
use super::looking::{Changes, First, List, Looking, collect_still, is_closed, least_unveiled};
use super::place::{Place, Pyramid, Spheres, View};
use super::pool::{Pool, Slot};
use super::visibility::Visibility;

/// Trees of a few species. For several threads, make one forest for each thread from its
/// [`shares`](super::shares()) of the trees, with a clone of the [`Visibility`]: cuts are then its own, and what
/// clones of an [`Occlusion`](super::Occlusion) compute they share.
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
    /// For each tree 0 where it may be in the picture, infinity where not.
    veil: Vec<f32>,
    /// The picture that it is for.
    veiled: Option<View>,
    /// For each tree whether its cut rests on what is hidden.
    asked: Vec<bool>,
    /// For each tree the path at which its first node is due; [`ANEW`] where all of its nodes are.
    due: Vec<f32>,
    /// For each tree the path at which its first node may begin to fade.
    fades: Vec<f32>,
    slots: Vec<Slot>,
    pool: Pool,
    spare: List,
    /// What [`Forest::collect`] had to change.
    late: Changes,
}

/// Due, and nothing that was known holds any more.
const ANEW: f32 = f32::NEG_INFINITY;

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
            veil: vec![f32::INFINITY; places.len()],
            veiled: None,
            asked: vec![false; places.len()],
            due: vec![ANEW; places.len()],
            fades: vec![0.0; places.len()],
            species,
            places,
            visibility,
            fade: 0.1,
            clock: Clock::default(),
            slots,
            pool,
            spare: List::with_capacity(most),
            late: Changes::default(),
        }
    }

    /// Follows the camera. Trees that can't be in the picture wait: a cut is made when it is asked for,
    /// by a later frame or by [`Forest::collect`]. Allocates only while lists grow to a size that they
    /// never had before.
    pub fn update(&mut self, view: &View) -> Changes {
        let epoch = self.visibility.epoch(view.eye);
        let (all, hidden) = self.clock.tick(view, self.fade, epoch);
        if all {
            self.due.fill(ANEW);
        } else if hidden {
            let asked = self.due.iter_mut().zip(&self.asked);
            asked.for_each(|(due, &asked)| *due = if asked { ANEW } else { *due });
        }
        let mut changes = std::mem::take(&mut self.late);
        if !view.sees() {
            return changes;
        }
        self.look(view);
        let path = self.clock.path;
        // Most trees are due in no frame: they are passed over in groups.
        const TOGETHER: usize = 32;
        for start in (0..self.due.len()).step_by(TOGETHER) {
            let end = (start + TOGETHER).min(self.due.len());
            if least_unveiled(&self.due[start..end], &self.veil[start..end]) > path {
                continue;
            }
            for tree in start..end {
                if self.due[tree].max(self.veil[tree]) <= path {
                    changes += self.refresh(tree, view, path);
                }
            }
        }
        changes
    }

    fn refresh(&mut self, tree: usize, view: &View, path: f32) -> Changes {
        let all = self.due[tree] == ANEW;
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
    /// the cuts were last updated. The picture may be another than that of the update (a shadow's): what
    /// has waited outside of it is cut now.
    pub fn collect(&mut self, view: &View, out: &mut Vec<Drawn>) {
        if !view.sees() {
            return;
        }
        self.prepare(view);
        let path = self.clock.path;
        let updated = self.clock.view().unwrap_or(*view);
        for (tree, (&veil, &slot)) in self.veil.iter().zip(&self.slots).enumerate() {
            if veil > 0.0 {
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
            let mut looking = Looking::new(hierarchy, &mut self.visibility, place, &updated, marks);
            looking.collect(tree as u32, nodes, &self.pool.fades[range], out);
        }
    }

    /// Finds what may be in a picture.
    fn look(&mut self, view: &View) {
        Pyramid::new(view).veils(&self.spheres, &mut self.veil);
        self.veiled = Some(*view);
    }

    /// Cuts what may be in this picture and was not in that of the last update.
    fn prepare(&mut self, view: &View) {
        if self.veiled == Some(*view) {
            return;
        }
        self.look(view);
        let (Some(updated), path) = (self.clock.view(), self.clock.path) else {
            return;
        };
        for tree in 0..self.due.len() {
            if self.due[tree].max(self.veil[tree]) <= path {
                let changes = self.refresh(tree, &updated, path);
                self.late += changes;
            }
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
