//! What a frame hands to the engine.

/// How a sub-tree is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// By its billboards, with all that it carries.
    Billboard,
    /// By its own triangles: it carries nothing else.
    Geometry,
}

/// One thing to draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drawn {
    /// Index of the tree.
    pub tree: u32,
    /// Index of the node in the species' [`Hierarchy`](super::Hierarchy).
    pub node: u32,
    /// How.
    pub form: Form,
    /// 1: all of it. Less: the node fades in over its children, which are drawn in full; a page
    /// dithers this share of its pixels.
    pub fade: f32,
}
