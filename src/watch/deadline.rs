//! A bake that may only take so long.

use std::time::{Duration, Instant};

use super::Watch;
use crate::error::Error;

/// Passes everything on, and stops when time is over.
pub struct Deadline<'a> {
    inner: &'a dyn Watch,
    until: Option<Instant>,
    seconds: u32,
}

impl<'a> Deadline<'a> {
    /// From now on; 0 seconds: without an end.
    pub fn new(inner: &'a dyn Watch, seconds: u32) -> Self {
        let span = Duration::from_secs(seconds.into());
        Self {
            inner,
            until: (seconds > 0).then(|| Instant::now() + span),
            seconds,
        }
    }

    /// Says that it was the time, where it was.
    pub fn explain(&self, error: Error) -> Error {
        match error {
            Error::Interrupted if self.over() && !self.inner.stopped() => Error::usage(
                format!("the bake took longer than {} seconds", self.seconds),
                "raise most_seconds in the recipe, ask for fewer levels, or take --preset draft",
            ),
            other => other,
        }
    }

    fn over(&self) -> bool {
        self.until.is_some_and(|until| Instant::now() >= until)
    }
}

impl Watch for Deadline<'_> {
    fn stage(&self, name: &str, steps: u64) {
        self.inner.stage(name, steps);
    }

    fn part(&self, name: &str) {
        self.inner.part(name);
    }

    fn step(&self) {
        self.inner.step();
    }

    fn stopped(&self) -> bool {
        self.inner.stopped() || self.over()
    }
}
