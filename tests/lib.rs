//! Tests of what crosses crates live in `tests/tests/`: the layering of the crates, licences, the layout of the
//! repository's root, the pages for readers, and the shipped models. This library only says where the repository is.

pub mod imports;

use std::path::{Path, PathBuf};

/// The repository's root: where cargo runs the test from, not where it was compiled. A target folder may be shared
/// by several checkouts.
pub fn root() -> PathBuf {
    let compiled_in = env!("CARGO_MANIFEST_DIR").into();
    Path::new(&std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or(compiled_in)).join("..")
}

/// The Rust examples of the README are compiled as tests of this crate's documentation.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
