//! Our own rows, through the crate that users call: finders without training, a trained network, and the fit of the mesh.

use anyhow::{Context, Result, ensure};
use deepsft::session::{VideoFollower, VideoOptions};
use deepsft::{Architecture, Device, Estimator, Finder, MODEL_FILE, ModelBundle, Target, TargetFinder, View};
use deepsft_formats::template_fingerprint;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, Maps, Picture, Template, TriangleMesh};
use deepsft_synth::Sample;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The training-free finder and fit of a template.
/// Fails for a print of a size that no print has.
pub fn features(template: &Template) -> Result<TargetFinder> {
    Ok(TargetFinder::new(Target::from_template(template.clone()))?)
}

/// A trained network, alone and with the fit of the mesh to the image.
pub struct Network {
    /// What it is called in tables.
    pub name: String,
    /// The network alone.
    pub alone: Estimator,
    /// Its maps, then the fit; no other finder.
    pub with_fit: TargetFinder,
}

impl Network {
    /// Reads the bundle in `folder`, which was trained for `template`.
    /// Errors name the folder that is no bundle or one of another template.
    pub fn read(folder: &Path, template: &Template) -> Result<Self> {
        Self::open(folder, template).with_context(|| format!("model bundle {}", folder.display()))
    }

    fn open(folder: &Path, template: &Template) -> Result<Self> {
        let read = |name: &str| fs::read(folder.join(name)).with_context(|| name.to_owned());
        let description = read(MODEL_FILE)?;
        let listed = ModelBundle::file_names(&description)?.into_iter();
        let files = listed.map(|(name, _)| Ok((name.clone(), read(&name)?)));
        let mut files = files.collect::<Result<BTreeMap<_, _>>>()?;
        files.insert(MODEL_FILE.to_owned(), description);
        let bundle = ModelBundle::from_files(&files)?;
        let is_same = template_fingerprint(bundle.template()) == template_fingerprint(template);
        ensure!(is_same, "it was trained for another template");
        let (name, divisor) = match bundle.network().config.architecture {
            Architecture::Compact(_) => ("ours", 1),
            Architecture::Paper(config) => ("DeepSfT", config.width_divisor),
            Architecture::R50F(config) => ("R50F", config.width_divisor),
        };
        let name = match divisor {
            1 => name.to_owned(),
            _ => format!("{name} of 1/{divisor} of the width"),
        };
        let alone = Estimator::new(&bundle, &Device::Cpu)?;
        let finders = vec![Finder::Network(Box::new(alone.clone()))];
        Ok(Self {
            with_fit: TargetFinder::with_finders(Target::from_model(&bundle, &Device::Cpu)?, finders),
            alone,
            name,
        })
    }

    /// The network's own maps of an image.
    /// Fails when the image is not of its camera's size.
    pub fn maps(&self, image: &Picture, camera: &Camera) -> Result<Option<Maps>> {
        let estimate = pollster::block_on(self.alone.estimate(image, camera))?;
        Ok(estimate.judgement.found.then_some(estimate.maps))
    }
}

/// The model bundles among the folders in `trained`, by name.
/// Fails when the folder cannot be read.
pub fn bundles(trained: Option<&Path>) -> Result<Vec<PathBuf>> {
    let Some(trained) = trained else { return Ok(Vec::new()) };
    let entries = fs::read_dir(trained).with_context(|| trained.display().to_string())?;
    let mut folders = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    folders.retain(|folder| folder.join(MODEL_FILE).is_file());
    folders.sort();
    Ok(folders)
}

/// The maps of the fitted mesh of an image, where `finder` finds the object.
/// Fails when the image is not of its camera's size.
pub fn fitted_maps(finder: &mut TargetFinder, image: &Picture, camera: &Camera) -> Result<Option<Maps>> {
    let estimate = pollster::block_on(finder.estimate(&mut View::new(image, camera)))?;
    Ok(estimate.judgement.found.then_some(estimate.maps))
}

/// Follows a video from its frames alone: the template is found without training, then tracked.
/// Fails for a template that cannot be tracked.
pub fn follower(finder: &mut TargetFinder) -> Result<VideoFollower<'_>> {
    // A file waits for its answers.
    let options = VideoOptions {
        delay: 0,
        ..VideoOptions::default()
    };
    Ok(VideoFollower::new(finder, options, || 0.0)?)
}

/// The maps of the mesh in the next frame of a video, taken at `time_s`, where it is found.
/// Fails when the image is not of its camera's size.
pub fn followed(
    follower: &mut VideoFollower<'_>,
    time_s: f64,
    sample: &Sample,
    mesh: &TriangleMesh,
) -> Result<Option<Maps>> {
    let mut view = View::new(&sample.image, &sample.camera);
    let surface = pollster::block_on(follower.follow(time_s, &mut view))?.followed.surface;
    Ok(surface.map(|surface| VisibleSurface::new(mesh, &surface.vertices_camera, &sample.camera).maps()))
}
