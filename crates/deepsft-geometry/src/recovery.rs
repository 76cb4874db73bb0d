//! The ways from a network's maps to the whole surface.

use crate::camera::Camera;
use crate::completion::MapsCompletion;
use crate::error::GeometryError;
use crate::fitting::{FrameFitter, Start};
use crate::image::Picture;
use crate::maps::Maps;
use crate::surface::Surface;

/// The way from a network's maps to the whole surface, prepared for one template.
#[derive(Debug)]
pub enum MeshRecovery {
    /// The mesh is fitted to the maps and to the image under isometry.
    Fit(Box<FrameFitter>),
    /// The paper's completion: visible vertices stay about where the maps have them, ARAP recovers the others.
    Completion(Box<MapsCompletion>),
}

impl MeshRecovery {
    /// Recovers the surface from `maps`, a network's for `image`, which `camera` took. `None` when the maps show too little.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when image, camera and maps are not of one size.
    pub fn recover(&mut self, image: &Picture, camera: &Camera, maps: &Maps) -> Result<Option<Surface>, GeometryError> {
        match self {
            Self::Fit(fitter) => fitter.fit(image, camera, &Start::Maps(maps.clone())),
            Self::Completion(completion) => completion.complete(maps, camera),
        }
    }
}
