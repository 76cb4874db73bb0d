//! A batch of frames and targets as flat arrays, and as tensors.

use super::cell_targets::{CellTargets, two_bins};
use burn::tensor::{Device, Tensor, TensorData};
use deepsft::{CompactConfig, DepthRange};
use deepsft_geometry::RestSurface;
use deepsft_network::PIXELS_PER_CELL;
use deepsft_synth::Sample;
use serde::Serialize;

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

/// What a batch of N windows has, each as an array T: H x W pixels and h x w cells, h = H / 8, K bins.
#[derive(Debug, Default)]
pub struct WindowArrays<T> {
    /// [N, 3, H, W], 0..=1.
    pub images: T,
    /// Pixel (x, y) of the frame where each window begins, [N, 2, 1, 1].
    pub corners: T,
    /// [N, 1, H, W], 0 or 1.
    pub mask: T,
    /// The C coordinates at the cells' centres, [N, C, h, w]: (u, v, d), or (x, y, d, z) of rest positions.
    pub cells: T,
    /// [N, 1, h, w].
    pub cell_weight: T,
    /// Soft bins of each coordinate, [N, K, h / 2, w / 2].
    pub bin_targets: Vec<T>,
    /// [N, 1, h / 2, w / 2].
    pub bin_weight: T,
}

/// A batch on a device.
pub type BatchTensors = WindowArrays<Tensor<4>>;

/// Windows of synthetic frames with what a compact network should predict for them: row-major arrays, one window after the
/// other.
pub struct Batch {
    shape: BatchShape,
    bins: Vec<usize>,
    depth_range: DepthRange,
    arrays: WindowArrays<Vec<f32>>,
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
    /// An empty batch of windows of `shape` for the network `compact` of `depth_range`, to be filled with [`Batch::push`].
    pub fn new(shape: BatchShape, compact: &CompactConfig, depth_range: DepthRange) -> Self {
        Self {
            shape,
            bins: compact.bins.clone(),
            depth_range,
            arrays: WindowArrays {
                bin_targets: vec![Vec::new(); compact.bins.len()],
                ..WindowArrays::default()
            },
        }
    }

    /// Adds the window of `sample` whose corner is pixel (`left`, `top`); pixels past the frame's
    /// edge are black and outside the object. A network that says rest positions learns them of `surface`.
    pub fn push(&mut self, sample: &Sample, surface: Option<&RestSurface>, (left, top): (usize, usize)) {
        let BatchShape { width, height, .. } = self.shape;
        let arrays = &mut self.arrays;
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
        arrays.images.extend(values);
        arrays.corners.extend([left as f32, top as f32]);
        let seen = |(x, y)| inside(x, y) && truth.inside(y * truth.size().width + x);
        arrays
            .mask
            .extend(pixels().map(|pixel| f32::from(u8::from(seen(pixel)))));
        let (columns, rows) = (width / PIXELS_PER_CELL, height / PIXELS_PER_CELL);
        let cells = CellTargets::of_window(truth, self.depth_range, surface, (left, top), (columns, rows));
        let frame_weight = frame_weight(cells.weight.iter().sum());
        for k in 0..self.bins.len() {
            arrays.cells.extend(cells.coordinates.iter().map(|c| c[k]));
        }
        arrays
            .cell_weight
            .extend(cells.weight.iter().map(|weight| frame_weight * weight));
        let coarse = cells.coarse();
        for (k, (&bins, all)) in self.bins.iter().zip(&mut arrays.bin_targets).enumerate() {
            let mut targets = vec![0.0; bins * coarse.len()];
            for (i, (coordinates, _)) in coarse.iter().enumerate() {
                two_bins(coordinates[k], bins, |bin, fraction| {
                    targets[bin * coarse.len() + i] = fraction;
                });
            }
            all.extend(targets);
        }
        arrays
            .bin_weight
            .extend(coarse.iter().map(|(_, weight)| frame_weight * weight));
    }

    /// The batch as tensors on `device`, when all its windows were added.
    pub fn into_tensors(self, device: &Device) -> BatchTensors {
        let BatchShape { frames, width, height } = self.shape;
        let (h, w) = (height / PIXELS_PER_CELL, width / PIXELS_PER_CELL);
        let tensor = |values: Vec<f32>, [channels, rows, columns]: [usize; 3]| {
            let shape = [frames, channels, rows, columns];
            Tensor::<4>::from_data(TensorData::new(values, shape), device)
        };
        let arrays = self.arrays;
        let bins = self.bins.iter().zip(arrays.bin_targets);
        BatchTensors {
            images: tensor(arrays.images, [3, height, width]),
            corners: tensor(arrays.corners, [2, 1, 1]),
            mask: tensor(arrays.mask, [1, height, width]),
            cells: tensor(arrays.cells, [self.bins.len(), h, w]),
            cell_weight: tensor(arrays.cell_weight, [1, h, w]),
            bin_targets: bins
                .map(|(&bins, values)| tensor(values, [bins, h / 2, w / 2]))
                .collect(),
            bin_weight: tensor(arrays.bin_weight, [1, h / 2, w / 2]),
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
