//! The coarse mesh of one frame: where every fit and every track starts.

use super::correlation::Correlation;
use super::isometric_mesh::IsometricMesh;
use super::measurements::{Measurement, measurements, measurements_of_mesh};
use super::mesh_fitter::{FitRound, MeshFitter, Resolution, check_blurs, window_of};
use super::options::FitOptions;
use super::self_similarity::SelfSimilarity;
use super::start::Start;
use crate::camera::Camera;
use crate::error::{GeometryError, check_size, check_start};
use crate::image::GreyImage;
use crate::maps::Maps;
use crate::mesh::{RigidMotion, SurfacePoint, Template};
use crate::solver::{DepthPrior, Energy, ImagePoint, PointDepth, Reprojection, Robust};
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
    /// Solver steps that it took.
    pub(crate) iterations: usize,
}

/// What the coarse fit starts from.
pub(crate) struct CoarseStart<'a> {
    pub(crate) measured: Vec<Measurement>,
    /// The coarse mesh to begin with; `None`: the flat sheet where the measurements are.
    mesh: Option<Vec<DVec3>>,
    /// Maps whose mask says where the object is seen; `None`: wherever the mesh is drawn.
    mask: Option<&'a Maps>,
    /// Whether the measurements were moved to a place that looks alike: such a place has one try.
    is_moved: bool,
}

impl CoarseStart<'_> {
    /// The same pixels at the places of the print that look as theirs do.
    pub(crate) fn moved(&self, like: &SelfSimilarity) -> Self {
        let is_on_print = |uv: &DVec2| uv.cmpge(DVec2::ZERO).all() && uv.cmple(DVec2::ONE).all();
        let moved = |m: &Measurement| {
            let uv = Some(like.of(m.uv)).filter(is_on_print)?;
            Some(Measurement { uv, ..*m })
        };
        Self {
            measured: self.measured.iter().filter_map(moved).collect(),
            mesh: None,
            mask: None,
            is_moved: true,
        }
    }

    /// Whether the object may be seen at a pixel (column, row).
    pub(crate) fn shows(&self, x: usize, y: usize) -> bool {
        self.mask.is_none_or(|maps| maps.inside(y * maps.width() + x))
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

    /// What the coarse fit takes from `start`. `None` when that shows too little.
    pub(crate) fn start<'a>(
        &self,
        start: &'a Start,
        camera: &Camera,
    ) -> Result<Option<CoarseStart<'a>>, GeometryError> {
        let template = &self.mesh_fitter.template;
        let (measured, mesh, mask) = match start {
            Start::Maps(maps) => {
                check_size(maps.size(), camera.size())?;
                (measurements(maps, template), None, Some(maps))
            }
            Start::Mesh(vertices) => {
                check_start(vertices, template.mesh().vertices().len())?;
                let vertices = self.mesh_fitter.coarse_vertices(vertices);
                let measured = measurements_of_mesh(&self.mesh_fitter.coarse.mesh, &vertices, camera);
                (measured, Some(vertices), None)
            }
        };
        let is_enough = measured.len() >= MIN_MEASUREMENTS;
        Ok(is_enough.then_some(CoarseStart {
            measured,
            mesh,
            mask,
            is_moved: false,
        }))
    }

    /// The coarse mesh where the measurements of `from` are, without the image.
    pub(crate) fn placed(&mut self, from: &CoarseStart<'_>, camera: &Camera) -> Result<Vec<DVec3>, GeometryError> {
        if let Some(mesh) = &from.mesh {
            return Ok(mesh.clone());
        }
        let trust = self.options.continuation_registrations;
        let (reprojection, depth) =
            self.measured_terms(&self.mesh_fitter.coarse, &from.measured, camera, trust, |_| 1.0)?;
        let start = self.aligned(&from.measured, camera);
        let coarse = &mut self.mesh_fitter.coarse;
        Ok(coarse
            .solve_by_continuation(&[&reprojection, &depth], start, CONTINUATION_STEPS)?
            .0)
    }

    /// The coarse mesh placed on the measurements and fitted to the image. Where the image does not confirm the whole of it, a
    /// second try begins with less trust in the registration, whose errors then bend the mesh less. The try that the image
    /// confirms over more of the print is kept.
    pub(crate) fn fit(
        &mut self,
        frame: (&GreyImage, &Camera),
        from: &CoarseStart<'_>,
        blurs: &[f32],
    ) -> Result<CoarseFit, GeometryError> {
        let camera = frame.1;
        let worth = self.options.independent_registrations;
        let (reprojection, depth) =
            self.measured_terms(&self.mesh_fitter.coarse, &from.measured, camera, worth, |_| 1.0)?;
        let priors: [&dyn Energy; 2] = [&reprojection, &depth];
        let placed = self.placed(from, camera)?;
        let first = self.fitted_from(frame, from, placed, blurs, &priors)?;
        if first.correlation.whole >= CONFIRMED || from.is_moved {
            return Ok(first);
        }
        let start = match &from.mesh {
            Some(mesh) => mesh.clone(),
            None => self.aligned(&from.measured, camera),
        };
        let coarse = &mut self.mesh_fitter.coarse;
        let (placed, _) = coarse.solve_by_continuation(&priors, start, CONTINUATION_STEPS)?;
        let second = self.fitted_from(frame, from, placed, blurs, &priors)?;
        let confirmed = |fit: &CoarseFit| fit.correlation.whole * fit.correlation.points as f64;
        let (mut better, other) = if confirmed(&second) > confirmed(&first) {
            (second, first)
        } else {
            (first, second)
        };
        better.iterations += other.iterations;
        Ok(better)
    }

    /// The photo-consistency rounds of the coarse mesh from `vertices`.
    fn fitted_from(
        &mut self,
        frame: (&GreyImage, &Camera),
        from: &CoarseStart<'_>,
        mut vertices: Vec<DVec3>,
        blurs: &[f32],
        priors: &[&dyn Energy],
    ) -> Result<CoarseFit, GeometryError> {
        let (mut correlation, mut iterations) = (Correlation::default(), 0);
        let shows = |x: usize, y: usize| from.shows(x, y);
        for &blur in blurs {
            let round = self.round(Resolution::Coarse, blur);
            let fitted = self
                .mesh_fitter
                .round(frame, &vertices, &round, shows, |_| true, priors)?;
            vertices = fitted.vertices;
            correlation = fitted.correlation;
            iterations += fitted.report.iterations;
        }
        Ok(CoarseFit {
            vertices,
            correlation,
            iterations,
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
