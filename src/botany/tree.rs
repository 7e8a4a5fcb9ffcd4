//! What recognition knows of a model: its parts, organs, leaves, skeleton and sub-trees.

use glam::Vec3;
use smallvec::SmallVec;

use super::model::Model;

/// Triangles of which there are few, as most leaves have: up to four take no allocation of their own.
pub type TriangleList = SmallVec<[u32; 4]>;

/// A model with its botany. All lengths are in normalised units (bounding-sphere radius one).
#[derive(Clone, Debug, Default)]
pub struct Tree {
    /// The polygons.
    pub model: Model,
    /// For each triangle, what it is part of.
    pub organ: Vec<Organ>,
    /// For each triangle, its welded connected part.
    pub triangle_part: Vec<u32>,
    /// Number of parts.
    pub part_count: u32,
    /// Foliage: one entry a leaf (a leaf may be two crossed quads).
    pub leaves: Vec<Leaf>,
    /// Congruent leaves.
    pub leaf_classes: Vec<LeafClass>,
    /// Centre lines of the wood; empty where the model has no wood.
    pub skeleton: Skeleton,
    /// For each triangle of wood the skeleton node that it belongs to; `NO_NODE` for foliage.
    pub wood_node: Vec<u32>,
    /// The hierarchy of sub-trees; parents before children; entry 0 is the whole tree.
    pub subtrees: Vec<Subtree>,
    /// What was guessed or could not be had, each said once.
    pub warnings: Vec<String>,
}

/// No skeleton node.
pub const NO_NODE: u32 = u32::MAX;

/// What a triangle is part of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
pub enum Organ {
    /// Trunk, branch or twig.
    #[default]
    Wood,
    /// Leaf, needle, flower, frond.
    Foliage,
}

/// One leaf.
#[derive(Clone, Debug, Default)]
pub struct Leaf {
    /// Its triangles.
    pub triangles: TriangleList,
    /// Its class of congruence.
    pub class: u32,
    /// Area-weighted centre of mass.
    pub center: Vec3,
    /// Surface area (one side), normalised units squared, alpha not counted.
    pub area: f32,
    /// Skeleton node that it is attached to, or `NO_NODE`.
    pub node: u32,
}

/// Leaves that are equal up to rotation, translation and uniform scale.
#[derive(Clone, Debug, Default)]
pub struct LeafClass {
    /// The leaf that stands for the class.
    pub prototype: u32,
    /// Number of leaves in the class.
    pub count: u32,
}

/// The skeleton graph: nodes along chains, chains joined to parent chains.
#[derive(Clone, Debug, Default)]
pub struct Skeleton {
    /// Nodes; a parent has a smaller index than its children.
    pub nodes: Vec<Node>,
    /// Chains; a parent chain has a smaller index than its children.
    pub chains: Vec<Chain>,
}

/// A point on a centre line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Position.
    pub position: Vec3,
    /// Radius of the wood there.
    pub radius: f32,
    /// Next node towards the root, or `NO_NODE` at a root. For a chain's first node this is a
    /// node of the parent chain.
    pub parent: u32,
    /// Chain that the node belongs to.
    pub chain: u32,
}

/// A branch from its base to its tip.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chain {
    /// Nodes from base to tip; never empty.
    pub nodes: Vec<u32>,
    /// The chain that carries it, or `None` for a trunk.
    pub parent: Option<u32>,
    /// Branch order: 0 for a trunk.
    pub order: u32,
}

/// A sub-tree: all that grows from one chain (wood and leaves), or the whole tree, or a cluster
/// of leaves where no skeleton can be had.
#[derive(Clone, Debug, Default)]
pub struct Subtree {
    /// Parent in the hierarchy; `None` for the whole tree.
    pub parent: Option<u32>,
    /// Children in the hierarchy.
    pub children: Vec<u32>,
    /// The chain that it grows along, if it has one.
    pub chain: Option<u32>,
    /// Branch order of that chain.
    pub order: u32,
    /// Where it is connected to its parent.
    pub connector: Vec3,
    /// Leaves that hang on its own chain (not on its children).
    pub leaves: Vec<u32>,
    /// Number of leaves on it and all that it carries.
    pub leaf_count: u32,
    /// Bounding sphere of all its geometry: centre and radius.
    pub sphere: (Vec3, f32),
}
