//! Files and folders that are there whole or not at all.

use deepsft_formats::{FolderKind, FolderLock, FormatError, StagedFolder, recover_folder, write_file, write_folder};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

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
    let place = above.path().join("set");
    let staged = StagedFolder::resume(&place, &KIND, &["state"]).unwrap();
    // A replacement that was killed has left an older version of the notes beside.
    fs::create_dir(&place).unwrap();
    for (folder, notes) in [(staged.path(), "old"), (&place, "new")] {
        fs::write(folder.join("mark"), notes).unwrap();
        fs::write(folder.join("notes.txt"), notes).unwrap();
    }
    staged.commit().unwrap();
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
fn the_beginning_of_a_folder_that_can_be_resumed_stays_and_a_foreign_one_is_left_alone() {
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("set");
    let resume = || StagedFolder::resume(&place, &KIND, &["state"]);
    let staged = resume().unwrap();
    assert!(matches!(resume(), Err(FormatError::Locked { .. })));
    staged.write("state", b"state").unwrap();
    drop(staged);
    assert_eq!(read_folder(resume().unwrap().path()), files(&["state"]));
    fs::rename(
        above.path().join("set.partial/state"),
        above.path().join("set.partial/thesis"),
    )
    .unwrap();
    let error = resume().unwrap_err().to_string();
    assert!(
        error.contains("set.partial") && error.contains("holds no state"),
        "{error}"
    );
    let left = read_folder(&above.path().join("set.partial"));
    assert_eq!(
        left.into_iter().collect::<Vec<_>>(),
        [("thesis".to_owned(), b"state".to_vec())]
    );
}

#[test]
fn what_a_killed_process_left_beside_the_place_goes_and_what_it_put_aside_comes_back() {
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("cover");
    // Killed while it filled the folder, and between two renames.
    for (name, file) in [(".cover.partial", "half"), (".cover.replaced", "mark")] {
        fs::create_dir(above.path().join(name)).unwrap();
        fs::write(above.path().join(name).join(file), "old").unwrap();
    }
    let staged = StagedFolder::new(&place, &KIND).unwrap();
    assert_eq!(fs::read_to_string(place.join("mark")).unwrap(), "old");
    staged.filled(&files(&["mark"])).unwrap().commit().unwrap();
    assert_eq!(read_folder(&place), files(&["mark"]));
    assert_eq!(fs::read_dir(above.path()).unwrap().count(), 1);
    // One that was not removed in time is outdated.
    fs::create_dir(above.path().join(".cover.replaced")).unwrap();
    recover_folder(&place).unwrap();
    assert_eq!(read_folder(&place), files(&["mark"]));
    assert_eq!(fs::read_dir(above.path()).unwrap().count(), 1);
}

#[test]
fn a_folder_that_is_begun_cannot_be_begun_by_another() {
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("cover");
    let staged = StagedFolder::new(&place, &KIND).unwrap();
    assert!(matches!(
        StagedFolder::new(&place, &KIND),
        Err(FormatError::Locked { .. })
    ));
    staged.filled(&files(&["mark"])).unwrap().commit().unwrap();
    let alone = FolderLock::acquire(&place).unwrap();
    assert!(matches!(
        write_folder(&place, &KIND, &files(&["mark"])),
        Err(FormatError::Locked { .. })
    ));
    // Who holds the lock can.
    let staged = StagedFolder::under(&alone, &place, &KIND).unwrap();
    staged.filled(&files(&["mark", "old"])).unwrap().commit().unwrap();
    drop(alone);
    assert_eq!(read_folder(&place), files(&["mark", "old"]));
    assert_eq!(fs::read_dir(above.path()).unwrap().count(), 1);
}

#[cfg(any(target_os = "linux", target_os = "macos"))]
#[test]
fn a_folder_that_is_replaced_is_there_at_every_moment() {
    use std::sync::atomic::{AtomicBool, Ordering};
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("cover");
    write_folder(&place, &KIND, &files(&["mark"])).unwrap();
    let ends = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let looks = scope.spawn(|| {
            let mut looks = 0;
            while !ends.load(Ordering::Relaxed) {
                assert!(place.join("mark").is_file(), "it was away after {looks} looks");
                looks += 1;
            }
            looks
        });
        for _ in 0..300 {
            write_folder(&place, &KIND, &files(&["mark", "old"])).unwrap();
        }
        ends.store(true, Ordering::Relaxed);
        assert!(looks.join().unwrap() > 0);
    });
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
