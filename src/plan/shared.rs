//! Which species of a plan can share an atlas.

use super::answer::{LevelAnswer, SpeciesAnswer};
use super::kind::Kind;

/// Says of each species with which others it can share one: those that are painted with the same colours and images
/// (one's may be a part of the other's), and that show a level of the same size.
pub fn partners(kinds: &[Kind], answers: &mut [SpeciesAnswer]) {
    let found: Vec<Vec<String>> = (0..kinds.len())
        .map(|i| {
            let others = (0..kinds.len()).filter(|&k| k != i);
            let like = others.filter(|&k| {
                painted_alike(&kinds[i], &kinds[k]) && shown_alike(&answers[i], &answers[k])
            });
            like.map(|k| kinds[k].name.clone()).collect()
        })
        .collect();
    for (answer, found) in answers.iter_mut().zip(found) {
        answer.can_share_with = found;
    }
}

fn painted_alike(a: &Kind, b: &Kind) -> bool {
    let (few, many) = match a.paints.len() <= b.paints.len() {
        true => (&a.paints, &b.paints),
        false => (&b.paints, &a.paints),
    };
    !few.is_empty() && few.is_subset(many)
}

fn shown_alike(a: &SpeciesAnswer, b: &SpeciesAnswer) -> bool {
    let shown = |answer: &SpeciesAnswer| -> Vec<LevelAnswer> {
        let levels = answer.levels.iter().skip(1);
        levels.filter(|l| l.needed).cloned().collect()
    };
    let theirs = shown(b);
    let same = |l: &LevelAnswer| theirs.iter().any(|other| other.height_px == l.height_px);
    shown(a).iter().any(same)
}
