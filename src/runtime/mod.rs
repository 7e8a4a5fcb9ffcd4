//! What an engine calls every frame: camera in, list of (sub-tree, representation, fade) out.
//!
//! No files, no threads, no allocation once its lists have grown: plain data goes in (the manifest
//! writes it) and plain data comes out. It builds with `default-features = false` and needs `glam`
//! alone.
//!
//! ```text
//! Hierarchy    sub-trees of one species, in the order of a walk from the trunk to the tips
//! Visibility   how far off a sub-tree counts, and how much of it is seen: one interface for
//!                Plain      distance alone
//!                Density    Deng: rear branches of a dense crown count as farther off
//!                Hidden     El-Sana: what the cells of a grid hide counts less
//!                Shown      ours: what was measured to be hidden by its own tree counts less
//! Measured     ours: pixels counted beforehand from directions over the sphere
//! ActiveCut    follows the camera through one tree by splits and merges
//! Forest       the same for many trees; most of them cost one comparison a frame
//! Spender      Lee: which leaves to draw under a budget
//! ```
//!
//! A cut is one representation for each sub-tree on it, and every leaf is under exactly one.
//!
//! ```
//! use glam::Vec3;
//! use pleach::runtime::{Density, Forest, Hierarchy, Place, Subtree, View};
//!
//! let whole = Subtree { leaves: 2, radius: 5.0, switch_distance: 80.0, ..Subtree::default() };
//! let branch = |x: f32| Subtree {
//!     parent: Some(0), leaves: 1, radius: 2.0, switch_distance: 30.0, center: Vec3::X * x,
//!     branch: Vec3::X * x.signum(), density: 1.0, ..Subtree::default()
//! };
//! let oak = Hierarchy::new(&[whole, branch(3.0), branch(-3.0)])?;
//! let places = [Place::at(Vec3::ZERO), Place::at(Vec3::X * 200.0)];
//! let mut forest = Forest::new(vec![oak], &places, Density::default());
//! let view = View::looking(Vec3::X * 40.0, Vec3::NEG_X, 1.0, 1.6);
//! forest.update(&view);
//! let mut drawn = Vec::new();
//! forest.collect(&view, &mut drawn);
//! assert_eq!(drawn.len(), 2); // the near tree's two branches; the far one is behind the camera
//! # Ok::<(), pleach::runtime::Flaw>(())
//! ```

mod active_cut;
mod budget;
mod cells;
mod density;
mod drawn;
mod forest;
mod hidden;
mod hierarchy;
mod looking;
mod measured;
mod occlusion;
mod place;
mod pool;
mod shares;
mod shown;
mod solidity;
mod visibility;
mod walk;

pub use active_cut::ActiveCut;
pub use budget::{Chosen, Item, Spender, by_distance, by_normal};
pub use cells::Cells;
pub use density::{Density, DotProduct, Sibling, sibling_density};
pub use drawn::{Drawn, Form};
pub use forest::Forest;
pub use hidden::{Hidden, blend};
pub use hierarchy::{Flaw, Hierarchy, Node, Origin, OwnLeaves, Subtree};
pub use looking::Changes;
pub use measured::{Measured, Measuring};
pub use occlusion::Occlusion;
pub use place::{Place, View};
pub use shares::shares;
pub use shown::Shown;
pub use solidity::{by_faces, by_rays, splat};
pub use visibility::{Plain, Sight, Visibility};
pub use walk::Law;
