//! A batch of frames and targets as flat arrays, and as tensors.

use super::cell_targets::{CellTargets, two_bins};
use burn::tensor::{Device, Tensor, TensorData};
use deepsft::{DepthRange, NetworkConfig, PIXELS_PER_CELL};
use deepsft_synth::Sample;
use serde::Serialize;

/// What the targets of a compact network depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TargetShape {
    /// Bins for u, v and depth.
    pub bins: [usize; 3],
    /// Depths the network can predict.
    pub depth_range: DepthRange,
    /// Whether the registration jumps at seams of the texture.
    pub seams: bool,
}

impl TargetShape {
    /// For the network of `config`; `None` if it is not a compact one.
    pub fn of(config: &NetworkConfig) -> Option<Self> {
        config.as_compact().map(|compact| Self {
            bins: compact.bins,
            depth_range: config.depth_range,
            seams: compact.seams,
        })
    }
}

/// Number and size of the windows of a batch; sides in pixels, multiples of 16.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct BatchShape {
    /// Windows.
    pub frames: usize,
    /// Columns of a window.
    pub width: usize,
    /// Rows of a window.
    pub height: usize,
}

impl BatchShape {
    /// Whole frames: 480 x 270 padded to 480 x 272.
    pub const fn whole_frames(frames: usize) -> Self {
        Self {
            frames,
            width: 480,
            height: 272,
        }
    }

    /// Windows that are cut from one synthetic frame: two of a window well smaller than the frame
    /// (rendering is a large part of the cost of a small window), one otherwise.
    pub const fn windows_per_frame(&self) -> u64 {
        if 2 * self.width * self.height <= 480 * 270 {
            2
        } else {
            1
        }
    }
}

/// N windows of synthetic frames with what the network should predict for them, row-major.
pub struct Batch {
    shape: BatchShape,
    targets: TargetShape,
    /// [N, 3, H, W], 0..=1.
    images: Vec<f32>,
    /// Pixel (x, y) of the frame where each window begins, [N, 2].
    corners: Vec<f32>,
    /// [N, 1, H, W], 0 or 1.
    mask: Vec<f32>,
    /// [N, 3, h, w] with h = H / 8.
    cells: Vec<f32>,
    /// [N, 1, h, w].
    cell_weight: Vec<f32>,
    /// [N, K, h / 2, w / 2] for each of u, v, d.
    bin_targets: [Vec<f32>; 3],
    /// [N, 1, h / 2, w / 2].
    bin_weight: Vec<f32>,
}

/// A batch on a device.
pub struct BatchTensors {
    /// [N, 3, H, W], 0..=1.
    pub images: Tensor<4>,
    /// Pixel (x, y) of the frame where each window begins, [N, 2, 1, 1].
    pub corners: Tensor<4>,
    /// [N, 1, H, W], 0 or 1.
    pub mask: Tensor<4>,
    /// (u, v, d) at the cells' centres, [N, 3, h, w].
    pub cells: Tensor<4>,
    /// [N, 1, h, w].
    pub cell_weight: Tensor<4>,
    /// Soft bins of u, v, d, [N, K, h / 2, w / 2].
    pub bin_targets: [Tensor<4>; 3],
    /// [N, 1, h / 2, w / 2].
    pub bin_weight: Tensor<4>,
}

/// Cells of the object in a frame that counts neither more nor less than its cells say.
const TYPICAL_CELLS: f32 = 400.0;
/// Fewer cells than these do not make a frame count more.
const FEWEST_CELLS: f32 = 50.0;

/// Weight of the cells of a frame that shows `cells` of the object: by the mean over cells a sheet near the camera
/// counts ten times as much as one far away, which is the harder one; so a frame counts as the square root of
/// its cells.
fn frame_weight(cells: f32) -> f32 {
    (TYPICAL_CELLS / cells.max(FEWEST_CELLS)).sqrt()
}

impl Batch {
    /// Room for a batch of `shape`, to be filled with [`Batch::push`].
    pub fn new(shape: BatchShape, targets: TargetShape) -> Self {
        Self {
            shape,
            targets,
            images: Vec::with_capacity(shape.frames * 3 * shape.width * shape.height),
            corners: Vec::with_capacity(2 * shape.frames),
            mask: Vec::with_capacity(shape.frames * shape.width * shape.height),
            cells: Vec::new(),
            cell_weight: Vec::new(),
            bin_targets: Default::default(),
            bin_weight: Vec::new(),
        }
    }

    /// Adds the window of `sample` whose corner is pixel (`left`, `top`); pixels past the frame's
    /// edge are black and outside the object.
    pub fn push(&mut self, sample: &Sample, left: usize, top: usize) {
        let BatchShape { width, height, .. } = self.shape;
        let image = &sample.image;
        let truth = &sample.truth;
        let inside = |x: usize, y: usize| x < image.width() && y < image.height();
        for channel in 0..3 {
            for y in top..top + height {
                for x in left..left + width {
                    let value = if inside(x, y) {
                        image.rgb()[3 * (y * image.width() + x) + channel]
                    } else {
                        0
                    };
                    self.images.push(f32::from(value) / 255.0);
                }
            }
        }
        self.corners.extend([left as f32, top as f32]);
        for y in top..top + height {
            for x in left..left + width {
                let seen = inside(x, y) && truth.inside(y * truth.width() + x);
                self.mask.push(f32::from(u8::from(seen)));
            }
        }
        let (columns, rows) = (width / PIXELS_PER_CELL, height / PIXELS_PER_CELL);
        let cells = {
            let TargetShape { depth_range, seams, .. } = self.targets;
            CellTargets::of_window(truth, depth_range, seams, (left, top), (columns, rows))
        };
        for k in 0..3 {
            self.cells.extend(cells.coordinates.iter().map(|c| c[k]));
        }
        let frame_weight = frame_weight(cells.weight.iter().sum());
        self.cell_weight
            .extend(cells.weight.iter().map(|weight| frame_weight * weight));
        let coarse = cells.coarse();
        for k in 0..3 {
            let start = self.bin_targets[k].len();
            self.bin_targets[k].resize(start + self.targets.bins[k] * coarse.len(), 0.0);
            for (i, (coordinates, _)) in coarse.iter().enumerate() {
                two_bins(coordinates[k], self.targets.bins[k], |bin, fraction| {
                    self.bin_targets[k][start + bin * coarse.len() + i] = fraction;
                });
            }
        }
        self.bin_weight
            .extend(coarse.iter().map(|(_, weight)| frame_weight * weight));
    }

    /// Frames pushed so far.
    pub fn frames(&self) -> usize {
        self.mask.len() / (self.shape.width * self.shape.height)
    }

    /// What [`crate::step_one_loss`] divides its sums over cells, over bins and over the mask's pixels by.
    pub(crate) fn loss_divisors(&self) -> [f64; 3] {
        let sum = |weights: &[f32]| weights.iter().map(|&weight| f64::from(weight)).sum::<f64>();
        [
            sum(&self.cell_weight) + 1.0,
            sum(&self.bin_weight) + 1.0,
            self.mask.len() as f64,
        ]
    }

    /// Batches of the first `sizes[0]` frames, the next `sizes[1]` and so on.
    pub(crate) fn split(self, sizes: &[usize]) -> Vec<Self> {
        let frames = self.frames();
        let mut parts = sizes
            .iter()
            .map(|&size| {
                let shape = BatchShape {
                    frames: size,
                    ..self.shape
                };
                Self::new(shape, self.targets)
            })
            .collect::<Vec<_>>();
        let mut deal = |values: Vec<f32>, field: fn(&mut Self) -> &mut Vec<f32>| {
            for (part, dealt) in parts.iter_mut().zip(deal_frames(&values, frames, sizes)) {
                field(part).extend_from_slice(dealt);
            }
        };
        deal(self.images, |batch| &mut batch.images);
        deal(self.corners, |batch| &mut batch.corners);
        deal(self.mask, |batch| &mut batch.mask);
        deal(self.cells, |batch| &mut batch.cells);
        deal(self.cell_weight, |batch| &mut batch.cell_weight);
        let [u, v, d] = self.bin_targets;
        deal(u, |batch| &mut batch.bin_targets[0]);
        deal(v, |batch| &mut batch.bin_targets[1]);
        deal(d, |batch| &mut batch.bin_targets[2]);
        deal(self.bin_weight, |batch| &mut batch.bin_weight);
        parts
    }

    /// The batch as tensors on `device`.
    pub fn into_tensors(self, device: &Device) -> BatchTensors {
        let n = self.frames();
        let BatchShape { width, height, .. } = self.shape;
        let (h, w) = (height / PIXELS_PER_CELL, width / PIXELS_PER_CELL);
        let tensor =
            |values: Vec<f32>, shape: [usize; 4]| Tensor::<4>::from_data(TensorData::new(values, shape), device);
        let [u, v, d] = self.bin_targets;
        let bins = |values, k: usize| tensor(values, [n, self.targets.bins[k], h / 2, w / 2]);
        BatchTensors {
            images: tensor(self.images, [n, 3, height, width]),
            corners: tensor(self.corners, [n, 2, 1, 1]),
            mask: tensor(self.mask, [n, 1, height, width]),
            cells: tensor(self.cells, [n, 3, h, w]),
            cell_weight: tensor(self.cell_weight, [n, 1, h, w]),
            bin_targets: [bins(u, 0), bins(v, 1), bins(d, 2)],
            bin_weight: tensor(self.bin_weight, [n, 1, h / 2, w / 2]),
        }
    }
}

/// The values of the first `sizes[0]` of `frames` frames, of the next `sizes[1]` and so on.
pub(crate) fn deal_frames<'a>(values: &'a [f32], frames: usize, sizes: &[usize]) -> Vec<&'a [f32]> {
    let a_frame = values.len() / frames.max(1);
    let mut rest = values;
    sizes
        .iter()
        .map(|size| {
            let (dealt, after) = rest.split_at(size * a_frame);
            rest = after;
            dealt
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_counts_as_the_square_root_of_its_cells() {
        let total = |cells: f32| cells * frame_weight(cells);
        assert!((total(1600.0) / total(400.0) - 2.0).abs() < 1e-5);
        assert!((total(400.0) - 400.0).abs() < 1e-3);
        // Slivers do not outshout whole sheets.
        assert!(total(10.0) < 0.1 * total(400.0));
    }
}
