//! Threads for a run.

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::{Error, Result};

/// So many threads; 0: one for each core.
///
/// # Errors
/// [`Error::Internal`] where the system has none to give.
pub fn pool(threads: usize) -> Result<ThreadPool> {
    let builder = ThreadPoolBuilder::new().num_threads(threads);
    builder.build().map_err(|e| Error::Internal {
        step: "start threads",
        what: e.to_string(),
    })
}
