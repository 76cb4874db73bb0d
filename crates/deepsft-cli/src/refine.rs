//! What is done after the network.

use anyhow::Result;
use clap::ValueEnum;
use deepsft_geometry::Template;
use deepsft_geometry::physics::{PhysicsOptions, PhysicsRefinement};

/// How maps are refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Refine {
    /// Not at all: the network's own maps
    None,
    /// By the mesh that explains the image under isometry
    Physics,
}

impl Refine {
    /// The refinement for a template, if there is to be one.
    pub fn prepare(self, template: &Template) -> Result<Option<PhysicsRefinement>> {
        Ok(match self {
            Self::None => None,
            Self::Physics => Some(PhysicsRefinement::new(template, PhysicsOptions::default())?),
        })
    }
}
