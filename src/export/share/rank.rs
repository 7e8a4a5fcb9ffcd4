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

#[cfg(test)]
pub(super) mod tests {
    use super::super::fitted::Fitted;
    use super::super::lone::Lone;
    use super::*;
    use glam::{DQuat, DVec3, Vec2, Vec3};

    use crate::botany::model::Model;
    use crate::cloud::card::Card;
    use crate::export::foliage::{CardGroup, Foliage};
    use crate::space::align::Similarity;

    /// A square card.
    pub fn group(side: f32) -> CardGroup {
        let outline = [Vec2::ZERO, Vec2::X * side, Vec2::ONE * side, Vec2::Y * side];
        CardGroup {
            card: Card {
                origin: Vec3::ZERO,
                u: Vec3::X,
                v: Vec3::Y,
                outline: outline.to_vec(),
            },
            triangles: Vec::new(),
        }
    }

    /// Cards of two texels a unit, without gutters.
    pub fn cards<'a>(
        model: &'a Model,
        foliage: &'a Foliage,
        groups: &'a [CardGroup],
        lone: &'a [Option<Lone>],
    ) -> Cards<'a> {
        Cards {
            model,
            groups,
            density: 2.0,
            samples: 1,
            pad: 0.0,
            lone,
            kin: &[],
            fitted: Fitted {
                foliage,
                opacity: &[],
            },
        }
    }

    #[test]
    fn what_stands_for_others_comes_first_and_what_others_stand_for_last() {
        // Eight leaves of a family, the largest in the middle, and two cards of their own.
        let sides = [1.0, 2.0, 3.0, 4.0, 5.0, 4.5, 3.5, 2.5, 10.0, 0.5];
        let groups: Vec<CardGroup> = sides.into_iter().map(group).collect();
        let leaf = Lone {
            family: 0,
            placement: Similarity {
                scale: 1.0,
                rotation: DQuat::IDENTITY,
                translation: DVec3::ZERO,
            },
        };
        let lone: Vec<Option<Lone>> = (0..10).map(|i| (i < 8).then_some(leaf)).collect();
        let (model, foliage) = (Model::default(), Foliage::default());
        let ranking = Ranking::new(&[cards(&model, &foliage, &groups, &lone)]);
        // One in four stands for the family.
        assert_eq!((ranking.standing, ranking.first), (2, 4));
        assert_eq!(ranking.order, [4, 5, 8, 9, 3, 6, 2, 7, 1, 0]);
        assert_eq!(ranking.areas[0], 100.0);
    }
}
