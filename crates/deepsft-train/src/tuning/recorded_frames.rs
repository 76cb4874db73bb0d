//! What steps 2 and 3 learn from and are measured on: the frames of a recording.

use super::training_frame::TrainingFrame;
use crate::error::TrainError;
use burn::module::Module;
use burn::tensor::Device;
use deepsft_formats::FormatError;
use deepsft_geometry::{Camera, ColorMatch, ColorResponse, Picture, Template};
use deepsft_network::Network;
use deepsft_synth::{Recording, Sample};
use std::collections::BTreeMap;

/// The frames of a recording, those that are trained on and those that are not.
#[derive(Clone, Debug)]
pub struct RecordedFrames {
    /// Trained on.
    pub training: Vec<TrainingFrame>,
    /// The end of the recording, never trained on.
    pub held_out: Vec<TrainingFrame>,
    /// Number of frames that are neither trained on nor measured on. The network does not see the object in the former, and in
    /// the latter no mask of the recording has it either.
    pub left_out: usize,
    /// Response of the recording's camera to the template's colours. It brings the template, drawn through the network's
    /// registrations of the frames that are trained on, to their images.
    pub colors: ColorResponse,
}

impl RecordedFrames {
    /// Reads `recording` for a network, see [`TrainingFrame::read`]; the last `held_out_fraction` of it is held out. `each` is
    /// called after every frame.
    ///
    /// # Errors
    /// As [`TrainingFrame::read`]; [`FormatError::File`] when nothing is left to train on or to measure on.
    pub fn read(
        recording: &Recording,
        network: &Network,
        template: &Template,
        canonical: &Camera,
        held_out_fraction: f64,
        device: &Device,
        mut each: impl FnMut(),
    ) -> Result<Self, TrainError> {
        let network = network.clone().fork(device);
        let count = recording.frames();
        let first_held_out = ((count as f64) * (1.0 - held_out_fraction)).round() as usize;
        let mut frames = Self {
            training: Vec::new(),
            held_out: Vec::new(),
            left_out: 0,
            colors: ColorResponse::IDENTITY,
        };
        let mut colors = ColorMatch::default();
        let surface = network.config().rest_surface(template);
        for index in 0..count {
            let shown = (template.texture(), surface.as_ref());
            match TrainingFrame::read(recording, index, &network, canonical, shown, device)? {
                Some((frame, _)) if index >= first_held_out => frames.held_out.push(frame),
                Some((frame, maps)) if frame.is_trainable() => {
                    colors.add(&frame.image, template.texture(), &maps)?;
                    frames.training.push(frame);
                }
                _ => frames.left_out += 1,
            }
            each();
        }
        for (part, frames) in [("trained on", &frames.training), ("held out", &frames.held_out)] {
            if frames.is_empty() {
                let reason = format!("the network sees the object in none of the frames to be {part}");
                let path = recording.folder().to_path_buf();
                return Err(FormatError::File { reason, path }.into());
            }
        }
        frames.colors = colors.response();
        Ok(frames)
    }
}

/// What a tuning learns from and is measured on.
#[derive(Clone, Copy, Debug)]
pub struct TuningSet<'a> {
    /// The frames.
    pub frames: &'a RecordedFrames,
    /// The template.
    pub template: &'a Template,
    /// The canonical camera.
    pub canonical: &'a Camera,
    /// The truth of frames of the recording by their numbers, where it is known. Only measured on, never trained on.
    pub truth: &'a BTreeMap<usize, Sample>,
}

impl TuningSet<'_> {
    /// The template's texture in the colours in which the recording's camera shows it, see [`RecordedFrames::colors`].
    pub fn texture_as_recorded(&self) -> Picture {
        self.frames.colors.apply(self.template.texture())
    }
}
