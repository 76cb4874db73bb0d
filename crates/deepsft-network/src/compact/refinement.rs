//! Depth Refinement Block and Registration Refinement Block (paper, section 3.3).
//!
//! As in the paper each sees what the image says (here the main block's features) beside the maps
//! found so far and corrects one of them. Ours also see what the registration implies for the depth
//! of an isometric surface, see [`isometric_depth`] and [`super::planar`].
//!
//! In the paper both blocks read the main block's maps. Our registration refinement reads the refined depth instead (our
//! choice): it is the better one, 11.2 against 15.6 mm in the median, and weights that were trained with it need it. The choice
//! matters little: on 100 synthetic images the whole block brings the median registration error from 1.66 to 1.62 px
//! (`deepsft eval --ablation`).

use super::cells::PIXELS_PER_CELL;
use super::planar::{PLANAR_CUES, normalise_depth};
use crate::convolution_layer::{Convolution, scaled_relu};
use crate::description::LayerTable;
use crate::weight_init::WeightInit;
use burn::module::Module;
use burn::tensor::{Tensor, activation};
use deepsft_inference::{CompactConfig, NetworkConfig};

/// Channels of the cues a refinement block reads beside the features and the coordinates: what [`departures`] gives.
const CUES: usize = ISOMETRIC_CUES + PLANAR_CUES;

/// Maps that [`isometric_depth`] returns.
pub const ISOMETRIC_CUES: usize = 2;

/// Brings departures of measured depths from the depth found, a few hundredths in normalised log depth,
/// to the size of the features beside them.
const DEPARTURE_GAIN: f64 = 10.0;
/// Largest departure that a block sees, after the gain: a factor of 1.5 in depth.
const LARGEST_DEPARTURE: f64 = 2.0;

/// Two 3x3 convolutions and a linear read-out over features and cues.
#[derive(Module, Debug)]
pub struct RefinementBlock {
    entry: Convolution,
    middle: Convolution,
    correction: Convolution,
}

impl RefinementBlock {
    /// A block with `outputs` values per cell.
    pub fn new(config: &CompactConfig, outputs: usize, init: WeightInit) -> Self {
        let width = config.refinement_channels;
        let inputs = config.channels[1] + CUES + config.bins.len();
        Self {
            entry: Convolution::standardised([inputs, width], 3, 1, 1.0, init),
            middle: Convolution::standardised([width, width], 3, 1, 1.0, init),
            correction: Convolution::head([width, outputs], 1, init),
        }
    }

    /// Features [N, C8, h, w] (already through [`scaled_relu`]) and cues [N, 7 or 8, h, w] -> [N, outputs, h, w].
    pub fn forward(&self, features: Tensor<4>, cues: Tensor<4>) -> Tensor<4> {
        let x = self.entry.forward(Tensor::cat(vec![features, cues], 1));
        let x = self.middle.forward_rectified(x);
        self.correction.forward(scaled_relu(x))
    }

    /// Writes its layers into `table`.
    pub fn describe(&self, table: &mut LayerTable) {
        self.entry.describe("entry", table);
        self.middle.describe("middle", table);
        self.correction.describe("correction", table);
    }
}

/// How far measured depths [N, K, h, w] lie from the depth found [N, 1, h, w], scaled and bounded for a
/// refinement block.
pub fn departures(measured: &Tensor<4>, depth: &Tensor<4>) -> Tensor<4> {
    ((measured.clone() - depth.clone().detach()) * DEPARTURE_GAIN).clamp(-LARGEST_DEPARTURE, LARGEST_DEPARTURE)
}

/// Mean of the depth found [N, 1, h, w] and the planes' depths [N, K, h, w] under the softmax of
/// `logits` [N, 1 + K, h, w].
pub fn weighed(depth: Tensor<4>, planar: Tensor<4>, logits: Tensor<4>) -> Tensor<4> {
    (activation::softmax(logits, 1) * Tensor::cat(vec![depth, planar], 1)).sum_dim(1)
}

/// Reads depth off the registration: coordinates (u, v, d) or (x, y, d, z) [N, 3 or 4, h, w] -> [N, 2, h, w].
///
/// A small piece of an isometric surface at depth z is seen by a camera of focal length f through
/// an affine map whose largest stretch, along the axis of tilt, is f / z pixels per millimetre: the
/// first-order solution of Shape-from-Template under weak perspective. So with J the Jacobian of
/// the registration in millimetres per pixel (of rest positions it has three rows), z = f * (its smallest singular value), and the ratio of
/// the singular values is the cosine of the tilt. Returned are that depth and the one from the
/// largest singular value, both as normalised log depth. Not differentiated: a measurement, which
/// the block learns to weigh.
pub fn isometric_depth(maps: &Tensor<4>, config: &NetworkConfig) -> Tensor<4> {
    let [n, coordinates, h, w] = maps.dims();
    let maps = maps.clone().detach();
    // The third coordinate is the depth; z is measured as x is.
    let [width_mm, height_mm] = config.template_size_mm;
    let sides = [Some(width_mm), Some(height_mm), None, Some(width_mm)];
    let pixels = PIXELS_PER_CELL as f64;
    // Central differences along a dimension; the outermost cells stand for those beyond.
    let slope = |m: &Tensor<4>, dim: usize, length: usize| {
        let edge = |at: usize| m.clone().narrow(dim, at, 1);
        let padded = Tensor::cat(vec![edge(0), m.clone(), edge(length - 1)], dim);
        (padded.clone().narrow(dim, 2, length) - padded.narrow(dim, 0, length)) / (2.0 * pixels)
    };
    // Singular values of a matrix of two columns from the eigenvalues of J^T J.
    let [mut a, mut b, mut c] = [(); 3].map(|()| Tensor::zeros([n, 1, h, w], &maps.device()));
    for (k, side) in (0..coordinates).zip(sides) {
        let Some(side) = side else { continue };
        let map = maps.clone().slice([0..n, k..k + 1]) * side;
        let (along_x, along_y) = (slope(&map, 3, w), slope(&map, 2, h));
        a = a + along_x.clone().square();
        b = b + along_y.clone().square();
        c = c + along_x * along_y;
    }
    let half_sum = (a.clone() + b.clone()) / 2.0;
    let half_gap = (((a - b) / 2.0).square() + c.square()).sqrt();
    let smallest = (half_sum.clone() - half_gap.clone()).clamp_min(1e-6).sqrt();
    let largest = (half_sum + half_gap).clamp_min(1e-6).sqrt();
    let normalised = |s: Tensor<4>| normalise_depth(s * config.focal, config.depth_range).clamp(-0.5, 1.5);
    Tensor::cat(vec![normalised(smallest), normalised(largest)], 1)
}
