//! Frames to measure a model on: synthetic ones, whose truth is exact, and recorded ones, whose depth was measured.

use super::measured_depth::depth_counts;
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

    /// Errors of `predicted`, maps of the camera's image.
    ///
    /// Against a measured depth only depth and 3D points have an error, and the masks only where the recording has
    /// masks. Depth counts two pixels inside the predicted mask and the recording's, where something was measured that
    /// differs from the prediction by less than 15 % (our choices, as in training step 2): a depth camera beside the
    /// colour camera sees hands and walls inside any mask. A larger error of the prediction is therefore not seen here.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when the maps are not of the camera's size.
    pub fn metrics(&self, predicted: &Maps, template_size_mm: DVec2) -> Result<FrameMetrics, GeometryError> {
        let compare = |truth: &Maps| frame_metrics(predicted, truth, &self.camera, template_size_mm);
        let reference = compare(&self.truth.reference(predicted))?;
        let FrameTruth::Measured { mask, .. } = &self.truth else {
            return Ok(reference);
        };
        let masks = match mask {
            Some(mask) => compare(&seen_at(predicted, mask))?,
            None => FrameMetrics::default(),
        };
        Ok(FrameMetrics {
            depth_rmse_mm: reference.depth_rmse_mm,
            points_rmse_mm: reference.points_rmse_mm,
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

    /// The true maps; of a measured depth the maps of the pixels in which it is compared with `predicted`, with a
    /// registration that means nothing.
    pub fn reference(&self, predicted: &Maps) -> Cow<'_, Maps> {
        match self {
            Self::Exact { maps, .. } => Cow::Borrowed(maps),
            Self::Measured { depth_mm, mask } => {
                let mut seen = predicted.clone();
                if let Some(mask) = mask {
                    for pixel in (0..mask.len()).filter(|&pixel| !mask[pixel]) {
                        seen.clear(pixel);
                    }
                }
                let counts = depth_counts(&seen, depth_mm);
                let mut maps = Maps::empty(predicted.width(), predicted.height());
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

    /// Says that 100 x 100 pixels at the top left are at 400 mm.
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

    #[test]
    fn a_measured_depth_has_errors_in_depth_and_in_space_only() {
        // Off by 3 mm in odd columns; the wall at 500 mm is 25 % away and no object.
        let frame = recorded(
            |pixel| match pixel % 480 {
                x if x >= 50 => 500.0,
                x if x % 2 == 1 => 403.0,
                _ => 400.0,
            },
            None,
        );
        let metrics = frame.metrics(&predicted(), SIZE).unwrap();
        // Columns 2 to 49: as many odd ones as even ones.
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
        let metrics = frame.metrics(&predicted(), SIZE).unwrap();
        assert_eq!(metrics.depth_rmse_mm, Some(40.0));
        assert_eq!(metrics.mask_iou, Some(50.0 / 125.0));
        assert_eq!(metrics.coverage, Some(50.0 / 75.0));
        assert!(!recorded(|_| 500.0, mask(0..0)).truth.has_template());
    }
}
