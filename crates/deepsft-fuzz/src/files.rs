//! Readers of folders: files on a disk that is memory, where there is one.

use anyhow::{Context, Result};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

thread_local! {
    static FOLDER: RefCell<Option<Folder>> = const { RefCell::new(None) };
}

/// A folder of this thread and what is in it.
struct Folder {
    folder: TempDir,
    content: BTreeMap<PathBuf, Vec<u8>>,
}

/// Calls `read` with a folder that holds these files and no others. Files that are the same as at the last call are not
/// written again.
pub(crate) fn with_folder<T>(files: &[(&str, &[u8])], read: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
    FOLDER.with_borrow_mut(|folder| {
        let folder = match folder {
            Some(folder) => folder,
            None => folder.insert(Folder {
                folder: tempfile::tempdir().context("no temporary folder")?,
                content: BTreeMap::new(),
            }),
        };
        folder.fill(files)?;
        read(folder.folder.path())
    })
}

impl Folder {
    fn fill(&mut self, files: &[(&str, &[u8])]) -> Result<()> {
        let gone: Vec<PathBuf> = (self.content.keys())
            .filter(|path| !files.iter().any(|(name, _)| Path::new(name) == path.as_path()))
            .cloned()
            .collect();
        for name in gone {
            let path = self.folder.path().join(&name);
            fs::remove_file(&path)?;
            // Folders without files go too.
            let mut above = path.parent();
            while let Some(folder) = above.filter(|folder| *folder != self.folder.path()) {
                if fs::remove_dir(folder).is_err() {
                    break;
                }
                above = folder.parent();
            }
            self.content.remove(&name);
        }
        for (name, bytes) in files {
            if self.content.get(Path::new(name)).is_some_and(|there| there == bytes) {
                continue;
            }
            let path = self.folder.path().join(name);
            if !self.content.contains_key(Path::new(name))
                && let Some(above) = path.parent()
            {
                fs::create_dir_all(above)?;
            }
            fs::write(&path, bytes)?;
            self.content.insert(PathBuf::from(name), bytes.to_vec());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_holds_the_files_of_the_last_call_and_no_others() {
        let seen = |folder: &Path| -> Result<(bool, bool, Vec<u8>)> {
            let inside = folder.join("rgb");
            Ok((inside.is_dir(), inside.join("a").is_file(), fs::read(folder.join("b"))?))
        };
        let files: [(&str, &[u8]); 2] = [("rgb/a", b"1"), ("b", b"2")];
        assert_eq!(with_folder(&files, seen).unwrap(), (true, true, b"2".to_vec()));
        assert_eq!(
            with_folder(&[("b", b"3")], seen).unwrap(),
            (false, false, b"3".to_vec())
        );
    }
}
