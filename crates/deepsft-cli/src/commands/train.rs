//! `deepsft train`: a model bundle for a template.

mod bundle_folder;
mod progress_lines;
mod recording_steps;

use crate::failure::usage;
use crate::network_choice::NetworkChoice;
use crate::output::{atomic, curve_plot, model_card};
use crate::synthesis::SynthesisOptions;
use crate::{input, progress, synthesis};
use anyhow::{Result, bail};
use bundle_folder::{MARKERS, companions, file_name};
use clap::{ArgGroup, Args, ValueEnum};
use deepsft::{DeviceDescription, DeviceKind, ModelBundle, encode_png, start_devices};
use deepsft_synth::Synthesizer;
use deepsft_train::{
    Budget, Checkpoint, CurvePoint, Device, Precision, RefinementStep, TrainConfig, Trained, export_bundle, train,
};
use progress_lines::tell;
use recording_steps::RefinedBundle;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[derive(Args)]
#[command(
    group = ArgGroup::new("budget").args(["minutes", "samples"]),
    group = ArgGroup::new("start").args(["template", "model"]).required(true),
    after_help = "\
The paper's three steps (section 4):
  1  all blocks, on synthetic images made on the fly; needs nothing but the template
  2  the depth refinement block alone, against the depth that an RGB-D camera measured
  3  the registration refinement block alone, by photo-consistency: the template, seen through the registration, is to
     look like the colour pictures. Nobody has to label anything
Steps 2 and 3 need --recording, and --model when step 1 is not among them; what they do not train stays bit for bit as
it is. Their end is held out: what it says before and after is printed, and kept with the curves in the bundle.

Step 1: ten minutes on two cores show that it works, an hour or more makes a model that is worth using. Every two
minutes the model is measured on held-out images and a checkpoint is saved to BUNDLE.checkpoint, beside the bundle; steps
2 and 3 save BUNDLE.step-2.checkpoint and BUNDLE.step-3.checkpoint after every epoch. The bundle is written at the end. A
training that was stopped, in whatever way, goes on with --resume; one that has ended goes on with --resume and a larger
budget. Files and folders of other kinds in BUNDLE (a poster to print) are kept.

--preset paper takes the paper's optimisers, learning rates, batches, epochs and losses; the default, ours, is what was
measured to work on the compact network in the time of a CPU.

--network paper and r50f learn by the paper's loss on full-resolution maps of whole frames. In full width they are for
a large GPU: `deepsft network describe paper --time` tells what they cost here. --width-divisor 8 or 16 makes narrow
ones (ours, not the paper's) that a CPU can train to see that everything works.

--devices N gives each of N devices a share of every batch, in a thread of its own; gradients are summed on the first.
The loss is that of the whole batch; batch normalisation (paper, r50f) sees each share alone. On the cpu a device is a
thread. --precision f16 or bf16 is mixed precision: layers in half precision; weights, optimiser, batch normalisation
and loss in single precision. f16 scales the loss: steps that overflow are told, not made, and halve the scale.

Examples:
  deepsft train --template cover --out cover-model --minutes 60
  deepsft train --template cover --out cover-model --minutes 180 --resume
  deepsft train --stages 2,3 --model cover-model --recording recording --out cover-refined
  deepsft train --stages 2,3 --model cover-model --recording recording --total-variation 0 --out cover-without-tv
  deepsft train --network paper --preset paper --template cover --out cover-paper --device vulkan
  deepsft train --stages 1,2,3 --template cover --recording recording --minutes 60 --out cover-model"
)]
pub struct TrainArguments {
    /// Folder of the template, for step 1
    #[arg(long, value_name = "DIR")]
    template: Option<PathBuf>,
    /// Folder of a trained model bundle, to go on with steps 2 and 3
    #[arg(long, value_name = "BUNDLE")]
    model: Option<PathBuf>,
    /// Folder of the model bundle to write
    #[arg(long, value_name = "BUNDLE")]
    out: PathBuf,
    /// Steps to train, in their order
    #[arg(long, alias = "stage", value_name = "1,2,3", value_delimiter = ',', default_value = "1",
          value_parser = clap::value_parser!(u8).range(1..=3))]
    stages: Vec<u8>,
    /// Folder of the RGB-D recording for steps 2 and 3 (its layout: `deepsft recording simulate --help`)
    #[arg(long, value_name = "DIR")]
    recording: Option<PathBuf>,
    /// Whose settings to train with
    #[arg(long, value_name = "PRESET", value_enum, default_value_t = Preset::Ours)]
    preset: Preset,
    /// Network that step 1 trains
    #[arg(long, value_name = "NETWORK", value_enum, default_value_t = NetworkChoice::Compact)]
    network: NetworkChoice,
    /// Divide the widths of --network paper or r50f by this; time and memory go with its square
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    width_divisor: u16,
    /// Minutes of step 1 in all, resumed ones included [default: 60]
    #[arg(long, value_name = "M", value_parser = positive)]
    minutes: Option<f64>,
    /// Training samples of step 1 in all, instead of minutes; repeatable on the CPU [default of --preset paper: 1880000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    samples: Option<u64>,
    /// Epochs of steps 2 and 3 [default: 10]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    epochs: Option<u64>,
    /// Weight of the squared total variation in the losses of steps 2 and 3, the lambda of the paper; 0 trains without [default: 1e-9]
    #[arg(long, value_name = "LAMBDA", value_parser = weight)]
    total_variation: Option<f64>,
    /// Share of the recording, its end, that steps 2 and 3 are measured on and not trained on
    #[arg(long, value_name = "SHARE", default_value_t = TrainConfig::default().held_out_share, value_parser = share)]
    held_out: f64,
    /// Seconds of step 1 between two measurements, each of which saves a checkpoint
    #[arg(long, value_name = "SECONDS", default_value_t = TrainConfig::default().evaluate_every, value_parser = positive)]
    evaluate_every: f64,
    /// Go on from the checkpoints beside the bundle
    #[arg(long)]
    resume: bool,
    /// Seed of the weights, of the training images and of the order of recorded frames
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// What computes: cpu, or vulkan or cuda if the program was built with it
    #[arg(long, value_name = "DEVICE", default_value_t = DeviceKind::Cpu)]
    device: DeviceKind,
    /// Devices of that kind that share each batch; on the cpu threads, each with its share
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    devices: u16,
    /// What the network's layers compute in (beyond the paper): f32, f16 or bf16 where the device has it
    #[arg(long, value_name = "PRECISION", default_value_t = Precision::F32)]
    precision: Precision,
    #[command(flatten)]
    images: SynthesisOptions,
    /// Name of the model for people [default: the name of BUNDLE]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
}

/// Whose settings a training has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Preset {
    /// Beyond the paper: AdamW, warm-up and cosine, averaged weights, windows; AdamW in steps 2 and 3
    Ours,
    /// The paper's values
    Paper,
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|&value: &f64| value.is_finite() && value > 0.0)
        .ok_or("expected a positive number".into())
}

fn weight(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|&value: &f64| value.is_finite() && value >= 0.0)
        .ok_or("expected a number of 0 or more".into())
}

fn share(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|value: &f64| (0.01..=0.99).contains(value))
        .ok_or("expected a share of 0.01 to 0.99".into())
}

pub fn run(arguments: &TrainArguments) -> Result<()> {
    let mut plan = Plan::new(arguments)?;
    atomic::check_folder(&arguments.out, &MARKERS)?;
    for checkpoint in plan.checkpoints() {
        if !arguments.resume && checkpoint.exists() {
            bail!(
                "there is a checkpoint of an earlier training: add --resume to go on with it, or remove it: {}",
                checkpoint.display()
            );
        }
    }
    let start = match (&arguments.template, &arguments.model) {
        (Some(folder), _) => Start::Template(input::template(folder)?),
        (None, Some(folder)) => Start::Bundle(Box::new(input::bundle(folder)?)),
        (None, None) => return Err(usage("--template or --model is needed")),
    };
    let template = match &start {
        Start::Template(template) => template.clone(),
        Start::Bundle(bundle) => bundle.template().clone(),
    };
    let (mut devices, description) = pollster::block_on(start_devices(arguments.device, arguments.devices.into()))?;
    devices
        .iter()
        .try_for_each(|device| arguments.precision.check(device))?;
    let device = devices.remove(0);
    plan.config.more_devices = devices;
    let synthesizer = Arc::new(synthesis::synthesizer(&template, &arguments.images)?);
    let sharing = match arguments.devices {
        1 => String::new(),
        count => format!(", each batch in {count} shares"),
    };
    let precision = match arguments.precision {
        Precision::F32 => String::new(),
        precision => format!(", in {precision}"),
    };
    println!(
        "training on {} ({}){sharing}{precision}",
        description.kind, description.adapter_name
    );
    let training = Training {
        arguments,
        plan: &plan,
        synthesizer,
        device,
        description,
    };
    let mut bundle = match start {
        Start::Template(_) => training.step_one()?,
        Start::Bundle(bundle) => *bundle,
    };
    if let Some(recording) = plan.recording {
        bundle = training.recording_steps(bundle, recording)?;
    }
    println!("model bundle: {} ({})", arguments.out.display(), bundle.name());
    Ok(())
}

/// What a training starts from.
enum Start {
    Template(deepsft_geometry::Template),
    Bundle(Box<ModelBundle>),
}

/// The steps to make, checked.
struct Plan<'a> {
    config: TrainConfig,
    synthetic: bool,
    steps: Vec<RefinementStep>,
    recording: Option<&'a Path>,
    out: &'a Path,
}

impl<'a> Plan<'a> {
    fn new(arguments: &'a TrainArguments) -> Result<Self> {
        let stages = &arguments.stages;
        if stages.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(usage("--stages are to be in their order, each once"));
        }
        let synthetic = stages.contains(&1);
        if synthetic != arguments.template.is_some() {
            return Err(usage(if synthetic {
                "step 1 starts from --template"
            } else {
                "steps 2 and 3 start from --model"
            }));
        }
        let steps: Vec<RefinementStep> = [RefinementStep::Depth, RefinementStep::Registration]
            .into_iter()
            .filter(|step| stages.contains(&step.number()))
            .collect();
        if steps.is_empty() == arguments.recording.is_some() {
            return Err(usage(if steps.is_empty() {
                "--recording is for steps 2 and 3: add them to --stages"
            } else {
                "steps 2 and 3 need --recording"
            }));
        }
        Ok(Self {
            config: config(arguments)?,
            synthetic,
            steps,
            recording: arguments.recording.as_deref(),
            out: &arguments.out,
        })
    }

    /// The checkpoint of a step on a recording.
    fn checkpoint(&self, step: RefinementStep) -> PathBuf {
        beside(self.out, &format!(".step-{}.checkpoint", step.number()))
    }

    fn checkpoints(&self) -> Vec<PathBuf> {
        let first = self.synthetic.then(|| self.config.checkpoint.clone());
        first
            .into_iter()
            .chain(self.steps.iter().map(|&step| self.checkpoint(step)))
            .collect()
    }
}

/// A training that runs.
struct Training<'a> {
    arguments: &'a TrainArguments,
    plan: &'a Plan<'a>,
    synthesizer: Arc<Synthesizer>,
    device: Device,
    description: DeviceDescription,
}

impl Training<'_> {
    /// Step 1: a bundle from nothing, written.
    fn step_one(&self) -> Result<ModelBundle> {
        let (template, config) = (self.synthesizer.template(), &self.plan.config);
        let mut network = self.arguments.network.config(
            self.arguments.width_divisor.into(),
            template.size_mm().to_array(),
            &self.synthesizer.config().camera,
        )?;
        if !template.is_sheet() {
            network = network.with_seams();
        }
        let bar = progress::share();
        let trained = train(&self.synthesizer, &network, config, &self.device, |told| {
            tell(&bar, told)
        })?;
        bar.finish_and_clear();
        let curve = trained.state.curve.clone();
        self.write(trained, &curve, None)
    }

    /// Steps 2 and 3: a bundle from another one, written.
    fn recording_steps(&self, bundle: ModelBundle, recording: &Path) -> Result<ModelBundle> {
        let plan = self.plan;
        let checkpoint = |step| plan.checkpoint(step);
        let refined = recording_steps::run(&bundle, recording, &plan.steps, &plan.config, checkpoint, &self.device)?;
        println!("\n{}", refined.table);
        let before = &bundle.card().provenance;
        let trained = Trained {
            network: refined.network.clone(),
            state: Checkpoint {
                samples: before.samples + refined.samples,
                seconds: before.seconds + refined.seconds,
                ..Checkpoint::default()
            },
        };
        self.write(trained, &[], Some(refined))
    }

    /// Measures a network on synthetic images, and writes its bundle.
    fn write(&self, trained: Trained, curve: &[CurvePoint], refined: Option<RefinedBundle>) -> Result<ModelBundle> {
        println!("measuring on held-out synthetic images");
        let arguments = self.arguments;
        let name = arguments
            .name
            .clone()
            .or_else(|| file_name(&arguments.out))
            .unwrap_or_default();
        let bundle = export_bundle(trained, &self.synthesizer, &self.plan.config, &name, &command_line())?;
        let mut extra = companions(&arguments.out)?;
        let table = refined.as_ref().map(|refined| refined.table.as_str());
        extra.insert(
            model_card::CARD_FILE.to_owned(),
            model_card::card(&bundle, &self.description, curve, table).into_bytes(),
        );
        if !curve.is_empty() {
            extra.insert(
                model_card::CURVE_FILE.to_owned(),
                model_card::curve_csv(curve).into_bytes(),
            );
        }
        if let Some(plot) = curve_plot::curve_plot(curve) {
            extra.insert(curve_plot::PLOT_FILE.to_owned(), encode_png(&plot)?);
        }
        extra.extend(refined.into_iter().flat_map(|refined| refined.files));
        extra.extend(bundle.to_files()?);
        atomic::write_folder(&arguments.out, &MARKERS, &extra)?;
        Ok(bundle)
    }
}

fn config(arguments: &TrainArguments) -> Result<TrainConfig> {
    let defaults = match arguments.preset {
        Preset::Ours => TrainConfig {
            budget: Budget::Seconds(3600.0),
            ..TrainConfig::default()
        },
        Preset::Paper => TrainConfig::paper(),
    };
    if arguments.seed == defaults.held_out_seed {
        return Err(usage(format!(
            "--seed {} is that of the held-out images: choose another one",
            arguments.seed
        )));
    }
    let budget = match (arguments.samples, arguments.minutes) {
        (Some(samples), _) => Budget::Samples(samples),
        (None, Some(minutes)) => Budget::Seconds(60.0 * minutes),
        (None, None) => defaults.budget,
    };
    if arguments.out.file_name().is_none() {
        return Err(usage(format!(
            "--out {} is not the name of a folder",
            arguments.out.display()
        )));
    }
    let mut config = TrainConfig {
        budget,
        seed: arguments.seed,
        resume: arguments.resume,
        evaluate_every: arguments.evaluate_every,
        checkpoint: beside(&arguments.out, ".checkpoint"),
        held_out_share: arguments.held_out,
        precision: arguments.precision,
        ..defaults
    };
    if let Some(epochs) = arguments.epochs {
        config.depth_steps.epochs = epochs;
        config.registration_steps.epochs = epochs;
    }
    if let Some(lambda) = arguments.total_variation {
        config.depth_loss.total_variation = lambda;
        config.photo_consistency.total_variation = lambda;
    }
    Ok(config)
}

/// The path beside `out` with the same name and an ending.
fn beside(out: &Path, ending: &str) -> PathBuf {
    let mut name: OsString = out.file_name().unwrap_or_default().to_os_string();
    name.push(ending);
    out.with_file_name(name)
}

/// The command as it was typed, for the record.
fn command_line() -> String {
    let words = std::env::args()
        .skip(1)
        .map(|word| if word.contains(' ') { format!("'{word}'") } else { word });
    std::iter::once("deepsft".to_owned())
        .chain(words)
        .collect::<Vec<_>>()
        .join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments(out: &str) -> TrainArguments {
        TrainArguments {
            template: Some("t".into()),
            model: None,
            out: out.into(),
            stages: vec![1],
            recording: None,
            preset: Preset::Ours,
            network: NetworkChoice::Compact,
            width_divisor: 1,
            minutes: None,
            samples: None,
            epochs: None,
            total_variation: None,
            held_out: 0.25,
            evaluate_every: 120.0,
            resume: false,
            seed: 1,
            device: DeviceKind::Cpu,
            devices: 1,
            precision: Precision::F32,
            images: SynthesisOptions::default(),
            name: None,
        }
    }

    #[test]
    fn checkpoints_lie_beside_the_bundle() {
        for out in ["models/cover", "models/cover/"] {
            let config = config(&arguments(out)).unwrap();
            assert_eq!(config.checkpoint, Path::new("models/cover.checkpoint"));
            assert_eq!(config.budget, Budget::Seconds(3600.0));
        }
        assert!(config(&arguments("..")).is_err());
        let all = TrainArguments {
            stages: vec![1, 2, 3],
            recording: Some("r".into()),
            ..arguments("models/cover")
        };
        let names = ["cover.checkpoint", "cover.step-2.checkpoint", "cover.step-3.checkpoint"];
        let expected: Vec<PathBuf> = names.iter().map(|name| Path::new("models").join(name)).collect();
        assert_eq!(Plan::new(&all).unwrap().checkpoints(), expected);
    }

    #[test]
    fn stages_and_what_they_need_belong_together() {
        let message = |arguments: TrainArguments| Plan::new(&arguments).err().unwrap().to_string();
        let steps = |stages: &[u8]| TrainArguments {
            stages: stages.to_vec(),
            ..arguments("a")
        };
        assert!(message(steps(&[2, 1])).contains("in their order"));
        assert!(message(steps(&[2])).contains("--model"));
        assert!(message(steps(&[1, 2])).contains("need --recording"));
        let mut unused = steps(&[1]);
        unused.recording = Some("r".into());
        assert!(message(unused).contains("add them to --stages"));
    }

    #[test]
    fn the_papers_preset_ends_after_the_papers_epochs() {
        let paper = TrainArguments {
            preset: Preset::Paper,
            epochs: Some(3),
            ..arguments("a")
        };
        let config = config(&paper).unwrap();
        assert_eq!(config.budget, Budget::Samples(40 * 47_000));
        assert_eq!((config.depth_steps.epochs, config.registration_steps.epochs), (3, 3));
        assert_eq!((config.depth_steps.batch, config.registration_steps.batch), (7, 6));
    }

    #[test]
    fn the_weight_of_the_total_variation_is_that_of_both_steps() {
        for (given, lambda) in [(None, 1e-9), (Some(0.0), 0.0), (Some(1e-6), 1e-6)] {
            let config = config(&TrainArguments {
                total_variation: given,
                ..arguments("a")
            });
            let config = config.unwrap();
            let weights = [
                config.depth_loss.total_variation,
                config.photo_consistency.total_variation,
            ];
            assert_eq!(weights, [lambda; 2]);
        }
        assert_eq!(weight("0"), Ok(0.0));
        assert!(weight("-1").is_err() && weight("inf").is_err());
    }

    #[test]
    fn the_seed_of_the_held_out_images_is_refused() {
        let held_out = TrainArguments {
            seed: TrainConfig::default().held_out_seed,
            ..arguments("a")
        };
        assert!(config(&held_out).unwrap_err().to_string().contains("held-out"));
    }

    #[test]
    fn minutes_are_positive_numbers() {
        assert_eq!(positive("0.5"), Ok(0.5));
        for text in ["0", "-1", "NaN", "inf", "ten"] {
            assert!(positive(text).is_err(), "{text}");
        }
    }
}
