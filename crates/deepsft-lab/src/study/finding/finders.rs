//! What looks for a print.

use crate::measuring::Stopwatch;
use anyhow::{Context, Result};
use deepsft::{DescriptorFinder, Estimator, FinderKind, SharedDescriptorNetwork};
use deepsft_finding::{FeatureFinder, FeatureOptions, Features, PictureTarget, feature_image};
use deepsft_geometry::fitting::Start;
use deepsft_geometry::{Camera, Picture, Template};

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
    /// Where it sees the print, for the canonical camera; `None` when it did not find it.
    pub start: Option<Start>,
    /// Processor time on one thread: what does not depend on the print, and the rest.
    pub features_ms: f64,
    pub find_ms: f64,
}

/// A way to find prints: a row of the table.
pub trait Finder {
    fn name(&self) -> &'static str;

    /// The print to look for from now on.
    fn take(&mut self, template: &Template) -> Result<()>;

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

    fn take(&mut self, template: &Template) -> Result<()> {
        self.finder = Some(FeatureFinder::new(PictureTarget::from_template(template.clone())?)?);
        Ok(())
    }

    fn find(&mut self, view: View<'_>) -> Result<Found> {
        let finder = self.finder.as_mut().context("there is no print to look for")?;
        let start = Stopwatch::start();
        let (small, camera) = feature_image(view.image, view.camera)?;
        let features = Features::of(&small, &FeatureOptions::default());
        let features_ms = start.ms();
        let start = Stopwatch::start();
        let found = finder.find(&features, &camera)?;
        Ok(Found {
            start: found.map(|found| Start::Mesh(found.vertices_camera)),
            features_ms,
            find_ms: start.ms(),
        })
    }
}

/// Makes a finder of a template.
type FinderOf = Box<dyn Fn(&Template) -> Result<deepsft::Finder>>;

/// One of the library's finders that run a network.
pub struct NetworkFinding {
    kind: FinderKind,
    finder_of: FinderOf,
    finder: Option<deepsft::Finder>,
}

impl NetworkFinding {
    /// The network that describes any picture.
    pub fn descriptors(network: SharedDescriptorNetwork) -> Self {
        Self {
            kind: FinderKind::Descriptors,
            finder_of: Box::new(move |template| {
                let finder = DescriptorFinder::new(&network, template)?;
                Ok(deepsft::Finder::Descriptors(Box::new(finder)))
            }),
            finder: None,
        }
    }

    /// The network of a model, whose template is the only print.
    pub fn of_model(network: Estimator) -> Self {
        Self {
            kind: FinderKind::Network,
            finder_of: Box::new(move |_| Ok(deepsft::Finder::Network(Box::new(network.clone())))),
            finder: None,
        }
    }
}

impl Finder for NetworkFinding {
    fn name(&self) -> &'static str {
        self.kind.name()
    }

    fn take(&mut self, template: &Template) -> Result<()> {
        self.finder = Some((self.finder_of)(template)?);
        Ok(())
    }

    fn find(&mut self, view: View<'_>) -> Result<Found> {
        let finder = self.finder.as_mut().context("there is no print to look for")?;
        let mut seen = deepsft::View::new(view.image, view.camera);
        let start = Stopwatch::start();
        match self.kind {
            FinderKind::Network => drop(seen.canonical(view.canonical)?),
            _ => drop(seen.features()?),
        }
        let features_ms = start.ms();
        let start = Stopwatch::start();
        let found = pollster::block_on(finder.find(&mut seen, view.canonical))?;
        Ok(Found {
            start: found.map(|(start, _)| start),
            features_ms,
            find_ms: start.ms(),
        })
    }
}
