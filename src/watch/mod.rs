//! Who watches a bake: told of every step, asked whether to go on.

mod clock;
mod deadline;

pub use clock::Clock;
pub use deadline::Deadline;

use crate::error::{Error, Result};

/// Follows a bake. All methods do nothing by default.
pub trait Watch: Sync {
    /// A stage of `steps` steps begins; the one before is over.
    fn stage(&self, name: &str, steps: u64) {
        let _ = (name, steps);
    }

    /// A part of the current step begins; the part before is over.
    fn part(&self, name: &str) {
        let _ = name;
    }

    /// A step of the stage is done.
    fn step(&self) {}

    /// Whether the bake should stop; asked between steps.
    fn stopped(&self) -> bool {
        false
    }
}

/// Nobody.
pub struct Unwatched;

impl Watch for Unwatched {}

/// A bake within a longer run: says nothing of its stages, and stops when `0` does.
pub struct Quiet<'a>(pub &'a dyn Watch);

impl Watch for Quiet<'_> {
    fn stopped(&self) -> bool {
        self.0.stopped()
    }
}

/// Begins a stage, unless the bake should stop.
///
/// # Errors
/// [`Error::Interrupted`].
pub fn begin(watch: &dyn Watch, name: &str, steps: u64) -> Result<()> {
    go_on(watch)?;
    watch.stage(name, steps);
    Ok(())
}

/// Begins a part of a step, unless the bake should stop.
///
/// # Errors
/// [`Error::Interrupted`].
pub fn part(watch: &dyn Watch, name: &str) -> Result<()> {
    go_on(watch)?;
    watch.part(name);
    Ok(())
}

/// Counts a step, unless the bake should stop.
///
/// # Errors
/// [`Error::Interrupted`].
pub fn step(watch: &dyn Watch) -> Result<()> {
    watch.step();
    go_on(watch)
}

fn go_on(watch: &dyn Watch) -> Result<()> {
    match watch.stopped() {
        true => Err(Error::Interrupted),
        false => Ok(()),
    }
}
