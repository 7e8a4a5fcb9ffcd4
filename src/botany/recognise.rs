//! Polygons become botany: parts, organs, leaves, skeleton, attachment, sub-trees.

use super::model::Model;
pub use super::organ::OrganRule;
use super::tree::{NO_NODE, Organ, Tree};
use super::{apart, attach, leaf, organ, part, skeleton, stance, subtree};
use crate::error::{Error, Result};

/// What the user may say about a model before it is recognised.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RecogniseOptions {
    /// Rules that overrule what shape and material say; the first that matches wins.
    pub organs: Vec<OrganRule>,
}

/// Finds wood, leaves, skeleton and sub-trees of a model.
///
/// Works on any polygons: without wood the sub-trees are clusters of leaves, without leaves
/// there is only a skeleton; what had to be guessed is in [`Tree::warnings`].
///
/// # Errors
/// [`Error::Input`] where the model has no triangle at all.
pub fn recognise(model: Model, options: &RecogniseOptions) -> Result<Tree> {
    if model.triangles.is_empty() {
        return Err(Error::input(
            std::path::Path::new(&model.name),
            "model",
            "no triangle with an area is left after loading",
            "check that the file holds a mesh of triangles",
        ));
    }
    let mut warnings = Vec::new();
    let mut parts = part::find(&model);
    let organs = organ::classify(&model, &parts, &options.organs, &mut warnings);
    let organs = mend_twigs(&mut parts, organs);
    let leaves = leaf::find(&model, &parts, &organs);
    let (skeleton, wood_node) = skeleton::build(&parts, &organs, &mut warnings);
    warnings.extend(stance::lies(&skeleton).map(stance::warning));
    let mut tree = Tree {
        organ: parts
            .triangle_part
            .iter()
            .map(|&p| organs[p as usize])
            .collect(),
        triangle_part: parts.triangle_part,
        part_count: parts.triangles.len() as u32,
        leaves: leaves.leaves,
        leaf_classes: leaves.classes,
        skeleton,
        wood_node,
        model,
        ..Tree::default()
    };
    attach::attach_leaves(&mut tree, &mut warnings);
    tree.subtrees = subtree::build(&tree, &mut warnings);
    let trees = apart::trees(&tree);
    if trees > 1 {
        warnings.push(apart::warning(trees));
    }
    tree.warnings = warnings;
    debug_assert!(tree.wood_node.len() == tree.model.triangles.len());
    debug_assert!(
        tree.leaves
            .iter()
            .all(|l| l.node == NO_NODE || (l.node as usize) < tree.skeleton.nodes.len())
    );
    Ok(tree)
}

/// Joins torn twigs; gives the organs of the parts that are left.
fn mend_twigs(parts: &mut part::Parts, organs: Vec<Organ>) -> Vec<Organ> {
    let scraps = organ::scraps(parts, &organs);
    let kind: Vec<u32> = organs.iter().map(|&o| o as u32).collect();
    let before: Vec<u32> = parts.triangles.iter().map(|t| t[0]).collect();
    part::mend(parts, &scraps, &kind);
    let mut after = vec![Organ::Wood; parts.triangles.len()];
    for (triangle, organ) in before.into_iter().zip(organs) {
        after[parts.triangle_part[triangle as usize] as usize] = organ;
    }
    after
}
