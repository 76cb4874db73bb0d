//! A batch of whole frames with their full-resolution labels, for the architectures that are trained on maps.

use super::window_batch::deal_frames;
use burn::tensor::{Device, Tensor, TensorData};
use deepsft::{DepthRange, OUTSIDE};
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH};
use deepsft_synth::Sample;

/// Pixels of a frame.
const PIXELS: usize = CANONICAL_WIDTH * CANONICAL_HEIGHT;

/// N whole frames with their labels, row-major.
pub struct MapBatch {
    range: DepthRange,
    /// [N, 3, 270, 480], 0..=1.
    images: Vec<f32>,
    /// Normalised depth, [N, 1, 270, 480]; outside the object [`OUTSIDE`].
    depth: Vec<f32>,
    /// (u, v), [N, 2, 270, 480]; outside the object [`OUTSIDE`].
    registration: Vec<f32>,
}

/// A batch on a device.
pub struct MapTensors {
    /// [N, 3, 270, 480], 0..=1.
    pub images: Tensor<4>,
    /// Normalised depth, [N, 1, 270, 480]; outside the object [`OUTSIDE`].
    pub depth: Tensor<4>,
    /// (u, v), [N, 2, 270, 480]; outside the object [`OUTSIDE`].
    pub registration: Tensor<4>,
}

impl MapBatch {
    /// Room for `frames` frames, to be filled with [`MapBatch::push`].
    pub fn new(frames: usize, range: DepthRange) -> Self {
        Self {
            range,
            images: Vec::with_capacity(3 * frames * PIXELS),
            depth: Vec::with_capacity(frames * PIXELS),
            registration: Vec::with_capacity(2 * frames * PIXELS),
        }
    }

    /// Adds a sample of 480 x 270 pixels.
    pub fn push(&mut self, sample: &Sample) {
        for channel in 0..3 {
            let plane = sample.image.rgb().iter().skip(channel).step_by(3);
            self.images.extend(plane.map(|&value| f32::from(value) / 255.0));
        }
        let truth = &sample.truth;
        let outside = OUTSIDE as f32;
        let inside = |pixel: usize, value: f32| if truth.inside(pixel) { value } else { outside };
        let normalised = |mm: f32| self.range.normalise_linear(f64::from(mm)) as f32;
        let depth = truth.depth().iter().enumerate();
        self.depth
            .extend(depth.map(|(pixel, &mm)| inside(pixel, normalised(mm))));
        for axis in 0..2 {
            let plane = truth.registration().iter().enumerate();
            self.registration
                .extend(plane.map(|(pixel, uv)| inside(pixel, uv[axis])));
        }
    }

    /// Frames pushed so far.
    pub fn frames(&self) -> usize {
        self.depth.len() / PIXELS
    }

    /// Batches of the first `sizes[0]` frames, the next `sizes[1]` and so on.
    pub(crate) fn split(self, sizes: &[usize]) -> Vec<Self> {
        let frames = self.frames();
        let mut parts: Vec<Self> = sizes.iter().map(|&size| Self::new(size, self.range)).collect();
        let mut deal = |values: Vec<f32>, field: fn(&mut Self) -> &mut Vec<f32>| {
            for (part, dealt) in parts.iter_mut().zip(deal_frames(&values, frames, sizes)) {
                field(part).extend_from_slice(dealt);
            }
        };
        deal(self.images, |batch| &mut batch.images);
        deal(self.depth, |batch| &mut batch.depth);
        deal(self.registration, |batch| &mut batch.registration);
        parts
    }

    /// The batch as tensors on `device`.
    pub fn into_tensors(self, device: &Device) -> MapTensors {
        let n = self.frames();
        let tensor = |values: Vec<f32>, channels: usize| -> Tensor<4> {
            let shape = [n, channels, CANONICAL_HEIGHT, CANONICAL_WIDTH];
            Tensor::from_data(TensorData::new(values, shape), device)
        };
        MapTensors {
            images: tensor(self.images, 3),
            depth: tensor(self.depth, 1),
            registration: tensor(self.registration, 2),
        }
    }
}
