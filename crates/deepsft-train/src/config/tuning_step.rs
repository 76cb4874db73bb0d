//! The training steps on a recording.

use deepsft_network::Block;

/// A training step on a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TuningStep {
    /// Step 2: the depth refinement block, against measured depth.
    Depth,
    /// Step 3: the registration refinement block, by photo-consistency.
    Registration,
}

impl TuningStep {
    /// The block that is trained.
    pub fn block(self) -> Block {
        match self {
            Self::Depth => Block::DepthRefinement,
            Self::Registration => Block::RegistrationRefinement,
        }
    }

    /// The paper's number of it.
    pub fn number(self) -> u8 {
        match self {
            Self::Depth => 2,
            Self::Registration => 3,
        }
    }
}
