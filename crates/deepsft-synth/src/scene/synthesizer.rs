//! What samples are made of: the template and its random shapes, backgrounds, and the art of other printed sheets.

use crate::deform::{ControlPointDeformation, EdgeLengthChange, TOY_EDGE_CHANGE, deform};
use crate::error::SynthError;
use crate::render::Texture;
use crate::scene::background::any_artwork;
use crate::scene::config::SynthConfig;
use crate::scene::photographs::{Photographs, SHEETS_PER_PHOTOGRAPH};
use crate::scene::pose::sample_pose;
use deepsft_formats::{fingerprint, template_fingerprint};
use deepsft_geometry::glam::{DQuat, DVec3};
use deepsft_geometry::{Picture, Template};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use std::path::PathBuf;
use std::sync::Arc;

/// Probability that another sheet's art is made from a photograph, where there are any.
const PHOTOGRAPH_ART_PROBABILITY: f64 = 0.4;

/// Makes synthetic samples of one template.
///
/// [`Synthesizer::sample`] starts no threads; callers run indices in parallel.
///
/// ```
/// use deepsft_geometry::{Picture, Template};
/// use deepsft_synth::{SynthConfig, Synthesizer};
/// let texture = Picture::from_fn(64, 48, |x, y| [4 * x as u8, 5 * y as u8, 128]);
/// let template = Template::thin_shell(texture, 200.0, 150.0)?;
/// let synthesizer = Synthesizer::new(&template, SynthConfig::default())?;
/// let sample = synthesizer.sample(1, 0);
/// assert_eq!((sample.image.width(), sample.image.height()), (480, 270));
/// assert_eq!(sample.has_template, sample.truth.area() > 0);
/// # Ok::<(), deepsft_synth::SynthError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Synthesizer {
    template: Template,
    config: SynthConfig,
    pub(super) texture: Texture,
    /// Art of a sheet with nothing on it.
    pub(super) blank: Arc<Texture>,
    /// Vertices along a sheet's outline, in order; none of other templates.
    pub(super) outline: Vec<usize>,
    control_points: Option<ControlPointDeformation>,
    /// The user's photographs, at least one.
    photographs: Option<Arc<Photographs>>,
}

impl Synthesizer {
    /// Prepares the template's texture and the pool of backgrounds and other sheets (painted once per process, about
    /// a second).
    ///
    /// # Errors
    /// [`SynthError::Setting`] or [`SynthError::Refused`] when the configuration is not valid.
    /// [`SynthError::Geometry`] for a mesh without an edge of positive length.
    pub fn new(template: &Template, config: SynthConfig) -> Result<Self, SynthError> {
        config.check()?;
        Ok(Self {
            texture: Texture::new(template.texture()),
            blank: Arc::new(Texture::new(&Picture::from_fn(1, 1, |_, _| [255; 3]))),
            outline: outline(template),
            control_points: match template.is_sheet() {
                true => None,
                false => Some(ControlPointDeformation::new(template.mesh())?),
            },
            template: template.clone(),
            config,
            photographs: None,
        })
    }

    /// Adds photographs (PNG or JPEG files). [`SynthConfig::photograph_probability`] of the backgrounds show one, and pieces of
    /// them appear on other sheets. Samples then depend on the photographs and their order.
    ///
    /// Every file is decoded once now, to refuse what is no picture, and again when a scene needs it and it is not among
    /// those used last: at most 512 MiB of photographs stay decoded.
    ///
    /// # Errors
    /// [`FormatError::Unusable`](deepsft_formats::FormatError::Unusable) names the file that cannot be read.
    pub fn with_photographs(mut self, files: Vec<PathBuf>) -> Result<Self, SynthError> {
        if !files.is_empty() {
            self.photographs = Some(Arc::new(Photographs::open(files)?));
        }
        Ok(self)
    }

    /// Fails when a photograph could not be read again while samples were made. Samples made since then have other
    /// backgrounds than they should: ask after making samples that are to be kept.
    ///
    /// # Errors
    /// [`FormatError::Unusable`](deepsft_formats::FormatError::Unusable) names the file that has gone or changed.
    pub fn check_photographs(&self) -> Result<(), SynthError> {
        self.photographs
            .as_ref()
            .map_or(Ok(()), |photographs| photographs.check())
    }

    /// The template.
    pub fn template(&self) -> &Template {
        &self.template
    }

    /// The configuration.
    pub fn config(&self) -> &SynthConfig {
        &self.config
    }

    /// Differs when samples of the same seed and index would: the SHA-256 of configuration, template and photographs.
    pub fn fingerprint(&self) -> String {
        let photographs: Vec<&str> = self.photographs.iter().flat_map(|all| all.hashes()).collect();
        fingerprint(&(self.config(), template_fingerprint(self.template()), photographs))
    }

    /// How a template that is no sheet deforms, and the bounds that it keeps.
    pub(crate) fn control_points(&self) -> Option<(&ControlPointDeformation, EdgeLengthChange)> {
        let most = self.config.deformation.max_edge_change;
        let most = if most.p95 > 0.0 { TOY_EDGE_CHANGE } else { most };
        Some((self.control_points.as_ref()?, most))
    }

    /// Draws the vertices of a random shape in a random pose, mm, camera frame. Any side of a template that is no sheet may look at the
    /// camera: it is turned about its upright axis first, then posed as a sheet is.
    pub fn sample_vertices(&self, rng: &mut Pcg64Mcg) -> Vec<DVec3> {
        let vertices_template: Vec<DVec3> = match self.control_points() {
            None => deform(&self.template, &self.config.deformation, rng),
            Some((control_points, most)) => {
                let vertices = control_points.deform(most, rng);
                let turn = DQuat::from_rotation_y(rng.random_range(0.0..std::f64::consts::TAU));
                vertices.into_iter().map(|p| turn * p).collect()
            }
        };
        let pose = sample_pose(&self.config.camera, &vertices_template, &self.config.pose, rng);
        let posed = vertices_template.into_iter().map(|p| pose.transform_point3(p));
        posed.collect()
    }

    /// One of the user's photographs, as often as backgrounds show one.
    pub(crate) fn photograph(&self, rng: &mut Pcg64Mcg) -> Option<Arc<Texture>> {
        let photographs = self.photographs.as_ref()?;
        let is_shown = rng.random_bool(self.config.photograph_probability);
        let number = is_shown.then(|| rng.random_range(0..photographs.count()))?;
        Some(photographs.get(number)?.background)
    }

    /// Art of a sheet that is not the template.
    pub(crate) fn other_art(&self, rng: &mut Pcg64Mcg) -> Arc<Texture> {
        if let Some(photographs) = &self.photographs
            && rng.random_bool(PHOTOGRAPH_ART_PROBABILITY)
        {
            let number = rng.random_range(0..SHEETS_PER_PHOTOGRAPH * photographs.count());
            if let Some(photograph) = photographs.get(number / SHEETS_PER_PHOTOGRAPH) {
                return photograph.sheets[number % SHEETS_PER_PHOTOGRAPH].clone();
            }
        }
        any_artwork(rng)
    }
}

/// The vertices around a sheet's grid, clockwise from the top left; none of another template.
fn outline(template: &Template) -> Vec<usize> {
    let Some((columns, rows)) = template.grid() else {
        return Vec::new();
    };
    let top = 0..columns;
    let right = (1..rows).map(|j| j * columns + columns - 1);
    let bottom = (0..columns - 1).rev().map(|i| (rows - 1) * columns + i);
    let left = (1..rows - 1).rev().map(|j| j * columns);
    top.chain(right).chain(bottom).chain(left).collect()
}
