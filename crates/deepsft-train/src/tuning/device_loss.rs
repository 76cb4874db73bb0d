//! Where a share of a batch of steps 2 and 3 is computed, and its loss there.

use super::frame_part::FrameShare;
use super::recorded_frames::RefinementStep;
use super::training_frame::{FrameTensors, TrainingFrame};
use crate::config::TrainConfig;
use crate::loss::TexturePyramid;
use burn::tensor::{Device, FloatDType, Tensor};
use deepsft::{Network, NetworkMaps};
use deepsft_geometry::Picture;

/// A device and what it needs for its shares.
pub struct Site {
    /// Differentiable.
    device: Device,
    texture: TexturePyramid,
    /// What images are cast to.
    dtype: FloatDType,
}

impl Site {
    /// `device`, a differentiable one, with the template's `texture`; the network sees images in `dtype`.
    pub fn new(texture: &Picture, device: &Device, dtype: FloatDType) -> Self {
        Self {
            texture: TexturePyramid::new(texture, device),
            device: device.clone(),
            dtype,
        }
    }

    /// What `step` minimises, [1], of a share, said by `network`, which is on this device. It is in single precision.
    pub fn loss(
        &self,
        network: &Network,
        step: RefinementStep,
        share: &FrameShare<'_>,
        config: &TrainConfig,
    ) -> Tensor<1> {
        let tensors = FrameTensors::new(&share.frames, &self.device);
        let NetworkMaps {
            depth, registration, ..
        } = network.forward_maps(tensors.images.clone().cast(self.dtype));
        let loss = match step {
            RefinementStep::Depth => {
                let range = network.config().depth_range;
                let measured = (tensors.depth_mm - range.near_mm) / range.span_mm();
                config.depth_loss.apply(depth, measured, tensors.depth_counts)
            }
            RefinementStep::Registration => {
                let levels: Vec<usize> = share.frames.iter().map(|frame| frame.level).collect();
                let images = &tensors.images;
                config
                    .photo_consistency
                    .apply(registration, images, &tensors.inside, &self.texture, &levels)
            }
        };
        share.weighed(loss.total)
    }
}

/// The frames of a batch of `step` in shares for so many devices.
pub fn shares<'a>(
    step: RefinementStep,
    batch: &[&'a TrainingFrame],
    devices: usize,
    config: &TrainConfig,
) -> Vec<FrameShare<'a>> {
    match step {
        RefinementStep::Depth => FrameShare::of(batch, devices, config.depth_loss.reduction, |f| &f.depth_counts),
        RefinementStep::Registration => {
            FrameShare::of(batch, devices, config.photo_consistency.reduction, |f| &f.inside)
        }
    }
}
