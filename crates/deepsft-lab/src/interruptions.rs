//! `deepsft-lab kills` and `deepsft-lab full-disk`: commands that are stopped at any moment, and what they leave behind.

mod full_disk;
mod kills;
mod results;
mod subject;

pub use full_disk::{FullDiskArguments, run as run_full_disk};
pub use kills::{KillsArguments, run as run_kills};
