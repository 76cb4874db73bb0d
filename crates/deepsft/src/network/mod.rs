//! The compact DeepSfT network: main block, depth refinement, registration refinement.
//!
//! The paper's structure (section 3) at a hundredth of its cost. It sees the image in cells of 8
//! pixels, classifies coarse positions at 16, and hands out maps at full resolution.

mod bins;
mod layers;
mod main_block;
mod reading;
mod refinement;
mod weight_array;

pub use bins::cross_entropy;
pub use reading::{images_to_tensor, read_maps};
pub use weight_array::WeightArray;

use burn::module::Module;
use burn::tensor::{Device, Tensor};
use layers::{Convolution, depth_to_space, scaled_relu, upsample_bilinear, upsample_nearest};
use main_block::MainBlock;
use refinement::{RefinementBlock, isometric_depth};
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
    /// Depths the network can say.
    pub depth_range: DepthRange,
}

impl NetworkConfig {
    /// The compact network for a template of `template_size_mm` seen by a camera of focal length
    /// `focal` pixels.
    pub fn compact(template_size_mm: [f64; 2], focal: f64) -> Self {
        Self {
            channels: [32, 48, 96, 160],
            blocks_at_32: 2,
            bins: [32, 24, 24],
            refinement_channels: 32,
            mask_channels: 24,
            template_size_mm,
            focal,
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
            depth_refinement: RefinementBlock::new(self, 1, device),
            registration_refinement: RefinementBlock::new(self, 2, device),
            mask_coarse: Convolution::standardised([self.channels[1], mask], 1, 1, 1.0, device),
            mask_fine: Convolution::standardised([self.channels[0], mask], 1, 1, 1.0, device),
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
    mask: Convolution,
    #[module(skip)]
    config: NetworkConfig,
}

impl Network {
    /// How the network was built.
    pub fn config(&self) -> &NetworkConfig {
        &self.config
    }

    /// Images [N, 3, H, W] with values 0..=1, H and W multiples of 16 -> [`NetworkOutput`].
    pub fn forward(&self, images: Tensor<4>) -> NetworkOutput {
        let main = self.main.forward((images - 0.5) * 4.0);
        let [n, _, h, w] = main.coordinates.dims();
        let features = scaled_relu(main.features);
        let isometric = isometric_depth(&main.coordinates, &self.config);
        let cues = |coordinates: &Tensor<4>| Tensor::cat(vec![coordinates.clone(), isometric.clone()], 1);
        let registration = main.coordinates.clone().slice([0..n, 0..2, 0..h, 0..w]);
        let depth = main.coordinates.clone().slice([0..n, 2..3, 0..h, 0..w]);
        let depth = depth + self.depth_refinement.forward(features.clone(), cues(&main.coordinates));
        let seen = Tensor::cat(vec![registration.clone(), depth.clone()], 1);
        let registration = registration + self.registration_refinement.forward(features.clone(), cues(&seen));
        let refined = Tensor::cat(vec![registration, depth], 1);

        let coarse = upsample_nearest(self.mask_coarse.forward(features), 2 * h, 2 * w);
        let fine = self.mask_fine.forward(scaled_relu(main.patches));
        let mask = depth_to_space(self.mask.forward(scaled_relu(coarse + fine)), PATCH);
        NetworkOutput {
            bins: main.bins,
            main: main.coordinates,
            refined,
            mask,
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
            mask: self.mask.fold(),
            config: self.config,
        }
    }
}
