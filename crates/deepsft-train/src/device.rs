//! One update of the weights: on one device or several, in single or half precision, with the average of the weights.

mod parts;
mod precision;
mod replica;
mod stepper;
mod weight_average;

pub use precision::{LossScale, Precision};

pub(crate) use parts::{part_sizes, weighed};
pub(crate) use stepper::{Step, Stepper};
pub(crate) use weight_average::WeightAverage;
