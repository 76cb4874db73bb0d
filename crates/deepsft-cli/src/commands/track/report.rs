//! What a track is reported as: `track.json` and `track.csv`.

use crate::camera_choice::CameraReport;
use deepsft::session::{Detection, FrameTimes};
use deepsft_geometry::metrics::Summary;
use deepsft_train::tracking_errors::TRACKED_PX;
use serde::{Serialize, Serializer};

/// The content of `track.json`.
#[derive(Serialize)]
pub struct Report {
    pub video: String,
    /// The model's name, or the path of the picture or template.
    pub object: String,
    pub frames: usize,
    /// Why the track ends before the video does; absent when it does not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ended_early: Option<String>,
    pub frames_per_s: f64,
    /// Frames in which the object was found.
    pub found: usize,
    pub finding_delay_frames: Option<u64>,
    pub finding_every_frames: Option<u64>,
    pub smoothed: bool,
    pub camera: CameraReport,
    pub canonical_camera: CameraReport,
    /// What the network ran on; null without one.
    pub device: Option<String>,
    /// Medians over the frames that have the stage.
    pub median_ms: StageTimes,
    /// Where the truth is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub errors: Option<Errors>,
    pub per_frame: Vec<FrameReport>,
    pub deepsft_version: &'static str,
}

#[derive(Serialize)]
pub struct FrameReport {
    pub frame: usize,
    pub time_s: f64,
    pub found: bool,
    /// Whether it is found and the frame does not confirm its mesh, which stands where it was.
    pub held: bool,
    pub correlation: f64,
    pub iterations: usize,
    /// The detection that arrived.
    pub detection: Option<Detection>,
    pub ms: StageTimes,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<FrameTruth>,
    /// The further copies, where they are looked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub copies: Vec<CopyReport>,
}

/// A further copy of the object in one frame.
#[derive(Serialize)]
pub struct CopyReport {
    pub found: bool,
    pub held: bool,
    pub correlation: f64,
}

/// The stages of a frame.
const STAGES: [&str; 5] = ["decode", "canonical_warp", "follow", "catch_up", "finding"];

/// The milliseconds of each stage, as far as there were any.
#[derive(Clone, Copy)]
pub struct StageTimes(pub [Option<f64>; STAGES.len()]);

impl Serialize for StageTimes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(STAGES.iter().zip(self.0))
    }
}

/// What the truth says of a frame.
#[derive(Clone, Copy, Serialize)]
pub struct FrameTruth {
    /// Fraction of the template that is in view and not covered.
    pub print_in_view: f64,
    pub registration_rmse_px: Option<f64>,
    pub points_rmse_mm: Option<f64>,
}

/// Over the frames that confirm the mesh, with the object in view.
#[derive(Serialize)]
pub struct Errors {
    pub frames_in_view: usize,
    /// Those of them with a registration RMSE of at most 2 px.
    pub tracked: usize,
    /// Frames without any of the object that confirmed a mesh all the same.
    pub found_where_it_is_not: usize,
    pub registration_rmse_px: Option<MeanMedian>,
    pub points_rmse_mm: Option<MeanMedian>,
}

#[derive(Serialize)]
pub struct MeanMedian {
    pub mean: f64,
    pub median: f64,
}

impl StageTimes {
    pub fn new(decode_ms: f64, times: &FrameTimes) -> Self {
        let (warp_ms, follow_ms) = (Some(times.warp), Some(times.follow));
        Self([Some(decode_ms), warp_ms, follow_ms, times.catch_up, times.finding])
    }
}

/// The medians of the stages' times.
pub fn medians(frames: &[FrameReport]) -> StageTimes {
    let summary = |stage: usize| Summary::of(frames.iter().map(|frame| frame.ms.0[stage]));
    StageTimes(std::array::from_fn(|stage| Some(summary(stage)?.median)))
}

impl Errors {
    /// Over all frames of a clip.
    pub fn of(frames: &[FrameReport]) -> Self {
        let seen = |frame: &&FrameReport| frame.truth.is_some_and(|truth| truth.print_in_view > 0.0);
        let confirmed = || frames.iter().filter(|frame| !frame.held);
        let error = |frame: &FrameReport| frame.truth.and_then(|truth| truth.registration_rmse_px);
        let summary = |value: fn(&FrameTruth) -> Option<f64>| {
            let summary = Summary::of(confirmed().map(|frame| frame.truth.as_ref().and_then(value)));
            summary.map(|summary| MeanMedian {
                mean: summary.mean,
                median: summary.median,
            })
        };
        Self {
            frames_in_view: frames.iter().filter(seen).count(),
            tracked: confirmed()
                .filter(|frame| error(frame).is_some_and(|px| px <= TRACKED_PX))
                .count(),
            found_where_it_is_not: confirmed()
                .filter(|frame| frame.found && frame.truth.is_some() && !seen(frame))
                .count(),
            registration_rmse_px: summary(|truth| truth.registration_rmse_px),
            points_rmse_mm: summary(|truth| truth.points_rmse_mm),
        }
    }
}

/// The first line of `track.csv`: the names of its columns.
pub const TABLE_HEADER: &str = "frame,time_s,found,held,correlation,iterations,detection_of_frame,detection_by,detection_effect,decode_ms,\
                                canonical_warp_ms,follow_ms,catch_up_ms,finding_ms,print_in_view,registration_rmse_px,points_rmse_mm\n";

/// A frame's line of `track.csv`; a cell is empty where the frame has no such value.
pub fn table_row(frame: &FrameReport) -> String {
    let cell = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.4}"));
    let (detection, truth) = (frame.detection, frame.truth);
    let by = detection.and_then(|detection| detection.by);
    let times = frame.ms.0.map(cell).join(",");
    let cells = [
        frame.frame.to_string(),
        format!("{:.6}", frame.time_s),
        frame.found.to_string(),
        frame.held.to_string(),
        cell(Some(frame.correlation)),
        frame.iterations.to_string(),
        detection.map_or_else(String::new, |detection| detection.of_frame.to_string()),
        by.map_or_else(String::new, |by| by.name().to_owned()),
        detection.map_or_else(String::new, |detection| detection.effect.name().to_owned()),
        times,
        cell(truth.map(|truth| truth.print_in_view)),
        cell(truth.and_then(|truth| truth.registration_rmse_px)),
        cell(truth.and_then(|truth| truth.points_rmse_mm)),
    ];
    cells.join(",") + "\n"
}
