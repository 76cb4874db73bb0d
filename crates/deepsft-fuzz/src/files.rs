//! Inputs that are several files, or changes of a file; and folders of files.

use crate::png;
use anyhow::{Context, Result};
use std::fs;
use std::path::Path;

/// What stands between two files. A mark survives mutations that lengths before the files would not.
const MARK: &[u8] = b"\n<part>\n";

/// The files of an input, with repaired checksums where they hold PNG files.
pub(crate) fn split(input: &[u8]) -> Vec<Vec<u8>> {
    let mut parts = Vec::new();
    let mut rest = input;
    while let Some(at) = rest.windows(MARK.len()).position(|window| window == MARK) {
        parts.push(png::repaired(&rest[..at]));
        rest = &rest[at + MARK.len()..];
    }
    parts.push(png::repaired(rest));
    parts
}

/// The first files of an input; those that it lacks are empty.
pub(crate) fn parts<const COUNT: usize>(input: &[u8]) -> [Vec<u8>; COUNT] {
    let mut parts = split(input).into_iter();
    std::array::from_fn(|_| parts.next().unwrap_or_default())
}

/// The input of these files.
pub(crate) fn join(parts: &[&[u8]]) -> Vec<u8> {
    parts.join(MARK)
}

/// `part`, or where it begins with `~` the file `whole` with changes: three bytes of position and one of content each.
/// So mutations reach what lies deep in a file that is too large to be an input.
pub(crate) fn patched(part: &[u8], whole: &[u8]) -> Vec<u8> {
    let Some(changes) = part.strip_prefix(b"~") else {
        return part.to_vec();
    };
    let mut file = whole.to_vec();
    for &[a, b, c, content] in changes.as_chunks().0 {
        // Any position is one of the file.
        let position = u32::from_le_bytes([a, b, c, 0]) as usize % file.len().max(1);
        if let Some(byte) = file.get_mut(position) {
            *byte = content;
        }
    }
    file
}

/// Whether an input is one of `of` that get the more expensive checks. It depends on the input alone.
pub(crate) fn is_one_of(of: u32, input: &[u8]) -> bool {
    let mut crc = flate2::Crc::new();
    crc.update(input);
    crc.sum().is_multiple_of(of)
}

/// Calls `read` with a folder that holds these files and no others. Empty ones are not there.
pub(crate) fn with_folder<T>(
    files: impl IntoIterator<Item = (impl AsRef<Path>, impl AsRef<[u8]>)>,
    read: impl FnOnce(&Path) -> Result<T>,
) -> Result<T> {
    let folder = tempfile::tempdir().context("no temporary folder")?;
    for (name, bytes) in files {
        let path = folder.path().join(name);
        if !bytes.as_ref().is_empty() {
            fs::create_dir_all(path.parent().unwrap_or(folder.path()))?;
            fs::write(path, bytes)?;
        }
    }
    read(folder.path())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_come_back_and_empty_ones_count() {
        let parts: [&[u8]; 4] = [b"a\n", b"", b"<part>", b""];
        assert_eq!(split(&join(&parts)), parts);
        assert_eq!(split(b""), [b""]);
        assert_eq!(super::parts::<2>(b"a"), [&b"a"[..], b""]);
    }

    #[test]
    fn a_patch_changes_bytes_of_the_whole_file() {
        assert_eq!(patched(b"~\x01\x00\x00z\x05\x00\x00y\x01", b"abc"), b"azy");
        assert_eq!(patched(b"new", b"abc"), b"new");
        assert_eq!(patched(b"~\x01\x00\x00z", b""), b"");
    }
}
