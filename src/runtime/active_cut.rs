//! A cut that follows the camera (El-Sana and others 2001, section 5: the list of active nodes).
//!
//! Every node on the way from the root to the cut is kept with the length of the eye's path at
//! which it has to be looked at again: its distance can't change faster than the eye moves. Most
//! nodes are far from the distance at which they switch and stay untouched for many frames; the
//! cut is nevertheless the same, at every frame, as one made anew.

use glam::Vec3;

use super::forest::{Drawn, Form};
use super::hierarchy::Hierarchy;
use super::place::{Place, View};
use super::visibility::Visibility;

/// What a frame changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Changes {
    /// Nodes that were opened.
    pub splits: u32,
    /// Nodes that were closed.
    pub merges: u32,
    /// Nodes that were looked at.
    pub looked_at: u32,
}

impl std::ops::AddAssign for Changes {
    fn add_assign(&mut self, other: Self) {
        self.splits += other.splits;
        self.merges += other.merges;
        self.looked_at += other.looked_at;
    }
}

/// In a list of nodes: what stands for the node are its children (or, for a tip, its geometry).
pub(super) const OPEN: u32 = 1 << 31;

/// How far the eye has come.
#[derive(Clone, Debug, Default)]
pub(super) struct Clock {
    last: Option<View>,
    epoch: u64,
    /// Length of the eye's path since everything was looked at.
    pub path: f32,
}

/// A path so long that its length has lost its millimetres: everything is looked at again.
const LONG_PATH: f32 = 4096.0;

impl Clock {
    /// Moves on to a view; whether everything has to be looked at, and whether what was asked for its
    /// occlusion has.
    pub fn tick(&mut self, view: &View, epoch: u64) -> (bool, bool) {
        let step = match self.last {
            Some(last) if last.sees() == view.sees() && last.zoom == view.zoom => {
                last.eye.distance(view.eye)
            }
            _ => f32::INFINITY,
        };
        let path = self.path + step * 1.000_001;
        let all = (view.sees() && path.is_nan()) || path > LONG_PATH;
        let hidden = epoch != self.epoch;
        (self.last, self.epoch) = (Some(*view), epoch);
        self.path = if all { 0.0 } else { path };
        (all, hidden)
    }
}

/// One tree, seen in one frame.
pub(super) struct Looking<'a, V> {
    pub hierarchy: &'a Hierarchy,
    pub visibility: &'a mut V,
    pub place: &'a Place,
    /// The eye in the tree's own space.
    pub eye: Vec3,
    /// `None`: nothing is seen.
    pub zoom: Option<f32>,
    pub path: f32,
    pub looked_at: u32,
    /// Whether the occlusion of any node was asked for.
    pub asked: bool,
}

impl<'a, V: Visibility> Looking<'a, V> {
    #[inline]
    pub fn new(
        hierarchy: &'a Hierarchy,
        visibility: &'a mut V,
        place: &'a Place,
        view: &View,
        path: f32,
    ) -> Self {
        Self {
            hierarchy,
            visibility,
            eye: place.to_local(view.eye),
            place,
            zoom: view.sees().then_some(view.zoom),
            path,
            looked_at: 0,
            asked: false,
        }
    }

    /// Whether a node is open, and the length of the path until which that is sure.
    #[inline]
    pub fn look(&mut self, node: u32) -> (bool, f32) {
        self.looked_at += 1;
        let Some(zoom) = self.zoom else {
            return (false, f32::INFINITY);
        };
        let at = &self.hierarchy.nodes()[node as usize];
        let sight = self.visibility.sight(at, node, self.eye, self.place);
        let mut switch = sight.visibility * at.switch_distance * zoom;
        if sight.distance < switch {
            self.asked = true;
            switch *= 1.0 - self.visibility.occlusion(at, self.place);
        }
        // Rounding: what is as near as this to its switch is looked at in every frame.
        let unsure = 1e-5 * (sight.distance + switch) + 1e-6 * self.path;
        let free = ((sight.distance - switch).abs() - unsure) / sight.rate * self.place.scale;
        (sight.distance < switch, self.path + free.max(0.0))
    }

    /// How far a node is on its way to be drawn as a whole: 1 at its switch distance.
    #[inline]
    fn nearness(&mut self, node: u32) -> f32 {
        let at = &self.hierarchy.nodes()[node as usize];
        let sight = self.visibility.sight(at, node, self.eye, self.place);
        let seen = sight.visibility * (1.0 - self.visibility.occlusion(at, self.place));
        sight.distance / (seen * at.switch_distance * self.zoom.unwrap_or(0.0))
    }

    /// Looks again at the nodes of a list that are due (or `all`); `None` where one of them changed.
    /// Else the path at which the first is due again.
    #[inline]
    pub fn still(&mut self, nodes: &[u32], dues: &mut [f32]) -> Option<f32> {
        let mut first = f32::INFINITY;
        for (&node, due) in nodes.iter().zip(dues) {
            if *due <= self.path {
                let (open, next) = self.look(node & !OPEN);
                if open != (node & OPEN != 0) {
                    return None;
                }
                *due = next;
            }
            first = first.min(*due);
        }
        Some(first)
    }

    /// Writes the list anew: what is due (or `all`) is looked at, the rest is copied.
    pub fn rebuild(
        &mut self,
        old: (&[u32], &[f32]),
        all: bool,
        new: (&mut Vec<u32>, &mut Vec<f32>),
    ) -> Changes {
        let ((old, old_dues), (nodes, dues)) = (old, new);
        nodes.clear();
        dues.clear();
        let mut changes = Changes::default();
        let before = self.looked_at;
        let mut i = 0;
        while i < old.len() {
            let (node, was_open) = (old[i] & !OPEN, old[i] & OPEN != 0);
            let (open, due) = if all || old_dues[i] <= self.path {
                self.look(node)
            } else {
                (was_open, old_dues[i])
            };
            nodes.push(if open { node | OPEN } else { node });
            dues.push(due);
            i += 1;
            let end = self.hierarchy.nodes()[node as usize].end;
            if open && !was_open {
                changes.splits += 1;
                self.fill(node + 1, end, nodes, dues, &mut changes.splits);
            } else if was_open && !open {
                changes.merges += 1;
                while i < old.len() && (old[i] & !OPEN) < end {
                    changes.merges += u32::from(old[i] & OPEN != 0);
                    i += 1;
                }
            }
        }
        changes.looked_at = self.looked_at - before;
        changes
    }

    /// Writes the nodes from `node` to `end` that are seen from the root.
    fn fill(
        &mut self,
        mut node: u32,
        end: u32,
        nodes: &mut Vec<u32>,
        dues: &mut Vec<f32>,
        splits: &mut u32,
    ) {
        while node < end {
            let (open, due) = self.look(node);
            nodes.push(if open { node | OPEN } else { node });
            dues.push(due);
            if open {
                *splits += 1;
                node += 1;
            } else {
                node = self.hierarchy.nodes()[node as usize].end;
            }
        }
    }

    /// Writes what is drawn; `fade` is the share of its switch distance over which a node fades in
    /// over its children.
    #[inline]
    pub fn collect(
        &mut self,
        tree: u32,
        nodes: &[u32],
        dues: &[f32],
        fade: f32,
        out: &mut Vec<Drawn>,
    ) {
        for (&node, &due) in nodes.iter().zip(dues) {
            let index = node & !OPEN;
            let drawn = |form, fade| Drawn {
                tree,
                node: index,
                form,
                fade,
            };
            if node & OPEN == 0 {
                out.push(drawn(Form::Billboard, 1.0));
                continue;
            }
            let at = &self.hierarchy.nodes()[index as usize];
            if at.end == index + 1 {
                out.push(drawn(Form::Geometry, 1.0));
            }
            // What can't close before the eye has come this far has not begun to fade.
            let zone = fade * at.switch_distance * self.zoom.unwrap_or(0.0) * self.place.scale;
            if fade > 0.0 && due - self.path < zone {
                let share = (self.nearness(index) - (1.0 - fade)) / fade;
                if share > 0.0 {
                    out.push(drawn(Form::Billboard, share.min(1.0)));
                }
            }
        }
    }
}

/// A cut through one tree that follows the camera.
#[derive(Clone, Debug)]
pub struct ActiveCut<V> {
    hierarchy: Hierarchy,
    /// How visible sub-trees are.
    pub visibility: V,
    place: Place,
    clock: Clock,
    nodes: Vec<u32>,
    dues: Vec<f32>,
    spare: (Vec<u32>, Vec<f32>),
}

impl<V: Visibility> ActiveCut<V> {
    /// The coarsest cut. Lists get their full size at once: no frame allocates.
    pub fn new(hierarchy: Hierarchy, place: Place, visibility: V) -> Self {
        let most = hierarchy.nodes().len();
        let mut nodes = Vec::with_capacity(most);
        let mut dues = Vec::with_capacity(most);
        nodes.push(0);
        dues.push(0.0);
        Self {
            hierarchy,
            visibility,
            place,
            clock: Clock::default(),
            nodes,
            dues,
            spare: (Vec::with_capacity(most), Vec::with_capacity(most)),
        }
    }

    /// Follows the camera.
    pub fn update(&mut self, view: &View) -> Changes {
        let epoch = self.visibility.epoch(view.eye);
        let (all, hidden) = self.clock.tick(view, epoch);
        let (all, path) = (all || hidden, self.clock.path);
        let mut looking = Looking::new(
            &self.hierarchy,
            &mut self.visibility,
            &self.place,
            view,
            path,
        );
        if !all && looking.still(&self.nodes, &mut self.dues).is_some() {
            return Changes {
                looked_at: looking.looked_at,
                ..Changes::default()
            };
        }
        let changes = looking.rebuild(
            (&self.nodes, &self.dues),
            all,
            (&mut self.spare.0, &mut self.spare.1),
        );
        std::mem::swap(&mut self.nodes, &mut self.spare.0);
        std::mem::swap(&mut self.dues, &mut self.spare.1);
        changes
    }

    /// Appends what is drawn, seen from where the cut was last updated; see [`Drawn`]. `fade` is the share of its switch distance over which
    /// a node fades in over its children; 0 for none.
    pub fn collect(&mut self, view: &View, fade: f32, out: &mut Vec<Drawn>) {
        let path = self.clock.path;
        let mut looking = Looking::new(
            &self.hierarchy,
            &mut self.visibility,
            &self.place,
            view,
            path,
        );
        looking.collect(0, &self.nodes, &self.dues, fade, out);
    }

    /// The tree.
    pub fn hierarchy(&self) -> &Hierarchy {
        &self.hierarchy
    }
}
