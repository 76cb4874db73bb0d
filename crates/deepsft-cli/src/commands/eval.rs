//! `deepsft eval`: models against ground truth, in one table.

mod figure;
mod sets;
mod worst;

use crate::failure::usage;
use crate::mesh_choice::MeshChoice;
use crate::output::sheet;
use crate::synthesis::SynthesisOptions;
use crate::{input, progress};
use anyhow::{Context, Result};
use clap::{ArgGroup, Args};
use deepsft::{DeviceKind, Estimator, ModelBundle, encode_png};
use deepsft_train::{Evaluation, EvaluationReport, accuracy_table, reports_to_json};
use figure::Chosen;
use sets::{DataSet, FrameSet};
use std::path::PathBuf;
use worst::Worst;

#[derive(Args)]
#[command(
    group = ArgGroup::new("set").args(["synthetic", "data"]).required(true).multiple(true),
    after_help = "\
One table, a row for each model on each data set. Every figure is of one frame, over the pixels inside the true and the
predicted mask; printed are mean and median over the frames that show the object:
  depth_rmse_mm          depth, mm
  registration_rmse_px   how far an overlay sits from the truth, pixels of the 480 x 270 image
  registration_rmse_mm   the same on the object, mm
  photometric_error      the paper's E_pr, intensities 0 to 1, not corrected for light
  mask_iou, coverage     overlap of the masks; fraction of the true mask that was found
  rmse_3d_mm             3D points, mm
  frames_per_second      frames answered in a second, one after the other
The JSON of one model on one set has the means at the top (\"depth_rmse_mm\"), the medians in \"median\" (\"median\":
{\"depth_rmse_mm\"}) and each frame in \"per_frame\"; of several it has such objects in \"rows\". With --mesh,
\"fit\" says where the mesh was rejected and where it is worse than the network's own maps, whose errors stand beside
each frame's (\"network_...\").

--data takes data sets as `deepsft synth` writes them, and RGB-D recordings. A simulated recording has its truth beside
it. Any other has what its depth camera measured: no true registration, and masks only if it brings them. Its depth is
compared two pixels inside the recording's masks and away from jumps of the measured depth, whatever a model says there:
all models are compared over the same pixels, and a mesh at those of them that it covers; the line below the table counts
them. Without masks nobody knows where the object is: then each model is compared inside its own mask, and rows of two
models are over different pixels.

--ablation measures the maps after each block: the main block only, with the depth refinement, and with the registration
refinement, which is the answer. What total variation does is seen by training without it (`deepsft train
--total-variation 0`) and measuring both bundles.

--figure draws six frames, five spread over the set and the worst by registration: input, true depth, depth, u, v, the
errors, and the mean of the image and the template drawn through the registration (I_avg of the paper: the sharper, the
better the registration).

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
    /// Measure on a data set as `deepsft synth` writes, or on an RGB-D recording; may be given several times
    #[arg(long, visible_alias = "dataset", value_name = "DIR")]
    data: Vec<PathBuf>,
    /// How to find the whole mesh, whose maps are then measured
    #[arg(long, alias = "refine", value_name = "HOW", value_enum, default_value_t = MeshChoice::None)]
    mesh: MeshChoice,
    /// Measure the maps after each block of the network
    #[arg(long, conflicts_with_all = ["mesh", "sheet", "figure"])]
    ablation: bool,
    /// Write the figures to this file
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Draw the 12 worst frames (by registration) to this PNG file; for one model on one data set
    #[arg(long, value_name = "FILE")]
    sheet: Option<PathBuf>,
    /// Draw frames spread over each data set and the worst, as in the tables of the paper, to this PNG file
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// What computes: cpu, or vulkan, webgpu or cuda if the program was built with it
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
    let (mut worst_rows, mut figure_rows) = (Vec::new(), Vec::new());
    for (bundle, folder) in bundles.iter().zip(&arguments.model) {
        let alone = bundles.iter().filter(|other| other.name() == bundle.name()).count() == 1;
        let name = if alone {
            bundle.name().to_owned()
        } else {
            format!("{} ({})", bundle.name(), folder.display())
        };
        let (estimator, device) = input::estimator(bundle, arguments.device)?;
        let device = format!("{}: {}", device.kind, device.adapter_name);
        let measured = Measured {
            arguments,
            bundle,
            estimator: &estimator,
            name: &name,
            device: &device,
        };
        for set in &sets {
            let set = set.open(bundle)?;
            if arguments.ablation {
                reports.extend(measured.ablation(set)?);
                continue;
            }
            let (report, worst, chosen) = measured.evaluation(set)?;
            worst_rows.extend(worst.rows(bundle));
            let place = several.then(|| format!("{} on {}, ", report.model, report.set));
            figure_rows.extend(chosen.rows(bundle, &place.unwrap_or_default()));
            reports.push(report);
        }
    }
    println!("{}", accuracy_table(&reports));
    if let Some(path) = &arguments.json {
        deepsft_formats::write_file(path, &reports_to_json(&reports)?)?;
    }
    for (path, rows) in [(&arguments.sheet, worst_rows), (&arguments.figure, figure_rows)] {
        if let Some(path) = path {
            let sheet = sheet::sheet(&rows).context("no frame shows the object: there is nothing to draw")?;
            deepsft_formats::write_file(path, &encode_png(&sheet)?)?;
        }
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
    estimator: &'a Estimator,
    name: &'a str,
    device: &'a str,
}

impl Measured<'_> {
    /// A row of the table, and the frames to draw.
    fn evaluation(&self, set: FrameSet) -> Result<(EvaluationReport, Worst, Chosen)> {
        let bar = progress::counting(set.count, "frames");
        let (mut worst, mut chosen) = (Worst::default(), Chosen::new(set.count));
        let mut unreadable = None;
        let frames = set
            .frames
            .map_while(|frame| frame.map_err(|error| unreadable = Some(error)).ok());
        let mut refinement = self.arguments.mesh.prepare(self.bundle.template())?;
        let evaluation = Evaluation::run(
            self.estimator,
            refinement.as_mut(),
            self.bundle.template(),
            frames,
            |frame, estimate, result| {
                if self.arguments.sheet.is_some() {
                    worst.offer(frame, estimate, result);
                }
                if self.arguments.figure.is_some() {
                    chosen.offer(frame, estimate, result);
                }
                bar.inc(1);
            },
        )?;
        bar.finish_and_clear();
        match unreadable {
            Some(error) => Err(error),
            None => Ok((
                EvaluationReport::new(self.name, None, &set.name, &evaluation, self.device),
                worst,
                chosen,
            )),
        }
    }

    /// A row for each stage of the network.
    fn ablation(&self, set: FrameSet) -> Result<Vec<EvaluationReport>> {
        let bar = progress::counting(set.count, "frames");
        let mut unreadable = None;
        let frames = set
            .frames
            .map_while(|frame| frame.map_err(|error| unreadable = Some(error)).ok());
        let stages = Evaluation::ablation(self.estimator, self.bundle.template(), frames, || bar.inc(1))?;
        bar.finish_and_clear();
        if let Some(error) = unreadable {
            return Err(error);
        }
        let report =
            |(stage, evaluation)| EvaluationReport::new(self.name, Some(stage), &set.name, &evaluation, self.device);
        Ok(stages.into_iter().map(report).collect())
    }
}
