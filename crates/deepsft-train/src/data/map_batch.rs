//! A batch of whole frames with their full-resolution labels, for the architectures that are trained on maps.

use burn::tensor::{Device, Tensor, TensorData};
use deepsft::DepthRange;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH};
use deepsft_network::OUTSIDE;
use deepsft_synth::Sample;

/// Whole frames with their labels, row-major, one frame after the other; outside the object labels are [`OUTSIDE`].
pub struct MapBatch {
    range: DepthRange,
    frames: usize,
    /// [N, 3, 270, 480], 0..=1.
    images: Vec<f32>,
    /// Normalised depth, [N, 270, 480].
    depth: Vec<f32>,
    /// (u, v), [N, 2, 270, 480].
    registration: Vec<f32>,
}

/// A batch on a device.
#[derive(Debug)]
pub struct MapTensors {
    /// [N, 3, 270, 480], 0..=1.
    pub images: Tensor<4>,
    /// Normalised depth, [N, 1, 270, 480]; outside the object [`OUTSIDE`].
    pub depth: Tensor<4>,
    /// (u, v), [N, 2, 270, 480]; outside the object [`OUTSIDE`].
    pub registration: Tensor<4>,
}

impl MapBatch {
    /// An empty batch, to be filled with [`MapBatch::push`].
    pub fn new(range: DepthRange) -> Self {
        Self {
            range,
            frames: 0,
            images: Vec::new(),
            depth: Vec::new(),
            registration: Vec::new(),
        }
    }

    /// Adds a sample of 480 x 270 pixels.
    pub fn push(&mut self, sample: &Sample) {
        let truth = &sample.truth;
        let label = |pixel: usize, value: f32| if truth.inside(pixel) { value } else { OUTSIDE as f32 };
        for channel in 0..3 {
            let values = sample.image.rgb().iter().skip(channel).step_by(3);
            self.images.extend(values.map(|&value| f32::from(value) / 255.0));
        }
        let normalised = |mm: f32| self.range.normalise_linear(f64::from(mm)) as f32;
        let depth = truth.depth().iter().enumerate();
        self.depth
            .extend(depth.map(|(pixel, &mm)| label(pixel, normalised(mm))));
        for axis in 0..2 {
            let registration = truth.registration().iter().enumerate();
            self.registration
                .extend(registration.map(|(pixel, uv)| label(pixel, uv[axis])));
        }
        self.frames += 1;
    }

    /// Frames pushed so far.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// The batch as tensors on `device`.
    pub fn into_tensors(self, device: &Device) -> MapTensors {
        let tensor = |values: Vec<f32>, channels: usize| -> Tensor<4> {
            let shape = [self.frames, channels, CANONICAL_HEIGHT, CANONICAL_WIDTH];
            Tensor::from_data(TensorData::new(values, shape), device)
        };
        MapTensors {
            images: tensor(self.images, 3),
            depth: tensor(self.depth, 1),
            registration: tensor(self.registration, 2),
        }
    }
}
