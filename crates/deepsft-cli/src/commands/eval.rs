//! `deepsft eval`: a model against ground truth.

use crate::failure::BlameInput;
use crate::output::{atomic, panels, sheet};
use crate::refine::Refine;
use crate::synthesis::{Preset, SynthesisOptions};
use crate::{dataset, input, progress, synthesis};
use anyhow::{Context, Result, anyhow};
use clap::{ArgGroup, Args};
use deepsft::{DeviceKind, Estimate, ModelBundle, encode_png};
use deepsft_geometry::{Maps, Picture};
use deepsft_synth::Sample;
use deepsft_train::{Evaluation, EvaluationSummary, FrameResult};
use serde::Serialize;
use std::path::PathBuf;

/// Frames on the sheet.
const WORST: usize = 12;

/// Ends of the error scales on the sheet, mm.
const DEPTH_SCALE_MM: f64 = 50.0;
const REGISTRATION_SCALE_MM: f64 = 20.0;

#[derive(Args)]
#[command(
    group = ArgGroup::new("set").args(["synthetic", "dataset"]).required(true),
    after_help = "\
Every figure is of one frame, over the pixels inside the true and the predicted mask; printed are mean and
median over the frames that show the object:
  depth_rmse_mm          depth, mm
  registration_rmse_px   how far an overlay sits from the truth, pixels of the 480 x 270 image
  registration_rmse_mm   the same on the object, mm
  rmse_3d_mm             3D points, mm
  mask_iou, coverage     overlap of the masks; share of the true mask that was found
  photometric_error      the paper's E_pr, intensities 0 to 1, not corrected for light
The JSON has the means at the top (\"depth_rmse_mm\"), the medians in \"median\" (\"median\": {\"depth_rmse_mm\"})
and each frame in \"per_frame\". With --refine physics, \"refinement\" says where the mesh was refused and where it is
worse than the network's own maps, whose errors stand beside each frame's (\"network_...\").

Examples:
  deepsft eval --model models/poster-a4 --synthetic 500 --seed 999 --json accuracy.json --sheet worst.png
  deepsft eval --model models/poster-a4 --synthetic 500 --seed 999 --refine physics
  deepsft eval --model models/poster-a4 --dataset held-out"
)]
pub struct EvalArguments {
    /// Model bundle to measure
    #[arg(long, value_name = "BUNDLE")]
    model: PathBuf,
    /// Measure on this many synthetic images of the model's own template
    #[arg(long, value_name = "N", requires = "seed", value_parser = clap::value_parser!(u64).range(1..))]
    synthetic: Option<u64>,
    /// Seed of the synthetic images; choose one that was not trained on
    #[arg(long, value_name = "S", conflicts_with = "dataset")]
    seed: Option<u64>,
    /// What is varied in the synthetic images, and how far
    #[arg(long, value_name = "NAME", value_enum, default_value_t)]
    preset: Preset,
    #[command(flatten)]
    images: SynthesisOptions,
    /// Measure on a data set as `deepsft synth` writes
    #[arg(long, value_name = "DIR", conflicts_with_all = ["preset", "camera_effects", "backgrounds"])]
    dataset: Option<PathBuf>,
    /// Fit the template's mesh to the image, starting from the network's maps (physics), or only complete what the
    /// network sees by what is hidden (arap)
    #[arg(long, value_name = "HOW", value_enum, default_value_t = Refine::None)]
    refine: Refine,
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Draw the 12 worst frames (by registration) to this PNG file
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,
    /// What computes: cpu, vulkan or webgpu (the last two if the program was built with them)
    #[arg(long, value_name = "DEVICE", default_value_t = DeviceKind::Cpu)]
    device: DeviceKind,
}

/// The content of the JSON file.
#[derive(Serialize)]
struct Report {
    model: String,
    set: String,
    #[serde(flatten)]
    summary: EvaluationSummary,
    per_frame: Vec<FrameReport>,
    device: String,
    deepsft_version: &'static str,
}

#[derive(Serialize)]
struct FrameReport {
    index: u64,
    has_template: bool,
    found: bool,
    confidence: f32,
    depth_rmse_mm: Option<f64>,
    registration_rmse_px: Option<f64>,
    registration_rmse_mm: Option<f64>,
    rmse_3d_mm: Option<f64>,
    mask_iou: Option<f64>,
    coverage: Option<f64>,
    #[serde(flatten)]
    refinement: Option<RefinementReport>,
}

#[derive(Serialize)]
struct RefinementReport {
    mesh_taken: bool,
    network_depth_rmse_mm: Option<f64>,
    network_registration_rmse_px: Option<f64>,
    network_rmse_3d_mm: Option<f64>,
    photometric_cost: Option<[f64; 2]>,
}

pub fn run(arguments: &EvalArguments) -> Result<()> {
    let bundle = input::bundle(&arguments.model)?;
    let (estimator, device) = input::estimator(&bundle, arguments.device)?;
    let set = set(arguments, &bundle)?;
    let bar = progress::counting(set.count, "frames");
    let mut worst = Worst::default();
    let mut unreadable = None;
    let samples = set
        .samples
        .map_while(|sample| sample.map_err(|error| unreadable = Some(error)).ok());
    let mut refinement = arguments.refine.prepare(bundle.template())?;
    let evaluation = Evaluation::run(
        &estimator,
        refinement.as_mut(),
        bundle.template(),
        samples,
        |sample, estimate, result| {
            if arguments.sheet.is_some() {
                worst.offer(sample, estimate, result);
            }
            bar.inc(1);
        },
    )?;
    bar.finish_and_clear();
    if let Some(error) = unreadable {
        return Err(error);
    }
    let report = Report {
        model: bundle.name().to_owned(),
        set: set.name,
        summary: evaluation.summary(),
        per_frame: evaluation.frames.iter().map(FrameReport::new).collect(),
        device: format!("{}: {}", device.kind, device.adapter_name),
        deepsft_version: env!("CARGO_PKG_VERSION"),
    };
    print(&report);
    if let Some(path) = &arguments.json {
        atomic::write_file(path, &serde_json::to_vec_pretty(&report)?)?;
    }
    if let Some(path) = &arguments.sheet {
        let rows = worst.rows(&bundle);
        let sheet = sheet::sheet(&rows).context("no frame shows the object: there is nothing to draw")?;
        atomic::write_file(path, &encode_png(&sheet)?)?;
    }
    Ok(())
}

/// The frames to measure on.
struct FrameSet {
    name: String,
    count: u64,
    samples: Box<dyn Iterator<Item = Result<Sample>>>,
}

fn set(arguments: &EvalArguments, bundle: &ModelBundle) -> Result<FrameSet> {
    if let Some(folder) = &arguments.dataset {
        let description = dataset::open(folder)?;
        let fits = description.template_size_mm == bundle.template().size_mm().to_array();
        if !fits {
            let [width, height] = description.template_size_mm;
            let size = bundle.template().size_mm();
            Err(anyhow!(
                "its template has {width} x {height} mm, the model's {} x {} mm",
                size.x,
                size.y
            ))
            .blame("data set", folder)?;
        }
        return Ok(FrameSet {
            name: format!("data set {}", folder.display()),
            count: description.samples,
            samples: Box::new(dataset::samples(folder, &description, *bundle.camera())),
        });
    }
    let (count, seed) = (
        arguments.synthetic.unwrap_or_default(),
        arguments.seed.unwrap_or_default(),
    );
    if seed == bundle.card().provenance.seed {
        eprintln!("warning: the model was trained with seed {seed}: these frames are not new to it");
    }
    let images = arguments.images.with_preset(arguments.preset);
    let synthesizer = synthesis::synthesizer(bundle.template(), &images)?;
    Ok(FrameSet {
        name: format!("{count} synthetic frames of seed {seed}{}", images.note()),
        count,
        samples: Box::new(synthesis::samples(synthesizer, seed, 0..count).map(Ok)),
    })
}

impl FrameReport {
    fn new(result: &FrameResult) -> Self {
        let metrics = &result.metrics;
        Self {
            index: result.index,
            has_template: result.has_template,
            found: result.judgement.found,
            confidence: result.judgement.confidence,
            depth_rmse_mm: metrics.depth_rmse_mm,
            registration_rmse_px: metrics.registration_rmse_px,
            registration_rmse_mm: metrics.registration_rmse_mm,
            rmse_3d_mm: metrics.points_rmse_mm,
            mask_iou: metrics.mask_iou,
            coverage: metrics.coverage,
            refinement: result.refinement.map(|refinement| RefinementReport {
                mesh_taken: refinement.mesh_taken,
                network_depth_rmse_mm: refinement.network.depth_rmse_mm,
                network_registration_rmse_px: refinement.network.registration_rmse_px,
                network_rmse_3d_mm: refinement.network.points_rmse_mm,
                photometric_cost: refinement.photometric_cost,
            }),
        }
    }
}

fn print(report: &Report) {
    let (summary, mean, median) = (&report.summary, &report.summary.mean, &report.summary.median);
    println!(
        "{} on {}: {} frames show the object",
        report.model, report.set, summary.frames_with_template
    );
    println!("{:28}{:>10}{:>10}", "", "mean", "median");
    for (name, mean, median) in [
        (
            "registration RMSE, px",
            mean.registration_rmse_px,
            median.registration_rmse_px,
        ),
        (
            "registration RMSE, mm",
            mean.registration_rmse_mm,
            median.registration_rmse_mm,
        ),
        ("depth RMSE, mm", mean.depth_rmse_mm, median.depth_rmse_mm),
        ("3D point RMSE, mm", mean.rmse_3d_mm, median.rmse_3d_mm),
        ("mask IoU", mean.mask_iou, median.mask_iou),
        ("coverage", mean.coverage, median.coverage),
        ("photometric error", mean.photometric_error, median.photometric_error),
    ] {
        println!("{name:28}{:>10}{:>10}", figure(mean), figure(median));
    }
    let percent = |share: Option<f64>| share.map_or_else(|| "-".to_owned(), |share| format!("{:.1} %", 100.0 * share));
    println!("found where it is          {:>11}", percent(summary.found_share));
    println!(
        "not found where it is not  {:>11}",
        percent(summary.empty_flagged_share)
    );
    if let Some(refinement) = &summary.refinement {
        println!(
            "refinement, {} frames: the network's maps stay in {}; worse than they are in registration {}, in 3D {}",
            refinement.frames,
            percent(Some(refinement.fallback_share)),
            percent(Some(refinement.worse_registration_share)),
            percent(Some(refinement.worse_3d_share)),
        );
    }
    if summary.frames_without_answer > 0 {
        println!(
            "{} frames that show it have no pixel in common with the answer",
            summary.frames_without_answer
        );
    }
}

fn figure(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"))
}

/// The frames with the largest registration error, worst first.
#[derive(Default)]
struct Worst {
    frames: Vec<Frame>,
}

struct Frame {
    result: FrameResult,
    image: Picture,
    predicted: Maps,
    truth: Maps,
}

impl Worst {
    fn offer(&mut self, sample: &Sample, estimate: &Estimate, result: &FrameResult) {
        let at = self
            .frames
            .partition_point(|frame| badness(&frame.result) >= badness(result));
        if !result.has_template || at >= WORST {
            return;
        }
        let (image, predicted, truth) = (estimate.canonical.clone(), estimate.maps.clone(), sample.truth.clone());
        self.frames.insert(
            at,
            Frame {
                result: *result,
                image,
                predicted,
                truth,
            },
        );
        self.frames.truncate(WORST);
    }

    fn rows(&self, bundle: &ModelBundle) -> Vec<sheet::Row> {
        let size = bundle.template().size_mm();
        let row = |frame: &Frame| {
            let Frame {
                result,
                image,
                predicted,
                truth,
            } = frame;
            let metrics = &result.metrics;
            let caption = format!(
                "frame {}: registration {} px, depth {} mm, mask IoU {}, coverage {}, confidence {:.2}",
                result.index,
                figure(metrics.registration_rmse_px),
                figure(metrics.depth_rmse_mm),
                figure(metrics.mask_iou),
                figure(metrics.coverage),
                result.judgement.confidence,
            );
            let panels = vec![
                panels::plain("input", image),
                panels::overlay("registration, estimated", image, predicted, size),
                panels::overlay("registration, true", image, truth, size),
                panels::depth_error("depth error", predicted, truth, DEPTH_SCALE_MM),
                panels::registration_error("registration error", predicted, truth, size, REGISTRATION_SCALE_MM),
            ];
            // Half the size: twelve rows are to fit on a screen.
            let halved = |panel: sheet::Panel| sheet::Panel {
                picture: panel.picture.halved(),
                ..panel
            };
            sheet::Row {
                caption,
                panels: panels.into_iter().map(halved).collect(),
            }
        };
        self.frames.iter().map(row).collect()
    }
}

/// The order of the sheet: frames without any answer first, then by registration error.
fn badness(result: &FrameResult) -> f64 {
    result.metrics.registration_rmse_px.unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use deepsft::Judgement;
    use deepsft_geometry::Template;
    use deepsft_geometry::metrics::FrameMetrics;
    use deepsft_synth::{SynthConfig, Synthesizer};

    fn template() -> Template {
        Template::thin_shell(
            Picture::from_fn(40, 30, |x, y| [6 * x as u8, 8 * y as u8, 90]),
            200.0,
            150.0,
        )
        .unwrap()
    }

    #[test]
    fn the_worst_frames_are_kept_in_order_and_those_without_the_object_are_not() {
        let sample = Synthesizer::new(&template(), SynthConfig::default())
            .unwrap()
            .sample(1, 0);
        let judgement = Judgement {
            found: true,
            confidence: 0.5,
            area: 0.1,
        };
        let estimate = Estimate {
            maps: Maps::empty(480, 270),
            canonical: sample.image.clone(),
            judgement,
        };
        let mut worst = Worst::default();
        for index in 0..30 {
            let error = if index == 7 {
                None
            } else {
                Some((index * 11 % 30) as f64)
            };
            let metrics = FrameMetrics {
                registration_rmse_px: error,
                ..FrameMetrics::default()
            };
            let has_template = index != 8;
            let result = FrameResult {
                index,
                has_template,
                judgement,
                metrics,
                photometric_error: None,
                refinement: None,
            };
            worst.offer(&sample, &estimate, &result);
        }
        let errors: Vec<f64> = worst.frames.iter().map(|frame| badness(&frame.result)).collect();
        // 8 * 11 = 28 mod 30 is without the object.
        let expected = [
            f64::INFINITY,
            29.0,
            27.0,
            26.0,
            25.0,
            24.0,
            23.0,
            22.0,
            21.0,
            20.0,
            19.0,
            18.0,
        ];
        assert_eq!(errors, expected);
    }
}
