//! Frames to measure a model on: synthetic ones, whose truth is exact, and recorded ones, whose depth was measured.

use super::measured_depth::comparable_depth;
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::metrics::{FrameMetrics, frame_metrics};
use deepsft_geometry::{Camera, GeometryError, Maps, Picture};
use deepsft_synth::{RecordedFrame, Sample};
use std::borrow::Cow;

/// An image and what is known of it.
#[derive(Clone, Debug)]
pub struct EvaluationFrame {
    /// The picture.
    pub image: Picture,
    /// The camera that took it; the truth is in its image.
    pub camera: Camera,
    /// What is known.
    pub truth: FrameTruth,
}

/// What is known of a frame.
#[derive(Clone, Debug)]
pub enum FrameTruth {
    /// Depth and registration of every pixel.
    Exact {
        /// The maps.
        maps: Maps,
        /// Whether the template's front is seen in at least one pixel.
        has_template: bool,
    },
    /// What a depth camera measured; nobody knows the registration.
    Measured {
        /// Depth in mm, row-major; 0 where nothing was measured.
        depth_mm: Vec<f32>,
        /// Where the object is seen, if the recording says.
        mask: Option<Vec<bool>>,
    },
}

impl From<Sample> for EvaluationFrame {
    fn from(sample: Sample) -> Self {
        Self {
            image: sample.image,
            camera: sample.camera,
            truth: FrameTruth::Exact {
                maps: sample.truth,
                has_template: sample.has_template,
            },
        }
    }
}

impl EvaluationFrame {
    /// A frame of a recording, read for `canonical`.
    pub fn recorded(frame: RecordedFrame, canonical: Camera) -> Self {
        Self {
            image: frame.image,
            camera: canonical,
            truth: FrameTruth::Measured {
                depth_mm: frame.depth_mm,
                mask: frame.mask,
            },
        }
    }

    /// Errors of `predicted`, maps of the camera's image, against `reference`, which is that of
    /// [`FrameTruth::reference`].
    ///
    /// Against a measured depth only depth and 3D points have an error, and the masks only where the recording has
    /// masks.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when the maps are not of the camera's size.
    pub fn metrics(
        &self,
        predicted: &Maps,
        reference: &Maps,
        template_size_mm: DVec2,
    ) -> Result<FrameMetrics, GeometryError> {
        let compare = |truth: &Maps| frame_metrics(predicted, truth, &self.camera, template_size_mm);
        let errors = compare(reference)?;
        let FrameTruth::Measured { mask, .. } = &self.truth else {
            return Ok(errors);
        };
        let masks = match mask {
            Some(mask) => compare(&seen_at(predicted, mask))?,
            None => FrameMetrics::default(),
        };
        Ok(FrameMetrics {
            depth_rmse_mm: errors.depth_rmse_mm,
            points_rmse_mm: errors.points_rmse_mm,
            mask_iou: masks.mask_iou,
            coverage: masks.coverage,
            ..FrameMetrics::default()
        })
    }
}

impl FrameTruth {
    /// Whether the template is seen; so far as anybody knows it is in every frame of a recording without masks.
    pub fn has_template(&self) -> bool {
        match self {
            Self::Exact { has_template, .. } => *has_template,
            Self::Measured { mask, .. } => mask.as_ref().is_none_or(|mask| mask.contains(&true)),
        }
    }

    /// Whether there is a true registration.
    pub fn has_registration(&self) -> bool {
        matches!(self, Self::Exact { .. })
    }

    /// The true maps. Of a measured depth the maps of the pixels in which it is compared, with a registration that means
    /// nothing: two pixels inside the recording's mask and away from jumps of the measured depth, so that all models are
    /// compared over the same pixels and an error of any size counts. A recording without masks does not say where the
    /// object is: there the mask of `answer` stands in its place, and models with other masks are compared over other
    /// pixels.
    pub fn reference(&self, answer: &Maps) -> Cow<'_, Maps> {
        match self {
            Self::Exact { maps, .. } => Cow::Borrowed(maps),
            Self::Measured { depth_mm, mask } => {
                let object = mask.clone().unwrap_or_else(|| answer.mask());
                let counts = comparable_depth(&object, depth_mm, answer.width());
                let mut maps = Maps::empty(answer.width(), answer.height());
                for pixel in (0..counts.len()).filter(|&pixel| counts[pixel]) {
                    maps.set(pixel, depth_mm[pixel], [0.5; 2]);
                }
                Cow::Owned(maps)
            }
        }
    }
}

/// Maps that are inside where `mask` is, with values that mean nothing.
fn seen_at(like: &Maps, mask: &[bool]) -> Maps {
    let mut maps = Maps::empty(like.width(), like.height());
    for pixel in (0..mask.len()).filter(|&pixel| mask[pixel]) {
        maps.set(pixel, 1.0, [0.5; 2]);
    }
    maps
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft_geometry::training_camera;

    const SIZE: DVec2 = DVec2::new(200.0, 100.0);

    /// Maps in which 100 x 100 pixels at the top left are at 400 mm.
    fn predicted() -> Maps {
        let mut maps = Maps::empty(480, 270);
        for pixel in (0..100).flat_map(|y| (0..100).map(move |x| y * 480 + x)) {
            maps.set(pixel, 400.0, [0.1, 0.2]);
        }
        maps
    }

    fn recorded(depth: impl Fn(usize) -> f32, mask: Option<Vec<bool>>) -> EvaluationFrame {
        let frame = RecordedFrame {
            image: Picture::from_fn(480, 270, |_, _| [0; 3]),
            depth_mm: (0..480 * 270).map(depth).collect(),
            mask,
        };
        EvaluationFrame::recorded(frame, training_camera())
    }

    fn errors(frame: &EvaluationFrame, maps: &Maps) -> FrameMetrics {
        frame.metrics(maps, &frame.truth.reference(maps), SIZE).unwrap()
    }

    #[test]
    fn models_are_compared_over_the_same_measured_pixels_and_a_failure_counts() {
        let inside = |pixel: usize| pixel % 480 < 100 && pixel < 100 * 480;
        let frame = recorded(|_| 400.0, Some((0..480 * 270).map(inside).collect()));
        let right = predicted();
        // 40 mm off, less than 15 % of it, in one half and 100 mm off, more than that, in the other.
        let mut wrong = predicted();
        for pixel in (0..480 * 270).filter(|&pixel| inside(pixel)) {
            wrong.set(pixel, if pixel % 480 < 50 { 440.0 } else { 500.0 }, [0.1, 0.2]);
        }
        assert_eq!(frame.truth.reference(&right), frame.truth.reference(&wrong));
        assert_eq!(frame.truth.reference(&wrong).area(), 96 * 96);
        assert_eq!(errors(&frame, &right).depth_rmse_mm, Some(0.0));
        let expected = ((40.0_f64.powi(2) + 100.0_f64.powi(2)) / 2.0).sqrt();
        assert!((errors(&frame, &wrong).depth_rmse_mm.unwrap() - expected).abs() < 1e-9);
    }

    #[test]
    fn a_measured_depth_has_errors_in_depth_and_in_space_only() {
        // Off by 3 mm in odd columns.
        let frame = recorded(|pixel| if pixel % 2 == 1 { 403.0 } else { 400.0 }, None);
        let metrics = errors(&frame, &predicted());
        // Columns 2 to 97: as many odd ones as even ones.
        assert!((metrics.depth_rmse_mm.unwrap() - 4.5_f64.sqrt()).abs() < 1e-12);
        assert!(metrics.points_rmse_mm > metrics.depth_rmse_mm);
        let none = [metrics.registration_rmse_px, metrics.registration_rmse_mm];
        assert_eq!((none, metrics.mask_iou, metrics.coverage), ([None; 2], None, None));
        assert!(frame.truth.has_template() && !frame.truth.has_registration());
    }

    #[test]
    fn a_recordings_mask_says_what_is_the_object() {
        let mask = |columns: std::ops::Range<usize>| {
            let inside = |pixel: usize| columns.contains(&(pixel % 480)) && pixel < 100 * 480;
            Some((0..480 * 270).map(inside).collect())
        };
        // Right where it is not the object, 40 mm off where it is. Half of the prediction is on it, and 2/3 of it is
        // predicted.
        let frame = recorded(|pixel| if pixel % 480 < 50 { 400.0 } else { 440.0 }, mask(50..125));
        let metrics = errors(&frame, &predicted());
        assert_eq!(metrics.depth_rmse_mm, Some(40.0));
        assert_eq!(metrics.mask_iou, Some(50.0 / 125.0));
        assert_eq!(metrics.coverage, Some(50.0 / 75.0));
        assert!(!recorded(|_| 500.0, mask(0..0)).truth.has_template());
    }
}
