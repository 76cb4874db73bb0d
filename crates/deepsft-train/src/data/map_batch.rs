//! A batch of whole frames with their full-resolution labels, for the architectures that are trained on maps.

use burn::tensor::{Device, Tensor, TensorData};
use deepsft::DepthRange;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH};
use deepsft_network::OUTSIDE;
use deepsft_synth::Sample;

/// N whole frames with their labels.
pub struct MapBatch {
    range: DepthRange,
    frames: Vec<Frame>,
}

impl std::fmt::Debug for MapBatch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MapBatch")
            .field("range", &self.range)
            .finish_non_exhaustive()
    }
}

/// A frame and its labels, row-major; outside the object these are [`OUTSIDE`].
struct Frame {
    /// [3, 270, 480], 0..=1.
    image: Vec<f32>,
    /// Normalised depth, [270, 480].
    depth: Vec<f32>,
    /// (u, v), [2, 270, 480].
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
    /// Room for `frames` frames, to be filled with [`MapBatch::push`].
    pub fn new(frames: usize, range: DepthRange) -> Self {
        Self {
            range,
            frames: Vec::with_capacity(frames),
        }
    }

    /// Adds a sample of 480 x 270 pixels.
    pub fn push(&mut self, sample: &Sample) {
        let plane = |channel: usize| sample.image.rgb().iter().skip(channel).step_by(3);
        let truth = &sample.truth;
        let label = |pixel: usize, value: f32| if truth.inside(pixel) { value } else { OUTSIDE as f32 };
        let normalised = |mm: f32| self.range.normalise_linear(f64::from(mm)) as f32;
        let depth = truth.depth().iter().enumerate();
        let axis = |axis: usize| {
            let registration = truth.registration().iter().enumerate();
            registration.map(move |(pixel, uv)| label(pixel, uv[axis]))
        };
        self.frames.push(Frame {
            image: (0..3).flat_map(plane).map(|&value| f32::from(value) / 255.0).collect(),
            depth: depth.map(|(pixel, &mm)| label(pixel, normalised(mm))).collect(),
            registration: (0..2).flat_map(axis).collect(),
        });
    }

    /// Frames pushed so far.
    pub fn frames(&self) -> usize {
        self.frames.len()
    }

    /// The batch as tensors on `device`.
    pub fn into_tensors(self, device: &Device) -> MapTensors {
        let tensor = |part: fn(&Frame) -> &[f32], channels: usize| -> Tensor<4> {
            let values = self.frames.iter().map(part).collect::<Vec<_>>().concat();
            let shape = [self.frames(), channels, CANONICAL_HEIGHT, CANONICAL_WIDTH];
            Tensor::from_data(TensorData::new(values, shape), device)
        };
        MapTensors {
            images: tensor(|frame| &frame.image, 3),
            depth: tensor(|frame| &frame.depth, 1),
            registration: tensor(|frame| &frame.registration, 2),
        }
    }
}
