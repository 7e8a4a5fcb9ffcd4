//! Many trees in one run: a package for each, bounded memory, and nothing done twice.
//!
//! Every tree is baked by one thread of its own, as many at a time as there are threads: that
//! wastes none of them, where the threads of one bake wait for each other. A tree only starts
//! when the memory that it is expected to take is free. A tree that fails stops no other.

mod memory;
mod unchanged;

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use crate::error::{Error, Result};
use crate::pipeline::{Baked, Request, bake};
use crate::recipe::Recipe;
use crate::threads::pool;
use crate::watch::{Quiet, Watch};
pub use memory::{Gate, bytes_of_machine, expected_bytes};
pub use unchanged::{is_unchanged, unchanged};

/// What to bake.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// The trees.
    pub inputs: Vec<PathBuf>,
    /// The folder that gets a folder for each tree, named after the file without its ending.
    pub output: PathBuf,
    /// Everything else; `input` and `output` are filled in for each tree.
    pub request: Request,
    /// Whether to bake again what has not changed.
    pub rebake: bool,
    /// Threads; 0: one for each core.
    pub threads: usize,
}

/// What became of one tree.
#[derive(Debug)]
pub struct Outcome {
    /// The tree.
    pub input: PathBuf,
    /// Its package.
    pub output: PathBuf,
    /// What was done.
    pub done: Done,
    /// Wall-clock time, seconds.
    pub seconds: f64,
}

/// How a tree ended.
#[derive(Debug)]
pub enum Done {
    /// A package was written.
    Baked(Box<Baked>),
    /// The package that is there was made from the same input, recipe, scene and version.
    Unchanged,
    /// Why there is no new package; an old one is still there.
    Failed(Error),
}

/// Bakes all trees; the outcomes are in the order of the inputs. `watch` is told of the batch, one
/// step a tree, and asked whether to stop.
///
/// # Errors
/// [`Error::Usage`] where two packages would get the same folder, [`Error::Interrupted`], and
/// [`Error::Internal`] where threads can't be had. What is wrong with one tree is in its outcome.
pub fn bake_all(batch: &Batch, watch: &dyn Watch) -> Result<Vec<Outcome>> {
    let outputs = outputs(batch)?;
    watch.stage("trees", batch.inputs.len() as u64);
    let threads = match batch.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    };
    let workers = threads.min(batch.inputs.len()).max(1);
    // A few large trees share the threads; many small ones have one each.
    let pools: Vec<rayon::ThreadPool> = (0..workers)
        .map(|i| pool((threads + i) / workers))
        .collect::<Result<_>>()?;
    let gate = Gate::new(memory_bytes(&batch.request.recipe));
    let next = AtomicUsize::new(0);
    let outcomes: Vec<Mutex<Option<Outcome>>> =
        batch.inputs.iter().map(|_| Mutex::new(None)).collect();
    std::thread::scope(|scope| {
        for pool in &pools {
            scope.spawn(|| {
                loop {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    let (Some(input), false) = (batch.inputs.get(i), watch.stopped()) else {
                        break;
                    };
                    let outcome = pool.install(|| one(batch, input, &outputs[i], &gate, watch));
                    watch.step();
                    *outcomes[i].lock().unwrap_or_else(|e| e.into_inner()) = Some(outcome);
                }
            });
        }
    });
    if watch.stopped() {
        return Err(Error::Interrupted);
    }
    let all = outcomes.into_iter();
    Ok(all
        .filter_map(|o| o.into_inner().unwrap_or_else(|e| e.into_inner()))
        .collect())
}

/// Memory that trees may take together, bytes. A tree that is expected to take more is baked while
/// no other is.
pub fn memory_bytes(recipe: &Recipe) -> u64 {
    match recipe.memory_mib {
        // Where the system does not tell: what any machine has that bakes trees.
        0 => bytes_of_machine().unwrap_or(8 << 30) / 2,
        mib => u64::from(mib) << 20,
    }
}

/// The folder of each tree's package.
fn outputs(batch: &Batch) -> Result<Vec<PathBuf>> {
    let mut taken: std::collections::BTreeMap<String, &Path> = Default::default();
    let mut out = Vec::with_capacity(batch.inputs.len());
    for input in &batch.inputs {
        let Some(stem) = input.file_stem() else {
            return Err(Error::usage(
                format!("{} names no file", input.display()),
                "give .glb or .gltf files",
            ));
        };
        // Some file systems take upper and lower case for the same.
        let key = stem.to_string_lossy().to_lowercase();
        if let Some(other) = taken.insert(key, input) {
            return Err(Error::usage(
                format!(
                    "{} and {} would both be baked into {}",
                    other.display(),
                    input.display(),
                    batch.output.join(stem).display()
                ),
                "rename one of them, or bake them in two runs with different -o",
            ));
        }
        out.push(batch.output.join(stem));
    }
    Ok(out)
}

fn one(batch: &Batch, input: &Path, output: &Path, gate: &Gate, watch: &dyn Watch) -> Outcome {
    let start = Instant::now();
    let request = Request {
        input: input.into(),
        output: output.into(),
        ..batch.request.clone()
    };
    let done = if !batch.rebake && is_unchanged(&request) {
        Done::Unchanged
    } else {
        let _room = gate.enter(expected_bytes(&request));
        // Even a fault of ours ends one tree, not the batch.
        let caught = catch_unwind(AssertUnwindSafe(|| bake(&request, &Quiet(watch))));
        match caught.unwrap_or_else(|panic| Err(fault(&*panic))) {
            Ok(baked) => Done::Baked(Box::new(baked)),
            Err(error) => Done::Failed(error),
        }
    };
    Outcome {
        input: input.into(),
        output: output.into(),
        done,
        seconds: start.elapsed().as_secs_f64(),
    }
}

fn fault(panic: &(dyn Any + Send)) -> Error {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or(panic.downcast_ref::<&str>().copied());
    Error::Internal {
        step: "bake",
        what: text.unwrap_or("a panic").into(),
    }
}
