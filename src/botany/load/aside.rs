//! Nodes that hold no part of the tree, as the file says or the names that tools give them: coarser levels of another
//! node, and shapes for collisions.
//!
//! Packages of game assets hold a tree several times over, and a client that knows nothing of that draws all of it on top
//! of each other. A number says little, so a level is only what has one beside it with the same name and a smaller number.

use std::collections::{HashMap, HashSet};

use super::json::{Mesh, Node};

/// Why a node is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Aside {
    /// A coarser level of another node, or the picture that stands for it from afar.
    Level,
    /// The same, as another node says.
    Named,
    /// It stops what runs into the tree, and is never drawn.
    Collision,
}

impl Aside {
    /// What to tell of it.
    pub fn what(self) -> &'static str {
        match self {
            Self::Level => {
                "a node is a coarser level of another one by its name, and left out: levels are made from the finest; give \
                 it a name without LOD to keep it"
            }
            Self::Named => {
                "a node stands in the scene beside another one that names it as its coarser level (MSFT_lod), and is left out"
            }
            Self::Collision => "a node is a shape for collisions by its name, and left out",
        }
    }
}

/// Unreal Engine's prefixes of shapes for collisions.
const COLLISION_PREFIXES: [&str; 4] = ["ucx_", "ubx_", "usp_", "ucp_"];

/// Godot's suffixes of nodes that are not drawn.
const COLLISION_SUFFIXES: [&str; 2] = ["-colonly", "-convcolonly"];

/// Names of pictures of the whole tree, the last level of some tools.
const PICTURES: [&str; 3] = ["billboard", "impostor", "imposter"];

/// The nodes that a node of the scene with these `roots` names as its coarser levels, and that these name again. They belong
/// outside the scene, but stand in it in files that were taken apart and joined again. Only what nothing names begins: of
/// two that name each other both are kept.
pub(super) fn named(nodes: &[Node], roots: &[usize]) -> HashSet<usize> {
    // Nodes of the scene that name levels, with those.
    let mut claims: HashMap<usize, Vec<usize>> = HashMap::new();
    let mut seen = vec![false; nodes.len()];
    let mut stack = roots.to_vec();
    while let Some(at) = stack.pop() {
        let Some(node) = nodes.get(at) else {
            continue;
        };
        if std::mem::replace(&mut seen[at], true) {
            continue;
        }
        stack.extend(&node.children);
        let levels = node.extensions.as_deref().and_then(|e| e.levels.as_ref());
        let ids = levels.into_iter().flat_map(|levels| &levels.ids);
        let others = ids.copied().filter(|&id| id != at && id < nodes.len());
        let others: Vec<usize> = others.collect();
        if !others.is_empty() {
            claims.insert(at, others);
        }
    }
    let all: HashSet<usize> = claims.values().flatten().copied().collect();
    let finest = claims.keys().copied().filter(|at| !all.contains(at));
    let mut out = HashSet::new();
    let mut stack: Vec<usize> = finest.collect();
    while let Some(at) = stack.pop() {
        let levels = claims.get(&at).into_iter().flatten();
        stack.extend(levels.copied().filter(|&id| out.insert(id)));
    }
    out
}

/// Which of some nodes that stand beside each other are left out by their names, in their order.
pub(super) fn among(siblings: &[usize], nodes: &[Node], meshes: &[Mesh]) -> Vec<Option<Aside>> {
    let names: Vec<String> = siblings
        .iter()
        .map(|&node| name(nodes.get(node), meshes))
        .collect();
    // Only looked up, never iterated: its order reaches no output.
    let mut finest: HashMap<&str, u32> = HashMap::new();
    for (stem, number) in names.iter().filter_map(|name| level(name)) {
        let finest = finest.entry(stem).or_insert(number);
        *finest = number.min(*finest);
    }
    let why = |name: &String| {
        if is_collision(name) {
            return Some(Aside::Collision);
        }
        let coarser = match level(name) {
            Some((stem, number)) => finest.get(stem).is_some_and(|&least| number > least),
            None => !finest.is_empty() && PICTURES.iter().any(|p| name.contains(p)),
        };
        coarser.then_some(Aside::Level)
    };
    names.iter().map(why).collect()
}

/// The name of a node or else of its mesh, in lower case but for what tells that a word begins; without the number that
/// Blender gives copies.
fn name(node: Option<&Node>, meshes: &[Mesh]) -> String {
    let mesh = |node: &Node| meshes.get(node.mesh?)?.name.clone();
    let name = node.and_then(|n| n.name.clone().or_else(|| mesh(n)));
    let mut name = name.unwrap_or_default();
    // "TreeLOD1": a capital after a small letter begins a word, too.
    if let Some(at) = name.rfind("LOD")
        && name[..at].ends_with(|c: char| c.is_lowercase())
    {
        name.insert(at, '_');
    }
    let name = name.to_lowercase();
    match name.rsplit_once('.') {
        Some((stem, copy)) if copy.len() == 3 && copy.bytes().all(|b| b.is_ascii_digit()) => {
            stem.to_owned()
        }
        _ => name,
    }
}

/// The stem and the number of "stem_lod2", "stem-lod-2", "lod2".
fn level(name: &str) -> Option<(&str, u32)> {
    let is_mark = |c: char| matches!(c, '_' | '-' | ' ' | '.');
    let before = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let number = name[before.len()..].parse().ok()?;
    let stem = before.trim_end_matches(is_mark).strip_suffix("lod")?;
    let is_word = !stem.ends_with(char::is_alphabetic);
    is_word.then(|| (stem.trim_end_matches(is_mark), number))
}

fn is_collision(name: &str) -> bool {
    COLLISION_PREFIXES.iter().any(|p| name.starts_with(p))
        || COLLISION_SUFFIXES.iter().any(|s| name.ends_with(s))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(names: &[&str]) -> Vec<Option<Aside>> {
        let node = |name: &&str| Node {
            name: Some((*name).to_owned()),
            ..Node::default()
        };
        let nodes: Vec<Node> = names.iter().map(node).collect();
        let all: Vec<usize> = (0..nodes.len()).collect();
        among(&all, &nodes, &[])
    }

    #[test]
    fn coarser_levels_are_those_with_a_finer_one_of_their_name_beside_them() {
        const COARSER: Option<Aside> = Some(Aside::Level);
        assert_eq!(
            of(&["Oak_LOD0", "Oak_LOD1", "oak_lod2", "Oak_Billboard"]),
            [None, COARSER, COARSER, COARSER]
        );
        assert_eq!(
            of(&["LOD1", "LOD0", "TreeLOD3", "TreeLOD4"]),
            [COARSER, None, None, COARSER]
        );
        // Copies of a level, as Blender numbers them.
        assert_eq!(
            of(&["a_LOD0", "a_LOD0.001", "a_LOD1.002"]),
            [None, None, COARSER]
        );
        // Nothing finer is there; another tree's; no level.
        assert_eq!(of(&["Oak_LOD2", "Oak_Billboard_LOD2"]), [None, None]);
        assert_eq!(of(&["Oak_LOD0", "Ash_LOD1"]), [None, None]);
        assert_eq!(of(&["explod1", "explod2", "billboard"]), [None; 3]);
        assert_eq!(of(&["branch1", "branch2", "", "lod"]), [None; 4]);
    }

    #[test]
    fn shapes_for_collisions_are_those_that_engines_take_for_it() {
        const SHAPE: Option<Aside> = Some(Aside::Collision);
        let found = of(&["UCX_Oak_01", "Trunk-colonly", "Trunk-col", "column"]);
        assert_eq!(found, [SHAPE, SHAPE, None, None]);
    }

    #[test]
    fn a_node_without_a_name_has_its_mesh_s() {
        let mesh = |name: &str| Mesh {
            name: Some(name.to_owned()),
            ..Mesh::default()
        };
        let node = |mesh| Node {
            mesh: Some(mesh),
            ..Node::default()
        };
        let meshes = [mesh("b_lod0"), mesh("b_lod1")];
        let found = among(&[1, 0], &[node(0), node(1)], &meshes);
        assert_eq!(found, [Some(Aside::Level), None]);
    }
}
