//! A batch of whole frames with their full-resolution labels, for the architectures that are trained on maps.

use burn::tensor::{Device, Tensor, TensorData};
use deepsft::DepthRange;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH};
use deepsft_network::OUTSIDE;
use deepsft_synth::Sample;

/// What a batch of N frames has, each as an array T; outside the object labels are [`OUTSIDE`].
#[derive(Debug, Default)]
pub struct MapArrays<T> {
    /// [N, 3, 270, 480], 0..=1.
    pub images: T,
    /// Normalised depth, [N, 1, 270, 480].
    pub depth: T,
    /// (u, v), [N, 2, 270, 480].
    pub registration: T,
}

/// Whole frames with their labels, row-major, one frame after the other.
pub struct MapBatch {
    range: DepthRange,
    arrays: MapArrays<Vec<f32>>,
}

impl MapBatch {
    /// An empty batch, to be filled with [`MapBatch::push`].
    pub fn new(range: DepthRange) -> Self {
        Self {
            range,
            arrays: MapArrays::default(),
        }
    }

    /// Adds a sample of 480 x 270 pixels.
    pub fn push(&mut self, sample: &Sample) {
        let truth = &sample.truth;
        let label = |pixel: usize, value: f32| if truth.inside(pixel) { value } else { OUTSIDE as f32 };
        for channel in 0..3 {
            let values = sample.image.rgb().iter().skip(channel).step_by(3);
            self.arrays.images.extend(values.map(|&value| f32::from(value) / 255.0));
        }
        let normalised = |mm: f32| self.range.normalise_linear(f64::from(mm)) as f32;
        let depth = truth.depth().iter().enumerate();
        self.arrays
            .depth
            .extend(depth.map(|(pixel, &mm)| label(pixel, normalised(mm))));
        for axis in 0..2 {
            let registration = truth.registration().iter().enumerate();
            self.arrays
                .registration
                .extend(registration.map(|(pixel, uv)| label(pixel, uv[axis])));
        }
    }

    /// The batch as tensors on `device`.
    pub fn into_tensors(self, device: &Device) -> MapArrays<Tensor<4>> {
        let tensor = |values: Vec<f32>, channels: usize| -> Tensor<4> {
            let frames = values.len() / (channels * CANONICAL_HEIGHT * CANONICAL_WIDTH);
            let shape = [frames, channels, CANONICAL_HEIGHT, CANONICAL_WIDTH];
            Tensor::from_data(TensorData::new(values, shape), device)
        };
        MapArrays {
            images: tensor(self.arrays.images, 3),
            depth: tensor(self.arrays.depth, 1),
            registration: tensor(self.arrays.registration, 2),
        }
    }
}
