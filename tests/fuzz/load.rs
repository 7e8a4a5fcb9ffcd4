//! Any bytes end in a tree or an error of the user's: no panic, no abort, no hang.
//!
//!     cargo install cargo-fuzz
//!     cargo +nightly fuzz run --fuzz-dir tests/fuzz load tests/fuzz/corpus tests/fuzz/seeds -- \
//!         -dict=tests/fuzz/gltf.dict -max_total_time=600
//!
//! Seeds are small files that use what the loader knows; findings become tests in tests/load.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use pleach::botany::load::{Limits, load_slice};
use pleach::botany::recognise::{RecogniseOptions, recognise};

fuzz_target!(|bytes: &[u8]| {
    let limits = Limits {
        triangles: 5_000,
        pixels: 1 << 16,
        nodes: 1_000,
        bytes: 1 << 20,
    };
    // A file that is not there: what it refers to is not there either.
    match load_slice(bytes, Path::new("fuzz/none.glb"), &limits) {
        Ok(model) => {
            let tree = recognise(model, &RecogniseOptions::default()).expect("a model has triangles");
            assert_eq!(tree.organ.len(), tree.model.triangles.len());
            assert!(!tree.subtrees.is_empty());
        }
        Err(error) => assert_eq!(error.exit_code(), 2, "{error}"),
    }
});
