//! Evaluation: the errors of a model over frames whose truth is known.

use super::evaluation_frame::EvaluationFrame;
use crate::error::TrainError;
use deepsft::{DeepSftError, Estimate, Estimator, Judgement, Stage};
use deepsft_geometry::metrics::{FrameMetrics, Summary};
use deepsft_geometry::{Maps, MeshRecovery, Template, photo_consistency_error};
use serde::Serialize;
use std::borrow::Cow;
use std::time::Instant;

/// What came out for one frame; by default a frame without the template in which nothing was found.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameResult {
    /// Number of the frame in its set.
    pub index: u64,
    /// Whether the template is in the frame.
    pub has_template: bool,
    /// Whether the estimator found the template.
    pub judgement: Judgement,
    /// Errors against the truth; empty for a frame without the template.
    pub metrics: FrameMetrics,
    /// E_pr of the paper, intensities in 0..=1.
    pub photo_consistency_error: Option<f64>,
    /// Of a measured depth: over how many pixels the depth was compared.
    pub measured_pixels: Option<MeasuredPixels>,
    /// Errors of the network's own maps, where a mesh was asked for and made of them; against a measured depth at the pixels that
    /// the mesh covers.
    pub network: Option<FrameMetrics>,
    /// What the answer took: canonical warp, network, judgement and fit, one frame at a time. An ablation, whose
    /// rows come out of one pass, does not have it.
    pub seconds: Option<f64>,
}

/// Over how many pixels an estimated depth was compared with a measured one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct MeasuredPixels {
    /// Pixels that can be compared, see [`FrameTruth::reference`](super::FrameTruth::reference).
    pub measured: usize,
    /// Measured pixels over which the model's error is. They are all, whatever its own mask says, but of a mesh those that it
    /// covers.
    pub compared: usize,
}

/// All frames of a set.
#[derive(Clone, Debug, Default)]
pub struct Evaluation {
    /// One entry per frame, in order.
    pub frames: Vec<FrameResult>,
}

/// The metrics of a set: of each the mean or the median over the frames that have it.
#[derive(Clone, Copy, Debug, Serialize)]
#[non_exhaustive]
pub struct SetMetrics {
    /// RMSE of depth, mm.
    pub depth_rmse_mm: Option<f64>,
    /// RMSE of registration, pixels of the 480 x 270 image.
    pub registration_rmse_px: Option<f64>,
    /// RMSE of registration, mm on the template.
    pub registration_rmse_mm: Option<f64>,
    /// RMSE of 3D points, mm.
    pub rmse_3d_mm: Option<f64>,
    /// Intersection over union of the masks.
    pub mask_iou: Option<f64>,
    /// Fraction of the true mask that is predicted.
    pub coverage: Option<f64>,
    /// E_pr of the paper, intensities in 0..=1.
    pub photo_consistency_error: Option<f64>,
    /// Frames answered per second, one at a time: one over the mean, or the median, of [`FrameResult::seconds`]. Absent where
    /// that was not taken.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames_per_second: Option<f64>,
}

/// The summary that `deepsft eval` prints and writes as JSON. Means over the frames that show the template are at the top,
/// medians beside them.
#[derive(Clone, Copy, Debug, Serialize)]
#[non_exhaustive]
pub struct EvaluationSummary {
    /// Frames evaluated.
    pub frames: usize,
    /// Frames that show the template.
    pub frames_with_template: usize,
    /// Frames that show the template but got no pixel of it. They count as IoU and coverage 0 and have no registration or depth
    /// error.
    pub frames_without_answer: usize,
    /// Fraction of the frames with the template that were found.
    pub found_fraction: Option<f64>,
    /// Fraction of the frames without the template that were flagged as such.
    pub empty_flagged_fraction: Option<f64>,
    /// Means over frames.
    #[serde(flatten)]
    pub mean: SetMetrics,
    /// Medians over frames.
    pub median: SetMetrics,
    /// Against measured depths: over how many pixels of all frames the depth was compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured_pixels: Option<MeasuredPixels>,
    /// What the fit of the mesh did, if it was asked for.
    pub fit: Option<FitSummary>,
}

/// Where the fit of the mesh won and lost, over the frames that show the template and got a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FitSummary {
    /// Frames that got a mesh.
    pub frames: usize,
    /// Fraction of them whose registration error is larger than the network's.
    pub worse_registration_fraction: f64,
    /// Fraction of them whose 3D error is larger than the network's.
    pub worse_3d_fraction: f64,
}

impl SetMetrics {
    /// Of each metric of a frame what `of` makes of it.
    pub(super) fn new(of: impl Fn(fn(&FrameResult) -> Option<f64>) -> Option<f64>) -> Self {
        Self {
            depth_rmse_mm: of(|f| f.metrics.depth_rmse_mm),
            registration_rmse_px: of(|f| f.metrics.registration_rmse_px),
            registration_rmse_mm: of(|f| f.metrics.registration_rmse_mm),
            rmse_3d_mm: of(|f| f.metrics.points_rmse_mm),
            mask_iou: of(|f| f.metrics.mask_iou),
            coverage: of(|f| f.metrics.coverage),
            photo_consistency_error: of(|f| f.photo_consistency_error),
            frames_per_second: of(|f| f.seconds).map(f64::recip),
        }
    }
}

impl Evaluation {
    /// Evaluates `estimator` on `frames`. With a `recovery` it fits a mesh to the frames in which the template was found. It
    /// calls `each` after every frame with the frame, the answer, the maps whose depth was compared (see
    /// [`EvaluationFrame::metrics`]) and the result. Frames are of the estimator's canonical camera, as those of `deepsft
    /// eval`: of a wider one the estimate may be in another view than the truth.
    ///
    /// # Errors
    /// [`TrainError`] when a frame does not fit its camera or the device fails.
    pub fn run(
        estimator: &Estimator,
        mut recovery: Option<&mut MeshRecovery>,
        template: &Template,
        frames: impl IntoIterator<Item = impl Into<EvaluationFrame>>,
        mut each: impl FnMut(&EvaluationFrame, &Estimate, &Maps, &FrameResult),
    ) -> Result<Self, TrainError> {
        let mut results = Vec::new();
        for (index, frame) in frames.into_iter().enumerate() {
            let frame: EvaluationFrame = frame.into();
            let start = Instant::now();
            let mut estimate = pollster::block_on(estimator.estimate(&frame.image, &frame.camera))?;
            let mut seconds = start.elapsed().as_secs_f64();
            let reference = frame.truth.reference(&estimate.maps);
            let mut compared = match frame.truth.recorded_mask() {
                Some(mask) => pollster::block_on(estimator.infer_stages(&estimate.canonical, Some(mask)))?.pop(),
                None => None,
            };
            let mut network = None;
            if let Some(recovery) = recovery.as_deref_mut()
                && estimate.judgement.found
            {
                let start = Instant::now();
                let surface = recovery.recover(&estimate.canonical, &estimate.canonical_camera, &estimate.maps);
                seconds += start.elapsed().as_secs_f64();
                if let Some(surface) = surface.map_err(DeepSftError::from)? {
                    let maps = surface.maps(template.mesh()).within(&estimate.maps);
                    let own = compared.take().map(|(_, maps)| maps);
                    // A mesh is measured where it covers the measured pixels: there its rival is, too.
                    let shared = match frame.truth.has_registration() {
                        true => Cow::Borrowed(&*reference),
                        false => Cow::Owned(reference_within(&reference, &maps)),
                    };
                    let own = own.as_ref().unwrap_or(&estimate.maps);
                    network = Some(frame.metrics(&estimate.maps, own, &shared, template.into())?);
                    estimate.maps = maps;
                }
            }
            let compared = compared.as_ref().map_or(&estimate.maps, |(_, maps)| maps);
            let result = FrameResult::new(index as u64, &frame, &estimate, compared, &reference, template)?;
            let result = FrameResult {
                network,
                seconds: Some(seconds),
                ..result
            };
            each(&frame, &estimate, compared, &result);
            results.push(result);
        }
        Ok(Self { frames: results })
    }

    /// Evaluates each stage of the network of `estimator` (see [`deepsft_network::Network::stages`]) on the same `frames`: the
    /// ablation of its refinement blocks. The last stage is the network's answer, as [`Evaluation::run`] has it without a
    /// recovery.
    ///
    /// # Errors
    /// As [`Evaluation::run`].
    pub fn ablation(
        estimator: &Estimator,
        template: &Template,
        frames: impl IntoIterator<Item = impl Into<EvaluationFrame>>,
        mut each: impl FnMut(),
    ) -> Result<Vec<(Stage, Self)>, TrainError> {
        let mut rows: Vec<(Stage, Self)> = estimator.stages().iter().map(|&s| (s, Self::default())).collect();
        for (index, frame) in frames.into_iter().enumerate() {
            let frame: EvaluationFrame = frame.into();
            let canonical = estimator.canonical_image(&frame.image, &frame.camera)?;
            let stages = pollster::block_on(estimator.infer_stages(&canonical, None))?;
            let Some((_, answer)) = stages.last() else { continue };
            // The same pixels for all stages.
            let reference = frame.truth.reference(answer).into_owned();
            let compared = match frame.truth.recorded_mask() {
                Some(mask) => pollster::block_on(estimator.infer_stages(&canonical, Some(mask)))?,
                None => stages.clone(),
            };
            for (((_, row), (_, maps)), (_, compared)) in rows.iter_mut().zip(stages).zip(compared) {
                let camera = estimator.canonical_camera(canonical.size());
                let estimate = estimator.estimate_of(canonical.clone(), camera, maps)?;
                let result = FrameResult::new(index as u64, &frame, &estimate, &compared, &reference, template)?;
                row.frames.push(result);
            }
            each();
        }
        Ok(rows)
    }

    /// The metrics of the set.
    pub fn summary(&self) -> EvaluationSummary {
        let fraction = |of: usize, among: usize| (among > 0).then(|| of as f64 / among as f64);
        let shown = self.shown().count();
        let empty = self.frames.len() - shown;
        let found = self.shown().filter(|f| f.judgement.found).count();
        let flagged = self
            .frames
            .iter()
            .filter(|f| !f.has_template && !f.judgement.found)
            .count();
        let metrics =
            |pick: fn(Summary) -> f64| SetMetrics::new(|metric| Summary::of(self.shown().map(metric)).map(pick));
        EvaluationSummary {
            frames: self.frames.len(),
            frames_with_template: shown,
            frames_without_answer: self.shown().filter(|f| f.metrics.coverage == Some(0.0)).count(),
            found_fraction: fraction(found, shown),
            empty_flagged_fraction: fraction(flagged, empty),
            mean: metrics(|s| s.mean),
            median: metrics(|s| s.median),
            measured_pixels: self.measured_pixels(),
            fit: self.fit_summary(),
        }
    }

    fn fit_summary(&self) -> Option<FitSummary> {
        let fitted: Vec<(&FrameMetrics, &FrameMetrics)> = self
            .shown()
            .filter_map(|frame| Some((&frame.metrics, frame.network.as_ref()?)))
            .collect();
        let worse = |error: fn(&FrameMetrics) -> Option<f64>| {
            let worse = fitted.iter().filter(|(mesh, network)| error(mesh) > error(network));
            worse.count() as f64 / fitted.len() as f64
        };
        (!fitted.is_empty()).then(|| FitSummary {
            frames: fitted.len(),
            worse_registration_fraction: worse(|metrics| metrics.registration_rmse_px),
            worse_3d_fraction: worse(|metrics| metrics.points_rmse_mm),
        })
    }

    fn measured_pixels(&self) -> Option<MeasuredPixels> {
        let add = |sum: MeasuredPixels, pixels: MeasuredPixels| MeasuredPixels {
            measured: sum.measured + pixels.measured,
            compared: sum.compared + pixels.compared,
        };
        self.shown().filter_map(|frame| frame.measured_pixels).reduce(add)
    }

    fn shown(&self) -> impl Iterator<Item = &FrameResult> {
        self.frames.iter().filter(|f| f.has_template)
    }
}

impl FrameResult {
    /// Compares an estimate with `reference`, what is known of its frame (see
    /// [`FrameTruth::reference`](super::FrameTruth::reference)). Against a measured depth the maps `compared` stand for
    /// those of the estimate (see [`EvaluationFrame::metrics`]).
    ///
    /// # Errors
    /// [`TrainError::Geometry`] when the frame's maps are not of the canonical size.
    pub fn new(
        index: u64,
        frame: &EvaluationFrame,
        estimate: &Estimate,
        compared: &Maps,
        reference: &Maps,
        template: &Template,
    ) -> Result<Self, TrainError> {
        let compared_pixels = (0..reference.depth().len())
            .filter(|&pixel| reference.inside(pixel) && compared.inside(pixel))
            .count();
        Ok(Self {
            index,
            has_template: frame.truth.has_template(),
            judgement: estimate.judgement,
            metrics: frame.metrics(&estimate.maps, compared, reference, template.into())?,
            measured_pixels: (!frame.truth.has_registration()).then(|| MeasuredPixels {
                measured: reference.area(),
                compared: compared_pixels,
            }),
            photo_consistency_error: photo_consistency_error(&estimate.canonical, template.texture(), &estimate.maps),
            network: None,
            seconds: None,
        })
    }
}

/// `reference` in the pixels that `mesh` covers.
fn reference_within(reference: &Maps, mesh: &Maps) -> Maps {
    let mut maps = Maps::empty(reference.size());
    for pixel in (0..reference.depth().len()).filter(|&p| reference.inside(p) && mesh.inside(p)) {
        maps.set(pixel, reference.depth()[pixel], reference.registration()[pixel]);
    }
    maps
}
