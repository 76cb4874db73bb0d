//! How far a tracked mesh is from the truth of a synthetic clip.

use crate::error::TrainError;
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::metrics::{FrameMetrics, frame_metrics};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, Maps, Template};
use deepsft_synth::Sample;

/// A frame counts as tracked with a registration RMSE of at most this, pixels of the 480 x 270 image.
pub const TRACKED_PX: f64 = 2.0;

/// Cells per side into which the template is divided to see how much of it is in view.
const CELLS: usize = 16;

/// The truth of `sample` as maps of the `canonical` camera: as it was rendered where that is the sample's camera, else
/// from its mesh, less what the sample's own mask leaves out.
///
/// # Errors
/// [`TrainError::VertexCount`] when the sample is not of `template`.
pub fn truth_maps(sample: &Sample, template: &Template, canonical: &Camera) -> Result<Maps, TrainError> {
    if sample.camera == *canonical {
        return Ok(sample.truth.clone());
    }
    if !sample.has_template {
        return Ok(Maps::empty(canonical.size()));
    }
    let expected = template.mesh().vertices().len();
    if sample.vertices_camera.len() != expected {
        let actual = sample.vertices_camera.len();
        return Err(TrainError::VertexCount { actual, expected });
    }
    Ok(deepsft_synth::canonical_truth(sample, template.mesh(), canonical))
}

/// The errors of a mesh at `vertices_camera` (mm) against `truth`, maps of `camera`.
///
/// # Errors
/// [`TrainError::Geometry`] when `truth` is not of the camera's size.
pub fn mesh_errors(
    template: &Template,
    vertices_camera: &[DVec3],
    truth: &Maps,
    camera: &Camera,
) -> Result<FrameMetrics, TrainError> {
    let maps = VisibleSurface::new(template.mesh(), vertices_camera, camera).maps();
    Ok(frame_metrics(&maps, truth, camera, template)?)
}

/// Fraction of the template that is in view: of 16 x 16 cells of it those of which at least a pixel is seen.
pub fn print_in_view(truth: &Maps) -> f64 {
    let mut seen = [false; CELLS * CELLS];
    for pixel in (0..truth.depth().len()).filter(|&pixel| truth.inside(pixel)) {
        let [i, j] = truth.registration()[pixel].map(|c| ((c * CELLS as f32) as usize).min(CELLS - 1));
        seen[j * CELLS + i] = true;
    }
    seen.iter().filter(|seen| **seen).count() as f64 / seen.len() as f64
}
