//! Files that are there whole or not at all: written beside their place, then renamed.

use super::steps::step;
use crate::error::FormatError;
use crate::reasons::write_error;
use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::Path;

/// How the names of files begin that are being written.
const UNFINISHED_FILE: &str = ".unfinished-";

/// Writes a file whole. Folders above it are made as needed; an older file of the name is replaced.
///
/// # Errors
/// [`FormatError::Write`]; what was there before is still there then.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), FormatError> {
    write(path, bytes).map_err(|error| FormatError::unwritten(path, write_error(error)))
}

/// As [`write_file`]; the error names no path.
pub(super) fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let folder = parent(path);
    step(|| fs::create_dir_all(folder))?;
    let mut beside = tempfile::Builder::new().prefix(UNFINISHED_FILE).tempfile_in(folder)?;
    // By the file itself: errors would name its path, which nobody knows.
    beside.as_file_mut().write_all(bytes)?;
    beside.as_file().sync_all()?;
    let_all_read(beside.path(), 0o644)?;
    step(|| Ok(beside.persist(path)?)).map(drop)
}

/// Removes what [`write_file`] was writing into `folder` when its process was killed.
pub(super) fn remove_unfinished(folder: &Path) -> io::Result<()> {
    for entry in entries(folder)? {
        if entry.file_name().to_string_lossy().starts_with(UNFINISHED_FILE) {
            step(|| fs::remove_file(entry.path()))?;
        }
    }
    Ok(())
}

/// What is in a folder; nothing where there is none.
pub(super) fn entries(folder: &Path) -> io::Result<Vec<fs::DirEntry>> {
    match fs::read_dir(folder) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(Vec::new()),
        entries => entries?.collect(),
    }
}

/// `result`, with a file or folder that is not there as success.
pub(super) fn or_absent(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Waits until the names of the files in `folder` are on the disk. It does nothing where a folder cannot be opened as a file
/// (outside of Unix) or its file system cannot wait for folders.
pub(super) fn sync_names(folder: &Path) -> io::Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    step(|| fs::File::open(folder)?.sync_all()).or_else(|error| match error.kind() {
        // EINVAL and EOPNOTSUPP of file systems that do not offer it, as some of the network.
        ErrorKind::InvalidInput | ErrorKind::Unsupported => Ok(()),
        _ => Err(error),
    })
}

/// The folder that holds `path`.
pub(super) fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// Temporary files are for their owner alone; what we write is as readable as any new file.
#[cfg(unix)]
pub(super) fn let_all_read(path: &Path, mode: u32) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(path, fs::Permissions::from_mode(mode))
}

#[cfg(not(unix))]
pub(super) fn let_all_read(_path: &Path, _mode: u32) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_were_being_written_are_removed_and_no_others() {
        let folder = tempfile::tempdir().unwrap();
        for name in [".unfinished-aB3xZ9", "unfinished-", "report.json"] {
            fs::write(folder.path().join(name), name).unwrap();
        }
        remove_unfinished(folder.path()).unwrap();
        let left = entries(folder.path()).unwrap();
        let mut names: Vec<_> = left.iter().map(fs::DirEntry::file_name).collect();
        names.sort();
        assert_eq!(names, ["report.json", "unfinished-"]);
        remove_unfinished(&folder.path().join("none")).unwrap();
    }

    #[test]
    fn a_folder_is_synced_where_that_can_be_and_one_that_is_not_there_is_an_error() {
        let above = tempfile::tempdir().unwrap();
        sync_names(above.path()).unwrap();
        sync_names(parent(Path::new("name"))).unwrap();
        assert_eq!(sync_names(&above.path().join("none")).is_err(), cfg!(unix));
        // A file system that does not sync folders says EINVAL.
        if cfg!(target_os = "linux") {
            sync_names(Path::new("/proc")).unwrap();
        }
    }
}
