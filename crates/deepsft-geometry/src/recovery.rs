//! The ways from a network's maps to the whole mesh.

use crate::camera::Camera;
use crate::completion::MapsCompletion;
use crate::error::GeometryError;
use crate::fitting::{FrameFitter, PhotoConsistencyCost};
use crate::image::Picture;
use crate::maps::Maps;
use glam::DVec3;

/// What is done with a network's maps, prepared for one template.
#[derive(Debug)]
pub enum MeshRecovery {
    /// The mesh is fitted to the maps and to the image under isometry.
    Fit(Box<FrameFitter>),
    /// The paper's completion: visible vertices stay about where the maps have them, ARAP recovers the others.
    Completion(Box<MapsCompletion>),
}

/// A frame's mesh, and the maps of it.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct RecoveredMesh {
    /// Depth and registration: of the mesh where it is accepted, the network's otherwise.
    pub maps: Maps,
    /// Vertices of the mesh, camera frame, mm.
    pub vertices_camera: Vec<DVec3>,
    /// Whether the mesh is to be used. A fit that explains the image worse than the maps do is refused.
    pub accepted: bool,
    /// Of a fit: mean robust photo-consistency cost of the network's maps and of the mesh's.
    pub photo_consistency_cost: Option<PhotoConsistencyCost>,
}

impl MeshRecovery {
    /// Recovers the mesh from `maps`, the network's for `image`, which `camera` took. `None` when the maps show too little.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when image, camera and maps are not of one size.
    pub fn recover(
        &mut self,
        image: &Picture,
        camera: &Camera,
        maps: &Maps,
    ) -> Result<Option<RecoveredMesh>, GeometryError> {
        Ok(match self {
            Self::Fit(fitter) => fitter.fit(image, camera, maps, None)?.map(|fitted| RecoveredMesh {
                maps: fitted.maps,
                vertices_camera: fitted.vertices_camera,
                accepted: fitted.accepted,
                photo_consistency_cost: Some(fitted.photo_consistency_cost),
            }),
            Self::Completion(completion) => completion.complete(maps, camera, None)?.map(|completed| RecoveredMesh {
                maps: completed.maps,
                vertices_camera: completed.vertices_camera,
                accepted: true,
                photo_consistency_cost: None,
            }),
        })
    }
}

impl From<FrameFitter> for MeshRecovery {
    fn from(fitter: FrameFitter) -> Self {
        Self::Fit(Box::new(fitter))
    }
}

impl From<MapsCompletion> for MeshRecovery {
    fn from(completion: MapsCompletion) -> Self {
        Self::Completion(Box::new(completion))
    }
}
