//! The compact DeepSfT network: the paper's structure (section 3) with a 67th of its parameters and a
//! 250th of its operations.
//!
//! It sees the image in cells of 8 pixels, classifies coarse positions at 16, and hands out maps at full
//! resolution.

use super::cells::{INPUT_MULTIPLE, PATCH, PIXELS_PER_CELL};
use super::main_block::MainBlock;
use super::planar::{PLANAR_CUES, planar_depth};
use super::refinement::{RefinementBlock, departures, isometric_depth, weighed};
use super::residual_block::BRANCH_GAIN;
use crate::block::Block;
use crate::convolution_layer::{Convolution, scaled_relu};
use crate::description::LayerTable;
use crate::maps::NetworkMaps;
use crate::resampling::{depth_to_space, padded_to_multiple, upsample_bilinear, upsample_nearest};
use crate::weight_init::WeightInit;
use burn::module::Module;
use burn::tensor::{Tensor, activation};
use deepsft_inference::{CompactConfig, DepthRange, NetworkConfig};

/// Largest normalised log depth that is turned into millimetres: keeps maps and gradients finite where an untrained
/// network says anything at all.
const LARGEST_LOG_DEPTH: f64 = 2.0;

/// Everything the compact network says of N images of H x W pixels. Coordinates are (u, v, d), or (x, y, d, z) of rest positions: C
/// of them.
#[derive(Debug)]
pub struct NetworkOutput {
    /// Bin logits of each coordinate, [N, K, H/16, W/16].
    pub bins: Vec<Tensor<4>>,
    /// The coordinates of the main block, [N, C, H/8, W/8].
    pub main: Tensor<4>,
    /// The coordinates after both refinements, [N, C, H/8, W/8], at the cells' centres.
    pub refined: Tensor<4>,
    /// Logit of "the object is seen here", [N, 1, H, W].
    pub mask: Tensor<4>,
}

/// The compact network with its weights.
#[derive(Module, Debug)]
pub struct CompactNetwork {
    main: MainBlock,
    depth_refinement: RefinementBlock,
    registration_refinement: RefinementBlock,
    mask_coarse: Convolution,
    mask_fine: Convolution,
    mask_mix: Convolution,
    mask: Convolution,
    #[module(skip)]
    pub(crate) config: NetworkConfig,
}

impl CompactNetwork {
    /// A randomly initialised network of `shape` for the images of `config`.
    pub(crate) fn new(shape: &CompactConfig, config: &NetworkConfig, init: WeightInit) -> Self {
        let mask = shape.mask_channels;
        Self {
            main: MainBlock::new(shape, init),
            depth_refinement: RefinementBlock::new(shape, 2 + PLANAR_CUES, init),
            registration_refinement: RefinementBlock::new(shape, shape.bins.len() - 1, init),
            mask_coarse: Convolution::standardised([shape.channels[1], mask], 1, 1, 1.0, init),
            mask_fine: Convolution::standardised([shape.channels[0], mask], 1, 1, 1.0, init),
            mask_mix: Convolution::standardised([mask, mask], 3, 1, BRANCH_GAIN, init),
            mask: Convolution::head([mask, PATCH * PATCH], 1, init),
            config: config.clone(),
        }
    }

    /// Runs the network on frames [N, 3, H, W] of the training camera, values 0..=1. They are padded at the right and below to
    /// multiples of 16.
    pub fn forward(&self, images: Tensor<4>) -> NetworkOutput {
        self.forward_windows(images, None)
    }

    /// Runs the network on windows of frames. `corners` [N, 2, 1, 1] is the pixel (x, y) of each frame where its window begins;
    /// (0, 0) without them.
    pub fn forward_windows(&self, images: Tensor<4>, corners: Option<&Tensor<4>>) -> NetworkOutput {
        let main = self.main.forward((images - 0.5) * 4.0);
        let features = scaled_relu(main.features);

        let coarse = upsample_nearest(self.mask_coarse.forward(features.clone()), 2);
        let mask = coarse + self.mask_fine.forward_rectified(main.patches);
        let mask = mask.clone() + self.mask_mix.forward_rectified(mask);
        let mask = self.mask.forward(scaled_relu(mask)); // [N, 16, H / 4, W / 4]

        let registration = registration_of(&main.coordinates);
        let depth = main.coordinates.clone().narrow(1, 2, 1);
        let planar = match self.config.has_rest_positions() {
            // Planes are measured of one smooth chart. What was found stands in their place.
            true => depth.clone().repeat_dim(1, PLANAR_CUES),
            false => planar_depth(&main.coordinates, &seen_probability(&mask), corners, &self.config),
        };
        let isometric = isometric_depth(&main.coordinates, &self.config);
        let measured = Tensor::cat(vec![isometric, planar.clone().detach()], 1);

        let cues = around(&registration, &[depth.clone(), departures(&measured, &depth)]);
        let refinement = self.depth_refinement.forward(features.clone(), cues);
        let correction = refinement.clone().narrow(1, 0, 1);
        let depth = weighed(depth, planar, refinement.narrow(1, 1, 1 + PLANAR_CUES)) + correction;

        let cues = around(&registration, &[depth.clone(), departures(&measured, &depth)]);
        let registration = registration + self.registration_refinement.forward(features, cues);
        let refined = around(&registration, &[depth]);
        NetworkOutput {
            bins: main.bins,
            main: main.coordinates,
            refined,
            mask: depth_to_space(mask, PATCH),
        }
    }

    /// See [`crate::Network::forward_maps`].
    pub(crate) fn forward_maps(&self, images: Tensor<4>) -> NetworkMaps {
        let [n, _, height, width] = images.dims();
        let output = self.forward(padded_to_multiple(images, INPUT_MULTIPLE));
        let cut = |x: Tensor<4>, channels: std::ops::Range<usize>| x.slice([0..n, channels, 0..height, 0..width]);
        let depth = |x: &Tensor<4>| normalised_depth(cut(x.clone(), 2..3), self.config.depth_range);
        let main = Self::at_pixels(output.main);
        let refined = Self::at_pixels(output.refined);
        let registration =
            |x: &Tensor<4>| registration_of(&x.clone().slice([0..n, 0..x.dims()[1], 0..height, 0..width]));
        NetworkMaps {
            main_depth: depth(&main),
            main_registration: registration(&main),
            depth: depth(&refined),
            registration: registration(&refined),
            mask_logits: cut(output.mask, 0..1),
        }
    }

    /// Root mean square of the features of cells, of images [N, 3, H, W] with H and W multiples of 16. Waits for the device:
    /// native only.
    pub(crate) fn feature_size(&self, images: Tensor<4>) -> f32 {
        let features = self.main.features((images - 0.5) * 4.0).at8;
        features.square().mean().into_scalar::<f32>().sqrt()
    }

    /// Up-samples coordinates of cells [N, C, h, w] to every pixel, [N, C, 8 h, 8 w].
    pub fn at_pixels(coordinates: Tensor<4>) -> Tensor<4> {
        upsample_bilinear(coordinates, PIXELS_PER_CELL)
    }

    /// See [`crate::Network::describe`].
    pub(crate) fn describe(&self, table: &mut LayerTable) {
        let [_, height, width] = table.size;
        let [height, width] = [height, width].map(|side| side.next_multiple_of(INPUT_MULTIPLE));
        table.resize("padding", height, width);
        self.main.describe(table);
        let [cells, patches] = [PIXELS_PER_CELL, PATCH].map(|side| [height / side, width / side]);
        for (name, layer, [rows, columns]) in [
            ("mask 1x1 of cells", &self.mask_coarse, cells),
            ("mask 1x1 of patches", &self.mask_fine, patches),
            ("mask 3x3", &self.mask_mix, patches),
            ("mask 1x1", &self.mask, patches),
        ] {
            table.add(name, [layer.channels(), rows, columns], layer.cost(rows * columns, 1));
        }
        for (block, layers) in [
            (Block::DepthRefinement, &self.depth_refinement),
            (Block::RegistrationRefinement, &self.registration_refinement),
        ] {
            table.begin(block, [0, cells[0], cells[1]]);
            layers.describe(table);
        }
    }
}

/// The registration of coordinates: (u, v) of [N, 3, h, w], or (x, y, z) of [N, 4, h, w].
fn registration_of(coordinates: &Tensor<4>) -> Tensor<4> {
    let first = coordinates.clone().narrow(1, 0, 2);
    match coordinates.dims()[1] {
        3 => first,
        _ => Tensor::cat(vec![first, coordinates.clone().narrow(1, 3, 1)], 1),
    }
}

/// The first two coordinates of a registration, then `between`, then the third if there is one: the order of coordinates, and of the
/// cues of a refinement block.
fn around(registration: &Tensor<4>, between: &[Tensor<4>]) -> Tensor<4> {
    let mut parts = vec![registration.clone().narrow(1, 0, 2)];
    parts.extend_from_slice(between);
    if registration.dims()[1] > 2 {
        parts.push(registration.clone().narrow(1, 2, 1));
    }
    Tensor::cat(parts, 1)
}

/// Normalised log depth -> normalised depth, any shape, see [`DepthRange`].
fn normalised_depth(log_depth: Tensor<4>, range: DepthRange) -> Tensor<4> {
    let bounded = log_depth.clamp(-LARGEST_LOG_DEPTH, LARGEST_LOG_DEPTH);
    let depth = (bounded * (range.far_mm / range.near_mm).ln()).exp() * range.near_mm;
    (depth - range.near_mm) / range.span_mm()
}

/// Probability that a cell shows the object, from the mean logit of its pixels: logits of patches
/// [N, 16, 2 h, 2 w] -> [N, 1, h, w]. Not differentiated.
fn seen_probability(mask: &Tensor<4>) -> Tensor<4> {
    let [n, _, rows, columns] = mask.dims();
    let patches = mask.clone().detach().mean_dim(1);
    let cells: Tensor<6> = patches.reshape([n, 1, rows / 2, 2, columns / 2, 2]);
    let mean: Tensor<4> = cells.mean_dim(3).mean_dim(5).reshape([n, 1, rows / 2, columns / 2]);
    activation::sigmoid(mean)
}
