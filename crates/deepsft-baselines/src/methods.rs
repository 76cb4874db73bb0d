//! The methods by their names, and what each makes of a frame.

use crate::ch17::{Ch17, Ch17Surface};
use crate::ch17r::Ch17r;
use crate::frame::{Correspondence, correspondences};
use crate::ngo15::Ngo15;
use crate::ours::{self, Network};
use anyhow::{Context, Result};
use clap::ValueEnum;
use deepsft::TargetFinder;
use deepsft::features::{FeatureFinder, Features};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, Maps, Template};
use deepsft_synth::Sample;
use std::path::Path;

/// Matches that NGO15 is given: of some hundred nearly all of the clearest are right, and of the others few.
const CLEAREST: usize = 120;

/// A row of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Closed form, true registration
    Ch17Gtr,
    /// The same, refined
    Ch17rGtr,
    /// Closed form, registration by optical flow
    Ch17Dof,
    /// The same, refined
    Ch17rDof,
    /// The registration by optical flow itself
    Dof,
    /// Laplacian mesh from sparse matches
    Ngo15,
    /// Ours without training: features and the fit of the mesh
    Features,
    /// Ours: the network of --model
    Network,
    /// Ours: that network and the fit of the mesh
    NetworkFit,
}

impl Method {
    /// The name of the row.
    pub fn label(self) -> &'static str {
        match self {
            Self::Ch17Gtr => "CH17+GTR",
            Self::Ch17rGtr => "CH17R+GTR",
            Self::Ch17Dof => "CH17+DOF",
            Self::Ch17rDof => "CH17R+DOF",
            Self::Dof => "DOF",
            Self::Ngo15 => "NGO15",
            Self::Features => "ours, without training",
            Self::Network => "ours, network",
            Self::NetworkFit => "ours, network and fit",
        }
    }

    /// Whether the registration is given to it and not its own.
    pub fn is_registered(self) -> bool {
        matches!(self, Self::Ch17Gtr | Self::Ch17rGtr | Self::Ch17Dof | Self::Ch17rDof)
    }

    /// Whether it needs --model.
    pub fn needs_model(self) -> bool {
        matches!(self, Self::Network | Self::NetworkFit)
    }

    /// Whether it says depths, and not registration alone.
    pub fn has_depth(self) -> bool {
        self != Self::Dof
    }

    /// Whether it needs the frames of a video.
    pub fn needs_video(self) -> bool {
        matches!(self, Self::Ch17Dof | Self::Ch17rDof | Self::Dof)
    }
}

/// All methods, prepared for one template.
#[derive(Debug)]
pub struct Methods {
    template: Template,
    ch17r: Ch17r,
    ngo15: Ngo15,
    matcher: FeatureFinder,
    features: TargetFinder,
    network: Option<Network>,
}

impl Methods {
    /// Prepares them for `template`, a sheet, with the network in the folder `model`.
    ///
    /// # Errors
    /// For a template that is no sheet; where the bundle cannot be read.
    pub fn new(template: &Template, model: Option<&Path>) -> Result<Self> {
        Ok(Self {
            ch17r: Ch17r::new(template)?,
            ngo15: Ngo15::new(template)?,
            matcher: FeatureFinder::new(template.clone())?,
            features: ours::features(template)?,
            network: model.map(|folder| Network::read(folder, template)).transpose()?,
            template: template.clone(),
        })
    }

    /// The depth and registration that `method` has of a frame, and `flow` is its registration by optical flow. `None` where it finds
    /// nothing; errors of a method on its data count as that.
    ///
    /// # Errors
    /// Where the method lacks what it needs.
    pub fn answer(&mut self, method: Method, sample: &Sample, flow: Option<&Maps>) -> Result<Option<Maps>> {
        let (image, camera) = (&sample.image, &sample.camera);
        Ok(match method {
            Method::Ch17Gtr => self.closed_form(&sample.truth, camera),
            Method::Ch17rGtr => self.refined(&sample.truth, camera),
            Method::Ch17Dof => flow.and_then(|flow| self.closed_form(flow, camera)),
            Method::Ch17rDof => flow.and_then(|flow| self.refined(flow, camera)),
            Method::Ngo15 => {
                let matches = self.matches(sample)?;
                let vertices = self.ngo15.reconstruct(&matches, camera).ok();
                vertices.map(|vertices| self.drawn(&vertices, camera))
            }
            Method::Dof => flow.cloned(),
            Method::Features => ours::fitted_maps(&mut self.features, image, camera)?,
            Method::Network => self.network.as_ref().context("no --model")?.maps(image, camera)?,
            Method::NetworkFit => {
                let network = self.network.as_mut().context("no --model")?;
                ours::fitted_maps(&mut network.with_fit, image, camera)?
            }
        })
    }

    fn surface(&self, registration: &Maps, camera: &Camera) -> Option<(Vec<Correspondence>, Ch17Surface)> {
        let seen = correspondences(registration, camera, self.template.size_mm());
        let surface = Ch17::default().reconstruct(&seen, self.template.size_mm()).ok()?;
        Some((seen, surface))
    }

    fn closed_form(&self, registration: &Maps, camera: &Camera) -> Option<Maps> {
        let (_, surface) = self.surface(registration, camera)?;
        Some(surface.maps(registration, self.template.size_mm()))
    }

    fn refined(&mut self, registration: &Maps, camera: &Camera) -> Option<Maps> {
        let (seen, surface) = self.surface(registration, camera)?;
        let places = self.template.mesh().texture_coordinates().iter();
        let start: Vec<DVec3> = places.map(|uv| surface.point(*uv * self.template.size_mm())).collect();
        let vertices = self.ch17r.refine(&seen, camera, &start).ok()?;
        Some(self.drawn(&vertices, camera))
    }

    /// The clearest matches of our features, without any consensus.
    fn matches(&self, sample: &Sample) -> Result<Vec<Correspondence>> {
        let (features, camera) = Features::of(&sample.image, &sample.camera)?;
        let correspondence = |m: &deepsft::features::Match| {
            let ray = camera.ray_from_pixel(m.pixel.as_dvec2());
            let pixel = sample.camera.pixel_from_ray(ray)?;
            Some(Correspondence {
                place: m.place.as_dvec2(),
                pixel,
                ray,
            })
        };
        let matches = self.matcher.matches(&features);
        Ok(matches.iter().take(CLEAREST).filter_map(correspondence).collect())
    }

    /// The mesh as the camera sees it, with nothing before it.
    fn drawn(&self, vertices: &[DVec3], camera: &Camera) -> Maps {
        VisibleSurface::new(self.template.mesh(), vertices, camera).maps()
    }
}
