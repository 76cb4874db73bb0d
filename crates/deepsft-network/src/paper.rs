//! The paper's network (section 3.3), as its printed parameter counts describe it.
//!
//! The counts fit blocks of Keras' ResNet-50 exactly for the refinement blocks (13,618,689 with one output channel) and
//! to within 250 for the main block (81,664,515); the printed layer tables describe shallower networks. So the layers
//! here are those that the counts tell, on the tables' path of sizes. Where the paper is silent (our choice): pixels
//! enter as 2 value - 1, depth is the normalised depth of [`deepsft_inference::DepthRange`], a map of an odd height is cropped at
//! the bottom, so that its rows stay over the encoder's.

mod block;

use super::block::Block;
use super::description::LayerTable;
use super::maps::NetworkMaps;
use super::weight_init::WeightInit;
use block::PaperBlock;
use burn::module::Module;
use burn::tensor::Tensor;
use deepsft_geometry::{CANONICAL_HEIGHT, CANONICAL_WIDTH};
use deepsft_inference::{NetworkConfig, PaperConfig};

/// The paper's network with its weights.
#[derive(Module, Debug)]
pub struct PaperNetwork {
    main: PaperBlock,
    depth_refinement: PaperBlock,
    registration_refinement: PaperBlock,
    #[module(skip)]
    pub(crate) config: NetworkConfig,
}

impl PaperNetwork {
    /// A network of `shape` for the images of `config`; drawn weights are by Glorot and Bengio.
    pub(super) fn new(shape: &PaperConfig, config: &NetworkConfig, init: WeightInit) -> Self {
        let divisor = shape.width_divisor;
        Self {
            main: PaperBlock::main(divisor, init),
            depth_refinement: PaperBlock::refinement(divisor, 1, init),
            registration_refinement: PaperBlock::refinement(divisor, 2, init),
            config: config.clone(),
        }
    }

    /// See [`super::Network::forward_maps`].
    pub(super) fn forward_maps(&self, images: Tensor<4>) -> NetworkMaps {
        let images = images * 2.0 - 1.0;
        let main = self.main.forward(images.clone()); // [N, 3, 270, 480]
        let (main_depth, main_registration) = (main.clone().narrow(1, 0, 1), main.clone().narrow(1, 1, 2));
        let seen = Tensor::cat(vec![images, main], 1); // [N, 6, 270, 480]
        let depth = self.depth_refinement.forward(seen.clone());
        let registration = main_registration.clone() + self.registration_refinement.forward(seen);
        NetworkMaps {
            main_depth,
            main_registration,
            mask_logits: NetworkMaps::mask_logits_of_depth(depth.clone()),
            depth,
            registration,
        }
    }

    /// See [`super::Network::describe`].
    pub(super) fn describe(&self, table: &mut LayerTable) {
        self.main.describe(table);
        let seen = [6, CANONICAL_HEIGHT, CANONICAL_WIDTH];
        for (block, layers) in [
            (Block::DepthRefinement, &self.depth_refinement),
            (Block::RegistrationRefinement, &self.registration_refinement),
        ] {
            table.begin(block, seen);
            layers.describe(table);
        }
    }
}
