//! The three blocks of a network and which of them are trained.

use super::Network;
use burn::module::Module;

/// A block of the network (paper, section 3.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Block {
    /// Main Block: image -> depth and registration. For the compact network with its mask head, for R50F everything.
    Main,
    /// Depth Refinement Block.
    DepthRefinement,
    /// Registration Refinement Block.
    RegistrationRefinement,
}

impl Block {
    /// All of them, in the order of the network.
    pub const ALL: [Self; 3] = [Self::Main, Self::DepthRefinement, Self::RegistrationRefinement];

    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Main => "main block",
            Self::DepthRefinement => "depth refinement",
            Self::RegistrationRefinement => "registration refinement",
        }
    }
}

impl Network {
    /// Number of values of `block`'s weights; batch normalisation counts four a channel (scale, offset, running mean
    /// and variance). 0 for a block that the architecture does not have.
    pub fn block_parameters(&self, block: Block) -> usize {
        match self {
            Self::Compact(network) => network.block_parameters(block),
            Self::Paper(network) => network.block_parameters(block),
            Self::R50F(network) => network.block_parameters(block),
        }
    }

    /// The same network with only `blocks` trained (paper, section 4: step 2 trains the depth refinement, step 3 the
    /// registration refinement): the weights of the others get no gradients, and their batch normalisation uses and
    /// keeps its running statistics. `train_only(&Block::ALL)` trains everything again.
    pub fn train_only(self, blocks: &[Block]) -> Self {
        match self {
            Self::Compact(network) => Self::Compact(network.train_only(blocks)),
            Self::Paper(network) => Self::Paper(network.train_only(blocks)),
            Self::R50F(network) => Self::R50F(network.train_only(blocks)),
        }
    }
}

/// `module`, a part of `block`, as [`Network::train_only`] wants it.
pub(super) fn train_if_listed<M: Module>(module: M, block: Block, blocks: &[Block]) -> M {
    if blocks.contains(&block) {
        module.unfreeze()
    } else {
        module.freeze()
    }
}
