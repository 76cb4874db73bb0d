//! Tests of what crosses crates live in `tests/tests/`: the layering of the crates, the layout of the
//! repository's root, and the shipped models. This library only says where the repository is.

use std::path::{Path, PathBuf};

/// The repository's root.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}
