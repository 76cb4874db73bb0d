//! Stages at which maps are read from a network.

/// A stage of a network at which its maps are read: the rows of an ablation of the refinement blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// What the main block says.
    Main,
    /// The main block's registration with the depth of the depth refinement block.
    DepthRefinement,
    /// Depth and registration of the refinement blocks: the network's answer.
    RegistrationRefinement,
}

impl Stage {
    /// Returns its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Main => "main block only",
            Self::DepthRefinement => "+ depth refinement",
            Self::RegistrationRefinement => "+ registration refinement",
        }
    }
}
