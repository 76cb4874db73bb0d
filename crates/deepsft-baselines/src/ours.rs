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
///
/// # Errors
/// For a print of a size that no print has.
pub fn features(template: &Template) -> Result<TargetFinder> {
    Ok(TargetFinder::new(Target::from_template(template.clone()))?)
}

/// A trained network, alone and with the fit of the mesh to the image.
#[derive(Debug)]
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
        let name = match bundle.network().config.architecture {
            Architecture::Compact(_) => "ours".to_owned(),
            Architecture::Paper(config) => format!("DeepSfT{}", of_width(config.width_divisor)),
            Architecture::R50F(config) => format!("R50F{}", of_width(config.width_divisor)),
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
    ///
    /// # Errors
    /// When the image is not of its camera's size.
    pub fn maps(&self, image: &Picture, camera: &Camera) -> Result<Option<Maps>> {
        let estimate = pollster::block_on(self.alone.estimate(image, camera))?;
        Ok(estimate.judgement.found.then_some(estimate.maps))
    }
}

fn of_width(divisor: usize) -> String {
    if divisor == 1 {
        String::new()
    } else {
        format!(" of 1/{divisor} of the width")
    }
}

/// The model bundles among the folders in `trained`, by name.
///
/// # Errors
/// When the folder cannot be read.
pub fn bundles(trained: Option<&Path>) -> Result<Vec<PathBuf>> {
    let Some(trained) = trained else { return Ok(Vec::new()) };
    let entries = fs::read_dir(trained).with_context(|| trained.display().to_string())?;
    let folders = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    let mut bundles: Vec<_> = folders
        .into_iter()
        .filter(|folder| folder.join(MODEL_FILE).is_file())
        .collect();
    bundles.sort();
    Ok(bundles)
}

/// The maps of the fitted mesh of an image, where `finder` finds the object.
///
/// # Errors
/// When the image is not of its camera's size.
pub fn fitted_maps(finder: &mut TargetFinder, image: &Picture, camera: &Camera) -> Result<Option<Maps>> {
    let estimate = pollster::block_on(finder.estimate(&mut View::new(image, camera)))?;
    Ok(estimate.judgement.found.then_some(estimate.maps))
}

/// A video that is followed from its frames alone: the template is found without training, then tracked.
pub struct Follower<'a>(VideoFollower<'a>);

impl<'a> Follower<'a> {
    /// Before the first frame of a video that `finder` searches.
    ///
    /// # Errors
    /// For a template that cannot be tracked.
    pub fn new(finder: &'a mut TargetFinder) -> Result<Self> {
        // A file waits for its answers.
        let options = VideoOptions {
            delay: 0,
            ..VideoOptions::default()
        };
        Ok(Self(VideoFollower::new(finder, options, || 0.0)?))
    }

    /// The maps of the mesh in the next frame, taken at `time_s`, where it is found.
    ///
    /// # Errors
    /// When the image is not of its camera's size.
    pub fn follow(&mut self, time_s: f64, sample: &Sample, mesh: &TriangleMesh) -> Result<Option<Maps>> {
        let mut view = View::new(&sample.image, &sample.camera);
        let surface = pollster::block_on(self.0.follow(time_s, &mut view))?.followed.surface;
        Ok(surface.map(|surface| VisibleSurface::new(mesh, &surface.vertices_camera, &sample.camera).maps()))
    }
}
