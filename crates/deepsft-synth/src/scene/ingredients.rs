//! What scenes are made of: the template and its random shapes, backgrounds, and the art of other printed sheets.

use crate::deform::{ControlPointDeformation, EdgeLengthChange, TOY_EDGE_CHANGE, deform};
use crate::error::SynthError;
use crate::render::texture::Texture;
use crate::scene::background::{Background, any_artwork, any_background};
use crate::scene::config::SynthConfig;
use crate::scene::photographs::{Photographs, SHEETS_PER_PHOTOGRAPH};
use crate::scene::pose::sample_pose;
use deepsft_geometry::glam::{DQuat, DVec3};
use deepsft_geometry::{Picture, Template};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use std::sync::Arc;

/// Probability that another sheet's art is made from a photograph, where there are any.
const PHOTOGRAPH_ART_PROBABILITY: f64 = 0.4;

/// A template ready to be rendered, and the pools that its scenes draw from.
#[derive(Clone, Debug)]
pub(crate) struct Ingredients {
    pub(crate) template: Template,
    pub(crate) config: SynthConfig,
    pub(crate) texture: Texture,
    /// Art of a sheet with nothing on it.
    pub(crate) blank: Arc<Texture>,
    /// Vertices along a sheet's outline, in order; none of other templates.
    pub(crate) outline: Vec<usize>,
    /// How a template that is no sheet deforms.
    control_points: Option<ControlPointDeformation>,
    /// The user's photographs, at least one.
    pub(crate) photographs: Option<Arc<Photographs>>,
}

impl Ingredients {
    /// As [`crate::Synthesizer::new`].
    pub(crate) fn new(template: &Template, config: SynthConfig) -> Result<Self, SynthError> {
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

    /// How a template that is no sheet deforms, and the bounds that it keeps.
    pub(crate) fn control_points(&self) -> Option<(&ControlPointDeformation, EdgeLengthChange)> {
        Some((self.control_points.as_ref()?, self.most_change_of_solid()))
    }

    fn most_change_of_solid(&self) -> EdgeLengthChange {
        let most = self.config.deformation.max_edge_change;
        if most.p95 > 0.0 { TOY_EDGE_CHANGE } else { most }
    }

    /// The vertices of a random shape in a random pose, mm, camera frame. Any side of a template that is no sheet may look at the
    /// camera: it is turned about its upright axis first, then posed as a sheet is.
    pub(crate) fn sample_vertices(&self, rng: &mut Pcg64Mcg) -> Vec<DVec3> {
        let vertices_template: Vec<DVec3> = match &self.control_points {
            None => deform(&self.template, &self.config.deformation, rng),
            Some(control_points) => {
                let vertices = control_points.deform(self.most_change_of_solid(), rng);
                let turn = DQuat::from_rotation_y(rng.random_range(0.0..std::f64::consts::TAU));
                vertices.into_iter().map(|p| turn * p).collect()
            }
        };
        let pose = sample_pose(&self.config.camera, &vertices_template, &self.config.pose, rng);
        let posed = vertices_template.into_iter().map(|p| pose.transform_point3(p));
        posed.collect()
    }

    /// A background picture for a scene.
    pub(crate) fn background(&self, rng: &mut Pcg64Mcg) -> Background {
        if let Some(photographs) = &self.photographs
            && rng.random_bool(self.config.photograph_probability)
            && let Some(photograph) = photographs.get(rng.random_range(0..photographs.count()))
        {
            return Background::Photograph(photograph.background);
        }
        Background::Drawn(any_background(rng))
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
