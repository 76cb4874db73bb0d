//! Trainings: where they are resumed, on several devices, in half precision, from data sets, until a sample is learnt by heart.
//! (`tuning` is a program of its own: burn's random numbers are one stream, and its tests run beside one another.)

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "../common/mod.rs"]
mod common;

mod devices;
mod overfit_step_one;
mod precision;
mod resume;
mod stored_samples;
