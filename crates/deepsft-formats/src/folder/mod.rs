//! Files and folders of the disk.

mod camera;
mod file;
mod kind;
mod lock;
#[cfg(feature = "scan")]
mod scan;
mod staged_folder;
mod steps;
mod template;
#[cfg(test)]
mod tests;

pub use camera::read_camera;
pub use file::write_file;
pub use kind::FolderKind;
pub use lock::FolderLock;
#[cfg(feature = "scan")]
pub use scan::read_scan_file;
pub use staged_folder::{StagedFolder, check_folder, recover_folder, unfinished_folder, write_folder};
pub use template::read_template;
