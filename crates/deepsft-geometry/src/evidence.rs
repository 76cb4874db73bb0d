//! What the image confirms of a surface, pixel by pixel: of two in one place the better one.

use crate::camera::Camera;
use crate::maps::raster::VisibleSurface;
use crate::mesh::TriangleMesh;
use crate::surface::Surface;

/// Part of its evidence that a surface shares with one in the same place: a print that looks alike has nearly all of it from the other's
/// pixels. Two sheets of which one hides the other share none, for only one of them is confirmed where they overlap.
const SAME_PLACE: f32 = 0.5;

/// The evidence of an image for a surface.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// Confidence at each pixel, row-major; 0 beside the surface.
    confidence: Vec<f32>,
    total: f32,
}

impl Surface {
    /// Draws its confidence as `camera` sees it; `template` is the mesh at rest.
    pub fn evidence(&self, template: &TriangleMesh, camera: &Camera) -> Evidence {
        let mut confidence = vec![0.0; camera.size().area()];
        let surface = VisibleSurface::new(template, &self.vertices_camera, camera);
        for (column, row, face, triangle) in surface.front() {
            let at = surface.centres().position(column, row);
            let corners = template.faces()[face].into_iter().zip(triangle.barycentric(at.x, at.y));
            let there: f64 = corners.map(|(v, weight)| weight * f64::from(self.confidence[v])).sum();
            confidence[row * camera.size().width + column] = there.max(0.0) as f32;
        }
        let total = confidence.iter().sum();
        Evidence { confidence, total }
    }
}

impl Evidence {
    /// Whether `other`, drawn for the same camera, lies in the same place, and the image confirms more of it. Where both prints are alike
    /// the image confirms both: the pixels decide in which they differ.
    pub fn gives_way_to(&self, other: &Self) -> bool {
        self.is_rivalled_by(other, 1.0)
    }

    /// Whether `other` lies in the same place and the image confirms more than `fraction` as much of it.
    pub fn is_rivalled_by(&self, other: &Self, fraction: f32) -> bool {
        let pixels = self.confidence.iter().zip(&other.confidence);
        let shared: f32 = pixels.map(|(a, b)| a.min(*b)).sum();
        other.total > fraction * self.total && shared >= SAME_PLACE * self.total
    }
}
