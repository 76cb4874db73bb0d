//! One module for each format whose public functions it tests.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[cfg(feature = "scan")]
mod assembly;
#[cfg(feature = "fs")]
mod atomic;
mod camera;
#[cfg(all(feature = "shards", feature = "fs"))]
mod dataset_folder;
#[cfg(feature = "shards")]
mod edge_lengths;
#[cfg(feature = "exif")]
mod exif;
mod glb;
#[cfg(feature = "scan")]
mod gltf;
#[cfg(feature = "fs")]
mod lock;
mod npy;
mod obj;
#[cfg(all(feature = "shards", feature = "fs"))]
mod part;
mod picture;
#[cfg(feature = "scan")]
mod scanned_obj;
mod template;
