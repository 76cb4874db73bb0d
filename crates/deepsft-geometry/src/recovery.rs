//! The ways from a network's maps to the whole mesh.

use crate::camera::Camera;
use crate::completion::MapsCompletion;
use crate::error::GeometryError;
use crate::fitting::PhysicsRefinement;
use crate::image::Picture;
use crate::maps::Maps;
use glam::DVec3;

/// What is done with a network's maps, prepared for one template.
pub enum Refinement {
    /// The mesh is fitted to the maps and to the image under isometry.
    Physics(Box<PhysicsRefinement>),
    /// The paper's completion: visible vertices stay about where the maps have them, ARAP recovers the others.
    Arap(Box<MapsCompletion>),
}

/// A frame's mesh, and the maps of it.
#[derive(Clone, Debug)]
pub struct RefinedMesh {
    /// Depth and registration: of the mesh where it is accepted, the network's otherwise.
    pub maps: Maps,
    /// Vertices of the mesh, camera frame, mm.
    pub vertices_camera: Vec<DVec3>,
    /// Whether the mesh is to be used. Physics refuses one that explains the image worse than the maps do.
    pub accepted: bool,
    /// Of physics: mean robust photometric cost of the network's maps and of the mesh's.
    pub photometric_cost: Option<[f64; 2]>,
}

impl Refinement {
    /// Refines `maps`, what a network says of `image`, taken by `camera`. `None` when the maps show too little.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when image, camera and maps are not of one size.
    pub fn refine(
        &mut self,
        image: &Picture,
        camera: &Camera,
        maps: &Maps,
    ) -> Result<Option<RefinedMesh>, GeometryError> {
        Ok(match self {
            Self::Physics(physics) => physics.refine(image, camera, maps, None)?.map(|refined| RefinedMesh {
                maps: refined.maps,
                vertices_camera: refined.vertices_camera,
                accepted: refined.accepted,
                photometric_cost: Some(refined.photometric_cost),
            }),
            Self::Arap(completion) => completion.complete(maps, camera, None)?.map(|completed| RefinedMesh {
                maps: completed.maps,
                vertices_camera: completed.vertices_camera,
                accepted: true,
                photometric_cost: None,
            }),
        })
    }
}

impl From<PhysicsRefinement> for Refinement {
    fn from(physics: PhysicsRefinement) -> Self {
        Self::Physics(Box::new(physics))
    }
}

impl From<MapsCompletion> for Refinement {
    fn from(completion: MapsCompletion) -> Self {
        Self::Arap(Box::new(completion))
    }
}
