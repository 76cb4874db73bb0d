//! How a command finds the whole mesh after the network.

use anyhow::Result;
use clap::ValueEnum;
use deepsft_geometry::fitting::FrameFitter;
use deepsft_geometry::{CompletionOptions, MapsCompletion, MeshRecovery, Template};

/// How the whole mesh is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MeshChoice {
    /// No mesh: the network's own maps
    None,
    /// Fit the template's mesh to the network's maps and to the image: a sheet keeps its lengths, a solid its shape
    Fit,
    /// Keep what the network sees and recover the hidden rest as rigidly as possible (ARAP)
    Complete,
}

impl MeshChoice {
    /// What finds the mesh of `template`, if one is asked for.
    pub fn prepare(self, template: &Template) -> Result<Option<MeshRecovery>> {
        Ok(match self {
            Self::None => None,
            Self::Fit => Some(MeshRecovery::Fit(Box::new(FrameFitter::new(template)?))),
            Self::Complete => {
                let completion = MapsCompletion::new(template.mesh(), CompletionOptions::default())?;
                Some(MeshRecovery::Completion(Box::new(completion)))
            }
        })
    }
}
