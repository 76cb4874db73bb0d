//! Files and folders that are there whole or not at all: written beside their place, then renamed.

use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Writes a file. Folders above it are made as needed; an older file of the name is replaced.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    let write = || -> Result<()> {
        let folder = parent(path);
        fs::create_dir_all(folder)?;
        let mut beside = tempfile::NamedTempFile::new_in(folder)?;
        beside.write_all(bytes)?;
        beside.as_file().sync_all()?;
        share(beside.path(), 0o644)?;
        beside.persist(path)?;
        Ok(())
    };
    write().with_context(|| format!("could not write {}", path.display()))
}

/// Writes a folder of `files` as [`StagedFolder`] does.
pub fn write_folder(path: &Path, markers: &[&str], files: &BTreeMap<String, Vec<u8>>) -> Result<()> {
    let staged = StagedFolder::new(path, markers)?;
    for (name, bytes) in files {
        let file = staged.path().join(name);
        let write = || -> Result<()> {
            fs::create_dir_all(parent(&file))?;
            let mut file = fs::File::create(&file)?;
            file.write_all(bytes)?;
            Ok(file.sync_all()?)
        };
        write().with_context(|| format!("could not write {name} for {}", path.display()))?;
    }
    staged.commit()
}

/// A folder that is filled beside its place and put there whole by [`StagedFolder::commit`]; dropped
/// without that, nothing of it stays.
///
/// A folder that stands there already is replaced if it holds one of some `markers`, files by which its
/// kind is known, or nothing; anything else is somebody's own and stays as it is.
pub struct StagedFolder {
    place: PathBuf,
    beside: tempfile::TempDir,
}

impl StagedFolder {
    /// Begins the folder that is to stand at `place`.
    pub fn new(place: &Path, markers: &[&str]) -> Result<Self> {
        check_folder(place, markers)?;
        let begin = || -> Result<tempfile::TempDir> {
            fs::create_dir_all(parent(place))?;
            Ok(tempfile::Builder::new().prefix(".partial-").tempdir_in(parent(place))?)
        };
        let beside = begin().with_context(|| format!("could not write {}", place.display()))?;
        Ok(Self {
            place: place.to_path_buf(),
            beside,
        })
    }

    /// Where to put its files meanwhile.
    pub fn path(&self) -> &Path {
        self.beside.path()
    }

    /// Puts the folder in its place.
    pub fn commit(self) -> Result<()> {
        replace_folder(self.beside.path(), &self.place)
    }
}

/// Renames the folder `beside` to `place`, both in one folder; an older one there is removed.
pub fn replace_folder(beside: &Path, place: &Path) -> Result<()> {
    let replace = || -> Result<()> {
        share(beside, 0o755)?;
        // A folder cannot be renamed over a full one: the old one steps aside first.
        let aside = tempfile::Builder::new()
            .prefix(".replaced-")
            .tempdir_in(parent(place))?;
        let old = aside.path().join("old");
        match fs::rename(place, &old) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error.into()),
            _ => {}
        }
        let Err(error) = fs::rename(beside, place) else {
            return Ok(());
        };
        // The old one is put back.
        if old.exists() && fs::rename(&old, place).is_err() {
            let kept = aside.keep().join("old");
            return Err(error).context(format!("what was there before is now {}", kept.display()));
        }
        Err(error.into())
    };
    replace().with_context(|| format!("could not write {}", place.display()))
}

/// Whether [`StagedFolder`] would take this place: asked before work that takes long.
pub fn check_folder(path: &Path, markers: &[&str]) -> Result<()> {
    let mut entries = match fs::read_dir(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        entries => entries.with_context(|| format!("could not look into {}", path.display()))?,
    };
    if entries.next().is_some() && !markers.iter().any(|marker| path.join(marker).is_file()) {
        bail!(
            "{} exists and holds no {}: choose another folder, or remove it",
            path.display(),
            markers.join(" or ")
        );
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
fn share(path: &Path, mode: u32) -> Result<()> {
    use std::os::unix::fs::PermissionsExt;
    Ok(fs::set_permissions(path, fs::Permissions::from_mode(mode))?)
}

#[cfg(not(unix))]
fn share(_path: &Path, _mode: u32) -> Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

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
        write_folder(&path, &["mark"], &files(&["mark", "old", "sub/deep"])).unwrap();
        assert_eq!(read_folder(&path), files(&["mark", "old", "sub/deep"]));
        write_folder(&path, &["mark"], &files(&["mark", "new"])).unwrap();
        assert_eq!(read_folder(&path), files(&["mark", "new"]));
        assert_eq!(fs::read_dir(above.path().join("new")).unwrap().count(), 1);
    }

    #[test]
    fn a_folder_of_another_kind_is_left_alone() {
        let above = tempfile::tempdir().unwrap();
        let path = above.path().join("mine");
        write_folder(&path, &["thesis"], &files(&["thesis"])).unwrap();
        let error = write_folder(&path, &["mark"], &files(&["mark"])).unwrap_err();
        assert!(error.to_string().contains("holds no mark"), "{error}");
        assert_eq!(read_folder(&path), files(&["thesis"]));
    }

    #[test]
    fn a_folder_that_is_not_finished_leaves_nothing() {
        let above = tempfile::tempdir().unwrap();
        let staged = StagedFolder::new(&above.path().join("shards"), &["mark"]).unwrap();
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
