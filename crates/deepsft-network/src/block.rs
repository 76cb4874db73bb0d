//! The three blocks of a network and which of them are trained.

use burn::module::ParamGroup;
use deepsft_inference::Stage;

/// A block of the network (paper, section 3.3).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
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
    pub const ALL: &[Self] = &[Self::Main, Self::DepthRefinement, Self::RegistrationRefinement];

    /// Its name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Main => "main block",
            Self::DepthRefinement => "depth refinement",
            Self::RegistrationRefinement => "registration refinement",
        }
    }

    /// The stage at which its maps are read.
    pub fn stage(self) -> Stage {
        match self {
            Self::Main => Stage::Main,
            Self::DepthRefinement => Stage::DepthRefinement,
            Self::RegistrationRefinement => Stage::RegistrationRefinement,
        }
    }

    /// The values of its weights, as a part of a [`super::Network`].
    pub(super) fn group(self) -> ParamGroup {
        let parts = ["depth_refinement", "registration_refinement"];
        match self {
            Self::Main => ParamGroup::all().exclude(ParamGroup::from_any_predicates(parts.to_vec())),
            Self::DepthRefinement => ParamGroup::from_predicate(parts[0]),
            Self::RegistrationRefinement => ParamGroup::from_predicate(parts[1]),
        }
    }
}
