//! The deformed object in front of a camera: what fit, tracker and completion answer with.

use crate::camera::Camera;
use crate::error::GeometryError;
use crate::maps::Maps;
use crate::maps::raster::VisibleSurface;
use crate::mesh::TriangleMesh;
use crate::verdict::Verdict;
use glam::DVec3;

/// Least explained fraction of a shape that is determined, and greatest deviation of half of its vertices, as a fraction of their distance.
const MIN_EXPLAINED: f64 = 0.8;
const MAX_DEVIATION: f64 = 0.01;

/// The deformed surface of a template in front of a camera, hidden parts included.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// The camera in whose frame the vertices are; its image is the one that was looked at.
    pub camera: Camera,
    /// Vertices of the template's mesh, camera frame, mm.
    pub vertices_camera: Vec<DVec3>,
    /// How far the image confirms the mesh around each vertex, 0 to 1: the correlation of the normalised image with the normalised
    /// print. 0 where the print is not seen or has no contrast. Of a completion: 1 at vertices that the maps show, else 0.
    pub confidence: Vec<f32>,
    /// Vertices around which the image shows something else than the print: something hides the object. Empty where that is not
    /// judged.
    pub is_hidden: Vec<bool>,
    /// Standard deviation of the place of each vertex, mm, along the direction in which it is least sure: what the image holds is sure,
    /// what is hidden or blank is loose. Empty where that is not known: of tracked, coarse and completed meshes.
    pub deviations: Vec<f32>,
    /// What the image says of the whole.
    pub verdict: Verdict,
}

impl Surface {
    /// Depth (mm) and registration of the surface in its camera's image, without what something hides. `template`: the mesh at rest.
    pub fn maps(&self, template: &TriangleMesh) -> Maps {
        let surface = VisibleSurface::new(template, &self.vertices_camera, &self.camera);
        let mut maps = surface.maps();
        if self.is_hidden.is_empty() {
            return maps;
        }
        let width = maps.size().width;
        for (column, row, face, triangle) in surface.front() {
            let at = surface.centres().position(column, row);
            let corners = template.faces()[face].into_iter().zip(triangle.barycentric(at.x, at.y));
            let hidden = corners.filter(|(v, _)| self.is_hidden[*v]);
            if hidden.map(|(_, weight)| weight).sum::<f64>() > 0.5 {
                maps.clear(row * width + column);
            }
        }
        maps
    }

    /// Depth and registration as [`Surface::maps`], in the image of `camera`, which stands where the surface's own does: the photograph's, with its
    /// lens and all of its pixels.
    pub fn maps_in(&self, camera: &Camera, template: &TriangleMesh) -> Maps {
        let seen = Self {
            camera: *camera,
            ..self.clone()
        };
        seen.maps(template)
    }

    /// Whether the image determines the shape, and not only that the object is found: it explains the print, and half of the vertices
    /// are surer than a hundredth of their distance. False where the deviations are not known.
    pub fn is_shape_determined(&self) -> bool {
        let sure = |(deviation, p): (&f32, &DVec3)| f64::from(*deviation) < MAX_DEVIATION * p.length();
        let vertices = self.deviations.iter().zip(&self.vertices_camera);
        let count = vertices.filter(|vertex| sure(*vertex)).count();
        self.verdict.is_found() && self.verdict.explained >= MIN_EXPLAINED && 2 * count > self.vertices_camera.len()
    }

    /// The deformed mesh, mm, camera frame, with faces and texture coordinates of `template`, the mesh at rest.
    ///
    /// # Errors
    /// [`GeometryError`] for a mesh with another number of vertices.
    pub fn mesh(&self, template: &TriangleMesh) -> Result<TriangleMesh, GeometryError> {
        Ok(template.with_vertices(self.vertices_camera.clone())?)
    }
}

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
