//! Which cards get tiles of their own first.

use std::collections::HashMap;

use super::cards::{Cards, Of, all_of};

/// Tiles that stand for all cards of a family, at most.
const REPRESENTATIVES: usize = 16;

/// Cards of a family for each of them.
const FOR_EACH: usize = 4;

/// Cards in the order in which they get tiles of their own: first some of each family of lone leaves, as all others of
/// the family are shown by these; then cards without a family, and last the others of families, each the largest first.
#[derive(Clone, Debug)]
pub struct Ranking {
    /// Cards by their number in the order of [`all_of`].
    pub order: Vec<u32>,
    /// So many stand for a family.
    pub standing: usize,
    /// So many are first in the order: all that no other card is known to show.
    pub first: usize,
    /// Area of each card in the order, texels.
    pub areas: Vec<f64>,
}

impl Ranking {
    pub fn new(trees: &[Cards]) -> Self {
        let all = all_of(trees);
        let area = |of: Of| {
            let density = f64::from(trees[of.tree as usize].density);
            f64::from(of.group(trees).card.area()) * density * density
        };
        let mut sized: Vec<(u32, f64)> = (0..).zip(all.iter().map(|&of| area(of))).collect();
        sized.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let mut members: HashMap<(u32, u32), usize> = HashMap::new();
        for (family, _) in all.iter().filter_map(|of| of.lone(trees)) {
            *members.entry(family).or_default() += 1;
        }
        let mut taken: HashMap<(u32, u32), usize> = HashMap::new();
        let mut parts: [Vec<(u32, f64)>; 3] = Default::default();
        for (card, area) in sized {
            let part = match all[card as usize].lone(trees) {
                None => 1,
                Some((family, _)) => {
                    let taken = taken.entry(family).or_default();
                    *taken += 1;
                    let most = members[&family] / FOR_EACH;
                    let stands = *taken <= most.clamp(1, REPRESENTATIVES);
                    if stands { 0 } else { 2 }
                }
            };
            parts[part].push((card, area));
        }
        let (standing, plain) = (parts[0].len(), parts[1].len());
        let (order, areas) = parts.into_iter().flatten().unzip();
        Self {
            order,
            standing,
            first: standing + plain,
            areas,
        }
    }
}
