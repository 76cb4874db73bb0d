//! One process per folder.

use super::file::parent;
use crate::error::FormatError;
use crate::reasons::write_error;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// A lock on a folder for one process: a file `.NAME.lock` beside it. The system keeps it locked until the value is dropped or
/// the process ends, however it does. Only processes that ask for the lock heed it.
///
/// ```
/// use deepsft_formats::FolderLock;
/// let above = tempfile::tempdir()?;
/// let folder = above.path().join("cover-data");
/// let lock = FolderLock::acquire(&folder)?;
/// assert!(FolderLock::acquire(&folder).is_err());
/// drop(lock);
/// assert!(FolderLock::acquire(&folder).is_ok());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct FolderLock {
    file: File,
    path: PathBuf,
}

impl FolderLock {
    /// Locks the folder, which need not be there yet.
    ///
    /// # Errors
    /// [`FormatError::Locked`] when another process has it, [`FormatError::Write`] when the lock cannot be made.
    pub fn acquire(folder: &Path) -> Result<Self, FormatError> {
        let unwritten = |error: io::Error| FormatError::unwritten(folder, write_error(error));
        fs::create_dir_all(parent(folder)).map_err(unwritten)?;
        // By its own name: `.` and links to it are one folder.
        let folder = match fs::canonicalize(folder) {
            Ok(folder) => folder,
            Err(_) => parent(folder).join(folder.file_name().unwrap_or_default()),
        };
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        let path = folder.with_file_name(format!(".{name}.lock"));
        loop {
            let file = File::options()
                .create(true)
                .truncate(false)
                .write(true)
                .open(&path)
                .map_err(unwritten)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Err(FormatError::Locked { path: folder }),
                // File systems without locks: better without than not at all.
                Err(TryLockError::Error(error)) if has_no_locks(&error) => {}
                Err(TryLockError::Error(error)) => return Err(unwritten(error)),
            }
            // The process before may have removed the file between our opening and our locking it.
            if is_at(&file, &path) {
                return Ok(Self { file, path });
            }
        }
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // Removed while it is locked: nobody can lock a file of this name that is about to go. Where files in use cannot be
        // removed, an unlocked file stays and does no harm.
        let _ = fs::remove_file(&self.path);
        let _ = self.file.unlock();
    }
}

/// Whether a file system has no locks. std has no kind for ENOLCK, which is 37 on Linux and 77 on macOS and BSD.
fn has_no_locks(error: &io::Error) -> bool {
    let no_locks = if cfg!(target_os = "linux") { 37 } else { 77 };
    error.kind() == io::ErrorKind::Unsupported || (cfg!(unix) && error.raw_os_error() == Some(no_locks))
}

/// Whether `file` is still the one at `path`.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |metadata: fs::Metadata| (metadata.dev(), metadata.ino());
    match (file.metadata(), fs::metadata(path)) {
        (Ok(file), Ok(there)) => identity(file) == identity(there),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_at(_file: &File, path: &Path) -> bool {
    path.exists()
}
