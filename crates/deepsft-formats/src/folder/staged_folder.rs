//! Folders that are there whole or not at all: filled beside their place, then exchanged with what stands there.

use super::file::{entries, let_all_read, or_absent, parent, remove_unfinished, sync_names, write};
#[cfg(test)]
use super::steps::kill;
use super::steps::step;
use super::{FolderKind, FolderLock};
use crate::error::FormatError;
use crate::reasons::write_error;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Writes a folder of `files` as [`StagedFolder`] does.
///
/// # Errors
/// As [`StagedFolder::new`] and [`StagedFolder::commit`].
pub fn write_folder(path: &Path, kind: &FolderKind, files: &BTreeMap<String, Vec<u8>>) -> Result<(), FormatError> {
    StagedFolder::new(path, kind)?.filled(files)?.commit()
}

/// A folder that is filled beside its place and put there whole by [`StagedFolder::commit`].
///
/// It replaces a folder of the same kind, whose foreign files stay, or an empty one; anything else is somebody's own and
/// stays as it is. Until then no other process can begin the same folder. Dropped without a commit, nothing of it stays. A
/// process that is killed leaves what it made as `.NAME.partial` beside the place; the next one to begin the folder
/// removes it.
#[derive(Debug)]
pub struct StagedFolder {
    place: PathBuf,
    /// Where its files are meanwhile; none after a commit.
    beside: PathBuf,
    kind: FolderKind,
    /// Of a folder that can be resumed, the files by which its beginning is known.
    resumed_by: Option<&'static [&'static str]>,
    /// If this is its own and not its user's.
    _alone: Option<FolderLock>,
}

impl Drop for StagedFolder {
    fn drop(&mut self) {
        if self.resumed_by.is_none() && !self.beside.as_os_str().is_empty() {
            let _ = remove_folder(&self.beside);
        }
    }
}

impl StagedFolder {
    /// Begins the folder that is to stand at `place`.
    ///
    /// # Errors
    /// [`FormatError::Locked`] when another process makes it, [`FormatError::ForeignFolder`] for a folder of another kind,
    /// [`FormatError::Write`].
    pub fn new(place: &Path, kind: &FolderKind) -> Result<Self, FormatError> {
        check_folder(place, kind)?;
        let alone = FolderLock::acquire(place)?;
        let mut staged = Self::under(&alone, place, kind)?;
        staged._alone = Some(alone);
        Ok(staged)
    }

    /// Begins a folder whose lock `alone` the caller holds until the commit.
    ///
    /// # Errors
    /// [`FormatError::ForeignFolder`] for a folder of another kind, [`FormatError::Write`].
    pub fn under(_alone: &FolderLock, place: &Path, kind: &FolderKind) -> Result<Self, FormatError> {
        check_folder(place, kind)?;
        recover_folder(place)?;
        let beside = hidden(place, "partial");
        let begin = || -> io::Result<()> {
            step(|| fs::create_dir_all(parent(place)))?;
            remove_folder(&beside)?;
            step(|| fs::create_dir(&beside))
        };
        begin().map_err(|error| FormatError::unwritten(place, write_error(error)))?;
        Ok(Self {
            place: place.to_path_buf(),
            beside,
            kind: *kind,
            resumed_by: None,
            _alone: None,
        })
    }

    /// Begins the folder that is to stand at `place`, or resumes the one that an earlier process has begun.
    ///
    /// Until the commit it is `NAME.partial` beside the place, and it stays there when this is dropped. It is known by
    /// one of the files `resumed_by`, which the commit removes.
    ///
    /// # Errors
    /// Those of [`StagedFolder::new`]; [`FormatError::ForeignFolder`] also when `NAME.partial` is somebody's own.
    pub fn resume(place: &Path, kind: &FolderKind, resumed_by: &'static [&'static str]) -> Result<Self, FormatError> {
        check_folder(place, kind)?;
        let alone = FolderLock::acquire(place)?;
        recover_folder(place)?;
        let (beside, leaving) = (unfinished_folder(place), hidden(place, "partial"));
        let begun = |folder: &Path| resumed_by.iter().any(|name| folder.join(name).is_file());
        let unwritten = |error| FormatError::unwritten(&beside, write_error(error));
        let recover = || match begun(&leaving) && !beside.exists() {
            // Its process was killed while it came to its place.
            true => step(|| fs::rename(&leaving, &beside)),
            false => remove_folder(&leaving),
        };
        remove_files(place, resumed_by)
            .and_then(|()| recover())
            .and_then(|()| remove_unfinished(&beside))
            .map_err(unwritten)?;
        let known_by = resumed_by;
        check_folder(&beside, &FolderKind { known_by, ..*kind })?;
        step(|| fs::create_dir_all(&beside)).map_err(unwritten)?;
        Ok(Self {
            place: place.to_path_buf(),
            beside,
            kind: *kind,
            resumed_by: Some(resumed_by),
            _alone: Some(alone),
        })
    }

    /// Returns where its files are meanwhile.
    pub fn path(&self) -> &Path {
        &self.beside
    }

    /// Writes the file `name` into it, whole.
    ///
    /// # Errors
    /// [`FormatError::Write`] names the file by the folder's place.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), FormatError> {
        write(&self.beside.join(name), bytes)
            .map_err(|error| FormatError::unwritten(&self.place.join(name), write_error(error)))
    }

    /// Writes `files` into it.
    ///
    /// # Errors
    /// [`FormatError::Write`].
    pub fn filled(self, files: &BTreeMap<impl AsRef<str>, Vec<u8>>) -> Result<Self, FormatError> {
        (files.iter()).try_for_each(|(name, bytes)| self.write(name.as_ref(), bytes))?;
        Ok(self)
    }

    /// Puts the folder in another `place` beside the one it was begun for.
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
    /// [`FormatError::Write`] says where the new folder is. What was there before is still there then, unless the new folder
    /// came to its place and only its name may not be on the disk yet.
    pub fn commit(mut self) -> Result<(), FormatError> {
        // From here on it is not this that removes it.
        let beside = std::mem::take(&mut self.beside);
        let put = || -> io::Result<()> {
            let Some(resumed_by) = self.resumed_by else {
                return replace(&beside, &self.place, &self.kind);
            };
            // What stands there comes under a name that the next process removes.
            let leaving = hidden(&self.place, "partial");
            step(|| fs::rename(&beside, &leaving))?;
            if let Err(error) = replace(&leaving, &self.place, &self.kind) {
                let _ = step(|| fs::rename(&leaving, &beside));
                return Err(error);
            }
            // What stays is in nobody's way, and goes the next time.
            let _ = remove_files(&self.place, resumed_by);
            Ok(())
        };
        let reason = match put() {
            Ok(()) => match sync_names(parent(&self.place)) {
                Ok(()) => return Ok(()),
                Err(error) => format!("{error}; it is in its place, and a power cut might undo that"),
            },
            Err(error) => {
                let kept = match self.resumed_by {
                    Some(_) => beside,
                    None => keep(&beside).unwrap_or(beside),
                };
                format!("{error}; what was made is now {}", kept.display())
            }
        };
        Err(FormatError::unwritten(&self.place, reason))
    }
}

/// Renames a folder to a name that is free and that nobody removes; returns it.
fn keep(folder: &Path) -> io::Result<PathBuf> {
    let kept = step(|| tempfile::Builder::new().prefix(".kept-").tempdir_in(parent(folder)))?;
    let place = kept.path().join("folder");
    step(|| fs::rename(folder, &place))?;
    let _ = kept.keep();
    Ok(place)
}

/// Renames the folder `beside` to `place`, both in one folder. An older one there is removed, but for its files that are
/// not of the `kind`: they are put into the new one first. Where the system can exchange two folders (Linux and macOS, on most file
/// systems), one of them stands at `place` at any moment. Elsewhere [`recover_folder`] brings the older one back when the process was
/// killed between two renames. Everything is on the disk before it comes to its place, so that a power cut leaves no half of it.
/// An error says that `beside` is where it was.
fn replace(beside: &Path, place: &Path, kind: &FolderKind) -> io::Result<()> {
    keep_foreign(beside, place, kind)?;
    let_all_read(beside, 0o755)?;
    sync_names(beside)?;
    if step(|| exchange(beside, place)).is_ok() {
        // What stays of the old one is in nobody's way, and goes the next time.
        let _ = remove_folder(beside);
        return Ok(());
    }
    // A folder cannot be renamed over a full one: the old one steps aside first.
    let old = hidden(place, "replaced");
    remove_folder(&old)?;
    or_absent(step(|| fs::rename(place, &old)))?;
    if let Err(error) = step(|| fs::rename(beside, place)) {
        // The old one is put back.
        if old.exists() && step(|| fs::rename(&old, place)).is_err() {
            let reason = format!("{error}; what was there before is now {}", old.display());
            return Err(io::Error::new(error.kind(), reason));
        }
        return Err(error);
    }
    let _ = remove_folder(&old);
    Ok(())
}

/// Finishes a commit whose process was killed. The folder that it had put aside comes back if none is at `place`, else it goes.
/// The caller must hold the folder's lock.
///
/// # Errors
/// [`FormatError::Write`].
pub fn recover_folder(place: &Path) -> Result<(), FormatError> {
    let old = hidden(place, "replaced");
    let recover = || match place.exists() || !old.exists() {
        true => remove_folder(&old),
        false => step(|| fs::rename(&old, place)),
    };
    recover().map_err(|error| FormatError::unwritten(place, write_error(error)))
}

fn remove_files(folder: &Path, names: &[&str]) -> io::Result<()> {
    let mut files = names.iter().map(|name| folder.join(name));
    files.try_for_each(|file| or_absent(step(|| fs::remove_file(file))))
}

fn remove_folder(folder: &Path) -> io::Result<()> {
    // A kill may leave a part of it.
    #[cfg(test)]
    step(|| kill::remove_one_file(folder))?;
    or_absent(step(|| fs::remove_dir_all(folder)))
}

/// Exchanges two folders in one step, where system and file system can do that.
#[cfg(any(target_os = "linux", target_os = "macos"))]
fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    #[cfg(test)]
    if kill::CANNOT_EXCHANGE.get() {
        return Err(io::ErrorKind::Unsupported.into());
    }
    Ok(renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE)?)
}

#[cfg(not(any(target_os = "linux", target_os = "macos")))]
fn exchange(_one: &Path, _other: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Returns where a folder is made that can be resumed and is to stand at `place`: `NAME.partial`.
pub fn unfinished_folder(place: &Path) -> PathBuf {
    let mut name = place.file_name().map_or_else(OsString::new, OsString::from);
    name.push(".partial");
    place.with_file_name(name)
}

/// The hidden name beside `place` for what is no result: `.NAME.ENDING`.
fn hidden(place: &Path, ending: &str) -> PathBuf {
    let name = place.file_name().unwrap_or_default().to_string_lossy();
    parent(place).join(format!(".{name}.{ending}"))
}

/// Whether [`StagedFolder`] would take this place: asked before work that takes long.
///
/// # Errors
/// [`FormatError::ForeignFolder`] when it would not, [`FormatError::File`] when it cannot be told.
pub fn check_folder(path: &Path, kind: &FolderKind) -> Result<(), FormatError> {
    if path.is_file() {
        let reason = "it is a file, and a folder is written: choose another name";
        return Err(FormatError::unreadable(path, reason));
    }
    let unreadable = |error| FormatError::unreadable(path, write_error(error));
    let is_empty = entries(path).map_err(unreadable)?.is_empty();
    if !is_empty && !kind.known_by.iter().any(|marker| path.join(marker).is_file()) {
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
        // Where there is none, or it is gone meanwhile, nothing of it is left to keep.
        for entry in entries(&place.join(&folder))? {
            let name = folder.join(entry.file_name());
            let (old, new) = (entry.path(), beside.join(&name));
            // A link to a folder is a file here.
            if entry.file_type()?.is_dir() {
                folders.push(name);
            } else if !kind.has(&name) {
                step(|| fs::create_dir_all(parent(&new)))?;
                // A replacement that was interrupted may have left an older version there.
                or_absent(step(|| fs::remove_file(&new)))?;
                match step(|| fs::hard_link(&old, &new).or_else(|_| fs::copy(&old, &new).map(drop))) {
                    Err(_) if fs::symlink_metadata(&old).is_err() => {}
                    kept => kept?,
                }
            }
        }
    }
    Ok(())
}
