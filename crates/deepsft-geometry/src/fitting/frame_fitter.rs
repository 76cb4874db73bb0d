//! The mesh of one frame.

use super::close_up::{CloseUp, MORE, close_ups, fit_through};
use super::coarse_fitter::{BLURS_PX, CoarseStart, INDEPENDENT, JUDGED_BLUR_PX};
use super::deviations::deviations;
use super::isometric_mesh::Stiffness;
use super::low_modes::likeliest_shape;
use super::measurements::{Observation, Start, measurements_of_mesh};
use super::mesh_fitter::{FitRound, Fitted, MeshFitter, RIGIDITY, Resolution, STEPS};
use super::mode_hops::{MIN_CORRELATION, best_of_mode_hops};
use super::rigid_fit::reversed_pose;
use super::self_similarity::{SelfSimilarity, is_alike_in_detail, self_similarities};
use crate::camera::Camera;
use crate::error::{Result, check_size, check_start};
use crate::image::{GreyImage, Picture};
use crate::mesh::{SurfacePoint, Template};
use crate::solver::Energy;
use crate::surface::Surface;
use glam::DVec3;

/// Fits one template's mesh to frames.
#[derive(Debug)]
pub struct FrameFitter {
    fitter: MeshFitter,
    /// Looked for when first needed.
    self_similarities: Option<Vec<SelfSimilarity>>,
    /// Whether they hold in detail, looked for when a close-up needs it.
    is_alike_in_detail: Option<bool>,
}

impl FrameFitter {
    /// Prepares everything that does not depend on the frame.
    ///
    /// # Errors
    /// [`GeometryError`](crate::GeometryError) for a mesh without extent.
    pub fn new(template: &Template) -> Result<Self> {
        Ok(Self {
            fitter: MeshFitter::new(template, RIGIDITY)?,
            self_similarities: None,
            is_alike_in_detail: None,
        })
    }

    /// Whether the print repeats itself or looks the same when turned, so that features may be matched to the wrong place: see
    /// [`Verdict::ambiguity`](crate::Verdict::ambiguity). It is looked up once, also for [`FrameFitter::fit`].
    pub fn is_self_similar(&mut self) -> bool {
        !self.self_similarities().is_empty()
    }

    fn self_similarities(&mut self) -> Vec<SelfSimilarity> {
        let (template, known) = (&self.fitter.template, &mut self.self_similarities);
        known.get_or_insert_with(|| self_similarities(template)).clone()
    }

    fn is_alike_in_detail(&mut self) -> bool {
        let similar = self.self_similarities();
        let (template, known) = (&self.fitter.template, &mut self.is_alike_in_detail);
        *known.get_or_insert_with(|| is_alike_in_detail(template, &similar))
    }

    /// Fits the mesh to `start`, where a finder sees the object in `image`, and to `image` itself. `None` when the start shows too
    /// little.
    ///
    /// Matches may lead to another place where the print looks alike (a mode hop). From a mesh such places are tried too; the one
    /// that the image confirms most is kept, and [`Verdict::ambiguity`](crate::Verdict::ambiguity) says how much less it confirms of
    /// the next.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`](crate::GeometryError::MapSize) when image, camera and maps are not of one size, [`GeometryError::StartLength`](crate::GeometryError::StartLength) when a mesh does
    /// not have the template's vertices.
    pub fn fit(&mut self, image: &Picture, camera: &Camera, start: &Start) -> Result<Option<Surface>> {
        let Some(mut from) = self.fitter.start(start, camera)? else {
            return Ok(None);
        };
        let grey = GreyImage::of(image);
        let observation = Observation::new(&grey, camera)?;
        let is_whole = matches!(start, Start::Mesh(_));
        // The coarse mesh finds its place, the fine one the details.
        let [first @ .., last] = &BLURS_PX;
        let mut found = self.fitter.fit_coarse(observation, &from, first)?;
        let template = &self.fitter.template;
        // A solid whose matches lie on one side has two poses, and matches hardly tell which.
        if !template.is_sheet()
            && let Some(reversed) = reversed_pose(template.mesh(), &found.vertices, &found.correlation.confidence)
        {
            let other_from = CoarseStart {
                measured: measurements_of_mesh(&self.fitter.coarse().mesh, &reversed, camera),
                mesh: Some(reversed),
                mask: from.mask,
                is_moved: true,
            };
            let other = self.fitter.fit_coarse(observation, &other_from, first)?;
            if other.correlation.significance() > found.correlation.significance() {
                (found, from) = (other, other_from);
            }
        }
        let mut ambiguity = None;
        if is_whole {
            let similar = self.self_similarities();
            (found, from, ambiguity) =
                best_of_mode_hops(&mut self.fitter, &similar, observation, (found, from), first)?;
        }
        let fitter = &mut self.fitter;
        let vertices = fitter.fine_vertices(&found.vertices);
        // What the image confirms of a network's maps is left to the image. The whole surface that matches give is one
        // of right lengths already: letting go of it costs accuracy in depth.
        let confidence = fitter.fine_confidence(&found.correlation.confidence);
        let fine = &fitter.fine;
        let hold = |point: &SurfacePoint| {
            let confirmed = || point.interpolated(fine.mesh.faces(), &confidence).clamp(0.0, 1.0);
            if is_whole { 1.0 } else { 1.0 - confirmed() }
        };
        let (reprojection, depth) = fitter.measured_terms(fine, &from.measured, camera, INDEPENDENT, hold)?;
        let round = FitRound {
            resolution: Resolution::Fine,
            border: true,
            ..FitRound::new(*last, STEPS)
        };
        let priors: [&dyn Energy; 2] = [&reprojection, &depth];
        let mask = from.mask;
        let observation = Observation { mask, ..observation };
        let mut fitted = fitter.round(observation, &vertices, &round, &priors)?;
        if !fitter.template.is_sheet() {
            fitted = softened(fitter, observation, fitted, &round, &priors)?;
        }
        let correlation = fitted.correlation;
        Ok(Some(Surface {
            camera: *camera,
            vertices_camera: fitted.vertices,
            verdict: correlation.verdict(ambiguity),
            confidence: correlation.confidence,
            // A network's mask leaves out what hides the object.
            is_hidden: if is_whole { correlation.is_hidden } else { Vec::new() },
            deviations: Vec::new(),
        }))
    }

    /// Fits a surface that was found in a smaller image to the pixels of the camera's own `image`: in close-ups of the sheet, up to the
    /// resolution of the image or of the print, whichever is less. Before that a sheet is fitted anew from other shapes, along the softest
    /// modes of its fit, and the likeliest is taken. A softer mesh is taken where it explains more of the image. The
    /// surface stays where it is where the image shows no more detail. It tells its [`Surface::deviations`] in any case.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`](crate::GeometryError::MapSize) when image and camera are not of one size, [`GeometryError::StartLength`](crate::GeometryError::StartLength) when the surface does not
    /// have the template's vertices.
    pub fn fit_close_ups(&mut self, image: &Picture, camera: &Camera, mut surface: Surface) -> Result<Surface> {
        check_size(image.size(), camera.size())?;
        check_start(&surface.vertices_camera, self.fitter.fine.mesh.vertices().len())?;
        let is_clear = surface.verdict.correlation >= MIN_CORRELATION;
        let canonical = CloseUp::new(image, camera, surface.camera, 1.0)?;
        if self.fitter.template.is_sheet() {
            likeliest_shape(&mut self.fitter, &canonical, &mut surface)?;
        }
        let fine = &self.fitter.fine;
        // What the image shows nothing of stays about where it was.
        let measured = measurements_of_mesh(&fine.mesh, &surface.vertices_camera, &surface.camera);
        let (reprojection, depth) =
            (self.fitter).measured_terms(fine, &measured, &surface.camera, INDEPENDENT, |_| 1.0)?;
        let fitter = &mut self.fitter;
        let mut is_rigid = false;
        let mut close_ups = close_ups(image, camera, &surface, &fitter.print)?;
        if let Some(fitted) = fit_through(fitter, &close_ups, &surface, &[&reprojection, &depth])? {
            // A fit that is so bad says nothing of a print that looks like itself only when it is blurred.
            let ambiguity = surface.verdict.ambiguity;
            let ambiguity = ambiguity.filter(|_| is_clear || self.is_alike_in_detail());
            is_rigid = fitted.is_rigid;
            fitted.replace(&mut surface, ambiguity);
        }
        let last = close_ups.pop().unwrap_or(canonical);
        surface.deviations = deviations(&mut self.fitter, &last, &surface, is_rigid)?;
        Ok(surface)
    }

    /// Judges without a fit how far the image confirms each vertex of the mesh at `vertices`, 0 to 1. These are in the camera's frame, mm.
    ///
    /// # Errors
    /// As [`FrameFitter::fit`].
    pub fn confidence_at(&mut self, image: &Picture, camera: &Camera, vertices: &[DVec3]) -> Result<Vec<f32>> {
        check_start(vertices, self.fitter.fine.mesh.vertices().len())?;
        let grey = GreyImage::of(image);
        let round = FitRound {
            resolution: Resolution::Fine,
            ..FitRound::new(JUDGED_BLUR_PX, 0)
        };
        let observation = Observation::new(&grey, camera)?;
        let judged = self.fitter.round(observation, vertices, &round, &[])?;
        Ok(judged.correlation.confidence)
    }

    /// The template's mesh where `start` has the object, before any fit to the image: what a track starts from. Vertices in the
    /// camera's frame, mm. `None` when the start shows too little.
    ///
    /// # Errors
    /// As [`FrameFitter::fit`].
    pub fn initial_mesh(&mut self, camera: &Camera, start: &Start) -> Result<Option<Vec<DVec3>>> {
        let Some(from) = self.fitter.start(start, camera)? else {
            return Ok(None);
        };
        let coarse = self.fitter.initial_mesh(&from, camera)?;
        Ok(Some(self.fitter.fine_vertices(&coarse)))
    }
}

/// A solid fitted anew with less rigidity, from where it was, if that explains more of the image: an arm that swings is far from where a
/// stiff body has it.
fn softened(
    fitter: &mut MeshFitter,
    observation: Observation<'_>,
    stiff: Fitted,
    round: &FitRound<'_>,
    priors: &[&dyn Energy],
) -> Result<Fitted> {
    let mut softer = stiff.clone();
    for blur in BLURS_PX {
        let round = FitRound {
            stiffness: Stiffness::SOFTER,
            resolution: round.resolution,
            ..FitRound::new(blur, round.steps)
        };
        softer = fitter.round(observation, &softer.vertices, &round, priors)?;
    }
    let is_softer = softer.correlation.explained >= stiff.correlation.explained + MORE;
    Ok(if is_softer { softer } else { stiff })
}
