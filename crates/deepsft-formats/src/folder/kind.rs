//! The kinds of folders that commands write.

use std::path::Path;

/// A kind of folder: how it is known, and which files in it are its own.
#[derive(Clone, Copy, Debug)]
pub struct FolderKind {
    /// Files by one of which a folder of this kind is known.
    pub known_by: &'static [&'static str],
    /// Paths in the folder of all files that are ours, with `#` for any number of digits. Others are somebody's own and stay
    /// when the folder is replaced.
    pub files: &'static [&'static str],
}

impl FolderKind {
    /// A template.
    pub const TEMPLATE: Self = Self {
        known_by: &["template.json"],
        files: &["template.json", "texture.png", "mesh.obj", "views.png"],
    };

    /// A data set.
    pub const DATASET: Self = Self {
        known_by: &["dataset.json"],
        files: &["dataset.json", "state.json", "shard-#.tar", "shard.tmp"],
    };

    /// Whether the file `path` in a folder of this kind is one of its own.
    pub(super) fn has(&self, path: &Path) -> bool {
        let path = path.to_string_lossy().replace('\\', "/");
        self.files.iter().any(|pattern| fits(pattern, &path))
    }
}

/// Whether `text` is `pattern` with digits in place of each `#`.
fn fits(pattern: &str, text: &str) -> bool {
    let Some((before, after)) = pattern.split_once('#') else {
        return pattern == text;
    };
    let Some(rest) = text.strip_prefix(before) else {
        return false;
    };
    let unnumbered = rest.trim_start_matches(|c: char| c.is_ascii_digit());
    unnumbered.len() < rest.len() && fits(after, unnumbered)
}
