//! A cut that follows the camera (El-Sana and others 2001, section 5: the list of active nodes).
//!
//! Every node on the way from the root to the cut is kept with the length of the eye's path at
//! which it has to be looked at again: its distance can't change faster than the eye moves. Most
//! nodes are far from the distance at which they switch and stay untouched for many frames; the
//! cut is nevertheless the same, at every frame, as one made anew.

use super::drawn::Drawn;
use super::hierarchy::Hierarchy;
use super::looking::{Changes, List, Looking};
use super::place::{Place, View};
use super::visibility::Visibility;

/// How far the eye has come.
#[derive(Clone, Debug, Default)]
pub(super) struct Clock {
    last: Option<(View, f32)>,
    epoch: u64,
    /// Length of the eye's path since everything was looked at.
    pub path: f32,
}

/// A path so long that its length has lost its millimetres: everything is looked at again.
const LONG_PATH: f32 = 4096.0;

impl Clock {
    /// The view that it moved to last.
    pub fn view(&self) -> Option<View> {
        self.last.map(|(view, _)| view)
    }

    /// Moves on to a view; whether everything has to be looked at, and whether what was asked for its
    /// occlusion has.
    pub fn tick(&mut self, view: &View, fade: f32, epoch: u64) -> (bool, bool) {
        let step = match self.last {
            Some((last, faded))
                if last.sees() == view.sees() && last.zoom == view.zoom && faded == fade =>
            {
                last.eye.distance(view.eye)
            }
            _ => f32::INFINITY,
        };
        let path = self.path + step * 1.000_001;
        let all = (view.sees() && path.is_nan()) || path > LONG_PATH;
        let hidden = epoch != self.epoch;
        (self.last, self.epoch) = (Some((*view, fade)), epoch);
        self.path = if all { 0.0 } else { path };
        (all, hidden)
    }
}

/// A cut through one tree that follows the camera.
#[derive(Clone, Debug)]
pub struct ActiveCut<V> {
    hierarchy: Hierarchy,
    /// How visible sub-trees are.
    pub visibility: V,
    /// Share of its switch distance over which a node fades in over its children; 0 for none.
    pub fade: f32,
    place: Place,
    clock: Clock,
    list: List,
    spare: List,
}

impl<V: Visibility> ActiveCut<V> {
    /// The coarsest cut. Lists get their full size at once: no frame allocates.
    pub fn new(hierarchy: Hierarchy, place: Place, visibility: V) -> Self {
        let most = hierarchy.nodes().len();
        let mut list = List::with_capacity(most);
        list.nodes.push(0);
        list.dues.push(0.0);
        list.fades.push(0.0);
        Self {
            hierarchy,
            visibility,
            fade: 0.1,
            place,
            clock: Clock::default(),
            list,
            spare: List::with_capacity(most),
        }
    }

    /// Follows the camera.
    pub fn update(&mut self, view: &View) -> Changes {
        let epoch = self.visibility.epoch(view.eye);
        let (all, hidden) = self.clock.tick(view, self.fade, epoch);
        let all = all || hidden;
        let mut looking = Looking::new(
            &self.hierarchy,
            &mut self.visibility,
            &self.place,
            view,
            (self.clock.path, self.fade),
        );
        let List { nodes, dues, fades } = &mut self.list;
        if !all && looking.still(nodes, dues, fades) {
            return Changes {
                looked_at: looking.looked_at,
                ..Changes::default()
            };
        }
        let changes = looking.rebuild((nodes, dues, fades), all, &mut self.spare);
        std::mem::swap(&mut self.list, &mut self.spare);
        changes
    }

    /// Appends what is drawn, seen from where the cut was last updated; see [`Drawn`].
    pub fn collect(&mut self, view: &View, out: &mut Vec<Drawn>) {
        let updated = self.clock.view().unwrap_or(*view);
        let mut looking = Looking::new(
            &self.hierarchy,
            &mut self.visibility,
            &self.place,
            &updated,
            (self.clock.path, self.fade),
        );
        looking.collect(0, &self.list.nodes, &self.list.fades, out);
    }

    /// The tree.
    pub fn hierarchy(&self) -> &Hierarchy {
        &self.hierarchy
    }
}
