//! Our own rows, through the crate that users call: finders without training, a trained network, and the fit of the mesh.

use anyhow::{Context, Result, ensure};
use deepsft::{Device, Estimator, Finder, MODEL_FILE, ModelBundle, Target, TargetFinder, View};
use deepsft_formats::template_fingerprint;
use deepsft_geometry::{Camera, Maps, Picture, Template};
use std::collections::BTreeMap;
use std::{fs, path::Path};

/// The training-free finder and fit of a template.
///
/// # Errors
/// For a print of a size that no print has.
pub fn features(template: &Template) -> Result<TargetFinder> {
    Ok(TargetFinder::new(Target::from_template(template.clone()))?)
}

/// A trained network, alone and with the fit of the mesh to the image.
#[derive(Debug)]
pub struct Network {
    /// The network alone.
    pub alone: Estimator,
    /// Its maps, then the fit; no other finder.
    pub with_fit: TargetFinder,
}

impl Network {
    /// Reads the bundle in `folder`, which was trained for `template`.
    ///
    /// # Errors
    /// Names the folder that is no bundle or one of another template.
    pub fn read(folder: &Path, template: &Template) -> Result<Self> {
        Self::open(folder, template).with_context(|| format!("model bundle {}", folder.display()))
    }

    fn open(folder: &Path, template: &Template) -> Result<Self> {
        let read = |name: &str| fs::read(folder.join(name)).with_context(|| name.to_owned());
        let description = read(MODEL_FILE)?;
        let mut files = BTreeMap::new();
        for (name, _) in ModelBundle::file_names(&description)? {
            files.insert(name.clone(), read(&name)?);
        }
        files.insert(MODEL_FILE.to_owned(), description);
        let bundle = ModelBundle::from_files(&files)?;
        let is_same = template_fingerprint(bundle.template()) == template_fingerprint(template);
        ensure!(is_same, "it was trained for another template");
        let alone = Estimator::new(&bundle, &Device::Cpu)?;
        let finders = vec![Finder::Network(Box::new(alone.clone()))];
        Ok(Self {
            with_fit: TargetFinder::with_finders(Target::from_model(&bundle, &Device::Cpu)?, finders),
            alone,
        })
    }

    /// The network's own maps of an image.
    ///
    /// # Errors
    /// When the image is not of its camera's size.
    pub fn maps(&self, image: &Picture, camera: &Camera) -> Result<Option<Maps>> {
        let estimate = pollster::block_on(self.alone.estimate(image, camera))?;
        Ok(estimate.judgement.found.then_some(estimate.maps))
    }
}

/// The maps of the fitted mesh of an image, where `finder` finds the object.
///
/// # Errors
/// When the image is not of its camera's size.
pub fn fitted_maps(finder: &mut TargetFinder, image: &Picture, camera: &Camera) -> Result<Option<Maps>> {
    let estimate = pollster::block_on(finder.estimate(&mut View::new(image, camera)))?;
    Ok(estimate.judgement.found.then_some(estimate.maps))
}
