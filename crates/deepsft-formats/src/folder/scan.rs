//! Scans of the disk.

use crate::error::FormatError;
use crate::picture::decode_picture;
use crate::scan::{Scan, read_scan};
use std::path::Path;
use std::{fs, io};

/// Reads the scan at `path` with the files beside it. `texture`, if given, is the picture file of all its parts.
///
/// # Errors
/// [`FormatError::File`] for a file that cannot be read, and those of [`read_scan`].
pub fn read_scan_file(path: &Path, texture: Option<&Path>) -> Result<Scan, FormatError> {
    let texture = texture.map(read_picture).transpose()?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    read_scan(&name, &read(path)?, texture, &|beside| read(&folder.join(beside)))
}

fn read_picture(path: &Path) -> Result<deepsft_geometry::Picture, FormatError> {
    decode_picture(&read(path)?).map_err(|error| FormatError::unreadable(path, error))
}

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
