//! What commands read: bundles and pictures. Errors name the file.

use anyhow::{Context, Result};
use deepsft::{Device, Estimator, MODEL_FILE, ModelBundle, decode_picture};
use deepsft_geometry::Picture;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The model bundle in a folder.
pub fn bundle(folder: &Path) -> Result<ModelBundle> {
    let read = |name: &str| fs::read(folder.join(name)).with_context(|| format!("{}: {name}", folder.display()));
    let description = read(MODEL_FILE)?;
    let mut files = BTreeMap::new();
    for (name, _) in ModelBundle::file_names(&description)? {
        files.insert(name.clone(), read(&name)?);
    }
    files.insert(MODEL_FILE.to_owned(), description);
    Ok(ModelBundle::from_files(&files)?)
}

/// The model of a bundle on the CPU.
pub fn estimator(bundle: &ModelBundle) -> Result<Estimator> {
    Ok(Estimator::new(bundle, &Device::Cpu)?)
}

/// A PNG or JPEG file.
pub fn picture(path: &Path) -> Result<Picture> {
    let read = || -> Result<Picture> { Ok(decode_picture(&fs::read(path)?)?) };
    read().with_context(|| path.display().to_string())
}
