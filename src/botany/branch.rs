//! A part of a tree as a tree of its own: what bakes trees then bakes sub-trees.

use glam::{DVec3, Vec3};

use super::model::{Frame, Model};
use super::subtree;
use super::tree::{Chain, Leaf, NO_NODE, Node, Skeleton, Tree};

/// No new number.
const NONE: u32 = u32::MAX;

/// The tree of some triangles, in the order given: whole leaves, and the wood of whole chains.
///
/// It is normalised anew, its frame says where it stands in the world, and chains whose carrier
/// stays behind are its trunks. Images are shared with the whole.
pub fn branch(tree: &Tree, triangles: &[u32]) -> Tree {
    let (model, place) = model(&tree.model, triangles);
    let mut number = vec![NONE; tree.model.triangles.len()];
    for (new, &old) in (0..).zip(triangles) {
        number[old as usize] = new;
    }
    let (skeleton, node) = skeleton(tree, triangles, &place);
    let renumbered = |n: u32| node.get(n as usize).copied().unwrap_or(NO_NODE);
    let leaves = tree.leaves.iter().filter_map(|leaf| {
        let first = *leaf.triangles.first()?;
        (number[first as usize] != NONE).then(|| Leaf {
            triangles: leaf.triangles.iter().map(|&t| number[t as usize]).collect(),
            class: leaf.class,
            center: place.of(leaf.center),
            area: leaf.area / (place.radius * place.radius) as f32,
            node: renumbered(leaf.node),
        })
    });
    let leaves = leaves.collect();
    let of = |t: &u32| *t as usize;
    let mut out = Tree {
        organ: triangles.iter().map(|t| tree.organ[of(t)]).collect(),
        triangle_part: triangles
            .iter()
            .map(|t| tree.triangle_part[of(t)])
            .collect(),
        part_count: tree.part_count,
        leaves,
        leaf_classes: tree.leaf_classes.clone(),
        wood_node: triangles
            .iter()
            .map(|t| renumbered(tree.wood_node[of(t)]))
            .collect(),
        skeleton,
        model,
        ..Tree::default()
    };
    // What it says of a missing skeleton has been said of the whole.
    out.subtrees = subtree::build(&out, &mut Vec::new());
    out
}

/// The bounding sphere of a part in the whole's normalised units.
struct Place {
    center: DVec3,
    radius: f64,
}

impl Place {
    fn of(&self, p: Vec3) -> Vec3 {
        ((p.as_dvec3() - self.center) / self.radius).as_vec3()
    }
}

fn model(whole: &Model, triangles: &[u32]) -> (Model, Place) {
    let corners = || triangles.iter().flat_map(|&t| whole.triangles[t as usize]);
    let mut number = vec![NONE; whole.positions.len()];
    let mut used = Vec::new();
    for corner in corners() {
        if number[corner as usize] == NONE {
            number[corner as usize] = used.len() as u32;
            used.push(corner as usize);
        }
    }
    let points = || used.iter().map(|&i| whole.positions[i].as_dvec3());
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = points().fold(start, |(a, b), p| (a.min(p), b.max(p)));
    let center = (low + high) / 2.0;
    let square = points()
        .map(|p| p.distance_squared(center))
        .fold(0.0, f64::max);
    let place = Place {
        center,
        radius: square.sqrt().max(1e-9),
    };
    let picked = |uvs: &Vec<glam::Vec2>| match uvs.is_empty() {
        true => Vec::new(),
        false => used.iter().map(|&i| uvs[i]).collect(),
    };
    let model = Model {
        name: whole.name.clone(),
        frame: Frame {
            center: whole.frame.center + center * whole.frame.radius,
            radius: whole.frame.radius * place.radius,
        },
        positions: used.iter().map(|&i| place.of(whole.positions[i])).collect(),
        normals: used.iter().map(|&i| whole.normals[i]).collect(),
        uvs: [picked(&whole.uvs[0]), picked(&whole.uvs[1])],
        colors: match whole.colors.is_empty() {
            true => Vec::new(),
            false => used.iter().map(|&i| whole.colors[i]).collect(),
        },
        triangles: triangles
            .iter()
            .map(|&t| whole.triangles[t as usize].map(|i| number[i as usize]))
            .collect(),
        triangle_object: triangles
            .iter()
            .map(|&t| whole.triangle_object[t as usize])
            .collect(),
        objects: whole.objects.clone(),
        materials: whole.materials.clone(),
        images: whole.images.clone(),
        position_step: whole.position_step,
        ..Model::default()
    };
    (model, place)
}

/// The chains that have wood among the triangles; for each node of the whole its new number.
fn skeleton(tree: &Tree, triangles: &[u32], place: &Place) -> (Skeleton, Vec<u32>) {
    let whole = &tree.skeleton;
    let mut stays = vec![false; whole.chains.len()];
    for &t in triangles {
        if let Some(node) = whole.nodes.get(tree.wood_node[t as usize] as usize) {
            stays[node.chain as usize] = true;
        }
    }
    let mut chain_number = vec![NONE; whole.chains.len()];
    let mut node_number = vec![NO_NODE; whole.nodes.len()];
    let kept: Vec<usize> = (0..stays.len()).filter(|&c| stays[c]).collect();
    for (new, &old) in (0..).zip(&kept) {
        chain_number[old] = new;
    }
    // Nodes keep their order: a parent comes before its children.
    let mut old_nodes = Vec::new();
    for (old, node) in whole.nodes.iter().enumerate() {
        if stays[node.chain as usize] {
            node_number[old] = old_nodes.len() as u32;
            old_nodes.push(node);
        }
    }
    let numbered = |n: u32| node_number.get(n as usize).copied().unwrap_or(NO_NODE);
    let nodes = old_nodes.into_iter().map(|node| Node {
        position: place.of(node.position),
        radius: node.radius / place.radius as f32,
        parent: numbered(node.parent),
        chain: chain_number[node.chain as usize],
    });
    let nodes = nodes.collect();
    let mut chains: Vec<Chain> = Vec::with_capacity(kept.len());
    for &old in &kept {
        let chain = &whole.chains[old];
        let parent = chain
            .parent
            .map(|p| chain_number[p as usize])
            .filter(|&p| p != NONE);
        chains.push(Chain {
            nodes: chain.nodes.iter().map(|&n| numbered(n)).collect(),
            parent,
            order: parent.map_or(0, |p| chains[p as usize].order + 1),
        });
    }
    (Skeleton { nodes, chains }, node_number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::botany::grow::{Options, Species, grow};
    use crate::botany::load::{Limits, load_slice};
    use crate::botany::recognise::{RecogniseOptions, recognise};
    use crate::detail::optimal_distance::own_triangles;

    fn oak() -> Tree {
        let options = Options {
            leaves: Some(300),
            ..Options::default()
        };
        let species = Species::named("oak").unwrap();
        let grown = grow(&species, &options).unwrap();
        let file = std::path::Path::new("oak.glb");
        let model = load_slice(&grown.glb, file, &Limits::default()).unwrap();
        recognise(model, &RecogniseOptions::default()).unwrap()
    }

    #[test]
    fn a_branch_stands_where_it_grew_and_keeps_its_botany() {
        let tree = oak();
        let own = own_triangles(&tree);
        let carries = |s: &usize| !tree.subtrees[*s].children.is_empty();
        let at = (2..own.len()).find(carries).unwrap();
        let mut inside = vec![false; own.len()];
        inside[at] = true;
        for i in at + 1..own.len() {
            inside[i] = tree.subtrees[i].parent.is_some_and(|p| inside[p as usize]);
        }
        let triangles: Vec<u32> = (0..own.len())
            .filter(|&i| inside[i])
            .flat_map(|i| own[i].iter().copied())
            .collect();
        let part = branch(&tree, &triangles);
        assert_eq!(part.leaves.len() as u32, tree.subtrees[at].leaf_count);
        assert_eq!(
            part.skeleton.chains.len(),
            inside.iter().filter(|i| **i).count()
        );
        assert_eq!(part.skeleton.chains[0].parent, None);
        assert_eq!(part.subtrees[0].leaf_count, tree.subtrees[at].leaf_count);
        assert!((part.subtrees[0].sphere.1 - 1.0).abs() < 1e-4);
        for (new, &old) in (0..).zip(&triangles) {
            let here = part.model.corners(new).map(|p| world(&part, p));
            let there = tree.model.corners(old).map(|p| world(&tree, p));
            for (a, b) in here.iter().zip(there) {
                assert!(a.distance(b) < 1e-6 * tree.model.frame.radius);
            }
        }
        for leaf in part.leaves.iter().filter(|l| l.node != NO_NODE) {
            assert!((leaf.node as usize) < part.skeleton.nodes.len());
        }
    }

    fn world(tree: &Tree, p: Vec3) -> DVec3 {
        tree.model.frame.center + p.as_dvec3() * tree.model.frame.radius
    }
}
