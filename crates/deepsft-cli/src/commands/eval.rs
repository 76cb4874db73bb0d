//! `deepsft eval`: models against ground truth, in one table.

mod drawn_frames;
mod sets;

use crate::failure::usage;
use crate::input;
use crate::mesh_choice::MeshChoice;
use crate::output::sheet;
use crate::synthesis::SynthesisOptions;
use anyhow::{Context, Result};
use clap::{ArgGroup, Args};
use deepsft::{DeviceKind, Estimate, Estimator, ModelBundle, Stage, encode_png};
use deepsft_geometry::Maps;
use deepsft_train::{Evaluation, EvaluationFrame, EvaluationReport, FrameResult, accuracy_table, reports_to_json};
use drawn_frames::{DrawnFrames, FIGURE, WORST};
use sets::{DataSet, FrameSet};
use std::path::PathBuf;

#[derive(Args)]
#[command(
    group = ArgGroup::new("set").args(["synthetic", "data"]).required(true).multiple(true),
    after_help = "\
The command prints one table with a row for each model on each data set. It measures each frame over the pixels that lie in
both the true and the predicted mask, and prints mean and median over the frames that show the object:
  depth_rmse_mm            depth, mm
  registration_rmse_px     how far an overlay is displaced, pixels of the 480 x 270 image
  registration_rmse_mm     the same on the object, mm
  photo_consistency_error  the paper's E_pr, intensities 0 to 1, not corrected for light
  mask_iou, coverage       overlap of the masks; fraction of the true mask that was found
  rmse_3d_mm               3D points, mm
  frames_per_second        how many frames the model answers per second, one after the other
--json of one model on one set has the means at the top (\"depth_rmse_mm\"), the medians in \"median\" (\"median\":
{\"depth_rmse_mm\"}) and each frame in \"per_frame\". For several it has a list of such objects, \"rows\". With --mesh,
\"fit\" counts the frames that got a mesh and those where it is worse than the network's own maps. Each frame then also has
the errors of those maps (\"network_...\").

--data takes data sets of `deepsft synth` and RGB-D recordings. A simulated recording has its truth beside it. Other
recordings have only what their depth camera measured: no true registration, and masks only if somebody made them. Their
depth is compared two pixels inside the recording's masks and away from jumps of the measured depth. All models are
compared over these same pixels, and a mesh at those of them that it covers; the line below the table counts them. Without
masks nobody knows where the object is. Each model is then compared inside its own mask, and rows of two models are over
different pixels.

--ablation measures the maps after each block: after the main block, after the depth refinement, and after the registration
refinement, which gives the answer. To see what total variation does, train without it (`deepsft train
--total-variation 0`) and measure both bundles.

--figure draws six frames: five spread over the set, and the one with the worst registration. The columns are input, true
depth, depth, u, v, the errors, and the mean of the image and the template drawn through the registration (I_avg of the
paper: the better the registration, the sharper it is).

Examples:
  deepsft eval --model models/poster-a4 --synthetic 500 --seed 999 --json accuracy.json --sheet worst.png
  deepsft eval --model models/poster-a4 --synthetic 500 --seed 999 --mesh fit
  deepsft eval --model with-tv --model without-tv --synthetic 200 --seed 999 --data held-out --data recording
  deepsft eval --model models/poster-a4 --synthetic 200 --seed 999 --ablation
  deepsft eval --model models/poster-a4 --synthetic 100 --seed 999 --figure figure.png"
)]
pub struct EvalArguments {
    /// Model bundle to measure; may be given several times
    #[arg(long, value_name = "BUNDLE", required = true)]
    model: Vec<PathBuf>,
    /// Measure on this many synthetic images of the model's own template
    #[arg(long, value_name = "N", requires = "seed", value_parser = clap::value_parser!(u64).range(1..))]
    synthetic: Option<u64>,
    /// Seed of the synthetic images; choose one that was not trained on
    #[arg(long, value_name = "S", requires = "synthetic")]
    seed: Option<u64>,
    #[command(flatten)]
    images: SynthesisOptions,
    /// Measure on a data set of `deepsft synth` or on an RGB-D recording; may be given several times
    #[arg(long, visible_alias = "dataset", value_name = "DIR")]
    data: Vec<PathBuf>,
    /// How to find the whole mesh, whose maps are then measured
    #[arg(long, value_name = "HOW", value_enum, default_value_t = MeshChoice::None)]
    mesh: MeshChoice,
    /// Measure the maps after each block of the network
    #[arg(long, conflicts_with_all = ["mesh", "sheet", "figure"])]
    ablation: bool,
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Draw the 12 worst frames (by registration), as in the tables of the paper, to this PNG file; for one model on one data set
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,
    /// Draw frames spread over each data set and the worst, as in the tables of the paper, to this PNG file
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// What computes: cpu, or webgpu if the program was built with it
    #[arg(long, value_name = "DEVICE", default_value_t = DeviceKind::Cpu)]
    device: DeviceKind,
}

pub fn run(arguments: &EvalArguments) -> Result<()> {
    let sets = sets(arguments)?;
    let several = arguments.model.len() * sets.len() > 1;
    if several && arguments.sheet.is_some() {
        return Err(usage(
            "--sheet is for one model on one data set; --figure draws several",
        ));
    }
    let bundles: Vec<ModelBundle> = arguments
        .model
        .iter()
        .map(|folder| input::bundle(folder))
        .collect::<Result<_>>()?;
    let mut reports = Vec::new();
    let files = [(&arguments.sheet, &WORST), (&arguments.figure, &FIGURE)];
    let mut pictures: Vec<_> = files
        .into_iter()
        .filter_map(|(path, kind)| Some((path.as_ref()?, kind, Vec::new())))
        .collect();
    for (bundle, folder) in bundles.iter().zip(&arguments.model) {
        let alone = bundles.iter().filter(|other| other.name() == bundle.name()).count() == 1;
        let name = if alone {
            bundle.name().to_owned()
        } else {
            format!("{} ({})", bundle.name(), folder.display())
        };
        let (estimator, device) = input::estimator(bundle, arguments.device)?;
        let measured = Measured {
            arguments,
            bundle,
            estimator,
            name,
            device: device.to_string(),
        };
        for set in &sets {
            let set = set.open(bundle)?;
            if arguments.ablation {
                reports.extend(measured.ablation(set)?);
                continue;
            }
            let mut drawn: Vec<_> = (pictures.iter().map(|(_, kind, _)| DrawnFrames::new(kind, set.count))).collect();
            let report = measured.evaluation(set, &mut drawn)?;
            let place = several.then(|| format!("{} on {}, ", report.model, report.set));
            for ((.., rows), drawn) in pictures.iter_mut().zip(drawn) {
                rows.extend(drawn.rows(bundle.template(), bundle.camera(), place.as_deref().unwrap_or_default()));
            }
            reports.push(report);
        }
    }
    println!("{}", accuracy_table(&reports));
    if let Some(path) = &arguments.json {
        deepsft_formats::write_file(path, &reports_to_json(&reports)?)?;
    }
    for (path, _, rows) in pictures {
        let sheet = sheet::sheet(&rows).context("no frame shows the object: there is nothing to draw")?;
        deepsft_formats::write_file(path, &encode_png(&sheet)?)?;
    }
    Ok(())
}

/// The data sets that were asked for.
fn sets(arguments: &EvalArguments) -> Result<Vec<DataSet<'_>>> {
    let images = &arguments.images;
    let mut sets = Vec::new();
    match (arguments.synthetic, arguments.seed) {
        (Some(count), Some(seed)) => sets.push(DataSet::Synthetic { count, seed, images }),
        _ if !images.note().is_empty() => {
            return Err(usage(
                "--images, --camera-effects and --backgrounds are for --synthetic: what is on disk is as it is",
            ));
        }
        _ => {}
    }
    sets.extend(arguments.data.iter().map(DataSet::Folder));
    Ok(sets)
}

/// A model that is measured.
struct Measured<'a> {
    arguments: &'a EvalArguments,
    bundle: &'a ModelBundle,
    estimator: Estimator,
    name: String,
    device: String,
}

impl Measured<'_> {
    /// A row of the table; the frames are offered to those that are drawn.
    fn evaluation(&self, set: FrameSet, drawn: &mut [DrawnFrames]) -> Result<EvaluationReport> {
        let mut recovery = self.arguments.mesh.prepare(self.bundle.template())?;
        let set_name = set.name.clone();
        let evaluation = set.measure(|frames, bar| {
            let each = |frame: &EvaluationFrame, estimate: &Estimate, compared: &Maps, result: &FrameResult| {
                let offer = |drawn: &mut DrawnFrames| drawn.offer(frame, estimate, compared, result);
                drawn.iter_mut().for_each(offer);
                bar.inc(1);
            };
            Evaluation::run(&self.estimator, recovery.as_mut(), self.bundle.template(), frames, each)
        })?;
        Ok(self.report(None, &set_name, &evaluation))
    }

    /// A row for each stage of the network.
    fn ablation(&self, set: FrameSet) -> Result<Vec<EvaluationReport>> {
        let set_name = set.name.clone();
        let stages = set.measure(|frames, bar| {
            Evaluation::ablation(&self.estimator, self.bundle.template(), frames, || bar.inc(1))
        })?;
        let report = |(stage, evaluation)| self.report(Some(stage), &set_name, &evaluation);
        Ok(stages.into_iter().map(report).collect())
    }

    fn report(&self, stage: Option<Stage>, set: &str, evaluation: &Evaluation) -> EvaluationReport {
        EvaluationReport::new(&self.name, stage, set, evaluation, &self.device)
    }
}
