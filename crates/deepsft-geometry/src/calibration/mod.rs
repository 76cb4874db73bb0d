//! The camera from what it sees of a known sheet.

mod self_calibration;
mod view;

pub use self_calibration::{CalibratedCamera, SelfCalibration, SelfCalibrationOptions};
