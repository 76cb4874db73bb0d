//! The coarse mesh of one frame: where every fit and every track starts.

use super::correlation::Correlation;
use super::isometric_mesh::IsometricMesh;
use super::measurements::{Measurement, measurements};
use super::mesh_fitter::{FitRound, MeshFitter, Resolution, check_blurs, window_of};
use super::options::FitOptions;
use super::self_similarity::SelfSimilarity;
use crate::camera::Camera;
use crate::error::GeometryError;
use crate::image::GreyImage;
use crate::maps::Maps;
use crate::mesh::{RigidMotion, SurfacePoint, Template};
use crate::solver::{DepthPrior, Energy, ImagePoint, PointDepth, Reprojection, Robust, SolveReport};
use glam::{DVec2, DVec3};

/// Fewest measurements from which a mesh is fitted.
pub(crate) const MIN_MEASUREMENTS: usize = 12;

/// Blur at which mesh and network are compared, pixels.
pub(crate) const JUDGED_BLUR_PX: f32 = 0.7;

/// Correlation of image and print from which a first try is not followed by a second.
const CONFIRMED: f64 = 0.8;

/// Solver steps without the image, for each stiffness.
const CONTINUATION_STEPS: usize = 12;

/// The coarse mesh fitted to a frame.
pub(crate) struct CoarseFit {
    pub(crate) vertices: Vec<DVec3>,
    pub(crate) correlation: Correlation,
    pub(crate) reports: Vec<SolveReport>,
}

/// What a fit starts from.
pub(crate) struct FitStart {
    pub(crate) measured: Vec<Measurement>,
    /// Whether they lie elsewhere on the print than the maps say.
    pub(crate) is_moved: bool,
}

impl FitStart {
    /// The same pixels at the places of the print that look as theirs do.
    pub(crate) fn moved(&self, like: &SelfSimilarity) -> Self {
        let is_on_print = |uv: &DVec2| uv.cmpge(DVec2::ZERO).all() && uv.cmple(DVec2::ONE).all();
        let moved = |m: &Measurement| {
            let uv = Some(like.of(m.uv)).filter(is_on_print)?;
            Some(Measurement { uv, ..*m })
        };
        Self {
            measured: self.measured.iter().filter_map(moved).collect(),
            is_moved: true,
        }
    }
}

/// Fits one template's coarse mesh to frames.
pub(crate) struct CoarseFitter {
    pub(crate) options: FitOptions,
    pub(crate) mesh_fitter: MeshFitter,
}

impl CoarseFitter {
    /// Prepares everything that does not depend on the frame.
    pub(crate) fn new(template: &Template, options: FitOptions) -> Result<Self, GeometryError> {
        check_blurs(&options.blurs)?;
        Ok(Self {
            mesh_fitter: MeshFitter::new(template, &options)?,
            options,
        })
    }

    /// The coarse mesh where `maps` and the image say, with its correlation and reports: how a track starts. `None` when
    /// the maps show too little.
    pub(crate) fn start(
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
        let from = FitStart {
            measured,
            is_moved: false,
        };
        self.fit((grey, camera), maps, &from, None, &blurs).map(Some)
    }

    /// The coarse mesh solved by continuation on the measurements and fitted to the image. Where the image does not confirm the whole of
    /// it, a second try solves with less trust in the registration, whose errors then bend the mesh less; the try that
    /// the image confirms over more of the print is kept. Places that look alike have one try.
    pub(crate) fn fit(
        &mut self,
        (grey, camera): (&GreyImage, &Camera),
        maps: &Maps,
        from: &FitStart,
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
            let (vertices, report) = self.mesh_fitter.coarse.solve(&priors, &start, CONTINUATION_STEPS)?;
            return self.fitted_from((grey, camera), &seen, (vertices, vec![report]), blurs, &priors);
        }
        let start = self.aligned(measured, camera);
        let trust = self.options.continuation_registrations;
        let (trusted, trusted_depth) =
            self.measured_terms(&self.mesh_fitter.coarse, measured, camera, trust, |_| 1.0)?;
        let continued = self.mesh_fitter.coarse.solve_by_continuation(
            &[&trusted, &trusted_depth],
            start.clone(),
            CONTINUATION_STEPS,
        )?;
        let first = self.fitted_from((grey, camera), &seen, continued, blurs, &priors)?;
        if first.correlation.whole >= CONFIRMED || from.is_moved {
            return Ok(first);
        }
        let continued = self
            .mesh_fitter
            .coarse
            .solve_by_continuation(&priors, start, CONTINUATION_STEPS)?;
        let second = self.fitted_from((grey, camera), &seen, continued, blurs, &priors)?;
        let confirmed = |fit: &CoarseFit| fit.correlation.whole * fit.correlation.points as f64;
        Ok(if confirmed(&second) > confirmed(&first) {
            second
        } else {
            first
        })
    }

    /// The photo-consistency rounds of the coarse mesh from where the continuation has brought it.
    fn fitted_from(
        &mut self,
        (grey, camera): (&GreyImage, &Camera),
        seen: &impl Fn(usize, usize) -> bool,
        (mut vertices, mut reports): (Vec<DVec3>, Vec<SolveReport>),
        blurs: &[f32],
        priors: &[&dyn Energy],
    ) -> Result<CoarseFit, GeometryError> {
        let mut correlation = Correlation::default();
        for &blur in blurs {
            let round = self.round(Resolution::Coarse, blur);
            let fitted = self
                .mesh_fitter
                .round((grey, camera), &vertices, &round, seen, |_| true, priors)?;
            vertices = fitted.vertices;
            correlation = fitted.correlation;
            reports.push(fitted.report);
        }
        Ok(CoarseFit {
            vertices,
            correlation,
            reports,
        })
    }

    pub(crate) fn round(&self, resolution: Resolution, blur: f32) -> FitRound {
        FitRound {
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
    pub(crate) fn measured_terms(
        &self,
        isometric: &IsometricMesh,
        measured: &[Measurement],
        camera: &Camera,
        independent: f64,
        hold: impl Fn(&SurfacePoint) -> f64,
    ) -> Result<(Reprojection, DepthPrior), GeometryError> {
        let mesh = &isometric.mesh;
        let located: Vec<(SurfacePoint, &Measurement)> = measured
            .iter()
            .filter_map(|m| Some((isometric.locator.locate(m.uv)?, m)))
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

    /// How much of the image confirms a coarse mesh, where the image shows anything at all.
    pub(crate) fn confirmed(&mut self, frame: (&GreyImage, &Camera), found: &CoarseFit) -> Result<f64, GeometryError> {
        let round = FitRound {
            steps: 0,
            ..self.round(Resolution::Coarse, JUDGED_BLUR_PX)
        };
        let judged = self
            .mesh_fitter
            .round(frame, &found.vertices, &round, |_, _| true, |_| true, &[])?;
        Ok(judged.correlation.whole * judged.correlation.points as f64)
    }
}
