//! One level by Kratt's adaptive loop: its groups of leaves and their billboards instead of the
//! optimal cut's planes; wood as the cut draws it.
//!
//! The loop knows leaves alone. Twigs that the cut has on cards go to the nearest of the loop's
//! planes, whose outlines grow to hold them.

use std::collections::HashMap;

use super::adapt::{AdaptOptions, Generator, Group, adapt};
use super::level::{LevelPlan, Planner};
use crate::botany::tree::Tree;
use crate::cloud::Occlusion;
use crate::cloud::card::{Card, Outline};
use crate::export::foliage::CardGroup;

/// A card with the elements that it shows.
struct Shown {
    card: Card,
    members: Vec<u32>,
    /// Whether its outline may grow: sections of a strip hang together at their edges.
    free: bool,
}

/// Triangles kept back for a card of twigs, where no plane can take them.
const TWIG_CARD: usize = 2;

/// Replaces the leaves' cards of `cut` by those of the loop. `options.triangles` is the limit of
/// the whole level.
pub fn adaptive_level(
    planner: &Planner<'_>,
    tree: &Tree,
    occlusion: &Occlusion,
    cut: LevelPlan,
    options: AdaptOptions,
) -> LevelPlan {
    let wood: u64 = cut.tubes.iter().map(|&t| tube_triangles(planner, t)).sum();
    let limit = options
        .triangles
        .map(|all| all.saturating_sub(wood as usize + TWIG_CARD));
    let adapted = adapt(
        tree,
        occlusion,
        &AdaptOptions {
            triangles: limit,
            ..options
        },
    );
    let element_of: HashMap<u32, u32> = planner
        .elements
        .iter()
        .zip(0u32..)
        .filter(|(e, _)| e.chain.is_none())
        .flat_map(|(e, i)| e.triangles.iter().map(move |&t| (t, i)))
        .collect();
    let mut shown: Vec<Shown> = Vec::new();
    for group in &adapted.groups {
        let mut members: Vec<u32> = group
            .leaves
            .iter()
            .flat_map(|&leaf| &tree.leaves[leaf as usize].triangles)
            .filter_map(|t| element_of.get(t).copied())
            .collect();
        members.sort_unstable();
        members.dedup();
        show(planner, group, members, &mut shown);
    }
    let mut homeless = Vec::new();
    let twigs = cut.members.iter().flatten().copied();
    for twig in twigs.filter(|&e| planner.elements[e as usize].chain.is_some()) {
        let at = planner.elements[twig as usize].center;
        let free = shown.iter_mut().filter(|s| s.free);
        match free.min_by(|a, b| a.card.distance(at).total_cmp(&b.card.distance(at))) {
            Some(s) => s.members.push(twig),
            None => homeless.push(twig),
        }
    }
    // Strips and single leaves alone: one card for all twigs.
    if !homeless.is_empty() {
        shown.push(Shown {
            card: planner.card(&homeless).card,
            members: homeless,
            free: false,
        });
    }
    let mut plan = LevelPlan {
        tubes: cut.tubes,
        error: adapted.error(),
        ..LevelPlan::default()
    };
    for s in shown.into_iter().filter(|s| !s.members.is_empty()) {
        plan.cards.push(CardGroup {
            card: match s.free {
                true => grown(planner, s.card, &s.members),
                false => s.card,
            },
            triangles: triangles(planner, &s.members),
        });
        plan.members.push(s.members);
    }
    plan
}

fn tube_triangles(planner: &Planner<'_>, (element, choice): (u32, u32)) -> u64 {
    u64::from(planner.choices[element as usize][choice as usize].triangles)
}

/// Which card shows what: a plane and each half of a cross show all, a strip's section what is
/// nearest to it, and leaves that stay leaves get a card of their own.
fn show(planner: &Planner<'_>, group: &Group, members: Vec<u32>, shown: &mut Vec<Shown>) {
    let own = |card: &Card, members: Vec<u32>, free| Shown {
        card: card.clone(),
        members,
        free,
    };
    match group.generator {
        Generator::Geometry => shown.extend(members.iter().map(|&e| {
            let card = planner.card(&[e]).card;
            own(&card, vec![e], false)
        })),
        Generator::Plane | Generator::Cross => {
            shown.extend(group.cards.iter().map(|c| own(c, members.clone(), true)));
        }
        Generator::Strip => {
            let mut sections: Vec<Shown> = group
                .cards
                .iter()
                .map(|c| own(c, Vec::new(), false))
                .collect();
            for e in members {
                let at = planner.elements[e as usize].center;
                let nearest = sections
                    .iter_mut()
                    .min_by(|a, b| a.card.distance(at).total_cmp(&b.card.distance(at)));
                if let Some(section) = nearest {
                    section.members.push(e);
                }
            }
            shown.extend(sections);
        }
    }
}

/// The card in the same plane that holds all members.
fn grown(planner: &Planner<'_>, card: Card, members: &[u32]) -> Card {
    let outline = match card.outline.len() {
        3 => Outline::Triangle,
        _ => Outline::Quad,
    };
    Card::around(
        card.origin,
        card.u,
        card.v,
        planner.points(members),
        outline,
    )
}

fn triangles(planner: &Planner<'_>, members: &[u32]) -> Vec<u32> {
    members
        .iter()
        .flat_map(|&e| planner.elements[e as usize].triangles.iter().copied())
        .collect()
}
