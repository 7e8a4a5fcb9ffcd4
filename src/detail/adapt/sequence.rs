//! The sequence of merges from a cut to the whole tree, cheapest first.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::run::Run;

impl Run {
    /// All merges from the current cut to the whole tree, the least error for the triangles saved
    /// first.
    pub fn merge_sequence(&self) -> Vec<Merge> {
        let mut active = self.active.clone();
        let mut heap: BinaryHeap<Offer> = (0..active.len() as u32)
            .filter_map(|at| self.offer(at, self.active_halves(&active, at)?))
            .collect();
        let (mut triangles, mut error) = (self.triangles() as i64, self.error());
        let mut sequence = Vec::new();
        while let Some(offer) = heap.pop() {
            let Some(halves) = self.units.units[offer.unit as usize].children else {
                continue;
            };
            active[offer.unit as usize] = true;
            for half in halves {
                active[half as usize] = false;
            }
            triangles -= offer.saved;
            error += offer.lost;
            sequence.push(Merge {
                unit: offer.unit,
                triangles: triangles.max(0) as usize,
                error,
            });
            let parent = self.units.units[offer.unit as usize].parent;
            let next = parent.and_then(|p| self.offer(p, self.active_halves(&active, p)?));
            heap.extend(next);
        }
        sequence
    }

    /// What merging two halves saves and loses.
    fn offer(&self, unit: u32, halves: [u32; 2]) -> Option<Offer> {
        let whole = &self.judged[unit as usize].as_ref()?.representation;
        let [mut saved, mut lost, mut apart] = [0.0; 3];
        for half in halves {
            let half = &self.judged[half as usize].as_ref()?.representation;
            saved += half.triangles as f64;
            lost -= half.error();
            apart -= half.spread();
        }
        saved -= whole.triangles as f64;
        lost += whole.error();
        apart += whole.spread();
        // A merge that saves nothing may still open the way to one that does: last in line.
        let per = saved.max(1e-3);
        Some(Offer {
            unit,
            saved: saved as i64,
            lost,
            price: (lost / per, apart / per),
        })
    }
}

/// One step of the sequence, with what the cut costs and misses after it.
pub struct Merge {
    /// The unit whose halves are merged.
    pub unit: u32,
    /// Triangles of the cut after it.
    pub triangles: usize,
    /// Error of the cut after it.
    pub error: f64,
}

/// A merge that is possible now; the greatest is the cheapest.
struct Offer {
    unit: u32,
    saved: i64,
    lost: f64,
    /// Error, and then spread, for a triangle saved.
    price: (f64, f64),
}

impl Ord for Offer {
    fn cmp(&self, other: &Self) -> Ordering {
        let price = other.price.0.total_cmp(&self.price.0);
        price
            .then(other.price.1.total_cmp(&self.price.1))
            .then(other.unit.cmp(&self.unit))
    }
}

impl PartialOrd for Offer {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Offer {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Offer {}
