//! Trainings: where they are resumed, from data sets, until a sample is learnt by heart.
//! They run one at a time: burn has one stream of random numbers for all threads. `tuning` is a program of its own, whose
//! tests run side by side.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../common/mod.rs"]
mod common;

mod overfit_step_one;
mod resume;
mod stored_samples;
mod warm_start;
