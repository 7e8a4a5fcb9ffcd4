//! One tree looked at in one frame: which nodes of its cut are open, until when, and what is drawn.

use glam::Vec3;

use super::drawn::{Drawn, Form};
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
/// In a list of nodes: the node carries nothing but its own geometry.
const TIP: u32 = 1 << 30;
/// The node's index.
const INDEX: u32 = TIP - 1;

/// The nodes on the way from the root to the cut, in the order of the hierarchy.
#[derive(Clone, Debug, Default)]
pub(super) struct List {
    /// Index of the node, [`OPEN`] and [`TIP`].
    pub nodes: Vec<u32>,
    /// Length of the eye's path at which the node has to be looked at again.
    pub dues: Vec<f32>,
    /// Length of the eye's path at which it may begin to fade in over its children; infinite where it
    /// has none.
    pub fades: Vec<f32>,
}

impl List {
    pub fn with_capacity(most: usize) -> Self {
        Self {
            nodes: Vec::with_capacity(most),
            dues: Vec::with_capacity(most),
            fades: Vec::with_capacity(most),
        }
    }

    fn clear(&mut self) {
        self.nodes.clear();
        self.dues.clear();
        self.fades.clear();
    }

    fn copy(&mut self, nodes: &[u32], dues: &[f32], fades: &[f32]) {
        self.nodes.extend_from_slice(nodes);
        self.dues.extend_from_slice(dues);
        self.fades.extend_from_slice(fades);
    }

    #[inline]
    fn push(&mut self, node: u32, seen: Seen) {
        self.nodes.push(node | seen.state);
        self.dues.push(seen.due);
        self.fades.push(seen.fades);
    }
}

/// Paths at which a list has to be looked at again.
#[derive(Clone, Copy, Debug)]
pub(super) struct First {
    /// The first node is due.
    pub due: f32,
    /// The first node may begin to fade in.
    pub fades: f32,
}

impl First {
    /// Of a whole list.
    pub fn of(dues: &[f32], fades: &[f32]) -> Self {
        Self {
            due: least(dues),
            fades: least(fades),
        }
    }
}

/// The least of many numbers, none of which is no number; in lanes, as processors like it.
#[inline]
pub(super) fn least(numbers: &[f32]) -> f32 {
    const LANES: usize = 8;
    let smaller = |a: f32, b: f32| if b < a { b } else { a };
    if numbers.len() < LANES {
        return numbers.iter().fold(f32::INFINITY, |a, &b| smaller(a, b));
    }
    let chunks = numbers.chunks_exact(LANES);
    let rest = chunks.remainder();
    let mut lanes = [f32::INFINITY; LANES];
    for chunk in chunks {
        for (lane, &number) in lanes.iter_mut().zip(chunk) {
            *lane = smaller(*lane, number);
        }
    }
    let all = lanes.iter().chain(rest);
    all.fold(f32::INFINITY, |a, &b| smaller(a, b))
}

/// The least of what is due and not veiled (infinite); likewise.
#[inline]
pub(super) fn least_unveiled(dues: &[f32], veils: &[f32]) -> f32 {
    const LANES: usize = 8;
    let later = |due: f32, veil: f32| if due > veil { due } else { veil };
    let mut lanes = [f32::INFINITY; LANES];
    for (dues, veils) in dues.chunks(LANES).zip(veils.chunks(LANES)) {
        for ((lane, &due), &veil) in lanes.iter_mut().zip(dues).zip(veils) {
            let due = later(due, veil);
            *lane = if due < *lane { due } else { *lane };
        }
    }
    lanes.iter().fold(f32::INFINITY, |a, &b| a.min(b))
}

/// What a look at a node found.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// [`OPEN`] and [`TIP`], as they apply.
    state: u32,
    due: f32,
    fades: f32,
}

/// One tree, seen in one frame.
pub(super) struct Looking<'a, V> {
    hierarchy: &'a Hierarchy,
    visibility: &'a mut V,
    place: &'a Place,
    /// The eye in the tree's own space.
    eye: Vec3,
    /// `None`: nothing is seen.
    zoom: Option<f32>,
    path: f32,
    /// Share of its switch distance over which a node fades in over its children.
    fade: f32,
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
        (path, fade): (f32, f32),
    ) -> Self {
        Self {
            hierarchy,
            visibility,
            eye: place.to_local(view.eye),
            place,
            zoom: view.sees().then_some(view.zoom),
            path,
            fade,
            looked_at: 0,
            asked: false,
        }
    }

    /// Whether a node is open, and the length of the path until which that is sure.
    #[inline]
    fn look(&mut self, node: u32) -> Seen {
        self.looked_at += 1;
        let at = &self.hierarchy.nodes()[node as usize];
        let tip = if at.end == node + 1 { TIP } else { 0 };
        let Some(zoom) = self.zoom else {
            return Seen {
                state: tip,
                due: f32::INFINITY,
                fades: f32::INFINITY,
            };
        };
        let sight = self.visibility.sight(at, node, self.eye, self.place);
        let mut switch = sight.visibility * at.switch_distance * zoom;
        if sight.distance < switch {
            self.asked = true;
            switch *= 1.0 - self.visibility.occlusion(at, self.place);
        }
        // Rounding: what is as near as this to its switch is looked at in every frame.
        let unsure = 1e-5 * (sight.distance + switch) + 1e-6 * self.path;
        let free = ((sight.distance - switch).abs() - unsure) / sight.rate * self.place.scale;
        let due = self.path + free.max(0.0);
        if sight.distance >= switch {
            return Seen {
                state: tip,
                due,
                fades: f32::INFINITY,
            };
        }
        // What can't close before the eye has come this far has not begun to fade.
        let zone = self.fade * at.switch_distance * zoom * self.place.scale;
        Seen {
            state: tip | OPEN,
            due,
            fades: if self.fade > 0.0 {
                due - zone
            } else {
                f32::INFINITY
            },
        }
    }

    /// How far a node is on its way to be drawn as a whole: 1 at its switch distance.
    #[inline]
    fn nearness(&mut self, node: u32) -> f32 {
        let at = &self.hierarchy.nodes()[node as usize];
        let sight = self.visibility.sight(at, node, self.eye, self.place);
        let seen = sight.visibility * (1.0 - self.visibility.occlusion(at, self.place));
        sight.distance / (seen * at.switch_distance * self.zoom.unwrap_or(0.0))
    }

    /// Looks at a whole tree; the path at which it is due again if one billboard stands for it.
    #[inline]
    pub fn closed(&mut self) -> Option<f32> {
        let seen = self.look(0);
        (seen.state & OPEN == 0).then_some(seen.due)
    }

    /// Looks again at the nodes of a list that are due; whether all are as they were.
    #[inline]
    pub fn still(&mut self, nodes: &[u32], dues: &mut [f32], fades: &mut [f32]) -> bool {
        const TOGETHER: usize = 16;
        for start in (0..nodes.len()).step_by(TOGETHER) {
            let end = (start + TOGETHER).min(nodes.len());
            if least(&dues[start..end]) > self.path {
                continue;
            }
            for i in start..end {
                if dues[i] <= self.path {
                    let seen = self.look(nodes[i] & INDEX);
                    if (seen.state ^ nodes[i]) & OPEN != 0 {
                        return false;
                    }
                    (dues[i], fades[i]) = (seen.due, seen.fades);
                }
            }
        }
        true
    }

    /// Writes a list anew: what is due (or `all`) is looked at, the rest is copied.
    pub fn rebuild(
        &mut self,
        (nodes, dues, fades): (&[u32], &[f32], &[f32]),
        all: bool,
        new: &mut List,
    ) -> Changes {
        new.clear();
        let mut changes = Changes::default();
        let before = self.looked_at;
        let mut i = 0;
        while i < nodes.len() {
            if !all {
                let due = dues[i..].iter().position(|due| *due <= self.path);
                let end = due.map_or(nodes.len(), |due| i + due);
                new.copy(&nodes[i..end], &dues[i..end], &fades[i..end]);
                i = end;
                if i == nodes.len() {
                    break;
                }
            }
            let (node, was_open) = (nodes[i] & INDEX, nodes[i] & OPEN != 0);
            let seen = self.look(node);
            let open = seen.state & OPEN != 0;
            new.push(node, seen);
            i += 1;
            if open && !was_open {
                changes.splits += 1;
                let end = self.hierarchy.nodes()[node as usize].end;
                self.fill(node + 1, end, new, &mut changes.splits);
            } else if was_open && !open {
                changes.merges += 1;
                let end = self.hierarchy.nodes()[node as usize].end;
                while i < nodes.len() && (nodes[i] & INDEX) < end {
                    changes.merges += u32::from(nodes[i] & OPEN != 0);
                    i += 1;
                }
            }
        }
        changes.looked_at = self.looked_at - before;
        changes
    }

    /// Writes the nodes from `node` to `end` that are seen from the root.
    fn fill(&mut self, mut node: u32, end: u32, new: &mut List, splits: &mut u32) {
        while node < end {
            let seen = self.look(node);
            new.push(node, seen);
            if seen.state & OPEN != 0 {
                *splits += 1;
                node += 1;
            } else {
                node = self.hierarchy.nodes()[node as usize].end;
            }
        }
    }

    /// Writes what is drawn of a list in which nodes fade: first what is drawn in full.
    pub fn collect(&mut self, tree: u32, nodes: &[u32], fades: &[f32], out: &mut Vec<Drawn>) {
        collect_still(tree, nodes, out);
        for (&node, &fades) in nodes.iter().zip(fades) {
            if fades < self.path {
                let share = (self.nearness(node & INDEX) - (1.0 - self.fade)) / self.fade;
                if share > 0.0 {
                    out.push(Drawn {
                        tree,
                        node: node & INDEX,
                        form: Form::Billboard,
                        fade: share.min(1.0),
                    });
                }
            }
        }
    }
}

/// Whether an entry of a list is closed.
#[inline]
pub(super) fn is_closed(entry: u32) -> bool {
    entry & OPEN == 0
}

#[inline]
fn form(entry: u32) -> Form {
    if is_closed(entry) {
        Form::Billboard
    } else {
        Form::Geometry
    }
}

/// Writes what is drawn in full of a list: billboards for what is closed, geometry for open tips.
#[inline]
pub(super) fn collect_still(tree: u32, nodes: &[u32], out: &mut Vec<Drawn>) {
    // Written first and counted after: whether an entry is drawn can't be foretold.
    let start = out.len();
    let nothing = Drawn {
        tree,
        node: 0,
        form: Form::Billboard,
        fade: 1.0,
    };
    out.resize(start + nodes.len(), nothing);
    let (mut count, room) = (0, &mut out[start..]);
    for &entry in nodes {
        room[count] = Drawn {
            node: entry & INDEX,
            form: form(entry),
            ..nothing
        };
        count += usize::from(entry & (OPEN | TIP) != OPEN);
    }
    out.truncate(start + count);
}
