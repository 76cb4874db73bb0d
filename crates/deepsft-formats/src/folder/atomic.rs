//! Files and folders that are there whole or not at all: written beside their place, then renamed.

use super::{FolderKind, FolderLock};
use crate::error::FormatError;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// How the names of files begin that are being written.
const UNFINISHED_FILE: &str = ".unfinished-";

/// Writes a file. Folders above it are made as needed; an older file of the name is replaced.
///
/// # Errors
/// [`FormatError::Write`]; what was there before is still there then.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), FormatError> {
    let write = || -> io::Result<()> {
        let folder = parent(path);
        fs::create_dir_all(folder)?;
        let mut beside = tempfile::Builder::new().prefix(UNFINISHED_FILE).tempfile_in(folder)?;
        // By the file itself: errors would name its path, which nobody knows.
        beside.as_file_mut().write_all(bytes)?;
        beside.as_file().sync_all()?;
        let_all_read(beside.path(), 0o644)?;
        beside.persist(path)?;
        Ok(())
    };
    write().map_err(|error| FormatError::unwritten(path, error))
}

/// Removes what [`write_file`] was writing into `folder` when its process was killed. For folders that nobody else writes into
/// meanwhile.
///
/// # Errors
/// [`FormatError::Write`].
pub fn remove_unfinished_files(folder: &Path) -> Result<(), FormatError> {
    let remove = || -> io::Result<()> {
        let entries = match fs::read_dir(folder) {
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
            entries => entries?,
        };
        for entry in entries {
            let entry = entry?;
            if entry.file_name().to_string_lossy().starts_with(UNFINISHED_FILE) {
                fs::remove_file(entry.path())?;
            }
        }
        Ok(())
    };
    remove().map_err(|error| FormatError::unwritten(folder, error))
}

/// Writes a folder of `files` as [`StagedFolder`] does.
///
/// # Errors
/// As [`StagedFolder::new`] and [`StagedFolder::commit`].
pub fn write_folder(path: &Path, kind: &FolderKind, files: &BTreeMap<String, Vec<u8>>) -> Result<(), FormatError> {
    StagedFolder::new(path, kind)?.filled(files)?.commit()
}

/// A folder that is filled beside its place and put there whole by [`StagedFolder::commit`]; dropped
/// without that, nothing of it stays.
///
/// A folder that stands there already is replaced if it is of the same kind or empty; anything else is somebody's own and
/// stays as it is. Files in it that are not of the kind stay too. Until then no other process can begin the same folder. One
/// that is killed leaves what it made as `.NAME.partial` beside the place; the next one to begin the folder removes it.
#[derive(Debug)]
pub struct StagedFolder {
    place: PathBuf,
    beside: Beside,
    kind: FolderKind,
    /// If this is its own and not its user's.
    _alone: Option<FolderLock>,
}

/// The folder beside the place; removed when this is dropped.
#[derive(Debug)]
struct Beside(PathBuf);

impl Drop for Beside {
    fn drop(&mut self) {
        // After a commit it is not there any more.
        let _ = fs::remove_dir_all(&self.0);
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
        let staged = Self::under(&alone, place, kind)?;
        Ok(Self {
            _alone: Some(alone),
            ..staged
        })
    }

    /// As [`StagedFolder::new`], of a folder that its user has locked: `alone` is that lock, and has to outlive it.
    ///
    /// # Errors
    /// [`FormatError::ForeignFolder`] for a folder of another kind, [`FormatError::Write`].
    pub fn under(_alone: &FolderLock, place: &Path, kind: &FolderKind) -> Result<Self, FormatError> {
        check_folder(place, kind)?;
        recover_folder(place)?;
        let beside = hidden(place, "partial");
        let begin = || -> io::Result<()> {
            fs::create_dir_all(parent(place))?;
            remove_if_there(&beside)?;
            fs::create_dir(&beside)
        };
        begin().map_err(|error| FormatError::unwritten(place, error))?;
        Ok(Self {
            beside: Beside(beside),
            place: place.to_path_buf(),
            kind: *kind,
            _alone: None,
        })
    }

    /// Where to put its files meanwhile.
    pub fn path(&self) -> &Path {
        &self.beside.0
    }

    /// Writes `files` into it.
    ///
    /// # Errors
    /// [`FormatError::Write`].
    pub fn filled(self, files: &BTreeMap<String, Vec<u8>>) -> Result<Self, FormatError> {
        for (name, bytes) in files {
            let file = self.path().join(name);
            let write = || -> io::Result<()> {
                fs::create_dir_all(parent(&file))?;
                let mut file = fs::File::create(&file)?;
                file.write_all(bytes)?;
                file.sync_all()
            };
            write().map_err(|error| FormatError::unwritten(&self.place.join(name), error))?;
        }
        Ok(self)
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
    pub fn commit(mut self) -> Result<(), FormatError> {
        // From here on it is not this that removes it.
        let beside = std::mem::take(&mut self.beside.0);
        replace_folder(&beside, &self.place, &self.kind).map_err(|error| {
            let reason = match error {
                FormatError::Write { reason, .. } => reason,
                other => other.to_string(),
            };
            let kept = keep(&beside).unwrap_or(beside);
            FormatError::Write {
                reason: format!("{reason}; what was made is now {}", kept.display()),
                path: self.place,
            }
        })
    }
}

/// Renames a folder to a name that is free and that nobody removes; returns it.
fn keep(folder: &Path) -> io::Result<PathBuf> {
    let kept = tempfile::Builder::new().prefix(".kept-").tempdir_in(parent(folder))?;
    let place = kept.path().join("folder");
    fs::rename(folder, &place)?;
    let _ = kept.keep();
    Ok(place)
}

/// Renames the folder `beside` to `place`, both in one folder. An older one there is removed, but for its files that are
/// not of the `kind`: they are put into the new one first. Where the system can exchange two folders (Linux and macOS, on most file
/// systems), one of them stands at `place` at any moment. Elsewhere [`recover_folder`] brings the older one back when the process was
/// killed between two renames.
///
/// # Errors
/// [`FormatError::Write`]; what was there before is still there then, or the error names where it is.
pub fn replace_folder(beside: &Path, place: &Path, kind: &FolderKind) -> Result<(), FormatError> {
    let replace = || -> io::Result<()> {
        keep_foreign(beside, place, kind)?;
        let_all_read(beside, 0o755)?;
        if exchange(beside, place).is_ok() {
            // What stays of the old one is in nobody's way, and goes the next time.
            let _ = fs::remove_dir_all(beside);
            return Ok(());
        }
        // A folder cannot be renamed over a full one: the old one steps aside first.
        let old = hidden(place, "replaced");
        remove_if_there(&old)?;
        match fs::rename(place, &old) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let Err(error) = fs::rename(beside, place) else {
            let _ = fs::remove_dir_all(&old);
            return Ok(());
        };
        // The old one is put back.
        if old.exists() && fs::rename(&old, place).is_err() {
            let reason = format!("{error}; what was there before is now {}", old.display());
            return Err(io::Error::new(error.kind(), reason));
        }
        Err(error)
    };
    replace().map_err(|error| FormatError::unwritten(place, error))
}

/// Finishes a [`replace_folder`] whose process was killed: the folder that it had put aside comes back if none is at `place`, else
/// it goes. For who has locked the folder.
///
/// # Errors
/// [`FormatError::Write`].
pub fn recover_folder(place: &Path) -> Result<(), FormatError> {
    let old = hidden(place, "replaced");
    let recover = || match place.exists() || !old.exists() {
        true => remove_if_there(&old),
        false => fs::rename(&old, place),
    };
    recover().map_err(|error| FormatError::unwritten(place, error))
}

fn remove_if_there(folder: &Path) -> io::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Exchanges two folders in one step, where system and file system can do that.
#[cfg(any(target_os = "linux", target_os = "macos"))]
fn exchange(one: &Path, other: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE)?)
}

#[cfg(not(any(target_os = "linux", target_os = "macos")))]
fn exchange(_one: &Path, _other: &Path) -> io::Result<()> {
    Err(ErrorKind::Unsupported.into())
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
    let unreadable =
        |error: io::Error| FormatError::unreadable(path, format!("could not look into the folder: {error}"));
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

/// Waits until the names of the files in `folder` are on the disk. It does nothing where a folder cannot be opened as a file
/// (outside of Unix) or its file system cannot wait for folders.
///
/// # Errors
/// What the system says.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    let here = folder.as_os_str().is_empty();
    let folder = fs::File::open(if here { Path::new(".") } else { folder })?;
    folder.sync_all().or_else(|error| match error.kind() {
        // EINVAL and EOPNOTSUPP of file systems that do not offer it, as some of the network.
        ErrorKind::InvalidInput | ErrorKind::Unsupported => Ok(()),
        _ => Err(error),
    })
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
