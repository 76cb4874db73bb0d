//! Files and folders that are there whole or not at all: written beside their place, then renamed.

use super::FolderKind;
use crate::FormatError;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Writes a file. Folders above it are made as needed; an older file of the name is replaced.
///
/// # Errors
/// [`FormatError::Write`]; what was there before is still there then.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), FormatError> {
    let write = || -> io::Result<()> {
        let folder = parent(path);
        fs::create_dir_all(folder)?;
        let mut beside = tempfile::NamedTempFile::new_in(folder)?;
        beside.write_all(bytes)?;
        beside.as_file().sync_all()?;
        let_all_read(beside.path(), 0o644)?;
        beside.persist(path)?;
        Ok(())
    };
    write().map_err(|error| FormatError::unwritten(path, error))
}

/// Writes a folder of `files` as [`StagedFolder`] does.
///
/// # Errors
/// As [`StagedFolder::new`] and [`StagedFolder::commit`].
pub fn write_folder(path: &Path, kind: &FolderKind, files: &BTreeMap<String, Vec<u8>>) -> Result<(), FormatError> {
    let staged = StagedFolder::new(path, kind)?;
    for (name, bytes) in files {
        let file = staged.path().join(name);
        let write = || -> io::Result<()> {
            fs::create_dir_all(parent(&file))?;
            let mut file = fs::File::create(&file)?;
            file.write_all(bytes)?;
            file.sync_all()
        };
        write().map_err(|error| FormatError::unwritten(&path.join(name), error))?;
    }
    staged.commit()
}

/// A folder that is filled beside its place and put there whole by [`StagedFolder::commit`]; dropped
/// without that, nothing of it stays.
///
/// A folder that stands there already is replaced if it is of the same kind or empty; anything else is somebody's own and
/// stays as it is. Files in it that are not of the kind stay too.
#[derive(Debug)]
pub struct StagedFolder {
    place: PathBuf,
    beside: tempfile::TempDir,
    kind: FolderKind,
}

impl StagedFolder {
    /// Begins the folder that is to stand at `place`.
    ///
    /// # Errors
    /// [`FormatError::ForeignFolder`] for a folder of another kind, [`FormatError::Write`].
    pub fn new(place: &Path, kind: &FolderKind) -> Result<Self, FormatError> {
        check_folder(place, kind)?;
        let begin = || -> io::Result<tempfile::TempDir> {
            fs::create_dir_all(parent(place))?;
            tempfile::Builder::new().prefix(".partial-").tempdir_in(parent(place))
        };
        Ok(Self {
            beside: begin().map_err(|error| FormatError::unwritten(place, error))?,
            place: place.to_path_buf(),
            kind: *kind,
        })
    }

    /// Where to put its files meanwhile.
    pub fn path(&self) -> &Path {
        self.beside.path()
    }

    /// As [`StagedFolder::commit`], into another `place` beside the one it was begun for.
    ///
    /// # Errors
    /// [`FormatError::ForeignFolder`] for a folder of another kind, and those of [`StagedFolder::commit`].
    pub fn commit_to(mut self, place: &Path) -> Result<(), FormatError> {
        check_folder(place, &self.kind)?;
        self.place = place.to_path_buf();
        self.commit()
    }

    /// Puts the folder in its place.
    ///
    /// # Errors
    /// [`FormatError::Write`]; what was there before is still there then, and the error says where the new folder is.
    pub fn commit(self) -> Result<(), FormatError> {
        replace_folder(self.beside.path(), &self.place, &self.kind).map_err(|error| {
            let reason = match error {
                FormatError::Write { reason, .. } => reason,
                other => other.to_string(),
            };
            let kept = self.beside.keep();
            FormatError::Write {
                reason: format!("{reason}; what was made is now {}", kept.display()),
                path: self.place,
            }
        })
    }
}

/// Renames the folder `beside` to `place`, both in one folder. An older one there is removed, but for its files that are
/// not of the `kind`: they are put into the new one first.
///
/// # Errors
/// [`FormatError::Write`]; what was there before is still there then, or the error names where it is.
pub fn replace_folder(beside: &Path, place: &Path, kind: &FolderKind) -> Result<(), FormatError> {
    let replace = || -> io::Result<()> {
        keep_foreign(beside, place, kind)?;
        let_all_read(beside, 0o755)?;
        // A folder cannot be renamed over a full one: the old one steps aside first.
        let aside = tempfile::Builder::new()
            .prefix(".replaced-")
            .tempdir_in(parent(place))?;
        let old = aside.path().join("old");
        match fs::rename(place, &old) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let Err(error) = fs::rename(beside, place) else {
            return Ok(());
        };
        // The old one is put back.
        if old.exists() && fs::rename(&old, place).is_err() {
            let kept = aside.keep().join("old");
            let reason = format!("{error}; what was there before is now {}", kept.display());
            return Err(io::Error::new(error.kind(), reason));
        }
        Err(error)
    };
    replace().map_err(|error| FormatError::unwritten(place, error))
}

/// Whether [`StagedFolder`] would take this place: asked before work that takes long.
///
/// # Errors
/// [`FormatError::ForeignFolder`] when it would not, [`FormatError::File`] when it cannot be told.
pub fn check_folder(path: &Path, kind: &FolderKind) -> Result<(), FormatError> {
    let unreadable = |error: io::Error| FormatError::File {
        reason: format!("could not look into the folder: {error}"),
        path: path.to_path_buf(),
    };
    let mut entries = match fs::read_dir(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        entries => entries.map_err(unreadable)?,
    };
    if entries.next().is_some() && !kind.known_by.iter().any(|marker| path.join(marker).is_file()) {
        return Err(FormatError::ForeignFolder {
            markers: kind.known_by.join(" or "),
            path: path.to_path_buf(),
        });
    }
    Ok(())
}

/// Puts the files of `place` that are not of `kind` into `beside` too: by another link to the same file, or as a copy.
fn keep_foreign(beside: &Path, place: &Path, kind: &FolderKind) -> io::Result<()> {
    let mut folders = vec![PathBuf::new()];
    while let Some(folder) = folders.pop() {
        let entries = match fs::read_dir(place.join(&folder)) {
            // There is none, or it is gone meanwhile: nothing of it is left to keep.
            Err(error) if error.kind() == ErrorKind::NotFound => continue,
            entries => entries?,
        };
        for entry in entries {
            let entry = entry?;
            let name = folder.join(entry.file_name());
            let (old, new) = (entry.path(), beside.join(&name));
            // A link to a folder is a file here.
            if entry.file_type()?.is_dir() {
                folders.push(name);
            } else if !kind.has(&name) {
                fs::create_dir_all(parent(&new))?;
                // A replacement that was interrupted may have left an older version there.
                match fs::remove_file(&new) {
                    Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
                    _ => {}
                }
                match fs::hard_link(&old, &new).or_else(|_| fs::copy(&old, &new).map(drop)) {
                    Err(_) if fs::symlink_metadata(&old).is_err() => {}
                    kept => kept?,
                }
            }
        }
    }
    Ok(())
}

fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// Temporary files are for their owner alone; what we write is as readable as any new file.
#[cfg(unix)]
fn let_all_read(path: &Path, mode: u32) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(path, fs::Permissions::from_mode(mode))
}

#[cfg(not(unix))]
fn let_all_read(_path: &Path, _mode: u32) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const KIND: FolderKind = FolderKind {
        known_by: &["mark"],
        files: &["mark", "old", "sub/deep", "shard-#.tar"],
    };

    fn files(names: &[&str]) -> BTreeMap<String, Vec<u8>> {
        names
            .iter()
            .map(|&name| (name.to_owned(), name.as_bytes().to_vec()))
            .collect()
    }

    /// Every file of a folder by its path inside it.
    fn read_folder(path: &Path) -> BTreeMap<String, Vec<u8>> {
        let mut files = BTreeMap::new();
        let mut folders = vec![path.to_path_buf()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
                if entry.is_dir() {
                    folders.push(entry);
                } else {
                    let name = entry.strip_prefix(path).unwrap().to_str().unwrap().to_owned();
                    files.insert(name, fs::read(&entry).unwrap());
                }
            }
        }
        files
    }

    #[test]
    fn a_folder_is_replaced_whole_and_leaves_nothing_beside_it() {
        let above = tempfile::tempdir().unwrap();
        let path = above.path().join("new/bundle");
        write_folder(&path, &KIND, &files(&["mark", "old", "sub/deep"])).unwrap();
        assert_eq!(read_folder(&path), files(&["mark", "old", "sub/deep"]));
        write_folder(&path, &KIND, &files(&["mark", "new"])).unwrap();
        assert_eq!(read_folder(&path), files(&["mark", "new"]));
        assert_eq!(fs::read_dir(above.path().join("new")).unwrap().count(), 1);
    }

    #[test]
    fn a_folder_of_another_kind_is_left_alone() {
        let above = tempfile::tempdir().unwrap();
        let path = above.path().join("mine");
        fs::create_dir(&path).unwrap();
        fs::write(path.join("thesis"), "thesis").unwrap();
        let error = write_folder(&path, &KIND, &files(&["mark"])).unwrap_err();
        assert!(error.to_string().contains("holds no mark"), "{error}");
        assert_eq!(read_folder(&path), files(&["thesis"]));
    }

    #[test]
    fn files_that_are_not_ours_stay_in_a_folder_that_is_replaced() {
        let above = tempfile::tempdir().unwrap();
        let path = above.path().join("cover");
        write_folder(&path, &KIND, &files(&["mark", "old", "shard-000001.tar"])).unwrap();
        fs::create_dir_all(path.join("sub/mine")).unwrap();
        for name in ["art.jpg", "sub/mine/notes.txt", "shard-a.tar", "sub/deep"] {
            fs::write(path.join(name), name).unwrap();
        }
        write_folder(&path, &KIND, &files(&["mark"])).unwrap();
        assert_eq!(
            read_folder(&path),
            files(&["art.jpg", "mark", "shard-a.tar", "sub/mine/notes.txt"])
        );
        assert_eq!(fs::read_dir(above.path()).unwrap().count(), 1);
    }

    #[test]
    fn the_newest_file_that_is_not_ours_is_kept() {
        let above = tempfile::tempdir().unwrap();
        let (beside, place) = (above.path().join("set.partial"), above.path().join("set"));
        // A replacement that was killed has left an older version of the notes beside.
        for (folder, notes) in [(&beside, "old"), (&place, "new")] {
            fs::create_dir(folder).unwrap();
            fs::write(folder.join("mark"), notes).unwrap();
            fs::write(folder.join("notes.txt"), notes).unwrap();
        }
        replace_folder(&beside, &place, &KIND).unwrap();
        assert_eq!(fs::read_to_string(place.join("notes.txt")).unwrap(), "new");
        assert_eq!(fs::read_to_string(place.join("mark")).unwrap(), "old");
    }

    #[test]
    fn a_folder_that_is_not_finished_leaves_nothing() {
        let above = tempfile::tempdir().unwrap();
        let staged = StagedFolder::new(&above.path().join("shards"), &KIND).unwrap();
        fs::write(staged.path().join("half"), "half").unwrap();
        drop(staged);
        assert_eq!(fs::read_dir(above.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_file_is_replaced_and_leaves_nothing_beside_it() {
        let above = tempfile::tempdir().unwrap();
        let path = above.path().join("a/report.json");
        for content in [b"one", b"two"] {
            write_file(&path, content).unwrap();
            assert_eq!(fs::read(&path).unwrap(), content);
        }
        assert_eq!(fs::read_dir(above.path().join("a")).unwrap().count(), 1);
    }
}
