//! What is done after the network.

use anyhow::Result;
use clap::ValueEnum;
use deepsft_geometry::fitting::{FitOptions, FrameFitter};
use deepsft_geometry::{CompletionOptions, MapsCompletion, MeshRecovery, Template};

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
    pub fn prepare(self, template: &Template) -> Result<Option<MeshRecovery>> {
        Ok(match self {
            Self::None => None,
            Self::Physics => Some(FrameFitter::new(template, FitOptions::default())?.into()),
            Self::Arap => Some(MapsCompletion::new(template.mesh(), CompletionOptions::default())?.into()),
        })
    }
}
