//! What commands read: bundles, pictures, the object of a study. Errors name the file.

use anyhow::{Context, Result, ensure};
use clap::Args;
use deepsft::{Device, Estimator, MODEL_FILE, ModelBundle, Target, decode_picture};
use deepsft_formats::read_template;
use deepsft_geometry::Picture;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// An object by its model or by its template.
#[derive(Args)]
#[group(required = true, multiple = false)]
pub struct ObjectChoice {
    /// Model bundle of the object
    #[arg(long, value_name = "BUNDLE")]
    model: Option<PathBuf>,
    /// Folder of the object's template
    #[arg(long, value_name = "DIR")]
    template: Option<PathBuf>,
}

impl ObjectChoice {
    /// The object and its name: a model's, or the template's folder.
    pub fn target(&self) -> Result<(Target, String)> {
        if let Some(folder) = &self.model {
            let bundle = bundle(folder)?;
            return Ok((Target::from_model(&bundle, &Device::Cpu)?, bundle.name().to_owned()));
        }
        let folder = self.template.as_deref().context("--model or --template is needed")?;
        Ok((
            Target::from_template(read_template(folder)?),
            folder.display().to_string(),
        ))
    }
}

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

/// The PNG and JPEG files of a folder, by name. There must be one.
pub fn pictures(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut pictures = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        if ["png", "jpg", "jpeg"].iter().any(|known| extension == *known) {
            pictures.push(path);
        }
    }
    ensure!(
        !pictures.is_empty(),
        "{}: there is no PNG or JPEG file in it",
        folder.display()
    );
    pictures.sort();
    Ok(pictures)
}
