//! The methods by their names, and what each makes of a frame.

use crate::ch17::{Ch17, Ch17Surface};
use crate::ch17r::Ch17r;
use crate::frame::{Correspondence, correspondences};
use crate::frames::name;
use crate::networks::{Rival, RivalNetwork, Said, read_checkpoint};
use crate::ngo15::Ngo15;
use crate::ours::{self, Network};
use crate::robusft::Robusft;
use crate::table::Measured;
use anyhow::{Context, Result};
use burn::module::Module;
use burn::tensor::Device;
use clap::ValueEnum;
use deepsft::TargetFinder;
use deepsft::features::{FeatureFinder, Features};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, Maps, Template};
use deepsft_synth::Sample;
use std::path::{Path, PathBuf};

/// Matches that NGO15 and ROBUSfT are given: of a thousand nearly all of the clearest are right, and of the others few.
const NGO15_MATCHES: usize = 120;
const ROBUSFT_MATCHES: usize = 300;

/// Least depth of a vertex that can be drawn, mm.
const NEAREST_MM: f64 = 1.0;

/// Fraction by which a side may be longer on the surface than on its flattening.
const LONGER: f64 = 0.03;

/// A row of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Method {
    /// Chhatkuli et al. 2017: closed form and surface integration, from the true registration
    Ch17Gtr,
    /// The same, refined by Levenberg-Marquardt (Brunet et al. 2014)
    Ch17rGtr,
    /// Closed form from the registration of dense optical flow (Brox et al. 2004), frame to frame
    Ch17Dof,
    /// The same, refined
    Ch17rDof,
    /// The registration by optical flow itself
    Dof,
    /// Ngo, Ostlund, Fua 2015: Laplacian mesh from matches of our features
    Ngo15,
    /// Shetab-Bushehri et al. 2023: particles on the sightlines of such matches; in videos from the last measured shape
    Robusft,
    /// Golyanik et al. 2018: the grid of a sheet by a network, trained by `train`
    HdmNet,
    /// Shimada et al. 2019: the same, adversarial
    IsmoGan,
    /// Alhashim, Wonka 2018: depth of any scene, with their authors' weights; those are not read here, the row stays empty
    DenseDepth,
    /// The same, trained by `train` on our samples alone; depth inside the true mask, no registration
    DenseDepthFt,
    /// Lee et al. 2019: depth of any scene, with its authors' weights: an empty row
    Bts,
    /// The same, trained by `train`
    BtsFt,
    /// Ours without training: features and the fit of the mesh
    Features,
    /// The same in a video: found once, then tracked
    Tracked,
    /// The networks of --model and --trained: ours, R50F, the paper's
    Network,
    /// Those networks and the fit of the mesh
    NetworkFit,
}

impl Method {
    /// The name of the row, without that of its network.
    pub fn label(self) -> &'static str {
        match self {
            Self::Ch17Gtr => "CH17+GTR",
            Self::Ch17rGtr => "CH17R+GTR",
            Self::Ch17Dof => "CH17+DOF",
            Self::Ch17rDof => "CH17R+DOF",
            Self::Dof => "DOF",
            Self::Ngo15 => "NGO15",
            Self::Robusft => "ROBUSfT-like",
            Self::HdmNet => "HDM-Net",
            Self::IsmoGan => "IsMo-GAN",
            Self::DenseDepth => "DenseDepth",
            Self::DenseDepthFt => "DenseDepth+FT",
            Self::Bts => "BTS",
            Self::BtsFt => "BTS+FT",
            Self::Features => "ours, without training",
            Self::Tracked => "ours, without training, tracked",
            Self::Network => "network",
            Self::NetworkFit => "network and fit",
        }
    }

    /// What of its answers counts: depth but of optical flow, a registration but of networks for depth.
    pub fn measured(self) -> Measured {
        let is_depth_alone = matches!(self, Self::DenseDepth | Self::DenseDepthFt | Self::Bts | Self::BtsFt);
        Measured {
            depth: self != Self::Dof,
            registration: !is_depth_alone,
            given: self.is_closed_form(),
        }
    }

    /// Whether it is the closed form, refined or not.
    fn is_closed_form(self) -> bool {
        matches!(self, Self::Ch17Gtr | Self::Ch17rGtr | Self::Ch17Dof | Self::Ch17rDof)
    }

    /// Whether it has a row for each network.
    pub fn is_network(self) -> bool {
        matches!(self, Self::Network | Self::NetworkFit)
    }

    /// The network of others that it is, if we can train it.
    fn rival(self) -> Option<Rival> {
        match self {
            Self::HdmNet => Some(Rival::HdmNet),
            Self::IsmoGan => Some(Rival::IsmoGan),
            Self::DenseDepthFt => Some(Rival::DenseDepth),
            Self::BtsFt => Some(Rival::Bts),
            _ => None,
        }
    }

    /// Whether it needs the frames of a video.
    pub fn needs_video(self) -> bool {
        matches!(self, Self::Ch17Dof | Self::Ch17rDof | Self::Dof | Self::Tracked)
    }
}

/// What the frames of a video so far say of the next one, and the processor time that it took, s.
#[derive(Default)]
pub struct Followed {
    /// The registration by optical flow; none in the first frame, and when the template was lost.
    pub registration: Option<Maps>,
    pub flow_s: f64,
    /// The maps of the tracked mesh, while it is found.
    pub tracked: Option<Maps>,
    pub tracker_s: f64,
}

/// The methods for flat sheets alone.
struct SheetMethods {
    ngo15: Ngo15,
    robusft: Robusft,
    matcher: FeatureFinder,
}

/// All methods, prepared for one template.
pub struct Methods {
    template: Template,
    /// None where the texture is no flattening of the surface.
    ch17r: Option<Ch17r>,
    sheet: Option<SheetMethods>,
    features: TargetFinder,
    networks: Vec<Network>,
    rivals: Vec<(Rival, RivalNetwork)>,
}

impl Methods {
    /// Prepares them for `template` with the networks in the folders `models` and those that were trained into `trained`.
    /// Fails where a bundle or a trained network cannot be read.
    pub fn new(template: &Template, models: &[PathBuf], trained: Option<&Path>) -> Result<Self> {
        let mut rivals = Vec::new();
        for rival in Rival::value_variants().iter().filter(|_| template.is_sheet()) {
            let read = |folder: &Path| read_checkpoint(&folder.join(name(*rival)), template, &Device::flex());
            let read = trained.map(read).transpose()?.flatten();
            rivals.extend(read.map(|(_, network)| (*rival, network.valid())));
        }
        let sheet = || -> Result<_> {
            Ok(SheetMethods {
                ngo15: Ngo15::new(template)?,
                robusft: Robusft::new(template)?,
                matcher: FeatureFinder::new(template.clone())?,
            })
        };
        let models = models.iter().cloned().chain(ours::bundles(trained)?);
        let networks = models.map(|folder| Network::read(&folder, template));
        Ok(Self {
            rivals,
            ch17r: is_flattened(template).then(|| Ch17r::new(template)).transpose()?,
            sheet: template.is_sheet().then(sheet).transpose()?,
            features: ours::features(template)?,
            networks: networks.collect::<Result<_>>()?,
            template: template.clone(),
        })
    }

    /// Forgets the last frame: the next one is the first of a video, or an image of its own.
    pub fn begin_take(&mut self) {
        if let Some(sheet) = &mut self.sheet {
            sheet.robusft.forget();
        }
    }

    /// The names of the networks.
    pub fn networks(&self) -> impl Iterator<Item = &str> {
        self.networks.iter().map(|network| network.name.as_str())
    }

    /// Why the row of `method` has to stay empty; `None` where it can run.
    pub fn missing(&self, method: Method) -> Option<String> {
        let alone = |for_what: &str| Some(format!("for {for_what} alone"));
        match method {
            _ if method.is_closed_form() && self.ch17r.is_none() => alone("surfaces that can be flattened"),
            Method::Ngo15 | Method::Robusft | Method::HdmNet | Method::IsmoGan if self.sheet.is_none() => {
                alone("flat sheets")
            }
            Method::DenseDepth | Method::Bts => {
                Some("no weights: its authors', of NYU Depth v2, are not read here".to_owned())
            }
            _ => {
                let rival = method.rival()?;
                let untrained = format!("no weights: `train {}`, then --trained", name(rival));
                self.network_of(rival).is_none().then_some(untrained)
            }
        }
    }

    /// The depth and registration that `method`, by the network of that number, has of a frame of a video that was `followed` until it.
    /// `None` where it finds nothing; errors of a method on its data count as that.
    /// Fails where the method lacks what it needs.
    pub fn answer(
        &mut self,
        method: Method,
        network: usize,
        sample: &Sample,
        followed: &Followed,
    ) -> Result<Option<Maps>> {
        let (image, camera, flow) = (&sample.image, &sample.camera, followed.registration.as_ref());
        Ok(match method {
            Method::Ch17Gtr => self.closed_form(&sample.truth, camera),
            Method::Ch17rGtr => self.refined(&sample.truth, camera),
            Method::Ch17Dof => flow.and_then(|flow| self.closed_form(flow, camera)),
            Method::Ch17rDof => flow.and_then(|flow| self.refined(flow, camera)),
            Method::Ngo15 | Method::Robusft => {
                let sheet = self.sheet.as_mut().context("it is for sheets")?;
                let vertices = if method == Method::Ngo15 {
                    sheet.ngo15.reconstruct(&sheet.matches(sample, NGO15_MATCHES)?, camera)
                } else {
                    let matches = sheet.matches(sample, ROBUSFT_MATCHES)?;
                    sheet.robusft.reconstruct(&matches, camera)
                };
                vertices.ok().map(|vertices| self.drawn(&vertices, camera))
            }
            Method::Dof => flow.cloned(),
            Method::Features => ours::fitted_maps(&mut self.features, image, camera)?,
            Method::Tracked => followed.tracked.clone(),
            Method::Network => self.networks[network].maps(image, camera)?,
            Method::NetworkFit => ours::fitted_maps(&mut self.networks[network].with_fit, image, camera)?,
            _ => {
                let network = method.rival().and_then(|rival| self.network_of(rival));
                match network.context("no weights")?.say(image, &Device::flex())? {
                    Said::Depth(maps) => Some(maps),
                    Said::Vertices(vertices) => {
                        let is_ahead = vertices.iter().all(|p| p.is_finite() && p.z > NEAREST_MM);
                        is_ahead.then(|| self.drawn(&vertices, camera))
                    }
                }
            }
        })
    }

    fn network_of(&self, rival: Rival) -> Option<&RivalNetwork> {
        let mut rivals = self.rivals.iter();
        rivals.find_map(|(trained, network)| (*trained == rival).then_some(network))
    }

    fn surface(&self, registration: &Maps, camera: &Camera) -> Option<(Vec<Correspondence>, Ch17Surface)> {
        let seen = correspondences(registration, camera, self.template.size_mm());
        let surface = Ch17::COMPARED.reconstruct(&seen, self.template.size_mm()).ok()?;
        Some((seen, surface))
    }

    fn closed_form(&self, registration: &Maps, camera: &Camera) -> Option<Maps> {
        let (_, surface) = self.surface(registration, camera)?;
        Some(surface.maps(registration, self.template.size_mm()))
    }

    fn refined(&mut self, registration: &Maps, camera: &Camera) -> Option<Maps> {
        let (seen, surface) = self.surface(registration, camera)?;
        let ch17r = self.ch17r.as_mut()?;
        let places = self.template.mesh().texture_coordinates().iter();
        let start: Vec<DVec3> = places.map(|uv| surface.point(*uv * self.template.size_mm())).collect();
        let vertices = ch17r.refine(&seen, camera, &start).ok()?;
        Some(self.drawn(&vertices, camera))
    }

    /// The mesh as the camera sees it, with nothing before it.
    fn drawn(&self, vertices: &[DVec3], camera: &Camera) -> Maps {
        VisibleSurface::new(self.template.mesh(), vertices, camera).maps()
    }
}

impl SheetMethods {
    /// The clearest matches of our features, `most` of them, without any consensus.
    fn matches(&self, sample: &Sample, most: usize) -> Result<Vec<Correspondence>> {
        let (features, camera) = Features::of(&sample.image, &sample.camera)?;
        let correspondence = |m: &deepsft::features::Match| {
            let ray = camera.ray_from_pixel(m.pixel.as_dvec2());
            let (place, pixel) = (m.place.as_dvec2(), sample.camera.pixel_from_ray(ray)?);
            Some(Correspondence { place, pixel, ray })
        };
        let matches = self.matcher.matches(&features);
        Ok(matches.iter().take(most).filter_map(correspondence).collect())
    }
}

/// Whether lengths on the texture are those on the surface.
fn is_flattened(template: &Template) -> bool {
    let (mesh, size_mm) = (template.mesh(), template.size_mm());
    let (points, places) = (mesh.vertices(), mesh.texture_coordinates());
    let mut sides = mesh.faces().iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    sides.all(|(a, b)| {
        let flat = ((places[a] - places[b]) * size_mm).length();
        (points[a].distance(points[b]) - flat).abs() < LONGER * flat
    })
}
