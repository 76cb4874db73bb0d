//! Files and folders of the disk.

mod atomic;
mod camera;
mod kind;
mod lock;
#[cfg(feature = "scan")]
mod scan;
mod template;

pub use atomic::{StagedFolder, check_folder, replace_folder, sync_folder, write_file, write_folder};
pub use camera::read_camera;
pub use kind::FolderKind;
pub use lock::FolderLock;
#[cfg(feature = "scan")]
pub use scan::read_scan_file;
pub use template::read_template;

use crate::error::FormatError;
use std::path::Path;
use std::{fs, io};

/// Largest file that is read whole, bytes.
const LARGEST_FILE: u64 = 4 << 30;

/// The bytes of a file. Devices and pipes, which may never end, are refused.
fn read(path: &Path) -> Result<Vec<u8>, FormatError> {
    let read = || -> io::Result<Vec<u8>> {
        let file = fs::metadata(path)?;
        if !file.is_file() {
            return Err(io::Error::other("it is not a file"));
        }
        if file.len() > LARGEST_FILE {
            return Err(io::Error::other("it is larger than 4 GiB"));
        }
        fs::read(path)
    };
    read().map_err(|error| FormatError::unreadable(path, error))
}
