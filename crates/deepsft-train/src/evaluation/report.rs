//! What evaluations found, as JSON.

use super::{Evaluation, EvaluationSummary, FrameResult, MeasuredPixels, SetMetrics};
use deepsft::Stage;
use serde::Serialize;
use std::collections::BTreeMap;

/// A row of the table: a model, or a stage of it, on a data set.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct EvaluationReport {
    /// Name of the model.
    pub model: String,
    /// Which maps were measured, in an ablation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage: Option<&'static str>,
    /// Name of the data set.
    pub set: String,
    /// Means and medians.
    #[serde(flatten)]
    pub summary: EvaluationSummary,
    /// The frames in order.
    pub per_frame: Vec<FrameReport>,
    /// What computed.
    pub device: String,
    /// Version of this crate.
    pub deepsft_version: &'static str,
}

/// A frame's line of an [`EvaluationReport`].
#[derive(Debug, Serialize)]
pub struct FrameReport {
    index: u64,
    has_template: bool,
    found: bool,
    confidence: f32,
    #[serde(flatten)]
    metrics: SetMetrics,
    #[serde(skip_serializing_if = "Option::is_none")]
    measured_pixels: Option<MeasuredPixels>,
    #[serde(flatten)]
    network: Option<NetworkReport>,
}

#[derive(Debug, Serialize)]
struct NetworkReport {
    network_depth_rmse_mm: Option<f64>,
    network_registration_rmse_px: Option<f64>,
    network_rmse_3d_mm: Option<f64>,
}

impl EvaluationReport {
    /// The report of `evaluation`, of the maps after `stage` in an ablation.
    pub fn new(model: &str, stage: Option<Stage>, set: &str, evaluation: &Evaluation, device: &str) -> Self {
        Self {
            model: model.to_owned(),
            stage: stage.map(Stage::name),
            set: set.to_owned(),
            summary: evaluation.summary(),
            per_frame: evaluation.frames.iter().map(FrameReport::new).collect(),
            device: device.to_owned(),
            deepsft_version: env!("CARGO_PKG_VERSION"),
        }
    }
}

/// The JSON file of rows: a single row by itself, several as `rows`.
///
/// # Errors
/// Those of the writer.
pub fn reports_to_json(rows: &[EvaluationReport]) -> serde_json::Result<Vec<u8>> {
    match rows {
        [row] => serde_json::to_vec_pretty(row),
        rows => serde_json::to_vec_pretty(&BTreeMap::from([("rows", rows)])),
    }
}

impl FrameReport {
    fn new(result: &FrameResult) -> Self {
        Self {
            index: result.index,
            has_template: result.has_template,
            found: result.judgement.found,
            confidence: result.judgement.confidence,
            // The same frames give the same lines; how long one took does not belong there.
            metrics: SetMetrics {
                frames_per_second: None,
                ..SetMetrics::new(|metric| metric(result))
            },
            measured_pixels: result.measured_pixels,
            network: result.network.map(|network| NetworkReport {
                network_depth_rmse_mm: network.depth_rmse_mm,
                network_registration_rmse_px: network.registration_rmse_px,
                network_rmse_3d_mm: network.points_rmse_mm,
            }),
        }
    }
}
