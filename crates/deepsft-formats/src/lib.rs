#![doc = include_str!("../README.md")]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod camera;
mod error;
#[cfg(feature = "exif")]
mod exif;
mod fingerprint;
#[cfg(feature = "fs")]
mod folder;
mod foreign;
#[cfg(feature = "cameras")]
mod foreign_camera;
mod glb;
mod npy;
mod obj;
mod picture;
mod reasons;
#[cfg(feature = "scan")]
mod scan;
mod template;

pub use camera::{CAMERA_FILE, CameraFile, camera_from_json, camera_to_json};
pub use error::FormatError;
#[cfg(feature = "exif")]
pub use exif::camera_from_exif;
#[cfg(feature = "fs")]
pub use fingerprint::sha256_file;
pub use fingerprint::{fingerprint, picture_fingerprint, sha256, template_fingerprint};
#[cfg(all(feature = "fs", feature = "scan"))]
pub use folder::read_scan_file;
#[cfg(feature = "fs")]
pub use folder::{
    FolderKind, FolderLock, StagedFolder, check_folder, pictures_in, read_camera, read_template, recover_folder,
    unfinished_folder, write_file, write_folder,
};
pub use foreign::guarded;
#[cfg(feature = "cameras")]
pub use foreign_camera::camera_from_foreign;
pub use glb::mesh_to_glb;
pub use npy::{bool_npy, f32_npy, f32_npy_header, rows_from_npy};
pub use obj::{mesh_from_obj, mesh_to_obj};
pub use picture::{
    MAX_PICTURE_SIDE_PX, decode_as_stored, decode_image, decode_photograph, decode_picture, encode_jpeg, encode_pixels,
    encode_png, is_picture,
};
pub use reasons::{json_reason, read_error, write_error};
#[cfg(feature = "scan")]
pub use scan::{Scan, ScanPart, ScannedTemplate, Wrap, assemble_scan, mesh_vertices, read_scan};
pub use template::{TEMPLATE_FILE, TEXTURE_FILE, TemplateFile, template_to_files};
