//! From maps to the whole surface.

use super::arap_completion::{ArapCompletion, CompletionOptions};
use super::visible_vertices::VisibleVertices;
use crate::camera::Camera;
use crate::error::GeometryError;
use crate::maps::Maps;
use crate::mesh::TriangleMesh;
use crate::surface::Surface;
use crate::verdict::Verdict;

/// Pixels of the canonical image at the object's edge that are not used: there the network mixes what lies on both sides.
const MARGIN_PX: usize = 2;

/// Fewest visible vertices from which a mesh is completed: less than a patch of two cells shows no pose.
const MIN_VERTICES: usize = 6;

/// The paper's way from the network's maps to the whole object: visible vertices, then ARAP completion.
#[derive(Debug)]
pub struct MapsCompletion {
    visible: VisibleVertices,
    completion: ArapCompletion,
}

impl MapsCompletion {
    /// Prepares for `template`, the rest shape.
    ///
    /// # Errors
    /// As [`ArapCompletion::new`].
    pub fn new(template: &TriangleMesh, options: CompletionOptions) -> Result<Self, GeometryError> {
        Ok(Self {
            visible: VisibleVertices::new(template, MARGIN_PX),
            completion: ArapCompletion::new(template, options)?,
        })
    }

    /// Completes what `maps` of `camera` show. `None` when fewer than 6 vertices are visible.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when camera and maps are not of one size, and as [`ArapCompletion::complete`].
    pub fn complete(&mut self, maps: &Maps, camera: &Camera) -> Result<Option<Surface>, GeometryError> {
        let points = self.visible.find(maps, camera)?;
        if points.len() < MIN_VERTICES {
            return Ok(None);
        }
        let completed = self.completion.complete(&points, None)?;
        let mut confidence = vec![0.0; completed.vertices.len()];
        points.iter().for_each(|point| confidence[point.vertex] = 1.0);
        Ok(Some(Surface {
            camera: *camera,
            vertices_camera: completed.vertices,
            confidence,
            is_hidden: Vec::new(),
            deviations: Vec::new(),
            verdict: Verdict::default(),
        }))
    }
}
