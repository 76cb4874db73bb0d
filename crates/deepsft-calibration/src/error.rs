//! The error of boards and calibrations.

use deepsft_geometry::GeometryError;
use thiserror::Error;

/// An error of a board or of a calibration.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// There is no such board.
    #[error("no such board: {0}")]
    Board(String),
    /// The image is empty.
    #[error(transparent)]
    Camera(#[from] GeometryError),
    /// Too few views hold enough points.
    #[error("{actual} views show enough of the target, expected {expected} or more")]
    Views {
        /// Views with enough points.
        actual: usize,
        /// Views needed.
        expected: usize,
    },
    /// The views leave the focal length open: its standard deviation as a fraction of it, infinite where nothing fits.
    #[error(
        "the views leave the focal length open (standard deviation {:.0} %): tilt the target or the camera by 20 to 40 degrees, \
         each time another way",
        100.0 * .0
    )]
    Undetermined(f64),
}

/// The result of boards and calibrations.
pub(crate) type Result<T, E = CalibrationError> = std::result::Result<T, E>;
