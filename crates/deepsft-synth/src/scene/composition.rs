//! Everything in a synthetic picture but the template's shape and pose.

use crate::deform::centroid;
use crate::error::SynthError;
use crate::random::uniform;
use crate::render::{Bars, CameraEffects, Frame, Lighting, Paper, Texture, paint_sheet, silhouette};
use crate::sample::Sample;
use crate::scene::background::{Placement, any_background, strew};
use crate::scene::config::PhotographUse;
use crate::scene::occluder::{ImageOccluder, Occluder, SheetInImage, covered_by, sample_occluders};
use crate::scene::synthesizer::Synthesizer;
use deepsft_geometry::glam::{DVec3, Vec2, Vec3};
use deepsft_geometry::raster::VisibleSurface;
use deepsft_geometry::{Camera, Maps};
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
    synthesizer: &'a Synthesizer,
    /// Background and other sheets behind the template.
    background: Frame,
    light: Lighting,
    paper: Paper,
    occluders: Vec<Occluder>,
    /// `None` for the ideal camera.
    effects: Option<CameraEffects>,
    bars: Option<Bars>,
    /// What is held in the template's place when it is not there: another sheet, or only its shape, which places the occluders.
    stand_in: (Vec<DVec3>, Option<Arc<Texture>>),
}

/// One instant of an exposure: where the template's vertices are (mm, camera frame) and what passes before everything.
pub(crate) type Moment = (Vec<DVec3>, Option<ImageOccluder>);

impl<'a> Scene<'a> {
    /// Draws a scene for the template, in the place and with the print of `other` if any is given:
    /// light, paper and camera settings.
    pub(crate) fn with_template(synthesizer: &'a Synthesizer, other: Option<&Scene<'_>>, rng: &mut Pcg64Mcg) -> Self {
        let mut scene = Self::empty(synthesizer, rng);
        if let Some(other) = other {
            scene.light = other.light.clone();
            scene.paper = other.paper.clone();
            scene.effects = other.effects.clone();
        }
        if rng.random_bool(synthesizer.config().distractor_probability) {
            for _ in 0..rng.random_range(1..3) {
                scene.add_sheet_behind(rng);
            }
        }
        scene
    }

    /// Draws a scene in which the template is not: another sheet in its place, or hands in the air.
    pub(crate) fn without_template(synthesizer: &'a Synthesizer, rng: &mut Pcg64Mcg, shape: &mut Pcg64Mcg) -> Self {
        let mut scene = Self::empty(synthesizer, rng);
        let mut vertices_camera = synthesizer.sample_vertices(shape);
        let mut art = None;
        if rng.random_bool(synthesizer.config().empty_distractor_probability) {
            let kind = rng.random::<f64>();
            art = Some(if kind < BLANK_PROBABILITY {
                synthesizer.blank.clone()
            } else {
                synthesizer.other_art(rng)
            });
            if kind > 1.0 - BACK_PROBABILITY {
                vertices_camera = turned_over(vertices_camera);
            }
        }
        scene.stand_in = (vertices_camera, art);
        scene
    }

    /// Mid grey ground, matt paper, even light, ideal camera.
    pub(crate) fn clean(synthesizer: &'a Synthesizer) -> Self {
        let camera = synthesizer.config().camera;
        Self {
            synthesizer,
            background: Frame::filled(camera.size().width, camera.size().height, Vec3::splat(CLEAN_GROUND)),
            light: Lighting::frontal(),
            paper: Paper::matt(),
            occluders: Vec::new(),
            effects: None,
            bars: None,
            stand_in: (Vec::new(), None),
        }
    }

    fn empty(synthesizer: &'a Synthesizer, rng: &mut Pcg64Mcg) -> Self {
        let config = synthesizer.config();
        let (width, height) = (config.camera.size().width, config.camera.size().height);
        let side = Vec2::new(width as f32, height as f32);
        let background = match synthesizer.photograph(rng) {
            Some(texture) if config.photographs == PhotographUse::Plain => {
                Placement::filling(&texture, side).frame(&texture, width, height)
            }
            photograph => {
                let texture = photograph.unwrap_or_else(|| any_background(rng));
                let mut background = Placement::sample(&texture, side, rng).frame(&texture, width, height);
                strew(&mut background, rng);
                background
            }
        };
        let light = Lighting::sample(&config.lighting, rng);
        let mut paper = Paper::sample(&config.lighting, rng);
        if !synthesizer.template().is_sheet() {
            // No light shines through what is stuffed.
            paper.translucency = 0.0;
        }
        Self {
            synthesizer,
            background,
            light,
            paper,
            occluders: sample_occluders(config.occluder_probability, config.occluders, rng),
            effects: Some(CameraEffects::sample(&config.effects, rng)),
            bars: rng
                .random_bool(config.effects.bars_probability)
                .then(|| Bars::sample(&config.camera, rng)),
            stand_in: (Vec::new(), None),
        }
    }

    /// Paints another sheet, farther away than the template would be.
    fn add_sheet_behind(&mut self, rng: &mut Pcg64Mcg) {
        let farther = f64::from(uniform(rng, [1.1, 2.2]));
        let [across, down] = [0; 2].map(|_| f64::from(uniform(rng, [0.6, 1.3])));
        let stretch = DVec3::new(across, down, 1.0);
        let vertices = self.synthesizer.sample_vertices(rng);
        let centre = centroid(&vertices);
        let moved = vertices.iter().map(|p| centre * farther + (*p - centre) * stretch);
        let vertices: Vec<DVec3> = moved.collect();
        let art = self.synthesizer.other_art(rng);
        let (mesh, config) = (self.synthesizer.template().mesh(), self.synthesizer.config());
        let paper = Paper::sample(&config.lighting, rng);
        let sheet = VisibleSurface::new(mesh, &vertices, &config.camera);
        paint_sheet(&sheet, &mut self.background, &art, &paper, &self.light);
    }

    /// The picture of the template with its vertices at `vertices_camera` (mm, camera frame) in this scene.
    /// `noise_seed` chooses the sensor noise, which differs from frame to frame of a sequence.
    ///
    /// # Errors
    /// [`SynthError::VertexCount`] when there are not as many vertices as the template's mesh has;
    /// [`SynthError::Geometry`] when one is not finite.
    pub fn render(&self, vertices_camera: Vec<DVec3>, noise_seed: u64) -> Result<Sample, SynthError> {
        self.expose(vec![(vertices_camera, None)], noise_seed)
    }

    /// The picture of an exposure, the mean of the light at `moments` (an odd number); the truth is that of the middle
    /// one. Errors as [`Scene::render`].
    pub(crate) fn expose(&self, moments: Vec<Moment>, noise_seed: u64) -> Result<Sample, SynthError> {
        let (mesh, camera) = (self.synthesizer.template().mesh(), &self.synthesizer.config().camera);
        let (count, middle) = (moments.len(), moments.len() / 2);
        let mut light = Frame::filled(camera.size().width, camera.size().height, Vec3::ZERO);
        let mut seen = (Maps::empty(camera.size()), Vec::new());
        for (k, (vertices_camera, passing)) in moments.into_iter().enumerate() {
            if vertices_camera.len() != mesh.vertices().len() {
                return Err(SynthError::VertexCount {
                    actual: vertices_camera.len(),
                    expected: mesh.vertices().len(),
                });
            }
            let mesh = mesh.with_vertices(vertices_camera)?;
            let sheet = VisibleSurface::new(&mesh, mesh.vertices(), camera);
            let art = Some(&self.synthesizer.texture);
            let (frame, truth) = self.light_and_truth(mesh.vertices(), &sheet, art, passing.as_ref());
            light.add(&frame);
            if k == middle {
                seen = (truth, mesh.vertices().to_vec());
            }
        }
        light.scale(1.0 / count.max(1) as f32);
        Ok(self.sample(light, seen.0, seen.1, noise_seed))
    }

    /// Takes the paper's discs away, which have a size in pixels: hands and things stay.
    pub(crate) fn keep_bodies(&mut self) {
        self.occluders.retain(|occluder| !occluder.in_pixels);
    }

    /// The occluders as another camera sees them, however much they cover; `vertices_camera` are in its frame.
    pub(crate) fn bodies(&self, camera: &Camera, vertices_camera: &[DVec3]) -> Vec<ImageOccluder> {
        let held = SheetInImage {
            outline: &self.synthesizer.outline,
            vertices_camera,
            camera,
        };
        let placed = self.occluders.iter().filter_map(|occluder| occluder.place(&held));
        placed.collect()
    }

    /// Pixels of a sheet's front in view before occluders.
    pub(crate) fn visible_area(&self, sheet: &VisibleSurface) -> usize {
        let is_shown = |column, row| self.bars.is_none_or(|bars| bars.shows(column, row));
        sheet.front().filter(|&(column, row, ..)| is_shown(column, row)).count()
    }

    /// The picture of the template as `sheet`, whose vertices are `vertices_camera`, in this scene.
    pub(crate) fn compose(&self, vertices_camera: Vec<DVec3>, sheet: &VisibleSurface, noise_seed: u64) -> Sample {
        let art = Some(&self.synthesizer.texture);
        let (light, truth) = self.light_and_truth(&vertices_camera, sheet, art, None);
        self.sample(light, truth, vertices_camera, noise_seed)
    }

    /// The picture of the scene without the template.
    pub(crate) fn compose_without_template(&self, noise_seed: u64) -> Sample {
        let (vertices_camera, art) = &self.stand_in;
        let mesh = self.synthesizer.template().mesh();
        let sheet = VisibleSurface::new(mesh, vertices_camera, &self.synthesizer.config().camera);
        let (light, truth) = self.light_and_truth(vertices_camera, &sheet, art.as_deref(), None);
        let nothing = Maps::empty(truth.size());
        self.sample(light, nothing, Vec::new(), noise_seed)
    }

    /// The sample of this light: the picture that the camera makes of it, with what is true of it.
    fn sample(&self, light: Frame, truth: Maps, vertices_camera: Vec<DVec3>, noise_seed: u64) -> Sample {
        let mut image = match &self.effects {
            Some(effects) => effects.expose(light, noise_seed),
            None => light.to_picture(),
        };
        if let Some(bars) = &self.bars {
            image = bars.blacken(image);
        }
        let camera = self.synthesizer.config().camera;
        let towards_light = self.light.towards_light.as_dvec3();
        Sample::new(image, truth, vertices_camera, camera, towards_light)
    }

    /// The light of the scene with a sheet that carries `art` (`None`: it is not painted) and with what passes before
    /// everything, and what is seen of the sheet.
    fn light_and_truth(
        &self,
        vertices_camera: &[DVec3],
        sheet: &VisibleSurface,
        art: Option<&Texture>,
        passing: Option<&ImageOccluder>,
    ) -> (Frame, Maps) {
        let camera = &self.synthesizer.config().camera;
        let mut frame = self.background.clone();
        let mut truth = sheet.maps();
        if let Some(bars) = &self.bars {
            bars.clear(&mut truth);
        }
        let occluders = self.fitting_occluders(vertices_camera, &frame, &truth);
        for occluder in &occluders {
            occluder.paint(&occluder.behind, &mut frame, &self.light, camera);
        }
        if let Some(art) = art {
            paint_sheet(sheet, &mut frame, art, &self.paper, &self.light);
        }
        for occluder in occluders.iter().chain(passing) {
            occluder.paint_front(&mut frame, &mut truth, &self.light, camera);
        }
        (frame, truth)
    }

    /// The occluders, laid into the image, that together cover no more of the sheet than they may.
    fn fitting_occluders(&self, vertices_camera: &[DVec3], frame: &Frame, truth: &Maps) -> Vec<ImageOccluder> {
        let (config, outline) = (self.synthesizer.config(), &self.synthesizer.outline);
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
            let mut covered = covered_by(&placed.front, frame);
            covered.retain(|&pixel| free[pixel]);
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
    let (centre, turn) = (centroid(&vertices_camera), DVec3::new(-1.0, 1.0, -1.0));
    let turned = vertices_camera.into_iter().map(|p| centre + (p - centre) * turn);
    turned.collect()
}
