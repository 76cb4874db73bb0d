//! The one error type of this crate.

use deepsft_geometry::GeometryError;
use deepsft_inference::DeviceKind;
use thiserror::Error;

/// What can go wrong with a network.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum NetworkError {
    /// A picture or a mask has another size than the rest.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// Weights cannot be used.
    #[error("{file} cannot be used: {reason}")]
    Weights {
        /// The file they came in.
        file: String,
        /// What does not fit.
        reason: String,
    },
    /// The device failed while computing or reading back.
    #[error("the device failed while computing: {reason}")]
    Execution {
        /// What the device says.
        reason: String,
    },
    /// A device cannot be used in this build or on this machine, or was lost.
    #[error("device {device} is not available: {reason}")]
    DeviceUnavailable {
        /// What was asked for.
        device: DeviceKind,
        /// What the build or the driver says.
        reason: String,
    },
}
