//! A camera from photographs of a flat target: a board or a print, whose points are known in millimetres.

mod adjustment;
mod calibrate;
mod camera_model;
mod homography;

pub use calibrate::{PlanarCalibration, PlanarView, PlanarViewReport, calibrate};
pub use camera_model::{CameraModel, CameraParameter};
