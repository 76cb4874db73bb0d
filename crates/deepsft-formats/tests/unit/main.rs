//! One module for each format whose public functions it tests.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[cfg(feature = "scan")]
mod assembly;
#[cfg(feature = "fs")]
mod atomic;
#[cfg(feature = "scan")]
mod baking;
mod camera;
#[cfg(feature = "exif")]
mod exif;
#[cfg(feature = "cameras")]
mod foreign_camera;
mod glb;
#[cfg(feature = "scan")]
mod gltf;
#[cfg(feature = "fs")]
mod lock;
mod npy;
mod obj;
mod picture;
#[cfg(feature = "scan")]
mod ply;
#[cfg(all(feature = "fs", feature = "scan"))]
mod scan_folder;
#[cfg(feature = "scan")]
mod scanned_obj;
mod template;
