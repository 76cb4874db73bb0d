//! The coarse mesh of one frame: where every fit and every track starts.

use super::isometric_mesh::{IsometricMesh, Stiffness};
use super::measurements::{Measurement, Observation, Start, differential_depths, measurements, measurements_of_mesh};
use super::mesh_fitter::{FitRound, Fitted, MeshFitter, RIGID_STEPS, STEPS};
use super::self_similarity::SelfSimilarity;
use crate::camera::Camera;
use crate::error::{Result, check_size, check_start};
use crate::maps::Maps;
use crate::mesh::{RigidMotion, SurfacePoint};
use crate::solver::{DepthPrior, Energy, ImagePoint, PointDepth, Reprojection, Robust};
use glam::{DVec2, DVec3};

/// Blur of image and drawing, pixels of the canonical image, of the rounds of the coarse mesh, and of the last.
pub(crate) const BLURS_PX: [f32; 3] = [3.0, 1.2, 0.7];

/// Standard deviation of a start's registration, pixels of the canonical image: scale of the robust reprojection term.
const REGISTRATION_DEVIATION_PX: f64 = 2.0;

/// Standard deviation of a start's depth, as a fraction of the depth.
const DEPTH_DEVIATION: f64 = 0.03;

/// Fewest measurements from which a mesh is fitted.
pub(crate) const MIN_MEASUREMENTS: usize = 12;

/// Blur at which places or prints that look alike are compared, pixels of the canonical image.
pub(super) const JUDGED_BLUR_PX: f32 = 0.7;

/// Correlation of image and print from which a first try is not followed by a second.
const CONFIRMED: f64 = 0.8;

/// Blur of the first round in which the sheet may stretch, pixels: what a wrong bend has moved is far off.
const FREE_BLUR_PX: f32 = 6.0;

/// Confidence of a vertex from which its registration tells a depth.
const TELLING: f32 = 0.6;

/// Times that another bend is tried: what one has brought near, the next uses.
const MAX_BENDS: usize = 4;

/// Mean distance of vertices within which a bend that derivatives tell is the one that is there already, a fraction of the print's longer
/// side.
const SAME_BEND: f64 = 0.003;

/// Solver steps without the image, for each stiffness.
const CONTINUATION_STEPS: usize = 12;

pub(crate) struct CoarseStart<'a> {
    pub(crate) measured: Vec<Measurement>,
    /// The coarse mesh to begin with; `None`: the flat sheet where the measurements are.
    pub(crate) mesh: Option<Vec<DVec3>>,
    /// Maps whose mask says where the object is seen; `None`: wherever the mesh is drawn.
    pub(crate) mask: Option<&'a Maps>,
    /// Whether the measurements were moved to a place that looks alike, or the mesh to another pose: such a place has one try.
    pub(crate) is_moved: bool,
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
}

/// How many independent measurements the registrations of a start are worth together, and how many its depths.
type Worth = (f64, f64);

/// Worth of a start's measurements beside the image. The weights of the fit were chosen on synthetic validation frames.
pub(crate) const INDEPENDENT: Worth = (10.0, 2.0);

/// The same before the image is compared. Much more, because only the network then says where a folded part is, and bending resists the
/// fold. The image can only pull in what is a few pixels off.
const CONTINUATION: Worth = (100.0, INDEPENDENT.1);

/// Worth of depths that derivatives of the registration tell: nothing but they holds the new bend.
const DIFFERENTIAL: Worth = (400.0, 450.0);

impl MeshFitter {
    /// What the coarse fit takes from `start`. `None` when that shows too little.
    pub(crate) fn start<'a>(&self, start: &'a Start, camera: &Camera) -> Result<Option<CoarseStart<'a>>> {
        let template = &self.template;
        let (measured, mesh, mask) = match start {
            Start::Maps(maps) => {
                check_size(maps.size(), camera.size())?;
                (measurements(maps, template), None, Some(maps))
            }
            Start::Mesh(vertices) => {
                check_start(vertices, template.mesh().vertices().len())?;
                let vertices = self.coarse_vertices(vertices);
                let measured = measurements_of_mesh(&self.coarse().mesh, &vertices, camera);
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
    pub(crate) fn initial_mesh(&mut self, from: &CoarseStart<'_>, camera: &Camera) -> Result<Vec<DVec3>> {
        if let Some(mesh) = &from.mesh {
            return Ok(mesh.clone());
        }
        let (reprojection, depth) =
            self.measured_terms(self.coarse(), &from.measured, camera, CONTINUATION, |_| 1.0)?;
        self.continued(from, camera, &[&reprojection, &depth])
    }

    /// Solves without the image by continuation, from the mesh of `from` or the flat sheet where its measurements are.
    fn continued(&mut self, from: &CoarseStart<'_>, camera: &Camera, terms: &[&dyn Energy]) -> Result<Vec<DVec3>> {
        let mesh = from.mesh.clone();
        let start = mesh.unwrap_or_else(|| self.aligned(&from.measured, camera));
        self.coarse_mut()
            .solve_by_continuation(terms, start, CONTINUATION_STEPS)
    }

    /// Fits the coarse mesh to the measurements and to the image, then tries other starts, of which the image keeps what it confirms more:
    /// the bend that derivatives of the registration tell, for isometry holds a wrong bend as fast as the right one; and, where the image
    /// does not confirm the whole, less trust in the measured registration, whose errors then bend the mesh less.
    pub(crate) fn fit_coarse(
        &mut self,
        observation: Observation<'_>,
        from: &CoarseStart<'_>,
        blurs: &[f32],
    ) -> Result<Fitted> {
        let (mask, camera) = (from.mask, observation.camera);
        let observation = Observation { mask, ..observation };
        let (reprojection, depth) = self.measured_terms(self.coarse(), &from.measured, camera, INDEPENDENT, |_| 1.0)?;
        let priors: [&dyn Energy; 2] = [&reprojection, &depth];
        let start = self.initial_mesh(from, camera)?;
        let mut best = self.fitted_from(observation, start, blurs, &priors)?;
        if from.is_moved {
            return Ok(best);
        }
        for _ in 0..MAX_BENDS {
            let Some(other) = self.fitted_by_derivatives(observation, &best, blurs)? else {
                break;
            };
            let is_better = other.confirms_more_than(&best);
            best = best.or_better(other);
            if !is_better {
                break;
            }
        }
        if best.correlation.whole >= CONFIRMED {
            return Ok(best);
        }
        let start = self.continued(from, camera, &priors)?;
        let second = self.fitted_from(observation, start, blurs, &priors)?;
        Ok(best.or_better(second))
    }

    /// The fit from where differential Shape-from-Template puts the registration of `found`, after that has settled in the image without
    /// isometry. `None` where too little of the image confirms that, or where it is the bend that was found.
    fn fitted_by_derivatives(
        &mut self,
        observation: Observation<'_>,
        found: &Fitted,
        blurs: &[f32],
    ) -> Result<Option<Fitted>> {
        // Of isometric sheets.
        if !self.template.is_sheet() {
            return Ok(None);
        }
        let camera = observation.camera;
        let mut free = found.clone();
        for &blur in [FREE_BLUR_PX].iter().chain(blurs) {
            let round = FitRound {
                border: true,
                stiffness: Stiffness::FREE,
                ..FitRound::new(blur, STEPS)
            };
            free = self.round(observation, &free.vertices, &round, &[])?;
        }
        let coarse = self.coarse();
        let depths = differential_depths(&coarse.mesh, &free.vertices, camera);
        let told = depths.into_iter().zip(&free.correlation.confidence);
        let measured: Vec<_> = told.filter_map(|(m, c)| m.filter(|_| *c >= TELLING)).collect();
        if measured.len() < MIN_MEASUREMENTS {
            return Ok(None);
        }
        let (reprojection, depth) = self.measured_terms(coarse, &measured, camera, DIFFERENTIAL, |_| 1.0)?;
        let start = self.aligned(&measured, camera);
        let terms: [&dyn Energy; 2] = [&reprojection, &depth];
        let start = (self.coarse_mut()).solve_by_continuation(&terms, start, CONTINUATION_STEPS)?;
        if found.distance(&start) < SAME_BEND * self.template.size_mm().max_element() {
            return Ok(None);
        }
        let measured = measurements_of_mesh(&self.coarse().mesh, &start, camera);
        let (reprojection, depth) = self.measured_terms(self.coarse(), &measured, camera, INDEPENDENT, |_| 1.0)?;
        let fitted = self.fitted_from(observation, start, blurs, &[&reprojection, &depth])?;
        Ok(Some(fitted))
    }

    /// The photo-consistency rounds of the coarse mesh from `vertices`.
    fn fitted_from(
        &mut self,
        observation: Observation<'_>,
        vertices: Vec<DVec3>,
        blurs: &[f32],
        priors: &[&dyn Energy],
    ) -> Result<Fitted> {
        let mut fitted = Fitted::unmoved(vertices);
        for &blur in blurs {
            let round = FitRound {
                border: true,
                rigid_steps: if self.template.is_sheet() { 0 } else { RIGID_STEPS },
                ..FitRound::new(blur, STEPS)
            };
            let before = fitted.iterations;
            fitted = self.round(observation, &fitted.vertices, &round, priors)?;
            fitted.iterations += before;
        }
        Ok(fitted)
    }

    /// The terms that measurements give, each registration weighted by `hold`.
    pub(crate) fn measured_terms(
        &self,
        isometric: &IsometricMesh,
        measured: &[Measurement],
        camera: &Camera,
        (registrations, depths): Worth,
        hold: impl Fn(&SurfacePoint) -> f64,
    ) -> Result<(Reprojection, DepthPrior)> {
        let mesh = isometric.welded();
        let located: Vec<(SurfacePoint, &Measurement)> = measured
            .iter()
            .filter_map(|m| Some((isometric.locator.locate(m.uv)?, m)))
            .collect();
        let count = located.len().max(1) as f64;
        let deviation = REGISTRATION_DEVIATION_PX;
        let weight = registrations / count / (deviation * deviation);
        let image_point = |&(point, m): &(SurfacePoint, &Measurement)| ImagePoint {
            point,
            pixel: m.pixel,
            weight: weight * hold(&point),
        };
        let points: Vec<ImagePoint> = located.iter().map(image_point).collect();
        let reprojection = Reprojection::new(mesh, camera, &points, Robust::Cauchy(1.5 * deviation))?;
        let point_depth = |&(point, m): &(SurfacePoint, &Measurement)| PointDepth {
            point,
            depth: m.depth_mm,
            deviation: DEPTH_DEVIATION * m.depth_mm,
        };
        let points: Vec<PointDepth> = located.iter().map(point_depth).collect();
        let depths = DepthPrior::new(mesh, &points, depths / count, Robust::Cauchy(2.0))?;
        Ok((reprojection, depths))
    }

    /// The flat coarse sheet where the measurements are.
    fn aligned(&self, measured: &[Measurement], camera: &Camera) -> Vec<DVec3> {
        let pairs = measured.iter().filter_map(|m| {
            let p_template = self.template.point_template(m.uv)?;
            Some((p_template, camera.unproject(m.pixel, m.depth_mm), 1.0))
        });
        let motion = RigidMotion::align(pairs, RigidMotion::IDENTITY);
        let vertices = self.coarse().mesh.vertices().iter();
        vertices.map(|&p| motion.apply(p)).collect()
    }

    /// How much of the image confirms a coarse mesh, where the image shows anything at all.
    pub(crate) fn confirmed(&mut self, observation: Observation<'_>, found: &Fitted) -> Result<f64> {
        let round = FitRound::new(JUDGED_BLUR_PX, 0);
        let judged = self.round(observation, &found.vertices, &round, &[])?;
        Ok(judged.correlation.confirmed_evidence())
    }
}
