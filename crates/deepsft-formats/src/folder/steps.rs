//! Steps on the disk, before each of which a test can end the process.

use std::io;

/// Takes a step that changes the disk.
pub(super) fn step<T>(step: impl FnOnce() -> io::Result<T>) -> io::Result<T> {
    #[cfg(test)]
    kill::before_step()?;
    step()
}

/// A kill: from the chosen step on nothing changes the disk any more.
#[cfg(test)]
pub(super) mod kill {
    use std::cell::Cell;
    use std::path::Path;
    use std::{fs, io};

    thread_local! {
        /// Steps until the process of this thread is killed.
        static LEFT: Cell<usize> = const { Cell::new(usize::MAX) };
        /// Whether this thread's file system cannot exchange two folders.
        pub static CANNOT_EXCHANGE: Cell<bool> = const { Cell::new(false) };
    }

    /// Removes a file of `folder`, as a kill may leave a folder that is being removed.
    pub fn remove_one_file(folder: &Path) -> io::Result<()> {
        let mut paths = fs::read_dir(folder)
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.path());
        paths.find(|path| path.is_file()).map_or(Ok(()), fs::remove_file)
    }

    /// Runs `process` and kills it before step number `step`; returns whether it came that far.
    pub fn at_step(step: usize, process: impl FnOnce()) -> bool {
        LEFT.set(step);
        process();
        LEFT.replace(usize::MAX) == 0
    }

    pub fn before_step() -> io::Result<()> {
        match LEFT.get() {
            0 => Err(io::Error::other("killed")),
            left => {
                LEFT.set(left - 1);
                Ok(())
            }
        }
    }
}
