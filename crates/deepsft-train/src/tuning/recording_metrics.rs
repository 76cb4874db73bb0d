//! How a network does on the held-out frames of a recording.

use super::recorded_frames::RefinementData;
use super::training_frame::TrainingFrame;
use crate::TrainError;
use burn::tensor::Device;
use deepsft::Network;
use deepsft_geometry::metrics::{Summary, frame_metrics};
use deepsft_geometry::{Maps, Picture, photometric_error, relit_photometric_error};
use serde::{Deserialize, Serialize};

/// How a network does on the held-out frames of a recording: means and medians over frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecordingFigures {
    /// RMSE of the depth against the measured one where it counts, mm.
    pub measured_depth_rmse_mm: Option<MeanMedian>,
    /// E_pr of the paper, intensities in 0..=1.
    pub photometric_error: Option<MeanMedian>,
    /// The same with the template's texture in the colours in which the recording's camera shows it, see
    /// [`RefinementData::texture_as_recorded`].
    pub recorded_colors_photometric_error: Option<MeanMedian>,
    /// The same with the light fitted to each image, see [`relit_photometric_error`].
    pub relit_photometric_error: Option<MeanMedian>,
    /// RMSE of the depth against the truth, mm, where there is a truth.
    pub depth_rmse_mm: Option<MeanMedian>,
    /// RMSE of the registration against the truth, pixels of the 480 x 270 image, where there is a truth.
    pub registration_rmse_px: Option<MeanMedian>,
}

/// Mean and median over frames.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeanMedian {
    /// The mean.
    pub mean: f64,
    /// The median.
    pub median: f64,
}

impl RecordingFigures {
    /// Measures `network`, which is on `device`, on the held-out frames of `data`.
    ///
    /// # Errors
    /// [`TrainError`] when the device fails or the truth is not of the canonical size.
    pub fn measure(network: &Network, data: RefinementData<'_>, device: &Device) -> Result<Self, TrainError> {
        let mut figures = Figures::of(data);
        for frame in &data.frames.held_out {
            // The same pixels before and after, whatever a step says of the depth that a network's mask is read from.
            let truth = data.truth.get(&frame.index).map(|sample| &sample.truth);
            let maps = pollster::block_on(network.infer_where(&frame.image, &frame.seen(truth)?, device))?;
            figures.add(&maps, frame, truth)?;
        }
        Ok(figures.summary())
    }

    /// The figures of the truth itself over the same pixels as [`RecordingFigures::measure`]: what no registration
    /// changes of E_pr, and the sensor's own errors. `None` where there is no truth.
    ///
    /// # Errors
    /// [`TrainError::Geometry`] when the truth is not of the canonical size.
    pub fn of_truth(data: RefinementData<'_>) -> Result<Option<Self>, TrainError> {
        let mut figures = Figures::of(data);
        for frame in &data.frames.held_out {
            if let Some(sample) = data.truth.get(&frame.index) {
                let seen = frame.seen(Some(&sample.truth))?;
                let mut exact = sample.truth.clone();
                (0..seen.len())
                    .filter(|&pixel| !seen[pixel])
                    .for_each(|pixel| exact.clear(pixel));
                figures.add(&exact, frame, Some(&sample.truth))?;
            }
        }
        Ok((!figures.photometric_error.is_empty()).then(|| figures.summary()))
    }
}

/// The figures of frames, as [`RecordingFigures`] has their means.
struct Figures<'a> {
    data: RefinementData<'a>,
    texture_as_recorded: Picture,
    measured_depth_rmse_mm: Vec<Option<f64>>,
    photometric_error: Vec<Option<f64>>,
    recorded_colors_photometric_error: Vec<Option<f64>>,
    relit_photometric_error: Vec<Option<f64>>,
    depth_rmse_mm: Vec<Option<f64>>,
    registration_rmse_px: Vec<Option<f64>>,
}

impl<'a> Figures<'a> {
    /// None yet.
    fn of(data: RefinementData<'a>) -> Self {
        Self {
            data,
            texture_as_recorded: data.texture_as_recorded(),
            measured_depth_rmse_mm: Vec::new(),
            photometric_error: Vec::new(),
            recorded_colors_photometric_error: Vec::new(),
            relit_photometric_error: Vec::new(),
            depth_rmse_mm: Vec::new(),
            registration_rmse_px: Vec::new(),
        }
    }

    fn add(&mut self, maps: &Maps, frame: &TrainingFrame, truth: Option<&Maps>) -> Result<(), TrainError> {
        let RefinementData {
            template, canonical, ..
        } = self.data;
        let texture = template.texture();
        let against = |reference: &Maps| frame_metrics(maps, reference, canonical, template.size_mm());
        self.measured_depth_rmse_mm
            .push(against(&frame.measured())?.depth_rmse_mm);
        self.photometric_error
            .push(photometric_error(&frame.image, texture, maps));
        self.recorded_colors_photometric_error
            .push(photometric_error(&frame.image, &self.texture_as_recorded, maps));
        self.relit_photometric_error
            .push(relit_photometric_error(&frame.image, texture, maps));
        if let Some(truth) = truth {
            let metrics = against(truth)?;
            self.depth_rmse_mm.push(metrics.depth_rmse_mm);
            self.registration_rmse_px.push(metrics.registration_rmse_px);
        }
        Ok(())
    }

    fn summary(self) -> RecordingFigures {
        let over_frames = |values: Vec<Option<f64>>| {
            Summary::of(values).map(|summary| MeanMedian {
                mean: summary.mean,
                median: summary.median,
            })
        };
        RecordingFigures {
            measured_depth_rmse_mm: over_frames(self.measured_depth_rmse_mm),
            photometric_error: over_frames(self.photometric_error),
            recorded_colors_photometric_error: over_frames(self.recorded_colors_photometric_error),
            relit_photometric_error: over_frames(self.relit_photometric_error),
            depth_rmse_mm: over_frames(self.depth_rmse_mm),
            registration_rmse_px: over_frames(self.registration_rmse_px),
        }
    }
}
