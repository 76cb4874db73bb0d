//! From maps to the whole mesh, and back to maps.

use super::arap_completion::ArapCompletion;
use super::options::CompletionOptions;
use super::report::CompletionReport;
use super::visible_vertices::VisibleVertices;
use crate::camera::Camera;
use crate::error::GeometryError;
use crate::maps::Maps;
use crate::maps::raster::VisibleSurface;
use crate::mesh::TriangleMesh;
use glam::DVec3;

/// Pixels at the object's edge that are not used: there the network mixes what lies on both sides.
const MARGIN_PX: usize = 2;

/// Fewest visible vertices from which a mesh is completed: less than a patch of two cells shows no pose.
const MIN_VERTICES: usize = 6;

/// The paper's way from the network's maps to the whole object: visible vertices, then ARAP completion.
#[derive(Debug)]
pub struct MapsCompletion {
    template: TriangleMesh,
    visible: VisibleVertices,
    completion: ArapCompletion,
}

/// A completed object.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct CompletedMaps {
    /// All vertices of the template, camera frame, in the template's unit.
    pub vertices_camera: Vec<DVec3>,
    /// Indices of the vertices that the maps show; the others are recovered.
    pub visible: Vec<usize>,
    /// Depth and registration drawn from the mesh where the given maps show the object; where the mesh ends
    /// before them their own values stay.
    pub maps: Maps,
    /// How the completion went.
    pub report: CompletionReport,
}

impl MapsCompletion {
    /// Prepares for `template`, the rest shape.
    ///
    /// # Errors
    /// As [`ArapCompletion::new`].
    pub fn new(template: &TriangleMesh, options: CompletionOptions) -> Result<Self, GeometryError> {
        Ok(Self {
            template: template.clone(),
            visible: VisibleVertices::new(template, MARGIN_PX),
            completion: ArapCompletion::new(template, options)?,
        })
    }

    /// Completes what `maps` of `camera` show. `start`: the mesh of the last frame of a video. `None` when fewer than 6
    /// vertices are visible.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when camera and maps are not of one size, and as [`ArapCompletion::complete`].
    pub fn complete(
        &mut self,
        maps: &Maps,
        camera: &Camera,
        start: Option<&[DVec3]>,
    ) -> Result<Option<CompletedMaps>, GeometryError> {
        let points = self.visible.find(maps, camera)?;
        if points.len() < MIN_VERTICES {
            return Ok(None);
        }
        let completed = self.completion.complete(&points, start)?;
        let drawn = VisibleSurface::new(&self.template, &completed.vertices, camera).maps();
        Ok(Some(CompletedMaps {
            vertices_camera: completed.vertices,
            visible: points.iter().map(|point| point.vertex).collect(),
            maps: drawn.within(maps),
            report: completed.report,
        }))
    }
}
