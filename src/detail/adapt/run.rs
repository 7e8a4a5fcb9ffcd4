//! The state of the adaptive loop and its four steps.

use rayon::prelude::*;

use super::represent::{Judgement, Representation, geometry, plane_candidate, represent};
use super::unit::Units;
use super::{AdaptOptions, Group, SIZE_TO_EPSILON};
use crate::botany::Tree;
use crate::cloud::foliage::faces_of;
use crate::cloud::{Face, Foliage, Occlusion};

/// What is known of one unit once it was looked at.
pub struct Judged {
    /// What stands for it.
    pub representation: Representation,
    /// Whether that is within the tolerance.
    pub passes: bool,
}

/// The state of the loop: which units make up the current cut, and what is known of them.
pub struct Run {
    pub units: Units,
    /// Faces of all leaves in the order of [`Units::order`].
    faces: Vec<Face>,
    /// Where each leaf's faces begin; one more than there are leaves.
    starts: Vec<usize>,
    /// Sums of the faces' visibility up to each face; one more than there are faces.
    sigma_sums: Vec<f64>,
    judgement: Judgement,
    pub judged: Vec<Option<Judged>>,
    /// Whether a unit is part of the current cut.
    pub active: Vec<bool>,
}

impl Run {
    pub fn new(tree: &Tree, occlusion: &Occlusion, options: &AdaptOptions) -> Self {
        let units = Units::new(tree);
        let mut starts = vec![0];
        let mut faces = Vec::new();
        for &leaf in &units.order {
            faces.extend(faces_of(tree, &[leaf]));
            starts.push(faces.len());
        }
        let seen = |face: &Face| occlusion.mean_sigma(face.corners);
        let sigmas: Vec<f64> = faces.par_iter().map(seen).collect();
        let mut sigma_sums = vec![0.0];
        sigma_sums.extend(sigmas.iter().scan(0.0, |sum, sigma| {
            *sum += sigma;
            Some(*sum)
        }));
        Self {
            judged: units.units.iter().map(|_| None).collect(),
            active: vec![false; units.units.len()],
            judgement: Judgement {
                epsilon: options.epsilon,
                tolerance: options.tolerance,
                outline: options.outline,
                crosses: options.crosses,
                strip_sections: options.strip_sections,
            },
            units,
            faces,
            starts,
            sigma_sums,
        }
    }

    /// Step 1: the largest units within the guessed size.
    pub fn begin(&mut self, root: u32, options: &AdaptOptions) -> usize {
        let guess = options
            .initial_size
            .unwrap_or(options.epsilon * SIZE_TO_EPSILON);
        let mut stack = vec![root];
        let mut count = 0;
        while let Some(at) = stack.pop() {
            let unit = &self.units.units[at as usize];
            match unit.children {
                Some(children) if f64::from(unit.size()) > guess => stack.extend(children),
                _ => {
                    self.active[at as usize] = true;
                    count += 1;
                }
            }
        }
        count
    }

    /// Step 2: splits what fails until nothing does. Single leaves that fail stay as they are.
    pub fn split_failing(&mut self) -> usize {
        let mut split = 0;
        let mut fresh: Vec<u32> = self.cut().collect();
        while !fresh.is_empty() {
            self.judge(&fresh);
            let mut halves = Vec::new();
            for at in fresh {
                let fails = self.judged[at as usize].as_ref().is_some_and(|j| !j.passes);
                if let Some(children) = self.units.units[at as usize].children
                    && fails
                {
                    self.replace(at, children);
                    halves.extend(children);
                    split += 1;
                }
            }
            fresh = halves;
        }
        split
    }

    /// Step 3: merges halves whose whole passes and costs no more. One pass from the leaves up
    /// finds all, as children come before their parents.
    pub fn merge_passing(&mut self) -> usize {
        let mut merged = 0;
        for at in 0..self.active.len() as u32 {
            let Some(halves) = self.active_halves(&self.active, at) else {
                continue;
            };
            self.judge(&[at]);
            let cost: usize = halves.iter().map(|&h| self.cost(h)).sum();
            let passes = self.judged[at as usize].as_ref().is_some_and(|j| j.passes);
            if passes && self.cost(at) <= cost {
                self.unite(at, halves);
                merged += 1;
            }
        }
        merged
    }

    /// Step 4: the best prefix of the sequence of merges that the limit can pay.
    pub fn merge_to(&mut self, limit: usize) -> usize {
        let above: Vec<u32> = self.above_the_cut();
        self.judge(&above);
        let sequence = self.merge_sequence();
        let within = sequence
            .iter()
            .enumerate()
            .filter(|(_, m)| m.triangles <= limit);
        let best = within
            .min_by(|(i, a), (j, b)| a.error.total_cmp(&b.error).then(i.cmp(j)))
            .map_or(sequence.len(), |(i, _)| i + 1);
        for merge in &sequence[..best] {
            if let Some(halves) = self.units.units[merge.unit as usize].children {
                self.unite(merge.unit, halves);
            }
        }
        if self.triangles() > limit {
            self.flatten_all();
        }
        best
    }

    /// The last resort: one plane for each group that is left.
    fn flatten_all(&mut self) {
        for at in self.cut().collect::<Vec<_>>() {
            let (foliage, sigma) = self.foliage(at);
            let flat = plane_candidate(&foliage, sigma, &self.judgement);
            if let (Some(flat), Some(judged)) = (flat, &mut self.judged[at as usize]) {
                judged.passes = flat.judged_error() <= self.judgement.tolerance;
                judged.representation = flat;
            }
        }
    }

    /// The faces of a unit and their mean visibility.
    fn foliage(&self, at: u32) -> (Foliage<'_>, f64) {
        let unit = &self.units.units[at as usize];
        let span = self.starts[unit.leaves.start]..self.starts[unit.leaves.end];
        let sigma = match span.len() {
            0 => 1.0,
            n => (self.sigma_sums[span.end] - self.sigma_sums[span.start]) / n as f64,
        };
        let foliage = Foliage {
            faces: &self.faces[span],
            connector: unit.connector,
        };
        (foliage, sigma)
    }

    /// Looks at units that were not looked at before, in parallel.
    fn judge(&mut self, units: &[u32]) {
        let new = units
            .iter()
            .filter(|&&at| self.judged[at as usize].is_none());
        let new: Vec<u32> = new.copied().collect();
        let results: Vec<Judged> = new.par_iter().map(|&at| self.judged_unit(at)).collect();
        for (at, result) in new.into_iter().zip(results) {
            self.judged[at as usize] = Some(result);
        }
    }

    fn judged_unit(&self, at: u32) -> Judged {
        let unit = &self.units.units[at as usize];
        let (foliage, sigma) = self.foliage(at);
        let leaves = || Judged {
            representation: geometry(&foliage, sigma),
            passes: true,
        };
        let single = unit.children.is_none();
        if single && foliage.faces.len() <= 2 {
            return leaves();
        }
        match represent(&foliage, sigma, &self.judgement) {
            // A single leaf is kept where billboards fail or cost as much; a group is split.
            Some((r, passes)) if single && (!passes || r.triangles >= foliage.faces.len()) => {
                leaves()
            }
            Some((representation, passes)) => Judged {
                passes: passes && representation.triangles <= foliage.faces.len(),
                representation,
            },
            None => leaves(),
        }
    }

    pub fn groups(&self) -> Vec<Group> {
        let group = |at: u32| {
            let Judged {
                representation: r,
                passes,
            } = self.judged[at as usize].as_ref()?;
            Some(Group {
                subtree: self.units.units[at as usize].subtree,
                leaves: self.units.leaves(at).to_vec(),
                cards: r.cards.clone(),
                generator: r.generator,
                triangles: r.triangles,
                error: r.error(),
                quality: r.quality(),
                sigma: r.sigma,
                passes: *passes,
            })
        };
        self.cut().filter_map(group).collect()
    }

    fn cut(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.active.len() as u32).filter(|&at| self.active[at as usize])
    }

    /// Units that hold more than one unit of the cut.
    fn above_the_cut(&self) -> Vec<u32> {
        let mut above = vec![false; self.active.len()];
        for at in 0..above.len() {
            let covered = self.active[at] || above[at];
            if let Some(parent) = self.units.units[at].parent {
                above[parent as usize] |= covered;
            }
        }
        (0..above.len() as u32)
            .filter(|&at| above[at as usize])
            .collect()
    }

    pub fn active_halves(&self, active: &[bool], at: u32) -> Option<[u32; 2]> {
        let halves = self.units.units[at as usize].children?;
        halves.iter().all(|&h| active[h as usize]).then_some(halves)
    }

    fn replace(&mut self, at: u32, halves: [u32; 2]) {
        self.active[at as usize] = false;
        for half in halves {
            self.active[half as usize] = true;
        }
    }

    fn unite(&mut self, at: u32, halves: [u32; 2]) {
        for half in halves {
            self.active[half as usize] = false;
        }
        self.active[at as usize] = true;
    }

    fn cost(&self, at: u32) -> usize {
        let judged = self.judged[at as usize].as_ref();
        judged.map_or(0, |j| j.representation.triangles)
    }

    pub fn triangles(&self) -> usize {
        self.cut().map(|at| self.cost(at)).sum()
    }

    pub fn error(&self) -> f64 {
        let judged = self
            .cut()
            .filter_map(|at| self.judged[at as usize].as_ref());
        judged.map(|j| j.representation.error()).sum()
    }
}
