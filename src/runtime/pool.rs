//! Many short lists that grow and shrink, in a few long ones.

use super::looking::List;

/// Room for the nodes of every tree's cut. The first entry of tree `t` alone has a place of its own at `t`;
/// longer lists live behind, in slots of a power of two, which are used again.
#[derive(Clone, Debug, Default)]
pub(super) struct Pool {
    pub nodes: Vec<u32>,
    pub dues: Vec<f32>,
    pub fades: Vec<f32>,
    /// Free slots by the logarithm of their room.
    free: [Vec<u32>; 32],
}

/// Where a list is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slot {
    pub start: u32,
    pub len: u32,
    /// Logarithm of the room.
    class: u8,
}

/// Slots of as many nodes as two to this are rare.
const LARGEST: usize = 13;

impl Pool {
    /// A root for each tree.
    pub fn new(trees: usize) -> (Self, Vec<Slot>) {
        let pool = Self {
            nodes: vec![0; trees],
            dues: vec![0.0; trees],
            fades: vec![0.0; trees],
            // Lists of free slots never grow beyond this either.
            free: std::array::from_fn(|class| match class {
                1..LARGEST => Vec::with_capacity(trees),
                _ => Vec::new(),
            }),
        };
        let slot = |start| Slot {
            start,
            len: 1,
            class: 0,
        };
        (pool, (0..trees as u32).map(slot).collect())
    }

    #[inline]
    pub fn range(slot: Slot) -> std::ops::Range<usize> {
        slot.start as usize..(slot.start + slot.len) as usize
    }

    /// Nodes, dues and fades of a list.
    #[inline]
    pub fn list(&mut self, range: std::ops::Range<usize>) -> (&[u32], &mut [f32], &mut [f32]) {
        (
            &self.nodes[range.clone()],
            &mut self.dues[range.clone()],
            &mut self.fades[range],
        )
    }

    /// Replaces a tree's list.
    pub fn replace(&mut self, tree: u32, slot: Slot, new: &List) -> Slot {
        let class = new.nodes.len().next_power_of_two().trailing_zeros() as u8;
        // A little shrinking keeps the room: the list may grow again.
        let fits = class == slot.class || (class > 0 && class + 1 == slot.class);
        let mut slot = slot;
        if !fits {
            if slot.class > 0 {
                self.free[slot.class as usize].push(slot.start);
            }
            slot = self.room(tree, class);
        }
        slot.len = new.nodes.len() as u32;
        let range = Self::range(slot);
        self.nodes[range.clone()].copy_from_slice(&new.nodes);
        self.dues[range.clone()].copy_from_slice(&new.dues);
        self.fades[range].copy_from_slice(&new.fades);
        slot
    }

    /// An empty slot; a larger one where none of the size is free, a new one where there is none at all.
    fn room(&mut self, tree: u32, class: u8) -> Slot {
        let slot = |start, class| Slot {
            start,
            len: 0,
            class,
        };
        if class == 0 {
            return slot(tree, 0);
        }
        for larger in class..32 {
            if let Some(start) = self.free[larger as usize].pop() {
                return slot(start, larger);
            }
        }
        let start = self.nodes.len();
        self.nodes.resize(start + (1 << class), 0);
        self.dues.resize(start + (1 << class), 0.0);
        self.fades.resize(start + (1 << class), 0.0);
        slot(start as u32, class)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_keep_apart_and_rooms_are_used_again() {
        let (mut pool, mut slots) = Pool::new(3);
        let list = |n: u32| (0..n).collect::<Vec<_>>();
        for (tree, n) in [(0u32, 5u32), (1, 6), (0, 1), (2, 7), (1, 3), (0, 9)] {
            let new = List {
                nodes: list(n),
                dues: vec![tree as f32; n as usize],
                fades: vec![tree as f32; n as usize],
            };
            slots[tree as usize] = pool.replace(tree, slots[tree as usize], &new);
            for (other, &own) in slots.iter().enumerate() {
                let range = Pool::range(own);
                assert_eq!(pool.nodes[range.clone()], list(own.len));
                if own.len > 1 {
                    assert!(pool.dues[range].iter().all(|d| *d == other as f32));
                }
            }
        }
        // Three singles, two slots of eight (tree 2 took the one that tree 0 gave back), one of 16.
        assert_eq!(pool.nodes.len(), 3 + 8 + 8 + 16);
    }
}
