//! The errors of a network on the held-out frames of a recording.

use super::recorded_frames::TuningSet;
use super::training_frame::TrainingFrame;
use crate::TrainError;
use burn::tensor::Device;
use deepsft::Network;
use deepsft_geometry::metrics::{Summary, frame_metrics};
use deepsft_geometry::{Maps, Picture, photo_consistency_error, relit_photo_consistency_error};
use serde::{Deserialize, Serialize};

/// The errors of a network on the held-out frames of a recording: means and medians over frames.
///
/// All but the mask's are over pixels that do not depend on the network that is measured, see
/// [`TrainingFrame::measured_region`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordingMetrics {
    /// RMSE of the depth against the measured one, mm, over [`RecordingMetrics::measured_depth_pixels`].
    pub measured_depth_rmse_mm: Option<MeanMedian>,
    /// Pixels of all frames whose depth is compared with the measured one.
    pub measured_depth_pixels: u64,
    /// E_pr of the paper, intensities in 0..=1.
    pub photometric_error: Option<MeanMedian>,
    /// The same with the template's texture in the colours in which the recording's camera shows it, see
    /// [`TuningSet::texture_as_recorded`].
    pub recorded_colors_photometric_error: Option<MeanMedian>,
    /// The same with the light fitted to each image, see [`relit_photo_consistency_error`].
    pub relit_photometric_error: Option<MeanMedian>,
    /// RMSE of the depth against the truth, mm, where there is a truth.
    pub depth_rmse_mm: Option<MeanMedian>,
    /// RMSE of the registration against the truth, pixels of the 480 x 270 image, where there is a truth.
    pub registration_rmse_px: Option<MeanMedian>,
    /// Intersection over union of the network's mask and the measured region. `None` for a compact network, whose mask no
    /// refinement block changes.
    pub mask_iou: Option<MeanMedian>,
}

/// Mean and median over frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
        let mut errors = FrameErrors::of(set);
        for frame in &set.frames.held_out {
            let truth = set.truth.get(&frame.index).map(|sample| &sample.truth);
            let region = frame.measured_region(truth)?;
            let maps = pollster::block_on(network.infer_where(&frame.image, &region, device))?;
            errors.add(&maps, frame, &region, truth)?;
            if network.says_outside() {
                let maps = pollster::block_on(network.infer(&[&frame.image], device))?;
                errors
                    .mask_iou
                    .extend(maps.iter().map(|maps| iou(&maps.mask(), &region)));
            }
        }
        Ok(errors.summary())
    }

    /// The errors of the truth itself over the same pixels as [`RecordingMetrics::measure`]: what no registration
    /// changes of E_pr, and the sensor's own errors. `None` where there is no truth.
    ///
    /// # Errors
    /// [`TrainError::Geometry`] when the truth is not of the canonical size.
    pub fn of_truth(set: TuningSet<'_>) -> Result<Option<Self>, TrainError> {
        let mut errors = FrameErrors::of(set);
        for frame in &set.frames.held_out {
            if let Some(sample) = set.truth.get(&frame.index) {
                let region = frame.measured_region(Some(&sample.truth))?;
                errors.add(&sample.truth, frame, &region, Some(&sample.truth))?;
            }
        }
        Ok((!errors.photometric_error.is_empty()).then(|| errors.summary()))
    }
}

/// The errors of one frame after another, as [`RecordingMetrics`] has their means.
struct FrameErrors<'a> {
    set: TuningSet<'a>,
    texture_as_recorded: Picture,
    measured_depth_rmse_mm: Vec<Option<f64>>,
    measured_depth_pixels: u64,
    photometric_error: Vec<Option<f64>>,
    recorded_colors_photometric_error: Vec<Option<f64>>,
    relit_photometric_error: Vec<Option<f64>>,
    depth_rmse_mm: Vec<Option<f64>>,
    registration_rmse_px: Vec<Option<f64>>,
    mask_iou: Vec<Option<f64>>,
}

impl<'a> FrameErrors<'a> {
    /// None yet.
    fn of(set: TuningSet<'a>) -> Self {
        Self {
            set,
            texture_as_recorded: set.texture_as_recorded(),
            measured_depth_rmse_mm: Vec::new(),
            measured_depth_pixels: 0,
            photometric_error: Vec::new(),
            recorded_colors_photometric_error: Vec::new(),
            relit_photometric_error: Vec::new(),
            depth_rmse_mm: Vec::new(),
            registration_rmse_px: Vec::new(),
            mask_iou: Vec::new(),
        }
    }

    /// Takes in `maps`, which are inside at the pixels of `region`.
    fn add(
        &mut self,
        maps: &Maps,
        frame: &TrainingFrame,
        region: &[bool],
        truth: Option<&Maps>,
    ) -> Result<(), TrainError> {
        let TuningSet {
            template, canonical, ..
        } = self.set;
        let texture = template.texture();
        let against = |reference: &Maps| frame_metrics(maps, reference, canonical, template.size_mm());
        let measured = frame.measured(region);
        self.measured_depth_rmse_mm.push(against(&measured)?.depth_rmse_mm);
        self.measured_depth_pixels += measured.area() as u64;
        self.photometric_error
            .push(photo_consistency_error(&frame.image, texture, maps));
        self.recorded_colors_photometric_error.push(photo_consistency_error(
            &frame.image,
            &self.texture_as_recorded,
            maps,
        ));
        self.relit_photometric_error
            .push(relit_photo_consistency_error(&frame.image, texture, maps));
        if let Some(truth) = truth {
            let metrics = against(truth)?;
            self.depth_rmse_mm.push(metrics.depth_rmse_mm);
            self.registration_rmse_px.push(metrics.registration_rmse_px);
        }
        Ok(())
    }

    fn summary(self) -> RecordingMetrics {
        let over_frames = |values: Vec<Option<f64>>| {
            let frames = values.iter().flatten().count();
            Summary::of(values).map(|Summary { mean, median, .. }| MeanMedian { mean, median, frames })
        };
        RecordingMetrics {
            measured_depth_rmse_mm: over_frames(self.measured_depth_rmse_mm),
            measured_depth_pixels: self.measured_depth_pixels,
            photometric_error: over_frames(self.photometric_error),
            recorded_colors_photometric_error: over_frames(self.recorded_colors_photometric_error),
            relit_photometric_error: over_frames(self.relit_photometric_error),
            depth_rmse_mm: over_frames(self.depth_rmse_mm),
            registration_rmse_px: over_frames(self.registration_rmse_px),
            mask_iou: over_frames(self.mask_iou),
        }
    }
}

/// Intersection over union of two masks; `None` when both are empty.
fn iou(one: &[bool], other: &[bool]) -> Option<f64> {
    let count = |of: fn(bool, bool) -> bool| one.iter().zip(other).filter(|(a, b)| of(**a, **b)).count();
    let either = count(|a, b| a || b);
    (either > 0).then(|| count(|a, b| a && b) as f64 / either as f64)
}
