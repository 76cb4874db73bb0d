//! All settings of the three training steps.

mod optimizer;
mod schedule;
mod train_config;

pub use optimizer::{LearningRate, Optimizer};
pub use schedule::Schedule;
pub use train_config::{Budget, RefinementSteps, TrainConfig};
