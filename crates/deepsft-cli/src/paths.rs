//! Names of files and folders.

use std::path::{Path, PathBuf};

/// The path beside `path` with the same name and an ending.
pub fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(ending);
    path.with_file_name(name)
}
