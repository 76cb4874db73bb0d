//! Files and folders of the disk.

mod atomic;
mod camera;
mod kind;
mod lock;
#[cfg(feature = "scan")]
mod scan;
mod template;

pub use atomic::{
    StagedFolder, check_folder, recover_folder, remove_unfinished_files, replace_folder, sync_folder, write_file,
    write_folder,
};
pub use camera::read_camera;
pub use kind::FolderKind;
pub use lock::FolderLock;
#[cfg(feature = "scan")]
pub use scan::read_scan_file;
pub use template::read_template;
