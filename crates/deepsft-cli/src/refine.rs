//! What is done after the network.

use anyhow::Result;
use clap::ValueEnum;
use deepsft_geometry::physics::{PhysicsOptions, PhysicsRefinement};
use deepsft_geometry::{CompletionOptions, MapsCompletion, Refinement, Template};

/// How maps are refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Refine {
    /// Not at all: the network's own maps
    None,
    /// By the mesh that explains the image under isometry
    Physics,
    /// Completed only: what is seen stays about where the network has it, what is hidden is recovered as rigidly as
    /// possible
    Arap,
}

impl Refine {
    /// The refinement for a template, if there is to be one.
    pub fn prepare(self, template: &Template) -> Result<Option<Refinement>> {
        Ok(match self {
            Self::None => None,
            Self::Physics => Some(PhysicsRefinement::new(template, PhysicsOptions::default())?.into()),
            Self::Arap => Some(MapsCompletion::new(template.mesh(), CompletionOptions::default())?.into()),
        })
    }
}
