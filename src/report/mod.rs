//! STEP 5: reads the package back and measures it against the original.
//!
//! What is measured is what was written: files are loaded again and drawn over the original's
//! pictures, supersampled and as an engine draws them.

mod asked;
pub mod band;
mod contact;
mod cost;
mod cuts;
mod cuts_beside;
mod drawable;
mod evaluate;
mod flip;
mod judge;
mod measure;
mod outline;
mod page;
mod reference;
pub mod schema;
mod shot;
mod silhouette;
pub mod species;
mod stage;
mod stand;
mod start;

pub use contact::contact_sheet;
pub use cost::{as_written, draw_calls, texture_bytes};
pub use cuts::Cuts;
pub use drawable::Drawable;
pub use evaluate::{Settings, evaluate, evaluate_watched};
pub use judge::{Judged, heights, judge};
pub use page::{Content, Made, Recognised, Sheet};
pub use reference::Reference;
pub use silhouette::{Agreement, agreement};
pub use start::{Start, start};
