//! Everything in a synthetic picture but the template's shape and pose.

use crate::error::SynthError;
use crate::random::uniform;
use crate::render::black_bars::Bars;
use crate::render::camera_effects::CameraEffects;
use crate::render::frame::Frame;
use crate::render::projected_mesh::ProjectedMesh;
use crate::render::shading::{Lighting, Paper};
use crate::render::silhouette::silhouette;
use crate::render::texture::Texture;
use crate::sample::Sample;
use crate::scene::background::{Background, Placement, strew};
use crate::scene::config::PhotographUse;
use crate::scene::ingredients::Ingredients;
use crate::scene::occluder::{ImageOccluder, Occluder, SheetInImage, sample_occluders};
use deepsft_geometry::glam::{DVec3, Vec2, Vec3};
use deepsft_geometry::{Camera, Maps, Picture};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use std::borrow::Cow;
use std::sync::Arc;

/// Reflectance (linear) of the ground of clean renders: mid grey.
const CLEAN_GROUND: f32 = 0.2;

/// Probability that another sheet in the template's place is blank, and that it is the template's own back.
const BLANK_PROBABILITY: f64 = 0.08;
const BACK_PROBABILITY: f64 = 0.07;

/// A scene waiting for the template: background with what lies behind, light, paper, occluders, camera effects.
#[derive(Debug)]
pub struct Scene<'a> {
    ingredients: &'a Ingredients,
    /// Background and other sheets behind the template.
    background: Frame,
    light: Lighting,
    paper: Paper,
    occluders: Vec<Occluder>,
    /// `None` for the ideal camera.
    effects: Option<CameraEffects>,
    bars: Option<Bars>,
    /// What is held in the template's place when it is not there.
    stand_in: Option<StandIn>,
}

/// One instant of an exposure: where the template's vertices are (mm, camera frame) and what passes before everything.
pub(crate) struct Moment {
    pub(crate) vertices_camera: Vec<DVec3>,
    pub(crate) passing: Option<ImageOccluder>,
}

/// Another sheet in the template's place, or only its shape, which places the occluders.
#[derive(Debug)]
struct StandIn {
    vertices_camera: Vec<DVec3>,
    art: Option<Arc<Texture>>,
}

impl<'a> Scene<'a> {
    /// Draws a scene for the template, in the place and with the print of `other` if any is given:
    /// light, paper and camera settings.
    pub(crate) fn with_template(ingredients: &'a Ingredients, other: Option<&Scene<'_>>, rng: &mut Pcg64Mcg) -> Self {
        let mut scene = Self::empty(ingredients, rng);
        if let Some(other) = other {
            scene.light = other.light.clone();
            scene.paper = other.paper.clone();
            scene.effects = other.effects.clone();
        }
        if rng.random_bool(ingredients.config.distractor_probability) {
            for _ in 0..rng.random_range(1..3) {
                scene.add_sheet_behind(rng);
            }
        }
        scene
    }

    /// Draws a scene in which the template is not: another sheet in its place, or hands in the air.
    pub(crate) fn without_template(ingredients: &'a Ingredients, rng: &mut Pcg64Mcg, shape: &mut Pcg64Mcg) -> Self {
        let mut scene = Self::empty(ingredients, rng);
        let mut vertices_camera = ingredients.sample_vertices(shape);
        let mut art = None;
        if rng.random_bool(ingredients.config.empty_distractor_probability) {
            let kind = rng.random::<f64>();
            art = Some(if kind < BLANK_PROBABILITY {
                ingredients.blank.clone()
            } else {
                ingredients.other_art(rng)
            });
            if kind > 1.0 - BACK_PROBABILITY {
                vertices_camera = turned_over(vertices_camera);
            }
        }
        scene.stand_in = Some(StandIn { vertices_camera, art });
        scene
    }

    /// Mid grey ground, matt paper, even light, ideal camera.
    pub(crate) fn clean(ingredients: &'a Ingredients) -> Self {
        let camera = ingredients.config.camera;
        Self {
            ingredients,
            background: Frame::filled(camera.size().width, camera.size().height, Vec3::splat(CLEAN_GROUND)),
            light: Lighting::frontal(),
            paper: Paper::matt(),
            occluders: Vec::new(),
            effects: None,
            bars: None,
            stand_in: None,
        }
    }

    fn empty(ingredients: &'a Ingredients, rng: &mut Pcg64Mcg) -> Self {
        let config = &ingredients.config;
        let (width, height) = (config.camera.size().width, config.camera.size().height);
        let side = Vec2::new(width as f32, height as f32);
        let background = match (ingredients.background(rng), config.photographs) {
            (Background::Photograph(texture), PhotographUse::Plain) => {
                Placement::filling(&texture, side).frame(&texture, width, height)
            }
            (Background::Photograph(texture) | Background::Drawn(texture), _) => {
                let mut background = Placement::sample(&texture, side, rng).frame(&texture, width, height);
                strew(&mut background, rng);
                background
            }
        };
        let light = Lighting::sample(&config.lighting, rng);
        let paper = Paper::sample(&config.lighting, rng);
        Self {
            ingredients,
            background,
            light,
            paper: Paper {
                // No light shines through what is stuffed.
                translucency: if ingredients.template.is_sheet() {
                    paper.translucency
                } else {
                    0.0
                },
                ..paper
            },
            occluders: sample_occluders(config.occluder_probability, config.occluders, rng),
            effects: Some(CameraEffects::sample(&config.effects, rng)),
            bars: rng
                .random_bool(config.effects.bars_probability)
                .then(|| Bars::sample(&config.camera, rng)),
            stand_in: None,
        }
    }

    /// Paints another sheet, farther away than the template would be.
    fn add_sheet_behind(&mut self, rng: &mut Pcg64Mcg) {
        let farther = f64::from(uniform(rng, [1.1, 2.2]));
        let stretch = DVec3::new(
            f64::from(uniform(rng, [0.6, 1.3])),
            f64::from(uniform(rng, [0.6, 1.3])),
            1.0,
        );
        let vertices = self.ingredients.sample_vertices(rng);
        let centre = vertices.iter().sum::<DVec3>() / vertices.len().max(1) as f64;
        let vertices: Vec<DVec3> = vertices
            .iter()
            .map(|p| centre * farther + (*p - centre) * stretch)
            .collect();
        let art = self.ingredients.other_art(rng);
        self.paint_sheet(&vertices, &art, &Paper::sample(&self.ingredients.config.lighting, rng));
    }

    fn paint_sheet(&mut self, vertices_camera: &[DVec3], art: &Texture, paper: &Paper) {
        let ingredients = self.ingredients;
        let sheet = ProjectedMesh::new(ingredients.template.mesh(), vertices_camera, &ingredients.config.camera);
        sheet.paint(&mut self.background, art, paper, &self.light);
    }

    /// The picture of the template with its vertices at `vertices_camera` (mm, camera frame) in this scene.
    /// `noise_seed` chooses the sensor noise, which differs from frame to frame of a sequence.
    ///
    /// # Errors
    /// [`SynthError::VertexCount`] when there are not as many vertices as the template's mesh has;
    /// [`SynthError::Geometry`] when one is not finite.
    pub fn render(&self, vertices_camera: Vec<DVec3>, noise_seed: u64) -> Result<Sample, SynthError> {
        let moment = Moment {
            vertices_camera,
            passing: None,
        };
        self.expose(vec![moment], noise_seed)
    }

    /// The picture of an exposure, the mean of the light at `moments` (an odd number); the truth is that of the middle
    /// one. Errors as [`Scene::render`].
    pub(crate) fn expose(&self, moments: Vec<Moment>, noise_seed: u64) -> Result<Sample, SynthError> {
        let mesh = self.ingredients.template.mesh();
        let (count, middle) = (moments.len(), moments.len() / 2);
        let mut light: Option<Frame> = None;
        let mut seen = None;
        for (k, moment) in moments.into_iter().enumerate() {
            let Moment {
                vertices_camera,
                passing,
            } = moment;
            if vertices_camera.len() != mesh.vertices().len() {
                return Err(SynthError::VertexCount {
                    actual: vertices_camera.len(),
                    expected: mesh.vertices().len(),
                });
            }
            let mesh = mesh.with_vertices(vertices_camera)?;
            let sheet = ProjectedMesh::new(&mesh, mesh.vertices(), &self.ingredients.config.camera);
            let art = Some(&self.ingredients.texture);
            let (frame, truth) = self.light_and_truth(mesh.vertices(), &sheet, art, passing.as_ref());
            match &mut light {
                None => light = Some(frame),
                Some(sum) => sum.add(&frame),
            }
            if k == middle {
                seen = Some((truth, mesh.vertices().to_vec()));
            }
        }
        let camera = self.ingredients.config.camera;
        let (width, height) = (camera.size().width, camera.size().height);
        let mut light = light.unwrap_or_else(|| self.background.clone());
        light.scale(1.0 / count.max(1) as f32);
        let (truth, vertices_camera) = seen.unwrap_or_else(|| (Maps::empty((width, height)), Vec::new()));
        Ok(self.sample(light, truth, vertices_camera, noise_seed))
    }

    /// Takes the paper's discs away, which have a size in pixels: hands and things stay.
    pub(crate) fn keep_bodies(&mut self) {
        self.occluders.retain(Occluder::is_body);
    }

    /// The occluders as another camera sees them, however much they cover; `vertices_camera` are in its frame.
    pub(crate) fn bodies(&self, camera: &Camera, vertices_camera: &[DVec3]) -> Vec<ImageOccluder> {
        let held = SheetInImage {
            outline: &self.ingredients.outline,
            vertices_camera,
            camera,
        };
        self.occluders
            .iter()
            .filter_map(|occluder| occluder.place(&held))
            .collect()
    }

    /// Pixels of a sheet's front in view before occluders.
    pub(crate) fn visible_area(&self, sheet: &ProjectedMesh) -> usize {
        sheet.front_area(|column, row| self.bars.is_none_or(|bars| bars.shows(column, row)))
    }

    /// The picture of the template as `sheet`, whose vertices are `vertices_camera`, in this scene.
    pub(crate) fn compose(&self, vertices_camera: Vec<DVec3>, sheet: &ProjectedMesh, noise_seed: u64) -> Sample {
        let art = Some(&self.ingredients.texture);
        let (light, truth) = self.light_and_truth(&vertices_camera, sheet, art, None);
        self.sample(light, truth, vertices_camera, noise_seed)
    }

    /// The picture of the scene without the template.
    pub(crate) fn compose_without_template(&self, noise_seed: u64) -> Sample {
        let (vertices_camera, art) = match &self.stand_in {
            Some(StandIn { vertices_camera, art }) => (vertices_camera.as_slice(), art.as_deref()),
            None => ([].as_slice(), None),
        };
        let mesh = self.ingredients.template.mesh();
        let sheet = ProjectedMesh::new(mesh, vertices_camera, &self.ingredients.config.camera);
        let (light, truth) = self.light_and_truth(vertices_camera, &sheet, art, None);
        let nothing = Maps::empty(truth.size());
        self.sample(light, nothing, Vec::new(), noise_seed)
    }

    /// The sample of this light: the picture that the camera makes of it, with what is true of it.
    fn sample(&self, light: Frame, truth: Maps, vertices_camera: Vec<DVec3>, noise_seed: u64) -> Sample {
        let image = self.develop(light, noise_seed);
        let towards_light = self.light.towards_light.as_dvec3();
        Sample::new(
            image,
            truth,
            vertices_camera,
            self.ingredients.config.camera,
            towards_light,
        )
    }

    fn truth(&self, sheet: &ProjectedMesh) -> Maps {
        let mut truth = sheet.maps();
        if let Some(bars) = &self.bars {
            bars.clear(&mut truth);
        }
        truth
    }

    /// The light of the scene with a sheet that carries `art` (`None`: it is not painted) and with what passes before
    /// everything, and what is seen of the sheet.
    fn light_and_truth(
        &self,
        vertices_camera: &[DVec3],
        sheet: &ProjectedMesh,
        art: Option<&Texture>,
        passing: Option<&ImageOccluder>,
    ) -> (Frame, Maps) {
        let camera = &self.ingredients.config.camera;
        let mut frame = self.background.clone();
        let mut truth = self.truth(sheet);
        let occluders = self.fitting_occluders(vertices_camera, &frame, &truth);
        for occluder in &occluders {
            occluder.paint_behind(&mut frame, &self.light, camera);
        }
        if let Some(art) = art {
            sheet.paint(&mut frame, art, &self.paper, &self.light);
        }
        for occluder in occluders.iter().chain(passing) {
            occluder.paint_front(&mut frame, &mut truth, &self.light, camera);
        }
        (frame, truth)
    }

    /// What the camera makes of light.
    fn develop(&self, frame: Frame, noise_seed: u64) -> Picture {
        let image = match &self.effects {
            Some(effects) => effects.expose(frame, noise_seed),
            None => frame.to_picture(),
        };
        match &self.bars {
            Some(bars) => bars.blacken(image),
            None => image,
        }
    }

    /// The occluders, laid into the image, that together cover no more of the sheet than they may.
    fn fitting_occluders(&self, vertices_camera: &[DVec3], frame: &Frame, truth: &Maps) -> Vec<ImageOccluder> {
        let Ingredients { config, outline, .. } = self.ingredients;
        let outline: Cow<'_, [usize]> = if self.occluders.is_empty() || !outline.is_empty() {
            outline.into()
        } else {
            silhouette(vertices_camera, &config.camera).into()
        };
        let mut budget = (config.max_occluded * truth.area() as f64) as usize;
        let mut free = truth.mask();
        let held = SheetInImage {
            outline: &outline,
            vertices_camera,
            camera: &config.camera,
        };
        let mut fitting = Vec::new();
        for placed in self.occluders.iter().filter_map(|occluder| occluder.place(&held)) {
            let covered: Vec<usize> = placed
                .covered_pixels(frame)
                .into_iter()
                .filter(|&pixel| free[pixel])
                .collect();
            if covered.len() <= budget {
                budget -= covered.len();
                covered.into_iter().for_each(|pixel| free[pixel] = false);
                fitting.push(placed);
            }
        }
        fitting
    }
}

/// The sheet turned over in its place: mirrored in depth about its centroid and from left to right, which is a half
/// turn about the vertical through it.
fn turned_over(vertices_camera: Vec<DVec3>) -> Vec<DVec3> {
    let centre = vertices_camera.iter().sum::<DVec3>() / vertices_camera.len().max(1) as f64;
    let turn = DVec3::new(-1.0, 1.0, -1.0);
    vertices_camera
        .into_iter()
        .map(|p| centre + (p - centre) * turn)
        .collect()
}
