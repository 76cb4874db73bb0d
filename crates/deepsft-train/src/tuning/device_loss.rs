//! The loss of a part of a batch of steps 2 and 3, on a device.

use super::frame_part::FramePart;
use super::training_frame::{FrameTensors, TrainingFrame};
use crate::config::{TrainConfig, TuningStep};
use crate::loss::TexturePyramid;
use burn::tensor::{Device, FloatDType, Tensor};
use deepsft_geometry::Picture;
use deepsft_network::{Network, NetworkMaps};

/// A device and what it needs for its parts of batches.
pub struct DeviceLoss {
    /// Differentiable.
    device: Device,
    texture: TexturePyramid,
    /// What images are cast to.
    dtype: FloatDType,
}

impl DeviceLoss {
    /// `device`, a differentiable one, with the template's `texture`; the network sees images in `dtype`.
    pub fn new(texture: &Picture, device: &Device, dtype: FloatDType) -> Self {
        Self {
            texture: TexturePyramid::new(texture, device),
            device: device.clone(),
            dtype,
        }
    }

    /// What `step` minimises, [1], of `part`, by `network`, which is on this device. It is in single precision.
    pub fn of(&self, network: &Network, step: TuningStep, part: &FramePart<'_>, config: &TrainConfig) -> Tensor<1> {
        let tensors = FrameTensors::new(&part.frames, &self.device);
        let NetworkMaps {
            depth, registration, ..
        } = network.forward_maps(tensors.images.clone().cast(self.dtype));
        let loss = match step {
            TuningStep::Depth => {
                let range = network.config().depth_range;
                // The mask of these networks is read from the depth: it has to stay -1 outside.
                let outside = network.says_outside().then(|| tensors.outside(&part.frames));
                let measured = (tensors.depth_mm - range.near_mm) / range.span_mm();
                config
                    .depth_loss
                    .apply(depth, measured, tensors.depth_counts, outside, range)
            }
            TuningStep::Registration => {
                let levels: Vec<usize> = part.frames.iter().map(|frame| frame.level).collect();
                let images = &tensors.images;
                config
                    .photo_consistency
                    .apply(registration, images, &tensors.inside, &self.texture, &levels)
            }
        };
        part.weighed(loss)
    }
}

/// The frames of a batch of `step` in parts for so many devices; `says_outside` as [`Network::says_outside`].
pub fn parts<'a>(
    step: TuningStep,
    batch: &[&'a TrainingFrame],
    devices: usize,
    config: &TrainConfig,
    says_outside: bool,
) -> Vec<FramePart<'a>> {
    let set = |flags: &[bool]| flags.iter().filter(|&&flag| flag).count();
    match step {
        TuningStep::Depth => FramePart::of(batch, devices, config.depth_loss.reduction, |frame| {
            let outside = if says_outside { set(&frame.outside()) } else { 0 };
            set(&frame.depth_counts) + outside
        }),
        TuningStep::Registration => FramePart::of(batch, devices, config.photo_consistency.reduction, |frame| {
            set(&frame.inside)
        }),
    }
}
