//! One process per folder.

use deepsft_formats::{FolderLock, FormatError};
use std::fs;

#[test]
fn a_folder_is_locked_once_and_nothing_stays_beside_it() {
    let above = tempfile::tempdir().unwrap();
    let folder = above.path().join("new/data");
    let lock = FolderLock::acquire(&folder).unwrap();
    let error = FolderLock::acquire(&folder).unwrap_err();
    assert!(
        matches!(&error, FormatError::Locked { path } if path.ends_with("new/data")),
        "{error}"
    );
    // Another folder beside it is another lock.
    FolderLock::acquire(&above.path().join("new/data-2")).unwrap();
    drop(lock);
    assert_eq!(fs::read_dir(above.path().join("new")).unwrap().count(), 0);
    FolderLock::acquire(&folder).unwrap();
}

#[test]
fn many_processes_that_take_turns_are_never_two_at_once() {
    use std::sync::atomic::{AtomicU32, Ordering};
    let above = tempfile::tempdir().unwrap();
    let folder = above.path().join("data");
    let (inside, turns) = (AtomicU32::new(0), AtomicU32::new(0));
    // Locks belong to open files: threads stand for processes.
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                while turns.load(Ordering::SeqCst) < 200 {
                    if let Ok(lock) = FolderLock::acquire(&folder) {
                        assert_eq!(inside.fetch_add(1, Ordering::SeqCst), 0);
                        turns.fetch_add(1, Ordering::SeqCst);
                        inside.fetch_sub(1, Ordering::SeqCst);
                        drop(lock);
                    }
                }
            });
        }
    });
}
