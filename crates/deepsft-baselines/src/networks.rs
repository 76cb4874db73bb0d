//! The networks that the paper compares itself with, on burn.

mod batch;
mod bts;
mod checkpoint;
mod dense_depth;
mod dense_net;
mod hdm_net;
mod ismo_gan;
mod layers;
mod rival;

pub use batch::Batch;
pub use checkpoint::{TrainingState, read_checkpoint};
pub use rival::{Rival, RivalNetwork, Said, Settings};
