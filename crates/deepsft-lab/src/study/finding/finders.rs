//! What looks for a print.

use crate::measuring::Stopwatch;
use anyhow::{Context, Result};
use deepsft::{DescriptorFinder, SharedDescriptorNetwork};
use deepsft_finding::{FeatureFinder, FeatureOptions, Features, PictureTarget, feature_image};
use deepsft_geometry::glam::DVec2;
use deepsft_geometry::{Camera, Maps, Picture, Template};

/// An image with its camera, and the canonical camera, for which maps are wanted.
#[derive(Clone, Copy)]
pub struct View<'a> {
    pub image: &'a Picture,
    pub camera: &'a Camera,
    pub canonical: &'a Camera,
}

/// What a finder found.
#[derive(Default)]
pub struct Found {
    /// Depth and registration for the canonical camera; `None` when it did not find the print.
    pub maps: Option<Maps>,
    /// The place on the print, mm, of a pixel of the image, before any mesh: OpenCV's warp.
    pub warp: Option<Box<dyn Fn(DVec2) -> DVec2>>,
    /// Processor time on one thread: what does not depend on the print, and the rest.
    pub features_ms: f64,
    pub find_ms: f64,
}

/// A way to find prints: a row of the table.
pub trait Finder {
    fn name(&self) -> &'static str;

    /// Whether it is DeepSfT's: the best of ours is a row too.
    fn is_ours(&self) -> bool;

    /// The print to look for from now on.
    fn take(&mut self, template: &Template) -> Result<()>;

    /// Called before other finders look at the image: a process of its own begins.
    fn begin(&mut self, _image: &Picture) -> Result<()> {
        Ok(())
    }

    fn find(&mut self, view: View<'_>) -> Result<Found>;
}

/// Our features.
#[derive(Default)]
pub struct FeatureFinding {
    finder: Option<FeatureFinder>,
}

impl Finder for FeatureFinding {
    fn name(&self) -> &'static str {
        "features"
    }

    fn is_ours(&self) -> bool {
        true
    }

    fn take(&mut self, template: &Template) -> Result<()> {
        self.finder = Some(FeatureFinder::new(PictureTarget::new(template.clone())?)?);
        Ok(())
    }

    fn find(&mut self, view: View<'_>) -> Result<Found> {
        let finder = self.finder.as_mut().context("there is no print to look for")?;
        let start = Stopwatch::start();
        let (small, camera) = feature_image(view.image, view.camera)?;
        let features = Features::of(&small, &FeatureOptions::default());
        let features_ms = start.ms();
        let start = Stopwatch::start();
        let found = finder.find(&features, &camera, view.canonical)?;
        Ok(Found {
            maps: found.map(|found| found.maps),
            warp: None,
            features_ms,
            find_ms: start.ms(),
        })
    }
}

/// The network that describes any picture.
pub struct DescriptorFinding {
    network: SharedDescriptorNetwork,
    finder: Option<deepsft::Finder>,
}

impl DescriptorFinding {
    pub fn new(network: SharedDescriptorNetwork) -> Self {
        Self { network, finder: None }
    }
}

impl Finder for DescriptorFinding {
    fn name(&self) -> &'static str {
        "descriptors"
    }

    fn is_ours(&self) -> bool {
        true
    }

    fn take(&mut self, template: &Template) -> Result<()> {
        let finder = pollster::block_on(DescriptorFinder::new(&self.network, template))?;
        self.finder = Some(deepsft::Finder::Descriptors(Box::new(finder)));
        Ok(())
    }

    fn find(&mut self, view: View<'_>) -> Result<Found> {
        let finder = self.finder.as_mut().context("there is no print to look for")?;
        let start = Stopwatch::start();
        let mut seen = deepsft::View::new(view.image, view.camera);
        seen.features()?;
        let features_ms = start.ms();
        let start = Stopwatch::start();
        let found = pollster::block_on(finder.find(&mut seen, view.canonical))?;
        Ok(Found {
            maps: found.map(|found| found.maps),
            warp: None,
            features_ms,
            find_ms: start.ms(),
        })
    }
}
