#![doc = include_str!("../README.md")]
//!
//! # How it calibrates
//!
//! 1. A view is a list of [`Correspondence`]s. [`CornerDetector`] finds the corners of boards. Of a print any finder may give matches, which
//!    [`refine_print`] makes exact.
//! 2. [`calibrate`] starts from Zhang's equations and minimises the distances in the image over camera and poses.
//! 3. A [`Calibration`] has the camera, the deviation of each parameter and the residuals of each view.

mod adjustment;
mod board;
mod calibrate;
mod camera_model;
mod corner_detector;
mod correspondence;
mod error;
mod homography;
mod print_refinement;

pub use board::{Board, BoardPatch};
pub use calibrate::{CalibratedView, Calibration, calibrate};
pub use camera_model::{CameraModel, CameraParameter};
pub use corner_detector::CornerDetector;
pub use correspondence::{Correspondence, MIN_CORRESPONDENCES};
pub use error::CalibrationError;
pub use print_refinement::refine_print;
