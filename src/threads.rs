//! Threads for a run.

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::{Error, Result};

/// So many threads; 0: one for each core.
///
/// # Errors
/// [`Error::Internal`] where the system has none to give.
pub fn pool(threads: usize) -> Result<ThreadPool> {
    started(ThreadPoolBuilder::new().num_threads(threads))
}

/// As [`pool`], but one of the threads is the caller's, once in its life: none waits for the others, and allocators that
/// keep what each thread has freed keep less.
///
/// # Errors
/// [`Error::Internal`] where the system has none to give, or where this was asked before.
pub fn pool_with_caller(threads: usize) -> Result<ThreadPool> {
    started(
        ThreadPoolBuilder::new()
            .num_threads(threads)
            .use_current_thread(),
    )
}

fn started(builder: ThreadPoolBuilder) -> Result<ThreadPool> {
    builder.build().map_err(|e| Error::Internal {
        step: "start threads",
        what: e.to_string(),
    })
}
