//! What the system and the reader of JSON say of a file, in words that tell what to do.

use std::io::{Error, ErrorKind};

/// Words an error of reading a file or folder: what is wrong with it, and what to do.
///
/// ```
/// let missing = std::fs::read("nowhere.png").map_err(deepsft_formats::read_error).unwrap_err();
/// assert_eq!(missing.to_string(), "there is no such file or folder: check the path");
/// ```
pub fn read_error(error: Error) -> Error {
    worded(error, |kind| match kind {
        ErrorKind::NotFound => Some("there is no such file or folder: check the path"),
        ErrorKind::IsADirectory => Some("it is a folder: name a file"),
        ErrorKind::NotADirectory => Some("a part of its path is a file, not a folder: check the path"),
        ErrorKind::PermissionDenied => Some("it may not be read: ask its owner for the permission, or copy it"),
        _ => None,
    })
}

/// Words an error of writing a file or folder, as [`read_error`] does.
pub fn write_error(error: Error) -> Error {
    worded(error, |kind| match kind {
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            Some("nothing may be written there: choose another folder")
        }
        ErrorKind::NotFound => Some("nothing can be made there: choose another folder"),
        ErrorKind::NotADirectory | ErrorKind::AlreadyExists => {
            Some("a part of its path is a file, not a folder: choose another folder")
        }
        ErrorKind::IsADirectory => Some("a folder has this name: choose another name"),
        _ => None,
    })
}

fn worded(error: Error, words: impl Fn(ErrorKind) -> Option<&'static str>) -> Error {
    // What was worded by us has no number of the system's.
    match words(error.kind()).filter(|_| error.raw_os_error().is_some()) {
        Some(words) => Error::new(error.kind(), words),
        None => error,
    }
}

/// Words an error of reading JSON.
pub fn json_reason(error: &serde_json::Error) -> String {
    use serde_json::error::Category;
    match error.classify() {
        Category::Eof => format!("it ends too early ({error}): copy it again from where it came"),
        Category::Syntax => format!("it is no valid JSON ({error}): correct it there, or copy it again"),
        Category::Data => format!("{error}: correct it there"),
        Category::Io => error.to_string(),
    }
}
