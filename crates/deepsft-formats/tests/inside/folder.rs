//! A process that is killed before any of its steps on the disk.

use super::file::entries;
use super::steps::kill::{self, CANNOT_EXCHANGE};
use super::{FolderKind, StagedFolder, recover_folder, write_folder};
use crate::error::FormatError;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

const KIND: FolderKind = FolderKind {
    known_by: &["mark"],
    files: &["mark", "first", "second", "state"],
};

/// The files of a folder; `None` where there is none.
fn read(folder: &Path) -> Option<BTreeMap<String, String>> {
    let entries = fs::read_dir(folder).ok()?.map(|entry| entry.unwrap().path());
    let name = |path: &Path| path.file_name().unwrap().to_str().unwrap().to_owned();
    let files = entries.map(|path| (name(&path), fs::read_to_string(&path).unwrap()));
    Some(files.collect())
}

/// Kills `process` before each of its steps over an older folder with a file of somebody's own, and runs it again. The
/// older folder or the new one is whole after the kill, the new one after the second run, with nothing beside it.
fn holds_at_every_step(process: impl Fn(&Path, bool) -> Result<(), FormatError>) {
    let files = |of_process: &[&str], text: &str| {
        let files = of_process
            .iter()
            .map(|&name| (name, text))
            .chain([("notes.txt", "mine")]);
        files
            .map(|(name, text)| (name.to_owned(), text.to_owned()))
            .collect::<BTreeMap<_, _>>()
    };
    let older = files(&["mark", "first"], "old");
    let newer = files(&["mark", "first", "second"], "new");
    for cannot_exchange in [false, true] {
        CANNOT_EXCHANGE.set(cannot_exchange);
        let mut steps = 0;
        loop {
            let above = tempfile::tempdir().unwrap();
            let place = above.path().join("cover");
            fs::create_dir(&place).unwrap();
            older
                .iter()
                .for_each(|(name, text)| fs::write(place.join(name), text).unwrap());
            let mut told = None;
            let killed = kill::at_step(steps, || told = process(&place, false).err());
            let told = told.map_or(String::new(), |error| error.to_string());
            let is_there = fs::read_to_string(place.join("second")).is_ok();
            let says_so = told.is_empty() || told.contains("it is in its place");
            assert_eq!(says_so, is_there, "step {steps}: {told}");
            let found = |what: &str| format!("{what}, killed before step {steps}, {:?}", read(&place));
            recover_folder(&place).unwrap();
            let mut there = read(&place).unwrap();
            // It goes last.
            there.remove("state");
            assert!(there == older || there == newer, "{}", found("half of a folder"));
            process(&place, true).unwrap();
            assert_eq!(read(&place).unwrap(), newer, "{}", found("not the new one"));
            let left = entries(above.path()).unwrap();
            let names: Vec<_> = left.iter().map(fs::DirEntry::file_name).collect();
            assert_eq!(names, ["cover"], "{}", found("something beside it"));
            if !killed {
                break;
            }
            steps += 1;
        }
        assert!(steps > 12, "{steps}");
    }
    CANNOT_EXCHANGE.set(false);
}

#[test]
fn a_folder_is_old_or_new_at_whatever_step_its_process_is_killed() {
    let files = ["mark", "first", "second"].map(|name| (name.to_owned(), b"new".to_vec()));
    let files = BTreeMap::from(files);
    holds_at_every_step(|place, _| write_folder(place, &KIND, &files));
}

#[test]
fn a_folder_that_can_be_resumed_keeps_what_was_made_at_whatever_step_its_process_is_killed() {
    let made = Cell::new(0);
    holds_at_every_step(|place, again| {
        let there = |name: &str| fs::read_to_string(place.join(name)).is_ok_and(|text| text == "new");
        if again && there("mark") {
            // The first process ended too late to be killed; what it left goes with the next folder.
            return StagedFolder::resume(place, &KIND, &["state"]).map(|staged| {
                fs::remove_dir_all(staged.path()).unwrap();
            });
        }
        if !again {
            made.set(0);
        }
        let staged = StagedFolder::resume(place, &KIND, &["state"])?;
        let whole = |name: &str| staged.path().join(name).is_file();
        let files = ["state", "first", "second", "mark"];
        assert!(files[..made.get()].iter().all(|name| whole(name)), "made anew");
        for (number, name) in files.into_iter().enumerate() {
            if !whole(name) {
                staged.write(name, b"new")?;
                made.set(number + 1);
            }
        }
        staged.commit()
    });
}
