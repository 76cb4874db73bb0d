//! The mesh of one frame.

use super::agreement::Agreement;
use super::level::IsometricMesh;
use super::lookalikes::Lookalike;
use super::measurements::{Measurement, measurements};
use super::mesh_fitter::{MeshFitter, POINT_STEP, Resolution, Round, WINDOW_PX, check_blurs, window_of};
use super::options::FitOptions;
use super::slips::Start;
use crate::camera::Camera;
use crate::error::{GeometryError, check_size, check_start};
use crate::image::{GreyImage, Normalizer, Part, Picture};
use crate::maps::Maps;
use crate::maps::raster::VisibleSurface;
use crate::mesh::{RigidMotion, SurfacePoint, Template, TriangleMesh};
use crate::solver::{DepthPrior, Energy, ImagePoint, PointDepth, Reprojection, Robust, SolveReport};
use glam::DVec3;

/// Where the mask of a fit's maps comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mask {
    /// It is that of the finder's maps.
    Given,
    /// It is the mesh's silhouette less what hides it.
    FromFit,
}

/// Fewest measurements from which a mesh is fitted.
pub(super) const MIN_MEASUREMENTS: usize = 12;

/// Blur at which mesh and network are compared, pixels.
pub(super) const JUDGED_BLUR_PX: f32 = 0.7;

/// Agreement of image and print from which a first try is not followed by a second.
const CONFIRMED: f64 = 0.8;

/// Solver steps without the image, for each stiffness.
const SETTLING_STEPS: usize = 12;

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
    pub agreement: f64,
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

/// The coarse mesh fitted to a frame.
pub(crate) struct CoarseFit {
    pub(crate) vertices: Vec<DVec3>,
    pub(crate) agreement: Agreement,
    pub(crate) reports: Vec<SolveReport>,
}

/// Fits one template's mesh to frames.
pub struct FrameFitter {
    options: FitOptions,
    pub(super) mesh_fitter: MeshFitter,
    /// Looked for when first needed.
    pub(super) lookalikes: Option<Vec<Lookalike>>,
}

impl std::fmt::Debug for FrameFitter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FrameFitter")
            .field("options", &self.options)
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
        check_blurs(&options.blurs)?;
        Ok(Self {
            mesh_fitter: MeshFitter::new(template, &options)?,
            options,
            lookalikes: None,
        })
    }

    /// What does not depend on the frame, for the tracker.
    pub(crate) fn mesh_fitter(&mut self) -> &mut MeshFitter {
        &mut self.mesh_fitter
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
    /// Features may have slipped to where the print looks alike. Such places are tried too; the one that the image confirms
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
            check_start(start, self.mesh_fitter.template.mesh().vertices().len())?;
        }
        let measured = measurements(maps, &self.mesh_fitter.template);
        if measured.len() < MIN_MEASUREMENTS {
            return Ok(None);
        }
        let grey = GreyImage::of(image);
        // The coarse mesh finds its place, the fine one the details.
        let (last, first) = match self.options.blurs.split_last() {
            Some((&last, first)) => (Some(last), first.to_vec()),
            None => (None, Vec::new()),
        };
        let mut from = Start {
            measured,
            is_moved: false,
        };
        let mut found = self.fitted_coarsely((&grey, camera), maps, &from, start, &first)?;
        let mut ambiguity = None;
        if mask == Mask::FromFit {
            (found, from, ambiguity) = self.best_of_lookalikes((&grey, camera), maps, (found, from), &first)?;
        }
        let mut vertices = self.mesh_fitter.fine_vertices(&found.vertices);
        if let Some(blur) = last {
            let worth = self.options.independent_registrations;
            // What the image confirms of a network's maps is left to the image. The whole surface that features give is one
            // of right lengths already: letting go of it costs accuracy in depth.
            let confidence = self.mesh_fitter.fine_confidence(&found.agreement.confidence);
            let fine = &self.mesh_fitter.fine;
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
            let (reprojection, depth) = self.measured_terms(fine, &from.measured, camera, worth, hold)?;
            let round = self.round(Resolution::Fine, blur);
            let seen = |x: usize, y: usize| from.is_moved || maps.inside(y * maps.width() + x);
            let priors: [&dyn Energy; 2] = [&reprojection, &depth];
            let fitted = self
                .mesh_fitter
                .round((&grey, camera), &vertices, &round, seen, |_| true, &priors)?;
            vertices = fitted.vertices;
            found.agreement = fitted.agreement;
            found.reports.push(fitted.report);
        }
        let judged = self.judge(&grey, camera, maps, (vertices, found.agreement), found.reports, mask);
        Ok(Some(FrameFit { ambiguity, ..judged }))
    }

    /// The coarse mesh where `maps` and the image say, with its agreement and reports: how a track starts. `None` when
    /// the maps show too little.
    pub(crate) fn coarse_start(
        &mut self,
        grey: &GreyImage,
        camera: &Camera,
        maps: &Maps,
    ) -> Result<Option<CoarseFit>, GeometryError> {
        let measured = measurements(maps, &self.mesh_fitter.template);
        if measured.len() < MIN_MEASUREMENTS {
            return Ok(None);
        }
        let blurs = self.options.blurs.clone();
        let from = Start {
            measured,
            is_moved: false,
        };
        self.fitted_coarsely((grey, camera), maps, &from, None, &blurs)
            .map(Some)
    }

    /// The coarse mesh settled on the measurements and fitted to the image. Where the image does not confirm the whole of
    /// it, a second try settles with less trust in the registration, whose errors then bend the mesh less; the try that
    /// the image confirms over more of the print is kept. Places that look alike have one try.
    pub(super) fn fitted_coarsely(
        &mut self,
        (grey, camera): (&GreyImage, &Camera),
        maps: &Maps,
        from: &Start,
        start: Option<&[DVec3]>,
        blurs: &[f32],
    ) -> Result<CoarseFit, GeometryError> {
        let measured = &from.measured;
        let seen = |x: usize, y: usize| from.is_moved || maps.inside(y * maps.width() + x);
        let worth = self.options.independent_registrations;
        let (reprojection, depth) = self.measured_terms(&self.mesh_fitter.coarse, measured, camera, worth, |_| 1.0)?;
        let priors: [&dyn Energy; 2] = [&reprojection, &depth];
        if let Some(start) = start {
            let start = self.mesh_fitter.coarse_vertices(start);
            let (vertices, report) = self.mesh_fitter.coarse.solve(&priors, &start, SETTLING_STEPS)?;
            return self.fitted_from((grey, camera), &seen, (vertices, vec![report]), blurs, &priors);
        }
        let start = self.aligned(measured, camera);
        let trust = self.options.settling_registrations;
        let (trusted, trusted_depth) =
            self.measured_terms(&self.mesh_fitter.coarse, measured, camera, trust, |_| 1.0)?;
        let settled = self
            .mesh_fitter
            .coarse
            .settle(&[&trusted, &trusted_depth], start.clone(), SETTLING_STEPS)?;
        let first = self.fitted_from((grey, camera), &seen, settled, blurs, &priors)?;
        if first.agreement.whole >= CONFIRMED || from.is_moved {
            return Ok(first);
        }
        let settled = self.mesh_fitter.coarse.settle(&priors, start, SETTLING_STEPS)?;
        let second = self.fitted_from((grey, camera), &seen, settled, blurs, &priors)?;
        let confirmed = |fit: &CoarseFit| fit.agreement.whole * fit.agreement.points as f64;
        Ok(if confirmed(&second) > confirmed(&first) {
            second
        } else {
            first
        })
    }

    /// The photo-consistency rounds of the coarse mesh from where it has settled.
    fn fitted_from(
        &mut self,
        (grey, camera): (&GreyImage, &Camera),
        seen: &impl Fn(usize, usize) -> bool,
        (mut vertices, mut reports): (Vec<DVec3>, Vec<SolveReport>),
        blurs: &[f32],
        priors: &[&dyn Energy],
    ) -> Result<CoarseFit, GeometryError> {
        let mut agreement = Agreement::default();
        for &blur in blurs {
            let round = self.round(Resolution::Coarse, blur);
            let fitted = self
                .mesh_fitter
                .round((grey, camera), &vertices, &round, seen, |_| true, priors)?;
            vertices = fitted.vertices;
            agreement = fitted.agreement;
            reports.push(fitted.report);
        }
        Ok(CoarseFit {
            vertices,
            agreement,
            reports,
        })
    }

    pub(super) fn round(&self, resolution: Resolution, blur: f32) -> Round {
        Round {
            resolution,
            blur,
            window: window_of(blur),
            // The network's mask has its own.
            margin: 0,
            rigid_steps: 0,
            steps: self.options.steps,
            is_near: false,
        }
    }

    /// The terms that the finder's maps give, the registrations worth `independent` measurements together, each of them
    /// weighted by `hold`.
    fn measured_terms(
        &self,
        level: &IsometricMesh,
        measured: &[Measurement],
        camera: &Camera,
        independent: f64,
        hold: impl Fn(&SurfacePoint) -> f64,
    ) -> Result<(Reprojection, DepthPrior), GeometryError> {
        let mesh = &level.mesh;
        let located: Vec<(SurfacePoint, &Measurement)> = measured
            .iter()
            .filter_map(|m| Some((level.locator.locate(m.uv)?, m)))
            .collect();
        let count = located.len().max(1) as f64;
        let deviation = self.options.registration_deviation_px;
        let weight = independent / count / (deviation * deviation);
        let points: Vec<ImagePoint> = located
            .iter()
            .map(|&(point, m)| ImagePoint {
                point,
                pixel: m.pixel,
                weight: weight * hold(&point),
            })
            .collect();
        let depths: Vec<PointDepth> = located
            .iter()
            .map(|&(point, m)| PointDepth {
                point,
                depth: m.depth_mm,
                deviation: self.options.depth_deviation * m.depth_mm,
            })
            .collect();
        Ok((
            Reprojection::new(mesh, camera, &points, Robust::Cauchy(1.5 * deviation))?,
            DepthPrior::new(
                mesh,
                &depths,
                self.options.independent_depths / count,
                Robust::Cauchy(2.0),
            )?,
        ))
    }

    /// The flat coarse sheet where the measurements are.
    fn aligned(&self, measured: &[Measurement], camera: &Camera) -> Vec<DVec3> {
        let pairs = measured.iter().filter_map(|m| {
            let p_template = self.mesh_fitter.template.point_template(m.uv)?;
            Some((p_template, camera.unproject(m.pixel, m.depth_mm), 1.0))
        });
        let motion = RigidMotion::align(pairs, RigidMotion::IDENTITY);
        self.mesh_fitter
            .coarse
            .mesh
            .vertices()
            .iter()
            .map(|&p| motion.apply(p))
            .collect()
    }

    /// Chooses between mesh and maps.
    fn judge(
        &self,
        grey: &GreyImage,
        camera: &Camera,
        maps: &Maps,
        (vertices, agreement): (Vec<DVec3>, Agreement),
        reports: Vec<SolveReport>,
        mask: Mask,
    ) -> FrameFit {
        let surface = VisibleSurface::new(self.mesh_fitter.template.mesh(), &vertices, camera);
        let mut fitted = surface.maps();
        let window = surface.window();
        let part = Part::around(
            &window.columns,
            &window.rows,
            Normalizer::reach(JUDGED_BLUR_PX),
            camera.size(),
        );
        let pixels: Vec<usize> = part.pixels().map(|(x, y)| y * maps.width() + x).collect();
        let is_in_both = |&pixel: &usize| maps.inside(pixel) && fitted.inside(pixel);
        let both: Vec<f32> = pixels.iter().map(|p| f32::from(u8::from(is_in_both(p)))).collect();
        let normalizer = Normalizer::new(both.clone(), part, camera.size(), JUDGED_BLUR_PX, WINDOW_PX);
        let image = normalizer.normalize(part.of(&grey.values, grey.width));
        let cost = |maps: &Maps| {
            let seen = |pixel: &usize| is_in_both(pixel).then(|| maps.registration()[*pixel]);
            let uvs: Vec<_> = pixels.iter().map(seen).collect();
            let depths = pixels
                .iter()
                .filter(|p| is_in_both(p))
                .map(|&p| f64::from(maps.depth()[p]));
            let depth = depths.clone().sum::<f64>() / depths.count().max(1) as f64;
            let print = self.mesh_fitter.print.drawn(&uvs, depth, camera.focal().x);
            let drawn = normalizer.normalize(print.into_iter());
            let robust = self.mesh_fitter.robust();
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
                self.mesh_fitter.template.mesh(),
                &agreement.hidden,
            ),
            // A network sees what lies in front. Where the mesh ends before its mask, its own values stay.
            Mask::Given if accepted => fitted = fitted.within(maps),
            Mask::Given => fitted = maps.clone(),
        }
        FrameFit {
            maps: fitted,
            vertices_camera: vertices,
            confidence: agreement.confidence,
            agreement: agreement.whole,
            explained: agreement.explained,
            ambiguity: None,
            confirmed_px: agreement.confirmed_points * (POINT_STEP * POINT_STEP) as f64,
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
