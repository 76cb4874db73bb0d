//! A batch of frames and targets as flat arrays, and as tensors.

use super::cell_targets::{CellTargets, two_bins};
use burn::tensor::{Device, Tensor, TensorData};
use deepsft::{DepthRange, NetworkConfig};
use deepsft_network::PIXELS_PER_CELL;
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

    /// Returns how many windows are cut from one synthetic frame. They are two of a window well smaller than the frame
    /// (rendering is a large part of the cost of a small window), one otherwise.
    pub const fn windows_per_frame(&self) -> u64 {
        if 2 * self.width * self.height <= 480 * 270 {
            2
        } else {
            1
        }
    }
}

/// Windows of synthetic frames with what the network should predict for them: row-major arrays, one window after the other.
/// H x W pixels and h x w cells, h = H / 8, K bins.
pub struct Batch {
    shape: BatchShape,
    targets: TargetShape,
    windows: usize,
    /// [N, 3, H, W], 0..=1.
    images: Vec<f32>,
    /// Pixel (x, y) of the frame where the window begins, [N, 2].
    corners: Vec<f32>,
    /// [N, H, W], 0 or 1.
    mask: Vec<f32>,
    /// [N, 3, h, w].
    cells: Vec<f32>,
    /// [N, h, w].
    cell_weight: Vec<f32>,
    /// [N, K, h / 2, w / 2] for each of u, v, d.
    bin_targets: [Vec<f32>; 3],
    /// [N, h / 2, w / 2].
    bin_weight: Vec<f32>,
}

/// A batch on a device.
#[derive(Debug)]
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
const MIN_CELLS: f32 = 50.0;

/// Weight of the cells of a frame that shows `cells` of the object: by the mean over cells a sheet near the camera
/// counts ten times as much as one far away, which is the harder one; so a frame counts as the square root of
/// its cells.
fn frame_weight(cells: f32) -> f32 {
    (TYPICAL_CELLS / cells.max(MIN_CELLS)).sqrt()
}

impl Batch {
    /// An empty batch of windows of `shape`, to be filled with [`Batch::push`].
    pub fn new(shape: BatchShape, targets: TargetShape) -> Self {
        Self {
            shape,
            targets,
            windows: 0,
            images: Vec::new(),
            corners: Vec::new(),
            mask: Vec::new(),
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
        let TargetShape {
            bins,
            depth_range,
            seams,
        } = self.targets;
        let (image, truth) = (&sample.image, &sample.truth);
        let inside = |x: usize, y: usize| x < image.width() && y < image.height();
        let pixels = || (top..top + height).flat_map(|y| (left..left + width).map(move |x| (x, y)));
        let values = (0..3).flat_map(|channel| {
            pixels().map(move |(x, y)| {
                if inside(x, y) {
                    f32::from(image.rgb()[3 * (y * image.width() + x) + channel]) / 255.0
                } else {
                    0.0
                }
            })
        });
        self.images.extend(values);
        self.corners.extend([left as f32, top as f32]);
        let seen = |(x, y)| inside(x, y) && truth.inside(y * truth.width() + x);
        self.mask.extend(pixels().map(|pixel| f32::from(u8::from(seen(pixel)))));
        let (columns, rows) = (width / PIXELS_PER_CELL, height / PIXELS_PER_CELL);
        let cells = CellTargets::of_window(truth, depth_range, seams, (left, top), (columns, rows));
        let frame_weight = frame_weight(cells.weight.iter().sum());
        for k in 0..3 {
            self.cells.extend(cells.coordinates.iter().map(|c| c[k]));
        }
        self.cell_weight
            .extend(cells.weight.iter().map(|weight| frame_weight * weight));
        let coarse = cells.coarse();
        for k in 0..3 {
            let mut targets = vec![0.0; bins[k] * coarse.len()];
            for (i, (coordinates, _)) in coarse.iter().enumerate() {
                two_bins(coordinates[k], bins[k], |bin, fraction| {
                    targets[bin * coarse.len() + i] = fraction;
                });
            }
            self.bin_targets[k].extend(targets);
        }
        self.bin_weight
            .extend(coarse.iter().map(|(_, weight)| frame_weight * weight));
        self.windows += 1;
    }

    /// Frames pushed so far.
    pub fn frames(&self) -> usize {
        self.windows
    }

    /// The batch as tensors on `device`.
    pub fn into_tensors(self, device: &Device) -> BatchTensors {
        let BatchShape { width, height, .. } = self.shape;
        let (h, w) = (height / PIXELS_PER_CELL, width / PIXELS_PER_CELL);
        let tensor = |values: Vec<f32>, [channels, rows, columns]: [usize; 3]| {
            let shape = [self.windows, channels, rows, columns];
            Tensor::<4>::from_data(TensorData::new(values, shape), device)
        };
        let [u, v, d] = self.bin_targets;
        let bins = |k: usize, values| tensor(values, [self.targets.bins[k], h / 2, w / 2]);
        BatchTensors {
            images: tensor(self.images, [3, height, width]),
            corners: tensor(self.corners, [2, 1, 1]),
            mask: tensor(self.mask, [1, height, width]),
            cells: tensor(self.cells, [3, h, w]),
            cell_weight: tensor(self.cell_weight, [1, h, w]),
            bin_targets: [bins(0, u), bins(1, v), bins(2, d)],
            bin_weight: tensor(self.bin_weight, [1, h / 2, w / 2]),
        }
    }
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
