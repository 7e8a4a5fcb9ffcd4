//! Every budget's best cut through a hierarchy, by optimal pruning.
//!
//! Costs and errors add up over the hierarchy, so for a multiplier l the cut that minimises
//! `error + l * triangles` is found in one bottom-up pass, and the cuts for growing l are nested
//! into each other (Breiman, Friedman, Olshen and Stone 1984; Chou, Lookabaugh and Gray 1989).
//! A budget is met by bisecting l; cuts lie on the lower convex hull of error against cost.

use serde::{Deserialize, Serialize};

use super::merge::Hierarchy;

/// One way to represent an element other than by a card: for wood, a tube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Triangles that it costs.
    pub triangles: u32,
    /// Error, area times length squared, normalised units.
    pub error: f64,
}

/// What a node of the cut is drawn as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drawn {
    /// One card for all elements under this node.
    Card(u32),
    /// Element `.0` by its own choice `.1`.
    Own(u32, u32),
}

/// A cut: every element is under exactly one of its nodes.
#[derive(Clone, Debug, Default)]
pub struct Cut {
    /// The nodes, in ascending order.
    pub drawn: Vec<Drawn>,
    /// Sum of the triangles.
    pub triangles: u64,
    /// Sum of the errors.
    pub error: f64,
}

/// What a cut costs, and how far off it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Triangles, wood included.
    pub triangles: u64,
    /// Root mean square distance from the original, metres.
    pub error_m: f64,
}

/// What pruning knows of the hierarchy.
pub struct Pruning<'a> {
    /// The groups.
    pub hierarchy: &'a Hierarchy,
    /// For each node the error of one card for all of it.
    pub card_error: &'a [f64],
    /// Triangles of a card.
    pub card_triangles: u32,
    /// For each element its own choices (empty for leaves, which are drawn as cards only).
    pub choices: &'a [Vec<Choice>],
}

impl Pruning<'_> {
    /// The best cut of at most `budget` triangles. Where even the coarsest cut costs more, the
    /// coarsest cut is returned: the caller sees its cost.
    pub fn cut(&self, budget: u64) -> Cut {
        let coarsest = self.at(f64::MAX / 1e30);
        if coarsest.triangles >= budget {
            return coarsest;
        }
        let finest = self.at(0.0);
        if finest.triangles <= budget {
            return finest;
        }
        // Bisect the multiplier by its exponent: errors span many orders of magnitude.
        let (mut low, mut high) = (-200.0f64, 60.0f64);
        let mut best = coarsest;
        for _ in 0..60 {
            let middle = (low + high) / 2.0;
            let cut = self.at(middle.exp2());
            if cut.triangles <= budget {
                (high, best) = (middle, cut);
                if best.triangles == budget {
                    break;
                }
            } else {
                low = middle;
            }
        }
        best
    }

    /// The cut of fewest triangles on the hull whose error is at most `error`; the finest one
    /// where none is that good.
    pub fn cut_within(&self, error: f64) -> Cut {
        let mut best = self.at(0.0);
        let (mut low, mut high) = (-200.0f64, 60.0f64);
        for _ in 0..60 {
            let middle = (low + high) / 2.0;
            let cut = self.at(middle.exp2());
            if cut.error <= error {
                (low, best) = (middle, cut);
            } else {
                high = middle;
            }
        }
        best
    }

    /// The cut that minimises `error + multiplier * triangles`.
    pub fn at(&self, multiplier: f64) -> Cut {
        let n = self.hierarchy.elements;
        let nodes = n + self.hierarchy.merges.len();
        let mut value = vec![0.0f64; nodes];
        // u32::MAX: a card (or, for a merge, "split"); else the element's own choice.
        let mut own = vec![u32::MAX; n];
        let mut split = vec![false; nodes];
        for node in 0..nodes {
            let card = self.card_error[node] + multiplier * f64::from(self.card_triangles);
            value[node] = card;
            if node < n {
                for (index, choice) in self.choices[node].iter().enumerate() {
                    let cost = choice.error + multiplier * f64::from(choice.triangles);
                    if cost < value[node] {
                        (value[node], own[node]) = (cost, index as u32);
                    }
                }
            } else {
                let [a, b] = self.hierarchy.merges[node - n];
                let apart = value[a as usize] + value[b as usize];
                if apart < card {
                    (value[node], split[node]) = (apart, true);
                }
            }
        }
        self.collect(&own, &split)
    }

    fn collect(&self, own: &[u32], split: &[bool]) -> Cut {
        let mut cut = Cut::default();
        let mut stack = self.hierarchy.roots.clone();
        while let Some(node) = stack.pop() {
            if split[node as usize] {
                stack.extend(self.hierarchy.merges[node as usize - self.hierarchy.elements]);
                continue;
            }
            match own.get(node as usize) {
                Some(&choice) if choice != u32::MAX => {
                    let chosen = self.choices[node as usize][choice as usize];
                    cut.triangles += u64::from(chosen.triangles);
                    cut.error += chosen.error;
                    cut.drawn.push(Drawn::Own(node, choice));
                }
                _ => {
                    cut.triangles += u64::from(self.card_triangles);
                    cut.error += self.card_error[node as usize];
                    cut.drawn.push(Drawn::Card(node));
                }
            }
        }
        cut.drawn.sort_unstable_by_key(|d| match *d {
            Drawn::Card(node) => (node, u32::MAX),
            Drawn::Own(node, choice) => (node, choice),
        });
        cut
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four elements; (0,1) and (2,3) merge, then all. Element 3 is wood with a tube of its own.
    fn small() -> (Hierarchy, Vec<f64>, Vec<Vec<Choice>>) {
        let hierarchy = Hierarchy {
            elements: 4,
            merges: vec![[0, 1], [2, 3], [4, 5]],
            error: vec![],
            roots: vec![6],
        };
        let error = vec![0.0, 0.0, 0.0, 9.0, 1.0, 12.0, 40.0];
        let tube = Choice {
            triangles: 6,
            error: 2.0,
        };
        (hierarchy, error, vec![vec![], vec![], vec![], vec![tube]])
    }

    /// By hand: 1 triangle: 40; 2: (0,1)+(2,3) = 13; 3: (0,1)+2+3 = 10; 4: all single = 9;
    /// 8: (0,1)+2+tube = 3; 9: 0+1+2+tube = 2. On the convex hull lie 1, 2, 3, 4?, 9.
    #[test]
    fn cuts_are_the_best_of_their_budget() {
        let (hierarchy, error, choices) = small();
        let pruning = Pruning {
            hierarchy: &hierarchy,
            card_error: &error,
            card_triangles: 1,
            choices: &choices,
        };
        let cost = |budget| {
            let cut = pruning.cut(budget);
            (cut.triangles, cut.error)
        };
        assert_eq!(cost(0), (1, 40.0));
        assert_eq!(cost(1), (1, 40.0));
        assert_eq!(cost(2), (2, 13.0));
        assert_eq!(cost(3), (3, 10.0));
        assert_eq!(cost(9), (9, 2.0));
        assert_eq!(cost(1000), (9, 2.0));
    }

    #[test]
    fn cuts_of_growing_multipliers_are_nested() {
        let (hierarchy, error, choices) = small();
        let pruning = Pruning {
            hierarchy: &hierarchy,
            card_error: &error,
            card_triangles: 1,
            choices: &choices,
        };
        let mut last = u64::MAX;
        for exponent in -10..10 {
            let triangles = pruning.at(f64::from(exponent).exp2()).triangles;
            assert!(triangles <= last);
            last = triangles;
        }
        assert_eq!(last, 1);
    }
}
