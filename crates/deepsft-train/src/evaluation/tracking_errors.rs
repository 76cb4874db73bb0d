//! How far a tracked mesh is from the truth of a synthetic clip.

use crate::TrainError;
use deepsft_geometry::glam::{DVec2, DVec3};
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
pub fn canonical_truth(sample: &Sample, template: &Template, canonical: &Camera) -> Result<Maps, TrainError> {
    if sample.camera == *canonical {
        return Ok(sample.truth.clone());
    }
    if !sample.has_template {
        return Ok(Maps::empty(canonical.width() as usize, canonical.height() as usize));
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
    Ok(frame_metrics(&maps, truth, camera, template.size_mm())?)
}

/// Fraction of the template that is in view: of 16 x 16 cells of it those of which at least a pixel is seen.
pub fn fraction_in_view(truth: &Maps) -> f64 {
    let mut seen = [false; CELLS * CELLS];
    for pixel in (0..truth.depth().len()).filter(|&pixel| truth.inside(pixel)) {
        let [i, j] = truth.registration()[pixel].map(|c| ((c * CELLS as f32) as usize).min(CELLS - 1));
        seen[j * CELLS + i] = true;
    }
    seen.iter().filter(|seen| **seen).count() as f64 / seen.len() as f64
}

/// The vertices that are seen: inside the image, where `truth` has the vertex's own texture coordinates.
pub fn seen_vertices(template: &Template, vertices_camera: &[DVec3], truth: &Maps, camera: &Camera) -> Vec<bool> {
    // About half the way to the next vertex.
    let near = match template.grid() {
        Some((columns, rows)) => DVec2::new(0.5 / (columns - 1) as f64, 0.5 / (rows - 1) as f64),
        None => DVec2::splat(0.5 / (template.mesh().vertices().len() as f64).sqrt()),
    };
    vertices_camera
        .iter()
        .zip(template.mesh().texture_coordinates())
        .map(|(p, uv)| {
            let Some(pixel) = camera.project(*p).map(DVec2::floor) else {
                return false;
            };
            let inside = pixel.cmpge(DVec2::ZERO).all()
                && pixel.x < f64::from(camera.width())
                && pixel.y < f64::from(camera.height());
            if !inside {
                return false;
            }
            let at = pixel.y as usize * truth.width() + pixel.x as usize;
            let [u, v] = truth.registration()[at].map(f64::from);
            truth.inside(at) && ((DVec2::new(u, v) - *uv).abs() / near).max_element() < 1.0
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::{Picture, training_camera};
    use deepsft_synth::{SynthConfig, Synthesizer};

    fn template() -> Template {
        Template::thin_shell(
            Picture::from_fn(30, 20, |x, y| [(8 * x) as u8, (12 * y) as u8, 90]),
            300.0,
            200.0,
        )
        .unwrap()
    }

    fn flat(template: &Template, z: f64) -> Vec<DVec3> {
        template.mesh().vertices().iter().map(|p| *p + DVec3::Z * z).collect()
    }

    /// A frame of a flat sheet seen by a camera of the size of the training camera's image times `scale`.
    fn sample(template: &Template, scale: u32) -> Sample {
        let config = SynthConfig {
            camera: training_camera().resized(480 * scale, 270 * scale).unwrap(),
            ..SynthConfig::default()
        };
        let synthesizer = Synthesizer::new(template, config).unwrap();
        synthesizer.render_clean(flat(template, 500.0)).unwrap()
    }

    #[test]
    fn the_truth_of_a_finer_camera_is_that_of_the_canonical_one() {
        let template = template();
        let [own, finer] = [1, 2].map(|scale| sample(&template, scale));
        let camera = training_camera();
        let truth = canonical_truth(&own, &template, &camera).unwrap();
        assert_eq!(truth, own.truth);
        let derived = canonical_truth(&finer, &template, &camera).unwrap();
        let metrics = frame_metrics(&derived, &truth, &camera, template.size_mm()).unwrap();
        // Pixels along the outline may differ: 760 of 35,000.
        assert!(metrics.mask_iou.unwrap() > 0.97, "{metrics:?}");
        assert!(metrics.registration_rmse_px.unwrap() < 1e-3 && metrics.depth_rmse_mm.unwrap() < 1e-3);
        // What lies before the sheet stays out of its truth.
        let mut covered = finer.clone();
        let (width, half) = (960, 480);
        (0..540 * width)
            .filter(|pixel| pixel % width < half)
            .for_each(|pixel| covered.truth.clear(pixel));
        let derived = canonical_truth(&covered, &template, &camera).unwrap();
        assert!((0..480 * 270).all(|pixel| pixel % 480 >= 240 || !derived.inside(pixel)));
        assert!(derived.area() > 15_000);
    }

    #[test]
    fn a_sheet_that_is_moved_by_three_pixels_is_three_pixels_off() {
        let template = template();
        let own = sample(&template, 1);
        // 3 pixels at 500 mm and f = 380.
        let moved: Vec<DVec3> = flat(&template, 500.0)
            .into_iter()
            .map(|p| p + DVec3::X * 3.0 * 500.0 / 380.0)
            .collect();
        let metrics = mesh_errors(&template, &moved, &own.truth, &training_camera()).unwrap();
        assert!(
            (metrics.registration_rmse_px.unwrap() - 3.0).abs() < 1e-3,
            "{metrics:?}"
        );
    }

    #[test]
    fn the_fraction_in_view_is_counted_and_so_are_its_vertices() {
        let template = template();
        let own = sample(&template, 1);
        let vertices = flat(&template, 500.0);
        let mut half = own.truth.clone();
        (0..480 * 270)
            .filter(|pixel| pixel % 480 >= 240)
            .for_each(|pixel| half.clear(pixel));
        assert_eq!(
            [&own.truth, &half, &Maps::empty(480, 270)].map(fraction_in_view),
            [1.0, 0.5, 0.0]
        );
        let seen = |truth: &Maps| {
            let seen = seen_vertices(&template, &vertices, truth, &training_camera());
            seen.iter().filter(|seen| **seen).count() as f64 / vertices.len() as f64
        };
        // Vertices on the outline may fall on the pixel beside it.
        assert!(seen(&own.truth) > 0.85, "{}", seen(&own.truth));
        assert!((0.4..0.55).contains(&seen(&half)), "{}", seen(&half));
    }
}
