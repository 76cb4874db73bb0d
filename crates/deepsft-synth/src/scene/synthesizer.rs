//! Synthetic samples: a pure function of (template, configuration, seed, index).

use crate::deform::{ControlPointDeformation, EdgeLengthChange};
use crate::error::SynthError;
use crate::random::{Stream, generator};
use crate::render::projected_mesh::ProjectedMesh;
use crate::sample::Sample;
use crate::scene::composition::Scene;
use crate::scene::config::SynthConfig;
use crate::scene::ingredients::Ingredients;
use crate::scene::photographs::Photographs;
use deepsft_formats::{fingerprint, template_fingerprint};
use deepsft_geometry::Template;
use deepsft_geometry::glam::DVec3;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use std::path::PathBuf;
use std::sync::Arc;

/// Draws of shape and pose before the one that shows most is taken.
const VIEW_TRIES: usize = 12;

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
    ingredients: Ingredients,
}

impl Synthesizer {
    /// Prepares the template's texture and the pool of backgrounds and other sheets (painted once per process, about
    /// a second).
    ///
    /// # Errors
    /// [`SynthError::Setting`] or [`SynthError::DistortedCamera`] when the configuration is not valid.
    /// [`SynthError::Geometry`] for a mesh without an edge of positive length.
    pub fn new(template: &Template, config: SynthConfig) -> Result<Self, SynthError> {
        Ok(Self {
            ingredients: Ingredients::new(template, config)?,
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
            self.ingredients.photographs = Some(Arc::new(Photographs::open(files)?));
        }
        Ok(self)
    }

    /// Fails when a photograph could not be read again while samples were made. Samples made since then have other
    /// backgrounds than they should: ask after making samples that are to be kept.
    ///
    /// # Errors
    /// [`FormatError::Unusable`](deepsft_formats::FormatError::Unusable) names the file that has gone or changed.
    pub fn check_photographs(&self) -> Result<(), SynthError> {
        self.ingredients
            .photographs
            .as_ref()
            .map_or(Ok(()), |photographs| photographs.check())
    }

    /// The template.
    pub fn template(&self) -> &Template {
        &self.ingredients.template
    }

    /// The configuration.
    pub fn config(&self) -> &SynthConfig {
        &self.ingredients.config
    }

    /// As [`Ingredients::control_points`].
    pub(crate) fn control_points(&self) -> Option<(&ControlPointDeformation, EdgeLengthChange)> {
        self.ingredients.control_points()
    }

    /// Differs when samples of the same seed and index would: the SHA-256 of configuration, template and photographs.
    pub fn fingerprint(&self) -> String {
        let photographs: Vec<&str> = self
            .ingredients
            .photographs
            .iter()
            .flat_map(|all| all.hashes())
            .collect();
        fingerprint(&(self.config(), template_fingerprint(self.template()), photographs))
    }

    /// Sample `index` of the data set `seed`: always the same for the same template, configuration, photographs,
    /// seed and index.
    pub fn sample(&self, seed: u64, index: u64) -> Sample {
        let mut rng = generator(seed, index, Stream::Shape);
        let noise_seed = rng.random();
        if rng.random_bool(self.config().empty_probability) {
            let scene =
                Scene::without_template(&self.ingredients, &mut generator(seed, index, Stream::Scene), &mut rng);
            return scene.compose_without_template(noise_seed);
        }
        let scene = self.scene(seed, index);
        let mut best: Option<(usize, Vec<DVec3>, ProjectedMesh)> = None;
        for _ in 0..VIEW_TRIES {
            let vertices_camera = self.ingredients.sample_vertices(&mut rng);
            let sheet = ProjectedMesh::new(self.template().mesh(), &vertices_camera, &self.config().camera);
            let visible = scene.visible_area(&sheet);
            if best.as_ref().is_none_or(|(most, ..)| visible > *most) {
                best = Some((visible, vertices_camera, sheet));
            }
            if visible >= self.config().min_visible_px {
                break;
            }
        }
        match best {
            Some((_, vertices, sheet)) => scene.compose(vertices, &sheet, noise_seed),
            None => scene.compose_without_template(noise_seed),
        }
    }

    /// Draws all of sample `index` of the data set `seed` but the sheet's shape and pose. That is background, other sheets,
    /// light, paper, occluders, camera effects. For sequences, in which only the sheet moves.
    pub fn scene(&self, seed: u64, index: u64) -> Scene<'_> {
        Scene::with_template(&self.ingredients, None, &mut generator(seed, index, Stream::Scene))
    }

    /// [`Synthesizer::scene`] under the light, on the paper and with the camera settings of `other`.
    pub(crate) fn scene_like(&self, other: &Scene<'_>, seed: u64, index: u64) -> Scene<'_> {
        let mut rng = generator(seed, index, Stream::Scene);
        Scene::with_template(&self.ingredients, Some(other), &mut rng)
    }

    /// Renders the template with its vertices at `vertices_camera` (mm, camera frame), without disturbances. The paper is matt,
    /// under even light from the camera, before mid grey; there are no occluders, and the camera is ideal.
    ///
    /// # Errors
    /// [`SynthError::VertexCount`] when there are not as many vertices as the template's mesh has;
    /// [`SynthError::Geometry`] when one is not finite.
    pub fn render_clean(&self, vertices_camera: Vec<DVec3>) -> Result<Sample, SynthError> {
        Scene::clean(&self.ingredients).render(vertices_camera, 0)
    }

    /// Draws the vertices of a random shape in a random pose, mm, camera frame.
    pub fn sample_vertices(&self, rng: &mut Pcg64Mcg) -> Vec<DVec3> {
        self.ingredients.sample_vertices(rng)
    }
}
