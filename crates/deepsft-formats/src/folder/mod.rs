//! Files and folders of the disk.

mod atomic;

pub use atomic::{StagedFolder, check_folder, replace_folder, write_file, write_folder};
