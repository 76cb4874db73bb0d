//! Frames to measure a model on: synthetic ones, whose truth is exact, and recorded ones, whose depth was measured.

use super::measured_depth::measured_maps;
use deepsft_geometry::metrics::{FrameMetrics, RestShape, frame_metrics};
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
#[non_exhaustive]
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
    /// Against a measured depth only depth and 3D points have an error, those of the maps `compared`, and the masks only
    /// where the recording has masks. Otherwise `compared` has no say.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when the maps are not of the camera's size.
    pub fn metrics(
        &self,
        predicted: &Maps,
        compared: &Maps,
        reference: &Maps,
        rest: RestShape<'_>,
    ) -> Result<FrameMetrics, GeometryError> {
        let errors = |maps: &Maps, truth: &Maps| frame_metrics(maps, truth, &self.camera, rest);
        if self.truth.has_registration() {
            return errors(predicted, reference);
        }
        let masks = match self.truth.recorded_mask() {
            Some(mask) => errors(predicted, &seen_at(predicted, mask))?,
            None => FrameMetrics::default(),
        };
        let errors = errors(compared, reference)?;
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

    /// Where the object is seen, if a recording says so.
    pub fn recorded_mask(&self) -> Option<&[bool]> {
        match self {
            Self::Exact { .. } => None,
            Self::Measured { mask, .. } => mask.as_deref(),
        }
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
                Cow::Owned(measured_maps(&object, depth_mm, answer.size()))
            }
        }
    }
}

/// Maps that are inside where `mask` is, with values that mean nothing.
fn seen_at(like: &Maps, mask: &[bool]) -> Maps {
    let mut maps = Maps::empty(like.size());
    for pixel in (0..mask.len()).filter(|&pixel| mask[pixel]) {
        maps.set(pixel, 1.0, [0.5; 2]);
    }
    maps
}
