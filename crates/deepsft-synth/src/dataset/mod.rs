//! Data sets made on disk, shard by shard.

mod unfinished;

pub use unfinished::{DatasetPlan, UnfinishedDataset};
