//! Synthetic samples: a pure function of (template, configuration, seed, index).

use crate::artwork::photograph_sheet;
use crate::background::{Background, photograph_texture, procedural_artworks, procedural_backgrounds};
use crate::isometry::edge_length_changes;
use crate::noise::{Stream, generator, mix};
use crate::scene::{Place, Scene};
use crate::sheet::ImageSheet;
use crate::texture::Texture;
use crate::{HandleDeformation, Sample, SynthConfig, SynthError, deform, sample_pose};
use deepsft_geometry::glam::{DQuat, DVec3};
use deepsft_geometry::{Picture, Template};
use rand::{Rng, RngExt};
use rand_pcg::Pcg64Mcg;

/// Sheets with other art that are made from each of the user's photographs.
const SHEETS_A_PHOTOGRAPH: usize = 2;

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
    pub(crate) template: Template,
    pub(crate) config: SynthConfig,
    pub(crate) texture: Texture,
    /// Art of a sheet with nothing on it.
    pub(crate) blank: Texture,
    /// Vertices along a sheet's outline, in order; none of other templates.
    pub(crate) outline: Vec<usize>,
    /// How a template that is no sheet deforms.
    handles: Option<HandleDeformation>,
    photographs: Vec<Texture>,
    photograph_sheets: Vec<Texture>,
    /// Fingerprint of the photographs as they were given.
    photographs_fingerprint: u64,
    /// The edges of the template's mesh.
    edges: Vec<[usize; 2]>,
}

/// A shape of the template in a pose.
struct PosedShape {
    /// Vertices, mm, camera frame.
    vertices_camera: Vec<DVec3>,
    /// [`crate::HandleShape::strength`] where handles made it.
    strength: Option<f64>,
}

impl Synthesizer {
    /// Prepares the template's texture and the pool of backgrounds and other sheets (painted once a process, about
    /// a second).
    ///
    /// # Errors
    /// [`SynthError::Setting`] or [`SynthError::DistortedCamera`] when the configuration is not valid.
    /// [`SynthError::Geometry`] for a mesh without an edge of positive length.
    pub fn new(template: &Template, config: SynthConfig) -> Result<Self, SynthError> {
        config.check()?;
        procedural_backgrounds();
        procedural_artworks();
        Ok(Self {
            texture: Texture::new(template.texture()),
            blank: Texture::new(&Picture::from_fn(1, 1, |_, _| [255; 3])),
            outline: outline(template),
            handles: match template.is_sheet() {
                true => None,
                false => Some(HandleDeformation::new(template.mesh())?),
            },
            template: template.clone(),
            config,
            photographs: Vec::new(),
            photograph_sheets: Vec::new(),
            photographs_fingerprint: 0,
            edges: template.mesh().edges(),
        })
    }

    /// Uses photographs too: [`SynthConfig::photograph_share`] of the backgrounds will show one, and pieces of them appear on other sheets. The
    /// samples then depend on the photographs and their order.
    pub fn with_photographs(mut self, photographs: Vec<Picture>) -> Self {
        for (number, photograph) in photographs.into_iter().enumerate() {
            let mut rng = generator(mix(number as u64), 0, Stream::Pool);
            self.photographs_fingerprint = fingerprint(self.photographs_fingerprint, &photograph);
            for _ in 0..SHEETS_A_PHOTOGRAPH {
                self.photograph_sheets
                    .push(Texture::new(&photograph_sheet(&photograph, &mut rng)));
            }
            self.photographs.push(photograph_texture(photograph));
        }
        self
    }

    /// The template.
    pub fn template(&self) -> &Template {
        &self.template
    }

    /// The configuration.
    pub fn config(&self) -> &SynthConfig {
        &self.config
    }

    /// A number that differs when samples of the same seed and index would: of template, configuration and photographs.
    pub fn fingerprint(&self) -> u64 {
        let start = mix(self.config.fingerprint() ^ self.photographs_fingerprint);
        template_fingerprint(start, &self.template)
    }

    /// Relative changes of the lengths of the mesh's edges in a sample, one an edge; none without the template.
    pub fn edge_length_changes(&self, sample: &Sample) -> Vec<f64> {
        edge_length_changes(self.template.mesh().vertices(), &self.edges, &sample.vertices_camera)
    }

    /// Sample `index` of the data set `seed`: always the same for the same template, configuration, photographs,
    /// seed and index.
    pub fn sample(&self, seed: u64, index: u64) -> Sample {
        self.sample_and_strength(seed, index).0
    }

    /// [`Synthesizer::sample`], and [`crate::HandleShape::strength`] of its shape where handles made it.
    pub fn sample_and_strength(&self, seed: u64, index: u64) -> (Sample, Option<f64>) {
        let mut rng = generator(seed, index, Stream::Shape);
        let noise_seed = rng.random();
        if rng.random_bool(self.config.empty_share) {
            let scene = Scene::without_template(self, &mut generator(seed, index, Stream::Scene), &mut rng);
            return (scene.compose_without_template(noise_seed), None);
        }
        let scene = self.scene(seed, index);
        let mut best: Option<(usize, PosedShape, ImageSheet)> = None;
        for _ in 0..VIEW_TRIES {
            let shape = self.sample_shape(&mut rng);
            let sheet = ImageSheet::new(self.template.mesh(), &shape.vertices_camera, &self.config.camera);
            let visible = scene.visible_area(&sheet);
            if best.as_ref().is_none_or(|(most, ..)| visible > *most) {
                best = Some((visible, shape, sheet));
            }
            if visible >= self.config.least_visible_px {
                break;
            }
        }
        match best {
            Some((_, shape, sheet)) => (scene.compose(shape.vertices_camera, &sheet, noise_seed), shape.strength),
            None => (scene.compose_without_template(noise_seed), None),
        }
    }

    /// Everything random of sample `index` of the data set `seed` but the sheet's shape and pose: background, other
    /// sheets, light, paper, occluders, camera effects. For sequences, in which only the sheet moves.
    pub fn scene(&self, seed: u64, index: u64) -> Scene<'_> {
        Scene::with_template(self, None, &mut generator(seed, index, Stream::Scene))
    }

    /// [`Synthesizer::scene`] at the place of another.
    pub(crate) fn scene_at(&self, place: &Place, seed: u64, index: u64) -> Scene<'_> {
        Scene::with_template(self, Some(place), &mut generator(seed, index, Stream::Scene))
    }

    /// A picture of the template with its vertices at `vertices_camera` (mm, camera frame), without disturbances: matt
    /// paper under even light from the camera before mid grey, no occluders, ideal camera.
    ///
    /// # Errors
    /// [`SynthError::VertexCount`] when there are not as many vertices as the template's mesh has;
    /// [`SynthError::Geometry`] when one is not finite.
    pub fn render_clean(&self, vertices_camera: Vec<DVec3>) -> Result<Sample, SynthError> {
        Scene::clean(self).render(vertices_camera, 0)
    }

    /// The template's vertices in a random shape and pose, mm, camera frame: a function of seed and index like a
    /// sample, but whatever is seen of it.
    pub fn random_vertices(&self, seed: u64, index: u64) -> Vec<DVec3> {
        self.sample_vertices(&mut generator(seed, index, Stream::Shape))
    }

    /// The vertices of a random shape in a random pose, mm, camera frame.
    pub(crate) fn sample_vertices(&self, rng: &mut Pcg64Mcg) -> Vec<DVec3> {
        self.sample_shape(rng).vertices_camera
    }

    /// A random shape in a random pose. Any side of a template that is no sheet may look at the camera: it is turned about
    /// its upright axis first, then posed as a sheet is.
    fn sample_shape(&self, rng: &mut Pcg64Mcg) -> PosedShape {
        let (vertices_template, strength) = match &self.handles {
            None => (deform(&self.template, &self.config.deformation, rng), None),
            Some(handles) => {
                let shape = handles.deform(&self.config.handles, rng);
                let turn = DQuat::from_rotation_y(rng.random_range(0.0..std::f64::consts::TAU));
                let turned = shape.vertices.into_iter().map(|p| turn * p);
                (turned.collect(), Some(shape.strength))
            }
        };
        let pose = sample_pose(&self.config.camera, &vertices_template, &self.config.pose, rng);
        let posed = vertices_template.into_iter().map(|p| pose.transform_point3(p));
        PosedShape {
            vertices_camera: posed.collect(),
            strength,
        }
    }

    /// A background picture for a scene.
    pub(crate) fn background(&self, rng: &mut Pcg64Mcg) -> Background<'_> {
        let procedural = procedural_backgrounds();
        if !self.photographs.is_empty() && rng.random_bool(self.config.photograph_share) {
            return Background::Photograph(pick(&self.photographs, rng));
        }
        Background::Drawn(pick(procedural, rng))
    }

    /// Art of a sheet that is not the template.
    pub(crate) fn other_art(&self, rng: &mut Pcg64Mcg) -> &Texture {
        if !self.photograph_sheets.is_empty() && rng.random_bool(0.4) {
            return pick(&self.photograph_sheets, rng);
        }
        pick(procedural_artworks(), rng)
    }
}

/// Folds the mesh and the texture of a template into a fingerprint.
fn template_fingerprint(start: u64, template: &Template) -> u64 {
    let mesh = template.mesh();
    let shape = mesh.vertices().iter().flat_map(|p| p.to_array()).map(f64::to_bits);
    let uv = mesh
        .texture_coordinates()
        .iter()
        .flat_map(|uv| uv.to_array())
        .map(f64::to_bits);
    let faces = mesh.faces().iter().flatten().map(|&vertex| vertex as u64);
    let all = shape
        .chain(uv)
        .chain(faces)
        .fold(start, |hash, value| mix(hash ^ value));
    fingerprint(all, template.texture())
}

/// Folds the size and the bytes of a picture into a fingerprint.
fn fingerprint(start: u64, picture: &Picture) -> u64 {
    let size = mix(start ^ mix(picture.width() as u64) ^ picture.height() as u64);
    let word = |bytes: &[u8]| bytes.iter().fold(0, |word: u64, &byte| word << 8 | u64::from(byte));
    picture
        .rgb()
        .chunks(8)
        .fold(size, |hash, bytes| mix(hash ^ word(bytes)))
}

fn pick<'a, T, R: Rng + ?Sized>(items: &'a [T], rng: &mut R) -> &'a T {
    &items[rng.random_range(0..items.len())]
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
