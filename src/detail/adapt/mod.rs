//! Kratt's adaptive loop: keep, merge or split groups of leaves until every one passes, or the
//! triangle limit binds (Kratt et al. 2014, section 3).
//!
//! 1. Begin with the largest groups that fit a guessed box size, from the tips to the trunk.
//! 2. Make billboards for each and judge them. A group that fails is split.
//! 3. Where both halves of a group are kept and the whole passes for no more triangles, merge.
//! 4. Over the triangle limit, merge on, least error for the triangles saved first.
//!
//! Splits only go down, merges only go up, and a group that passed is never split: so the loop
//! ends. All merges of step 4 are one fixed sequence, of which a limit takes the best prefix that
//! it can pay: so a higher limit never gives a larger error.

use serde::{Deserialize, Serialize};

pub mod represent;
mod run;
mod sequence;
pub mod unit;

use crate::botany::Tree;
use crate::cloud::{Card, Occlusion, Outline};
pub use represent::Generator;
use run::Run;

/// The initial guess: a group within this many `epsilon` is likely to pass.
const SIZE_TO_EPSILON: f64 = 8.0;

/// How the loop runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AdaptOptions {
    /// Distance from its billboard within which a vertex is valid, normalised units; see
    /// [`crate::cloud::coverage::epsilon`] for the one that belongs to a viewing distance.
    pub epsilon: f64,
    /// Largest share of a group's area, weighted by its visibility, that may be missing.
    pub tolerance: f64,
    /// Upper limit of triangles for the foliage, or none. One plane for all leaves is given
    /// where even that exceeds the limit.
    pub triangles: Option<usize>,
    /// Guessed diagonal of a group that just passes, normalised units; 8 `epsilon` where absent.
    /// It changes how long the loop takes and hardly what comes out.
    pub initial_size: Option<f64>,
    /// Outline of planes and crosses.
    pub outline: Outline,
    /// Whether crosses are tried where a plane fails.
    pub crosses: bool,
    /// Sections that a strip begins with; under 2: no strip is tried.
    pub strip_sections: usize,
}

impl Default for AdaptOptions {
    fn default() -> Self {
        Self {
            epsilon: 0.01,
            tolerance: 0.2,
            triangles: None,
            initial_size: None,
            outline: Outline::Quad,
            crosses: true,
            strip_sections: 6,
        }
    }
}

/// A group of leaves and what stands for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// The sub-tree that holds all its leaves.
    pub subtree: u32,
    /// Its leaves.
    pub leaves: Vec<u32>,
    /// Its billboards; none where the leaves stay as they are.
    pub cards: Vec<Card>,
    /// Who made them.
    pub generator: Generator,
    /// Triangles that it costs.
    pub triangles: usize,
    /// `sigma * (A - C)`, normalised units squared.
    pub error: f64,
    /// `sigma * C`, as the paper prints it.
    pub quality: f64,
    /// Mean visibility of its points, 0 hidden to 1.
    pub sigma: f64,
    /// Whether the error is within the tolerance.
    pub passes: bool,
}

/// What the loop came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Adapted {
    /// The groups; every leaf is in exactly one.
    pub groups: Vec<Group>,
    /// Groups in the initial guess.
    pub initial: usize,
    /// Groups that were split because they failed.
    pub split: usize,
    /// Merges because the whole passed as well.
    pub merged: usize,
    /// Merges because of the triangle limit.
    pub limited: usize,
}

impl Adapted {
    /// Triangles of all groups.
    pub fn triangles(&self) -> usize {
        self.groups.iter().map(|g| g.triangles).sum()
    }

    /// Sum of the groups' errors.
    pub fn error(&self) -> f64 {
        self.groups.iter().map(|g| g.error).sum()
    }
}

/// Runs the loop on all foliage of a tree.
pub fn adapt(tree: &Tree, occlusion: &Occlusion, options: &AdaptOptions) -> Adapted {
    let mut run = Run::new(tree, occlusion, options);
    let mut out = Adapted::default();
    let Some(root) = run.units.root() else {
        return out;
    };
    out.initial = run.begin(root, options);
    out.split = run.split_failing();
    out.merged = run.merge_passing();
    if let Some(limit) = options.triangles
        && run.triangles() > limit
    {
        out.limited = run.merge_to(limit);
    }
    out.groups = run.groups();
    out
}

#[cfg(test)]
mod tests {
    use super::unit::tests::sample_tree;
    use super::*;

    fn occlusion(tree: &Tree) -> Occlusion {
        let centers: Vec<_> = tree.leaves.iter().map(|l| l.center).collect();
        Occlusion::of_leaves(&centers, tree.model.height())
    }

    fn run(tree: &Tree, epsilon: f64, triangles: Option<usize>) -> Adapted {
        let options = AdaptOptions {
            epsilon,
            triangles,
            ..AdaptOptions::default()
        };
        adapt(tree, &occlusion(tree), &options)
    }

    fn every_leaf_once(adapted: &Adapted, count: usize) {
        let mut all: Vec<u32> = adapted
            .groups
            .iter()
            .flat_map(|g| g.leaves.clone())
            .collect();
        all.sort_unstable();
        assert_eq!(all, (0..count as u32).collect::<Vec<_>>());
    }

    #[test]
    fn every_leaf_is_in_one_group_at_every_distance_and_limit() {
        let tree = sample_tree(9, 13);
        for epsilon in [0.0, 1e-4, 0.01, 0.05, 0.3, 10.0] {
            for limit in [None, Some(100), Some(10), Some(0)] {
                let adapted = run(&tree, epsilon, limit);
                every_leaf_once(&adapted, 117);
                for group in &adapted.groups {
                    assert!(group.cards.iter().all(Card::is_sound));
                    assert_eq!(
                        group.cards.is_empty(),
                        group.generator == Generator::Geometry
                    );
                }
            }
        }
    }

    #[test]
    fn without_a_limit_every_group_passes() {
        let tree = sample_tree(9, 13);
        for epsilon in [1e-4, 0.01, 0.05, 0.3] {
            let adapted = run(&tree, epsilon, None);
            assert!(adapted.groups.iter().all(|g| g.passes), "{epsilon}");
        }
    }

    #[test]
    fn farther_away_fewer_groups_suffice() {
        let tree = sample_tree(9, 13);
        let counts = [1e-4, 0.02, 0.1, 3.0].map(|e| run(&tree, e, None).groups.len());
        assert!(counts.windows(2).all(|w| w[1] <= w[0]), "{counts:?}");
        // Near, nearly single leaves (hidden ones may share); at the horizon one group.
        assert!(counts[0] > 90 && counts[3] == 1, "{counts:?}");
    }

    #[test]
    fn a_higher_limit_never_gives_a_larger_error() {
        let tree = sample_tree(9, 13);
        for epsilon in [1e-3, 0.03] {
            let mut before = f64::MAX;
            for limit in [2, 3, 5, 8, 13, 21, 34, 55, 89, 144, 233, 400] {
                let adapted = run(&tree, epsilon, Some(limit));
                assert!(
                    adapted.triangles() <= limit,
                    "{} over {limit}",
                    adapted.triangles()
                );
                let error = adapted.error();
                assert!(
                    error <= before * (1.0 + 1e-9),
                    "{limit}: {error} after {before}"
                );
                before = error;
            }
        }
    }

    #[test]
    fn the_initial_guess_hardly_matters() {
        let tree = sample_tree(6, 10);
        let with = |initial_size| {
            let options = AdaptOptions {
                epsilon: 0.02,
                initial_size,
                ..AdaptOptions::default()
            };
            adapt(&tree, &occlusion(&tree), &options)
        };
        let [fine, guess, whole] = [Some(0.0), None, Some(99.0)].map(with);
        assert_eq!((fine.initial, whole.initial), (60, 1));
        let near = |a: &Adapted| (a.triangles() as f64 / guess.triangles() as f64 - 1.0).abs();
        assert!(near(&fine) < 0.2 && near(&whole) < 0.2);
    }

    #[test]
    fn the_same_input_gives_the_same_groups() {
        let tree = sample_tree(6, 10);
        assert_eq!(run(&tree, 0.02, Some(40)), run(&tree, 0.02, Some(40)));
    }

    #[test]
    fn a_tree_without_leaves_has_no_groups() {
        assert_eq!(run(&Tree::default(), 0.1, Some(5)), Adapted::default());
    }
}
