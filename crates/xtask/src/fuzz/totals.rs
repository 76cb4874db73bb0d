//! How many inputs each fuzz target has had, over all runs.

use anyhow::{Context, Result};
use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

const FILE: &str = "inputs.json";

/// The inputs of each target, and the file in which they are kept.
pub struct Totals {
    file: PathBuf,
    inputs: BTreeMap<String, u64>,
}

impl Totals {
    /// Those in `folder`, which need not be there yet.
    pub fn load(folder: &Path) -> Result<Self> {
        let file = folder.join(FILE);
        let inputs = match fs::read(&file) {
            Ok(bytes) => serde_json::from_slice(&bytes).with_context(|| format!("reading {}", file.display()))?,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => BTreeMap::new(),
            Err(error) => return Err(error).with_context(|| format!("reading {}", file.display())),
        };
        Ok(Self { file, inputs })
    }

    /// Inputs of a target.
    pub fn inputs(&self, name: &str) -> u64 {
        self.inputs.get(name).copied().unwrap_or(0)
    }

    /// Adds inputs of a target, and writes the file: beside itself, then a rename.
    pub fn add(&mut self, name: &str, inputs: u64) -> Result<()> {
        *self.inputs.entry(name.to_owned()).or_default() += inputs;
        let write = || -> std::io::Result<()> {
            fs::create_dir_all(self.file.parent().unwrap_or(Path::new(".")))?;
            let fresh = self.file.with_extension("new");
            fs::write(&fresh, serde_json::to_vec_pretty(&self.inputs)?)?;
            fs::rename(&fresh, &self.file)
        };
        write().with_context(|| format!("writing {}", self.file.display()))
    }
}
