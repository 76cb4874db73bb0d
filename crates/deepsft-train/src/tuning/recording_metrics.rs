//! The errors of a network on the held-out frames of a recording.

use super::recorded_frames::TuningSet;
use super::training_frame::TrainingFrame;
use crate::error::TrainError;
use burn::tensor::Device;
use deepsft_geometry::metrics::{Summary, frame_metrics};
use deepsft_geometry::{Maps, Picture, photo_consistency_error, relit_photo_consistency_error};
use deepsft_network::Network;
use deepsft_synth::Sample;
use serde::{Deserialize, Serialize};

/// The errors of a network on the held-out frames of a recording: means and medians over frames, or those of one frame.
///
/// All but the mask's are over pixels that do not depend on the network that is measured, see
/// [`TrainingFrame::measured_region`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordingMetrics<T = MeanMedian> {
    /// RMSE of the depth against the measured one, mm, over [`RecordingMetrics::measured_depth_pixels`].
    pub measured_depth_rmse_mm: Option<T>,
    /// Pixels of all frames whose depth is compared with the measured one.
    pub measured_depth_pixels: u64,
    /// E_pr of the paper, intensities in 0..=1.
    pub photo_consistency_error: Option<T>,
    /// The same with the template's texture in the colours in which the recording's camera shows it, see
    /// [`TuningSet::texture_as_recorded`].
    pub recorded_colors_photo_consistency_error: Option<T>,
    /// The same with the light fitted to each image, see [`relit_photo_consistency_error`].
    pub relit_photo_consistency_error: Option<T>,
    /// RMSE of the depth against the truth, mm, where there is a truth.
    pub depth_rmse_mm: Option<T>,
    /// RMSE of the registration against the truth, pixels of the 480 x 270 image, where there is a truth.
    pub registration_rmse_px: Option<T>,
    /// Intersection over union of the network's mask and the measured region. `None` for a compact network, whose mask no
    /// refinement block changes.
    pub mask_iou: Option<T>,
}

/// Mean and median over frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeanMedian {
    /// The mean.
    pub mean: f64,
    /// The median.
    pub median: f64,
    /// The number of frames.
    pub frames: usize,
}

impl RecordingMetrics {
    /// Measures `network`, which is on `device`, on the held-out frames of `set`.
    ///
    /// # Errors
    /// [`TrainError`] when the device fails or the truth is not of the canonical size.
    pub fn measure(network: &Network, set: TuningSet<'_>, device: &Device) -> Result<Self, TrainError> {
        let recorded = set.texture_as_recorded();
        let surface = network.config().rest_surface(set.template);
        let infer = |image: &Picture, seen: Option<&[bool]>| {
            pollster::block_on(network.infer(image, seen, surface.as_ref(), device))
        };
        let mut frames = Vec::new();
        for frame in &set.frames.held_out {
            let truth = set.truth.get(&frame.index).map(|sample| &sample.truth);
            let region = frame.measured_region(truth)?;
            let maps = infer(&frame.image, Some(&region))?;
            let mut errors = errors(set, &recorded, frame, &region, &maps, truth)?;
            if network.says_outside() {
                let maps = infer(&frame.image, None)?;
                errors.mask_iou = iou(&maps.mask(), &region);
            }
            frames.push(errors);
        }
        Ok(Self::over(&frames))
    }

    /// Measures the truth itself over the same pixels as [`RecordingMetrics::measure`]. It shows what no registration changes
    /// of E_pr, and the sensor's own errors. `None` where there is no truth.
    ///
    /// # Errors
    /// [`TrainError::Geometry`] when the truth is not of the canonical size.
    pub fn of_truth(set: TuningSet<'_>) -> Result<Option<Self>, TrainError> {
        let recorded = set.texture_as_recorded();
        let mut frames = Vec::new();
        for frame in &set.frames.held_out {
            if let Some(Sample { truth, .. }) = set.truth.get(&frame.index) {
                let region = frame.measured_region(Some(truth))?;
                frames.push(errors(set, &recorded, frame, &region, truth, Some(truth))?);
            }
        }
        Ok((!frames.is_empty()).then(|| Self::over(&frames)))
    }

    /// Means and medians over `frames`.
    fn over(frames: &[RecordingMetrics<f64>]) -> Self {
        let of = |error: fn(&RecordingMetrics<f64>) -> Option<f64>| {
            let counted = frames.iter().filter_map(error).count();
            Summary::of(frames.iter().map(error)).map(|Summary { mean, median, .. }| MeanMedian {
                mean,
                median,
                frames: counted,
            })
        };
        Self {
            measured_depth_rmse_mm: of(|frame| frame.measured_depth_rmse_mm),
            measured_depth_pixels: frames.iter().map(|frame| frame.measured_depth_pixels).sum(),
            photo_consistency_error: of(|frame| frame.photo_consistency_error),
            recorded_colors_photo_consistency_error: of(|frame| frame.recorded_colors_photo_consistency_error),
            relit_photo_consistency_error: of(|frame| frame.relit_photo_consistency_error),
            depth_rmse_mm: of(|frame| frame.depth_rmse_mm),
            registration_rmse_px: of(|frame| frame.registration_rmse_px),
            mask_iou: of(|frame| frame.mask_iou),
        }
    }
}

/// The errors of `maps`, which are inside at the pixels of `region`, in `frame`; all but the mask's. `recorded` is the texture as
/// recorded.
fn errors(
    TuningSet {
        template, canonical, ..
    }: TuningSet<'_>,
    recorded: &Picture,
    frame: &TrainingFrame,
    region: &[bool],
    maps: &Maps,
    truth: Option<&Maps>,
) -> Result<RecordingMetrics<f64>, TrainError> {
    let (image, texture) = (&frame.image, template.texture());
    let against = |reference: &Maps| frame_metrics(maps, reference, canonical, template);
    let measured = frame.measured(region);
    let against_truth = truth.map(against).transpose()?;
    Ok(RecordingMetrics {
        measured_depth_rmse_mm: against(&measured)?.depth_rmse_mm,
        measured_depth_pixels: measured.area() as u64,
        photo_consistency_error: photo_consistency_error(image, texture, maps),
        recorded_colors_photo_consistency_error: photo_consistency_error(image, recorded, maps),
        relit_photo_consistency_error: relit_photo_consistency_error(image, texture, maps),
        depth_rmse_mm: against_truth.and_then(|errors| errors.depth_rmse_mm),
        registration_rmse_px: against_truth.and_then(|errors| errors.registration_rmse_px),
        mask_iou: None,
    })
}

/// Intersection over union of two masks; `None` when both are empty.
fn iou(one: &[bool], other: &[bool]) -> Option<f64> {
    let count = |of: fn(bool, bool) -> bool| one.iter().zip(other).filter(|(a, b)| of(**a, **b)).count();
    let either = count(|a, b| a || b);
    (either > 0).then(|| count(|a, b| a && b) as f64 / either as f64)
}
