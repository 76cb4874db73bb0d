//! Data sets on disk: WebDataset-style tar shards, and the `dataset.json` that describes them.
//!
//! A shard holds four entries for each sample, `NNNNNN` being its number within the shard:
//!
//! | entry | content |
//! |---|---|
//! | `NNNNNN.rgb.png` | the picture, 8-bit RGB |
//! | `NNNNNN.depth.png` | depth, 16-bit grey, in tenths of a millimetre; 0 is outside the object |
//! | `NNNNNN.uv.png` | registration, 16-bit RGB: u and v times 65535 in red and green; blue is 65535 on the object and 0 outside, where red and green are 0 too |
//! | `NNNNNN.json` | seed, index, has_template, camera, towards_light, vertices_camera (mm) |
//!
//! So depth comes back within 0.05 mm and registration within 1 / 131070.

#[cfg(feature = "fs")]
mod dataset_folder;
mod description;
mod edge_lengths;
#[cfg(feature = "fs")]
mod index;
#[cfg(feature = "fs")]
mod part;
mod reader;
mod sample;
mod writer;

#[cfg(feature = "fs")]
pub use dataset_folder::{DATASET_FILE, DatasetFolder, dataset_parts, write_shards};
pub use description::{DatasetDescription, EdgeLengthSummary, ShapeCounts};
pub use edge_lengths::{EdgeLengthChange, EdgeLengthHistogram};
#[cfg(feature = "fs")]
pub use index::IndexedShards;
#[cfg(feature = "fs")]
pub use part::DatasetPart;
pub use reader::ShardReader;
pub use sample::{EncodedSample, Sample, SampleRecord};
pub use writer::{ShardWriter, write_shard};

/// Units of `depth.png` in a millimetre.
const DEPTH_UNITS_PER_MM: f32 = 10.0;

/// Value of 1 in `uv.png`.
const UV_ONE: f32 = 65535.0;

/// Endings of a sample's entries.
const PARTS: [&str; 4] = ["rgb.png", "depth.png", "uv.png", "json"];
