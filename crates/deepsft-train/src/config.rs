//! All settings of the three training steps.

mod optimizer;
mod schedule;
mod train_config;
mod tuning_step;

pub use optimizer::{LearningRate, Optimizer};
pub use schedule::Schedule;
pub use train_config::{Budget, TrainConfig, TuningSettings};
pub use tuning_step::TuningStep;
