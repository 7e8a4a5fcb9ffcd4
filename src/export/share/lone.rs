//! Cards that show one leaf each: how congruent leaves lie says where the picture of one card is on
//! another's tile, turned, seen from behind and scaled, without a search.

use std::collections::HashMap;

use glam::Vec3;

use crate::botany::prototype::{Alike, prototypes};
use crate::botany::tree::Tree;
use crate::export::foliage::CardGroup;
use crate::space::align::Similarity;

/// The only leaf of a card, among those that are congruent with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lone {
    /// Leaves of one family are copies of one prototype.
    pub family: u32,
    /// From the prototype's space into the tree's.
    pub placement: Similarity,
}

/// Cards that have to show leaves of a family before any is shown by another's texels.
const LEAST_MEMBERS: usize = 8;

/// Corners may be off by this share of a leaf's radius, and normals lean as they like: a leaf has few texels, and maps
/// of normals are fitted for all that show them.
const ALIKE: Alike = Alike {
    tolerance: 0.02,
    normals_deg: 180.0,
    copies: LEAST_MEMBERS,
};

/// For each card its only leaf, where it has but one and enough others have one like it.
pub fn lone(tree: &Tree, groups: &[CardGroup]) -> Vec<Option<Lone>> {
    let mut leaf_of: HashMap<u32, u32> = HashMap::new();
    for (leaf, own) in (0..).zip(&tree.leaves) {
        leaf_of.extend(own.triangles.iter().map(|&t| (t, leaf)));
    }
    let only = |group: &CardGroup| {
        let leaf = leaf_of.get(group.triangles.first()?)?;
        let all = group.triangles.iter().all(|t| leaf_of.get(t) == Some(leaf));
        all.then_some(*leaf)
    };
    let shown: Vec<Option<u32>> = groups.iter().map(only).collect();
    if shown.iter().flatten().count() < LEAST_MEMBERS {
        return vec![None; groups.len()];
    }
    let mut placed: HashMap<u32, Lone> = HashMap::new();
    for (family, prototype) in (0..).zip(prototypes(tree, &ALIKE)) {
        placed.extend(prototype.copies.iter().map(|copy| {
            let placement = copy.placement;
            (copy.leaf, Lone { family, placement })
        }));
    }
    let mut members: HashMap<u32, usize> = HashMap::new();
    let found: Vec<Option<Lone>> = (shown.iter())
        .map(|leaf| placed.get(leaf.as_ref()?).copied())
        .collect();
    for lone in found.iter().flatten() {
        *members.entry(lone.family).or_default() += 1;
    }
    let enough = |lone: &Lone| members[&lone.family] >= LEAST_MEMBERS;
    found.into_iter().map(|l| l.filter(enough)).collect()
}

impl Lone {
    /// Where a point of this leaf's card is on that of another leaf of the family.
    pub fn onto(&self, other: &Self, point: Vec3) -> Vec3 {
        let away = (point.as_dvec3() - self.placement.translation) / self.placement.scale;
        let local = self.placement.rotation.inverse() * away;
        other.placement.apply(local).as_vec3()
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::path::Path;

    use crate::botany::grow::{Options, Species, grow};
    use crate::botany::load::{Limits, load_slice};
    use crate::botany::recognise::{RecogniseOptions, recognise};

    pub fn oak(leaves: u32) -> Tree {
        let options = Options {
            leaves: Some(leaves),
            ..Options::default()
        };
        let grown = grow(&Species::named("oak").unwrap(), &options).unwrap();
        let model = load_slice(&grown.glb, Path::new("oak.glb"), &Limits::default()).unwrap();
        recognise(model, &RecogniseOptions::default()).unwrap()
    }

    /// A card of these leaves.
    pub fn showing(tree: &Tree, leaves: impl IntoIterator<Item = u32>) -> CardGroup {
        let leaves = leaves.into_iter().map(|leaf| &tree.leaves[leaf as usize]);
        CardGroup {
            triangles: leaves.flat_map(|l| l.triangles.clone()).collect(),
            ..CardGroup::default()
        }
    }

    #[test]
    fn corners_of_a_leaf_come_onto_those_of_another_of_its_family() {
        let tree = oak(60);
        let all = 0..tree.leaves.len() as u32;
        let groups: Vec<CardGroup> = all.map(|l| showing(&tree, [l])).collect();
        let found = lone(&tree, &groups);
        let alike: Vec<(usize, Lone)> = (found.iter().enumerate())
            .filter_map(|(i, l)| Some((i, (*l)?)))
            .collect();
        assert!(alike.len() > tree.leaves.len() / 2, "{}", alike.len());
        let (first, onto) = alike[0];
        let corners = |leaf: usize| {
            let triangles = tree.leaves[leaf].triangles.iter();
            triangles
                .flat_map(|&t| tree.model.corners(t))
                .collect::<Vec<Vec3>>()
        };
        let mut sizes = Vec::new();
        for &(leaf, own) in alike.iter().filter(|(_, l)| l.family == onto.family) {
            sizes.push(own.placement.scale);
            let size = (corners(first)[0] - corners(first)[1]).length();
            for (a, b) in corners(leaf).into_iter().zip(corners(first)) {
                let off = own.onto(&onto, a).distance(b);
                assert!(off < 0.05 * size, "{off} of {size}");
            }
        }
        // They differ in size: a scale is part of how they lie.
        let [least, most] = [f64::min, f64::max].map(|f| sizes.iter().copied().reduce(f).unwrap());
        assert!(most > 1.05 * least, "{least} {most}");
    }

    #[test]
    fn cards_of_two_leaves_or_of_wood_and_families_of_few_have_none() {
        let tree = oak(60);
        let pairs = (0..tree.leaves.len() as u32 / 2).map(|i| showing(&tree, [2 * i, 2 * i + 1]));
        let found = lone(&tree, &pairs.collect::<Vec<_>>());
        assert!(found.iter().filter(|l| l.is_some()).count() <= 1);
        let mut is_leaf = vec![false; tree.model.triangles.len()];
        for &t in tree.leaves.iter().flat_map(|l| &l.triangles) {
            is_leaf[t as usize] = true;
        }
        let wood = (0..is_leaf.len() as u32).filter(|&t| !is_leaf[t as usize]);
        let wood: Vec<CardGroup> = (wood.take(20))
            .map(|t| CardGroup {
                triangles: vec![t],
                ..CardGroup::default()
            })
            .collect();
        assert_eq!(lone(&tree, &wood), vec![None; 20]);
        let few = 0..LEAST_MEMBERS as u32 - 1;
        let few: Vec<CardGroup> = few.map(|l| showing(&tree, [l])).collect();
        assert_eq!(lone(&tree, &few), vec![None; LEAST_MEMBERS - 1]);
    }
}
