//! The object that a command shows: a template, or that of a model.

use crate::failure::usage;
use crate::input;
use anyhow::Result;
use clap::Args;
use deepsft_formats::read_template;
use deepsft_geometry::Template;
use std::path::PathBuf;

/// A template by its folder or by that of a model.
#[derive(Args)]
#[group(required = true, multiple = false)]
pub struct ObjectChoice {
    /// Folder of the template to show
    #[arg(long, value_name = "DIR")]
    template: Option<PathBuf>,
    /// Model bundle whose template to show
    #[arg(long, value_name = "BUNDLE")]
    model: Option<PathBuf>,
}

impl ObjectChoice {
    /// Reads the template.
    pub fn template(&self) -> Result<Template> {
        match (&self.template, &self.model) {
            (Some(folder), _) => Ok(read_template(folder)?),
            (None, Some(bundle)) => Ok(input::bundle(bundle)?.template().clone()),
            (None, None) => Err(usage("--template or --model is needed")),
        }
    }
}
