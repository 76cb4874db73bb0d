//! What a fit compares a mesh with.

use crate::camera::Camera;
use crate::error::{GeometryError, check_size};
use crate::image::GreyImage;

/// A grey image and the camera that took it; both are of one size.
#[derive(Clone, Copy)]
pub(crate) struct Observation<'a> {
    pub(super) grey: &'a GreyImage,
    pub(super) camera: &'a Camera,
}

impl<'a> Observation<'a> {
    /// Checks the sizes.
    pub(crate) fn new(grey: &'a GreyImage, camera: &'a Camera) -> Result<Self, GeometryError> {
        check_size(grey.size, camera.size())?;
        Ok(Self { grey, camera })
    }
}
