//! Files and folders of the disk.

mod file;
mod kind;
mod lock;
mod reading;
mod staged_folder;
mod steps;
#[cfg(test)]
#[path = "../../tests/inside/folder.rs"]
mod tests;

pub use file::write_file;
pub use kind::FolderKind;
pub use lock::FolderLock;
#[cfg(feature = "scan")]
pub use reading::read_scan_file;
pub use reading::{pictures_in, read_camera, read_template};
pub use staged_folder::{StagedFolder, check_folder, recover_folder, unfinished_folder, write_folder};
