//! The mesh of one frame.

use super::coarse_fitter::{CoarseFitter, FitStart, JUDGED_BLUR_PX, MIN_MEASUREMENTS};
use super::correlation::Correlation;
use super::measurements::measurements;
use super::mesh_fitter::{POINT_STEP, Resolution, WINDOW_PX};
use super::mode_hops::best_of_mode_hops;
use super::options::FitOptions;
use super::self_similarity::{SelfSimilarity, self_similarities};
use crate::camera::Camera;
use crate::error::{GeometryError, check_size, check_start};
use crate::image::{ContrastNormalizer, GreyImage, Part, Picture};
use crate::maps::Maps;
use crate::maps::raster::VisibleSurface;
use crate::mesh::{SurfacePoint, Template, TriangleMesh};
use crate::solver::{Energy, SolveReport};
use glam::DVec3;

/// Where the mask of a fit's maps comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mask {
    /// It is that of the finder's maps.
    Given,
    /// It is the mesh's silhouette less what hides it.
    FromFit,
}

/// How badly maps and mesh explain the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhotoConsistencyCost {
    /// Of the network's maps.
    pub maps: f64,
    /// Of the fitted mesh's.
    pub mesh: f64,
}

/// The outcome for one frame.
#[derive(Clone, Debug)]
pub struct FrameFit {
    /// Depth and registration: of the mesh where it was accepted, the network's otherwise.
    pub maps: Maps,
    /// Vertices of the mesh, camera frame, mm.
    pub vertices_camera: Vec<DVec3>,
    /// How well the image confirms the mesh around each vertex, 0 to 1: the correlation of the normalised image with the
    /// normalised print there. 0 where the print is not seen or has no contrast.
    pub confidence: Vec<f32>,
    /// The same for the whole visible print.
    pub correlation: f64,
    /// Of the visible print that has contrast: the fraction that the image confirms.
    pub explained: f64,
    /// About how many pixels of the image confirm the mesh.
    pub confirmed_px: f64,
    /// Of a print that repeats itself or looks the same when turned: what the image confirms of the next best place, as
    /// a fraction of what it confirms of this one. Near 1 nothing says which of the two is right; 1 also where the fit was
    /// too bad to be tried elsewhere. `None` where the print looks like itself nowhere else, and of fits to a network's maps,
    /// which know the place.
    pub ambiguity: Option<f64>,
    /// Whether the mesh explains the image better than the network's maps do.
    pub accepted: bool,
    /// Mean robust photo-consistency cost of the network's maps and of the mesh's, over the pixels of both.
    pub photo_consistency_cost: PhotoConsistencyCost,
    /// How each solve went: those without the image, then one per round.
    pub reports: Vec<SolveReport>,
}

/// Fits one template's mesh to frames.
pub struct FrameFitter {
    coarse: CoarseFitter,
    /// Looked for when first needed.
    self_similarities: Option<Vec<SelfSimilarity>>,
}

impl std::fmt::Debug for FrameFitter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FrameFitter")
            .field("options", &self.coarse.options)
            .finish_non_exhaustive()
    }
}

impl FrameFitter {
    /// Prepares everything that does not depend on the frame.
    ///
    /// # Errors
    /// [`GeometryError::Weight`] for weights that are no weights and for rounds without a blur,
    /// [`GeometryError::NotASheet`] for a template that is a mesh.
    pub fn new(template: &Template, options: FitOptions) -> Result<Self, GeometryError> {
        Ok(Self {
            coarse: CoarseFitter::new(template, options)?,
            self_similarities: None,
        })
    }

    /// Whether the print repeats itself or looks the same when turned, so that features may be matched to the wrong place: see
    /// [`FrameFit::ambiguity`]. It is looked up once, also for [`FrameFitter::fit_unmasked`].
    pub fn is_self_similar(&mut self) -> bool {
        !self.self_similarities().is_empty()
    }

    fn self_similarities(&mut self) -> Vec<SelfSimilarity> {
        let template = &self.coarse.mesh_fitter.template;
        let known = self
            .self_similarities
            .get_or_insert_with(|| self_similarities(template));
        known.clone()
    }

    /// Fits the mesh to `maps`, the network's for `image`, and to `image` itself. `start`: the mesh of the last frame of a video,
    /// camera frame, mm. `None` when the maps show too little to fit a mesh to.
    ///
    /// # Errors
    /// [`GeometryError::MapSize`] when image, camera and maps are not of one size, [`GeometryError::StartLength`] when
    /// `start` does not have the template's vertices.
    pub fn fit(
        &mut self,
        image: &Picture,
        camera: &Camera,
        maps: &Maps,
        start: Option<&[DVec3]>,
    ) -> Result<Option<FrameFit>, GeometryError> {
        self.fit_in((image, camera), maps, start, Mask::Given)
    }

    /// As [`FrameFitter::fit`], from maps of the whole surface, as features find it: their mask does not say what hides the
    /// object. The mask of the result is the mesh's silhouette less the parts whose print the image contradicts.
    ///
    /// Features may lead to another place where the print looks alike (a mode hop). Such places are tried too; the one that the image confirms
    /// most is kept, and [`FrameFit::ambiguity`] says how much less it confirms of the next.
    ///
    /// # Errors
    /// As [`FrameFitter::fit`].
    pub fn fit_unmasked(
        &mut self,
        image: &Picture,
        camera: &Camera,
        maps: &Maps,
    ) -> Result<Option<FrameFit>, GeometryError> {
        self.fit_in((image, camera), maps, None, Mask::FromFit)
    }

    fn fit_in(
        &mut self,
        (image, camera): (&Picture, &Camera),
        maps: &Maps,
        start: Option<&[DVec3]>,
        mask: Mask,
    ) -> Result<Option<FrameFit>, GeometryError> {
        check_size(image.size(), camera.size())?;
        check_size(maps.size(), camera.size())?;
        if let Some(start) = start {
            check_start(start, self.coarse.mesh_fitter.template.mesh().vertices().len())?;
        }
        let measured = measurements(maps, &self.coarse.mesh_fitter.template);
        if measured.len() < MIN_MEASUREMENTS {
            return Ok(None);
        }
        let grey = GreyImage::of(image);
        // The coarse mesh finds its place, the fine one the details.
        let (last, first) = match self.coarse.options.blurs.split_last() {
            Some((&last, first)) => (Some(last), first.to_vec()),
            None => (None, Vec::new()),
        };
        let mut from = FitStart {
            measured,
            is_moved: false,
        };
        let mut found = self.coarse.fit((&grey, camera), maps, &from, start, &first)?;
        let mut ambiguity = None;
        if mask == Mask::FromFit {
            let self_similarities = self.self_similarities();
            (found, from, ambiguity) = best_of_mode_hops(
                &mut self.coarse,
                &self_similarities,
                (&grey, camera),
                maps,
                (found, from),
                &first,
            )?;
        }
        let mut vertices = self.coarse.mesh_fitter.fine_vertices(&found.vertices);
        if let Some(blur) = last {
            let worth = self.coarse.options.independent_registrations;
            // What the image confirms of a network's maps is left to the image. The whole surface that features give is one
            // of right lengths already: letting go of it costs accuracy in depth.
            let confidence = self.coarse.mesh_fitter.fine_confidence(&found.correlation.confidence);
            let fine = &self.coarse.mesh_fitter.fine;
            let hold = |point: &SurfacePoint| {
                if mask == Mask::FromFit {
                    return 1.0;
                }
                let corners = fine.mesh.faces()[point.face].iter().zip(point.barycentric);
                1.0 - corners
                    .map(|(&v, w)| w * f64::from(confidence[v]))
                    .sum::<f64>()
                    .clamp(0.0, 1.0)
            };
            let (reprojection, depth) = self.coarse.measured_terms(fine, &from.measured, camera, worth, hold)?;
            let round = self.coarse.round(Resolution::Fine, blur);
            let seen = |x: usize, y: usize| from.is_moved || maps.inside(y * maps.width() + x);
            let priors: [&dyn Energy; 2] = [&reprojection, &depth];
            let fitted = self
                .coarse
                .mesh_fitter
                .round((&grey, camera), &vertices, &round, seen, |_| true, &priors)?;
            vertices = fitted.vertices;
            found.correlation = fitted.correlation;
            found.reports.push(fitted.report);
        }
        let judged = self.judge(&grey, camera, maps, (vertices, found.correlation), found.reports, mask);
        Ok(Some(FrameFit { ambiguity, ..judged }))
    }

    /// Chooses between mesh and maps.
    fn judge(
        &self,
        grey: &GreyImage,
        camera: &Camera,
        maps: &Maps,
        (vertices, correlation): (Vec<DVec3>, Correlation),
        reports: Vec<SolveReport>,
        mask: Mask,
    ) -> FrameFit {
        let surface = VisibleSurface::new(self.coarse.mesh_fitter.template.mesh(), &vertices, camera);
        let mut fitted = surface.maps();
        let window = surface.window();
        let part = Part::around(
            &window.columns,
            &window.rows,
            ContrastNormalizer::reach(JUDGED_BLUR_PX),
            camera.size(),
        );
        let pixels: Vec<usize> = part.pixels().map(|(x, y)| y * maps.width() + x).collect();
        let is_in_both = |&pixel: &usize| maps.inside(pixel) && fitted.inside(pixel);
        let both: Vec<f32> = pixels.iter().map(|p| f32::from(u8::from(is_in_both(p)))).collect();
        let normalizer = ContrastNormalizer::new(both.clone(), part, camera.size(), JUDGED_BLUR_PX, WINDOW_PX);
        let image = normalizer.normalize(part.of(&grey.values, grey.width));
        let cost = |maps: &Maps| {
            let seen = |pixel: &usize| is_in_both(pixel).then(|| maps.registration()[*pixel]);
            let uvs: Vec<_> = pixels.iter().map(seen).collect();
            let depths = pixels
                .iter()
                .filter(|p| is_in_both(p))
                .map(|&p| f64::from(maps.depth()[p]));
            let depth = depths.clone().sum::<f64>() / depths.count().max(1) as f64;
            let print = self.coarse.mesh_fitter.print.drawn(&uvs, depth, camera.focal().x);
            let drawn = normalizer.normalize(print.into_iter());
            let robust = self.coarse.mesh_fitter.robust();
            let (mut sum, mut count) = (0.0, 0_usize);
            let values = image.values().iter().zip(drawn.values());
            for ((seen, printed), _) in values.zip(&both).filter(|(_, both)| **both > 0.0) {
                sum += robust.rho((f64::from(*seen) - f64::from(*printed)).powi(2));
                count += 1;
            }
            sum / count.max(1) as f64
        };
        let photo_consistency_cost = PhotoConsistencyCost {
            maps: cost(maps),
            mesh: cost(&fitted),
        };
        let accepted = photo_consistency_cost.mesh < photo_consistency_cost.maps;
        match mask {
            Mask::FromFit => clear_hidden(
                &mut fitted,
                &surface,
                self.coarse.mesh_fitter.template.mesh(),
                &correlation.hidden,
            ),
            // A network sees what lies in front. Where the mesh ends before its mask, its own values stay.
            Mask::Given if accepted => fitted = fitted.within(maps),
            Mask::Given => fitted = maps.clone(),
        }
        FrameFit {
            maps: fitted,
            vertices_camera: vertices,
            confidence: correlation.confidence,
            correlation: correlation.whole,
            explained: correlation.explained,
            ambiguity: None,
            confirmed_px: correlation.confirmed_points * (POINT_STEP * POINT_STEP) as f64,
            accepted,
            photo_consistency_cost,
            reports,
        }
    }
}

/// Clears the pixels of `maps`, drawn from `surface`, around whose vertices something hides the object.
fn clear_hidden(maps: &mut Maps, surface: &VisibleSurface, mesh: &TriangleMesh, hidden: &[f32]) {
    let width = maps.width();
    for (column, row, face, triangle) in surface.front() {
        let at = surface.centres().position(column, row);
        let weights = triangle.barycentric(at.x, at.y);
        let corners = mesh.faces()[face].iter().zip(weights);
        if corners.map(|(&v, w)| w * f64::from(hidden[v])).sum::<f64>() > 0.5 {
            maps.clear(row * width + column);
        }
    }
}
