//! The compact DeepSfT network: main block, depth refinement, registration refinement.
//!
//! The paper's structure (section 3) at a hundredth of its cost. It sees the image in cells of 8
//! pixels, classifies coarse positions at 16, and hands out maps at full resolution.

mod bins;
mod layers;
mod main_block;
mod planar;
mod reading;
mod refinement;
mod weight_array;

pub use bins::cross_entropy;
pub use reading::{images_to_tensor, read_maps};
pub use weight_array::WeightArray;

use burn::module::Module;
use burn::tensor::{Device, Tensor, activation};
use deepsft_geometry::Camera;
use layers::{Convolution, depth_to_space, scaled_relu, upsample_bilinear, upsample_nearest};
use main_block::MainBlock;
use planar::{PLANAR_CUES, planar_depth};
use refinement::{RefinementBlock, departures, isometric_depth, weighed};
use serde::{Deserialize, Serialize};

/// Side of a patch that is embedded at once, pixels.
const PATCH: usize = 4;

/// Side of a cell of the network's coordinate maps, pixels.
pub const PIXELS_PER_CELL: usize = 8;

/// Height and width of an input must be multiples of this: the stride of the bins.
pub const INPUT_MULTIPLE: usize = 16;

/// Depths the network can say, mm. Depth z is handled as d = ln(z / near) / ln(far / near).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DepthRange {
    /// Depth of d = 0, mm.
    pub near_mm: f64,
    /// Depth of d = 1, mm.
    pub far_mm: f64,
}

impl DepthRange {
    /// Normalised log depth of `depth_mm`.
    pub fn normalise(&self, depth_mm: f64) -> f64 {
        (depth_mm / self.near_mm).ln() / (self.far_mm / self.near_mm).ln()
    }

    /// Depth in mm of normalised log depth `d`.
    pub fn depth_mm(&self, d: f64) -> f64 {
        self.near_mm * (self.far_mm / self.near_mm).powf(d)
    }
}

/// Shape of the compact network. Everything needed to build it again from its weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NetworkConfig {
    /// Channels at strides 4, 8, 16 and 32.
    pub channels: [usize; 4],
    /// Residual blocks at stride 32.
    pub blocks_at_32: usize,
    /// Bins for u, v and depth.
    pub bins: [usize; 3],
    /// Width of the two refinement blocks.
    pub refinement_channels: usize,
    /// Width of the mask head at stride 4.
    pub mask_channels: usize,
    /// Size of the template, mm (the isometric depth cue needs it).
    pub template_size_mm: [f64; 2],
    /// Focal length of the training camera, pixels.
    pub focal: f64,
    /// Principal point of the training camera, pixels.
    pub principal_point: [f64; 2],
    /// Depths the network can say.
    pub depth_range: DepthRange,
}

impl NetworkConfig {
    /// The compact network for a template of `template_size_mm` seen by the pinhole `camera` that training
    /// images are rendered with.
    pub fn compact(template_size_mm: [f64; 2], camera: &Camera) -> Self {
        Self {
            channels: [32, 48, 96, 160],
            blocks_at_32: 2,
            bins: [32, 24, 24],
            refinement_channels: 32,
            mask_channels: 24,
            template_size_mm,
            focal: camera.focal().x,
            principal_point: camera.principal_point().to_array(),
            depth_range: DepthRange {
                near_mm: 150.0,
                far_mm: 1200.0,
            },
        }
    }

    /// Whether a network of this shape can be made: widths and numbers within bounds far above what is
    /// useful, so that a damaged description costs no memory.
    ///
    /// # Errors
    /// A sentence that names the field.
    pub fn check(&self) -> Result<(), String> {
        let within = |field: &str, value: usize, least: usize, most: usize| {
            if (least..=most).contains(&value) {
                Ok(())
            } else {
                Err(format!("{field} is {value}, expected {least} to {most}"))
            }
        };
        self.channels.iter().try_for_each(|&c| within("channels", c, 1, 1024))?;
        within("blocks_at_32", self.blocks_at_32, 0, 32)?;
        self.bins.iter().try_for_each(|&b| within("bins", b, 2, 512))?;
        within("refinement_channels", self.refinement_channels, 1, 512)?;
        within("mask_channels", self.mask_channels, 1, 512)?;
        let lengths = [
            self.template_size_mm[0],
            self.template_size_mm[1],
            self.focal,
            self.depth_range.near_mm,
        ];
        if !lengths.iter().all(|l| l.is_finite() && *l > 0.0) {
            return Err("template_size_mm, focal and depth_range must be positive and finite".to_owned());
        }
        if !self.principal_point.iter().all(|c| c.is_finite()) {
            return Err("principal_point must be finite".to_owned());
        }
        if !(self.depth_range.far_mm.is_finite() && self.depth_range.far_mm > self.depth_range.near_mm) {
            return Err("depth_range ends before it begins".to_owned());
        }
        Ok(())
    }

    /// A randomly initialised network.
    pub fn init(&self, device: &Device) -> Network {
        let mask = self.mask_channels;
        Network {
            main: MainBlock::new(self, device),
            depth_refinement: RefinementBlock::new(self, 2 + PLANAR_CUES, device),
            registration_refinement: RefinementBlock::new(self, 2, device),
            mask_coarse: Convolution::standardised([self.channels[1], mask], 1, 1, 1.0, device),
            mask_fine: Convolution::standardised([self.channels[0], mask], 1, 1, 1.0, device),
            mask_mix: Convolution::standardised([mask, mask], 3, 1, layers::BRANCH_GAIN, device),
            mask: Convolution::head([mask, PATCH * PATCH], 1, device),
            config: self.clone(),
        }
    }
}

/// Everything the network says of N images of H x W pixels.
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

/// The network with its weights.
#[derive(Module, Debug)]
pub struct Network {
    main: MainBlock,
    depth_refinement: RefinementBlock,
    registration_refinement: RefinementBlock,
    mask_coarse: Convolution,
    mask_fine: Convolution,
    mask_mix: Convolution,
    mask: Convolution,
    #[module(skip)]
    config: NetworkConfig,
}

impl Network {
    /// How the network was built.
    pub fn config(&self) -> &NetworkConfig {
        &self.config
    }

    /// Frames [N, 3, H, W] of the training camera, values 0..=1, padded at the right and below to multiples
    /// of 16 -> [`NetworkOutput`].
    pub fn forward(&self, images: Tensor<4>) -> NetworkOutput {
        self.forward_at(images, None)
    }

    /// As [`Network::forward`], for windows of frames; `corners` [N, 2, 1, 1] is the pixel (x, y) of each
    /// frame where its window begins.
    pub fn forward_windows(&self, images: Tensor<4>, corners: &Tensor<4>) -> NetworkOutput {
        self.forward_at(images, Some(corners))
    }

    fn forward_at(&self, images: Tensor<4>, corners: Option<&Tensor<4>>) -> NetworkOutput {
        let main = self.main.forward((images - 0.5) * 4.0);
        let [n, _, h, w] = main.coordinates.dims();
        let features = scaled_relu(main.features);

        let coarse = upsample_nearest(self.mask_coarse.forward(features.clone()), 2 * h, 2 * w);
        let mask = coarse + self.mask_fine.forward(scaled_relu(main.patches));
        let mask = mask.clone() + self.mask_mix.forward(scaled_relu(mask));
        let mask = self.mask.forward(scaled_relu(mask)); // [N, 16, H / 4, W / 4]

        let isometric = isometric_depth(&main.coordinates, &self.config);
        let planar = planar_depth(&main.coordinates, &seen_share(&mask), corners, &self.config);
        let measured = Tensor::cat(vec![isometric, planar.clone()], 1);

        let registration = main.coordinates.clone().slice([0..n, 0..2]);
        let depth = main.coordinates.clone().slice([0..n, 2..3]);
        let cues = Tensor::cat(vec![main.coordinates.clone(), departures(&measured, &depth)], 1);
        let said = self.depth_refinement.forward(features.clone(), cues);
        let correction = said.clone().slice([0..n, 0..1]);
        let depth = weighed(depth, planar, said.slice([0..n, 1..2 + PLANAR_CUES])) + correction;

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

    /// Coordinates of cells [N, 3, h, w] at every pixel, [N, 3, 8 h, 8 w].
    pub fn at_pixels(coordinates: Tensor<4>) -> Tensor<4> {
        upsample_bilinear(coordinates, PIXELS_PER_CELL)
    }

    /// The same function with all standardisation baked into the weights, for inference.
    pub fn fold(self) -> Self {
        Self {
            main: self.main.fold(),
            depth_refinement: self.depth_refinement.fold(),
            registration_refinement: self.registration_refinement.fold(),
            mask_coarse: self.mask_coarse.fold(),
            mask_fine: self.mask_fine.fold(),
            mask_mix: self.mask_mix.fold(),
            mask: self.mask.fold(),
            config: self.config,
        }
    }
}

/// Probability that a cell shows the object, from the mean logit of its pixels: logits of patches
/// [N, 16, 2 h, 2 w] -> [N, 1, h, w]. Not differentiated.
fn seen_share(mask: &Tensor<4>) -> Tensor<4> {
    let [n, _, rows, columns] = mask.dims();
    let patches = mask.clone().detach().mean_dim(1);
    let cells: Tensor<6> = patches.reshape([n, 1, rows / 2, 2, columns / 2, 2]);
    let mean: Tensor<4> = cells.mean_dim(3).mean_dim(5).reshape([n, 1, rows / 2, columns / 2]);
    activation::sigmoid(mean)
}
