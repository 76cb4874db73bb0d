//! The compact DeepSfT network: the paper's structure (section 3) with a 67th of its parameters and a
//! 250th of its operations.
//!
//! It sees the image in cells of 8 pixels, classifies coarse positions at 16, and hands out maps at full
//! resolution.

use super::cells::{INPUT_MULTIPLE, PATCH, PIXELS_PER_CELL};
use super::main_block::MainBlock;
use super::planar::{PLANAR_CUES, planar_depth};
use super::refinement::{ISOMETRIC_CUES, RefinementBlock, departures, isometric_depth, weighed};
use super::residual_block::BRANCH_GAIN;
use super::seams::upsample_across_seams;
use crate::block::Block;
use crate::convolution_layer::{Convolution, scaled_relu};
use crate::description::LayerTable;
use crate::maps::NetworkMaps;
use crate::resampling::{depth_to_space, upsample_bilinear, upsample_nearest};
use crate::weight_init::WeightInit;
use burn::module::Module;
use burn::tensor::{Tensor, activation};
use deepsft_inference::{CompactConfig, DepthRange, NetworkConfig};

/// Largest normalised log depth that is turned into millimetres: keeps maps and gradients finite where an untrained
/// network says anything at all.
const LARGEST_LOG_DEPTH: f64 = 2.0;

/// Everything the compact network says of N images of H x W pixels.
#[derive(Debug)]
pub struct NetworkOutput {
    /// Bin logits of u, v and d, [N, K, H/16, W/16] each.
    pub bins: [Tensor<4>; 3],
    /// (u, v, d) of the main block, [N, 3, H/8, W/8].
    pub main: Tensor<4>,
    /// (u, v, d) after both refinements, [N, 3, H/8, W/8], at the cells' centres.
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
            registration_refinement: RefinementBlock::new(shape, 2, init),
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
        self.forward_at(images, None)
    }

    /// Runs the network on windows of frames. `corners` [N, 2, 1, 1] is the pixel (x, y) of each frame where its window begins.
    pub fn forward_windows(&self, images: Tensor<4>, corners: &Tensor<4>) -> NetworkOutput {
        self.forward_at(images, Some(corners))
    }

    fn forward_at(&self, images: Tensor<4>, corners: Option<&Tensor<4>>) -> NetworkOutput {
        let main = self.main.forward((images - 0.5) * 4.0);
        let [n, ..] = main.coordinates.dims();
        let features = scaled_relu(main.features);

        let coarse = upsample_nearest(self.mask_coarse.forward(features.clone()), 2);
        let mask = coarse + self.mask_fine.forward_rectified(main.patches);
        let mask = mask.clone() + self.mask_mix.forward_rectified(mask);
        let mask = self.mask.forward(scaled_relu(mask)); // [N, 16, H / 4, W / 4]

        let registration = main.coordinates.clone().slice([0..n, 0..2]);
        let depth = main.coordinates.clone().slice([0..n, 2..3]);
        let (measured, planar) = if self.has_seams() {
            // Nothing is measured: what was found stands in its place.
            let found = depth.clone().detach().repeat_dim(1, ISOMETRIC_CUES + PLANAR_CUES);
            (found, depth.clone().repeat_dim(1, PLANAR_CUES))
        } else {
            let isometric = isometric_depth(&main.coordinates, &self.config);
            let planar = planar_depth(&main.coordinates, &seen_probability(&mask), corners, &self.config);
            (Tensor::cat(vec![isometric, planar.clone()], 1), planar)
        };

        let cues = Tensor::cat(vec![main.coordinates.clone(), departures(&measured, &depth)], 1);
        let refinement = self.depth_refinement.forward(features.clone(), cues);
        let correction = refinement.clone().slice([0..n, 0..1]);
        let depth = weighed(depth, planar, refinement.slice([0..n, 1..2 + PLANAR_CUES])) + correction;

        let departures = departures(&measured, &depth);
        let cues = Tensor::cat(vec![registration.clone(), depth.clone(), departures], 1);
        let registration = registration + self.registration_refinement.forward(features, cues);
        let refined = Tensor::cat(vec![registration, depth], 1);
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
        let output = self.forward(pad(images, INPUT_MULTIPLE));
        let cut = |x: Tensor<4>, channels: std::ops::Range<usize>| x.slice([0..n, channels, 0..height, 0..width]);
        let depth = |x: &Tensor<4>| normalised_depth(cut(x.clone(), 2..3), self.config.depth_range);
        let main = self.upsample(output.main);
        let refined = self.upsample(output.refined);
        NetworkMaps {
            main_depth: depth(&main),
            main_registration: cut(main, 0..2),
            depth: depth(&refined),
            registration: cut(refined, 0..2),
            mask_logits: cut(output.mask, 0..1),
        }
    }

    /// Root mean square of the features of cells, of images [N, 3, H, W] with H and W multiples of 16. Waits for the device:
    /// native only.
    pub(crate) fn feature_size(&self, images: Tensor<4>) -> f32 {
        let features = self.main.features((images - 0.5) * 4.0).at8;
        features.square().mean().into_scalar::<f32>().sqrt()
    }

    fn has_seams(&self) -> bool {
        self.config.as_compact().is_some_and(|shape| shape.seams)
    }

    /// Up-samples coordinates of cells [N, 3, h, w] to every pixel, [N, 3, 8 h, 8 w]. It does so as
    /// [`CompactNetwork::at_pixels`] does, but not across seams if the template has them.
    pub fn upsample(&self, coordinates: Tensor<4>) -> Tensor<4> {
        if self.has_seams() {
            upsample_across_seams(coordinates, PIXELS_PER_CELL)
        } else {
            Self::at_pixels(coordinates)
        }
    }

    /// Coordinates of cells [N, 3, h, w] of one chart at every pixel, [N, 3, 8 h, 8 w].
    pub fn at_pixels(coordinates: Tensor<4>) -> Tensor<4> {
        upsample_bilinear(coordinates, PIXELS_PER_CELL)
    }

    /// See [`crate::Network::describe`].
    pub(crate) fn describe(&self, table: &mut LayerTable) {
        let [_, height, width] = table.size();
        let (height, width) = (
            height.next_multiple_of(INPUT_MULTIPLE),
            width.next_multiple_of(INPUT_MULTIPLE),
        );
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

/// Zeros at the right and below up to multiples of `multiple`: [N, C, H, W] -> [N, C, H', W'].
fn pad(images: Tensor<4>, multiple: usize) -> Tensor<4> {
    let [n, c, height, width] = images.dims();
    let (h, w) = (height.next_multiple_of(multiple), width.next_multiple_of(multiple));
    let device = images.device();
    let mut padded = images;
    if h > height {
        padded = Tensor::cat(vec![padded, Tensor::zeros([n, c, h - height, width], &device)], 2);
    }
    if w > width {
        padded = Tensor::cat(vec![padded, Tensor::zeros([n, c, h, w - width], &device)], 3);
    }
    padded
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
