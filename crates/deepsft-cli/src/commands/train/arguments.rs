//! The arguments of `deepsft train`, and its help.

use crate::network_choice::NetworkChoice;
use crate::synthesis::SynthesisOptions;
use anyhow::Result;
use clap::{ArgGroup, Args, ValueEnum};
use deepsft::DeviceKind;
use deepsft_train::{Light, Precision, TrainConfig};
use std::path::PathBuf;

#[derive(Args)]
#[command(
    group = ArgGroup::new("budget").args(["minutes", "samples"]),
    group = ArgGroup::new("start").args(["template", "model"]).required(true),
    after_help = "\
The paper's three steps (section 4):
  1  all blocks, on synthetic images made on the fly, which needs nothing but the template, or on data sets (--data)
  2  the depth refinement block alone, against the depth that an RGB-D camera measured
  3  the registration refinement block alone, by photo-consistency: the template, seen through the registration, is to
     look like the colour pictures. Nobody has to label anything
Steps 2 and 3 need --recording, and --model when step 1 is not among them; what they do not train stays bit for bit as
it is. Their end is held out: what it says before and after is printed, and kept with the curves in the bundle.

Step 1: ten minutes on two cores show that it works, an hour or more makes a model that is worth using. Before it, and
every two minutes, the model is measured on held-out images and a checkpoint is saved to BUNDLE.checkpoint, beside the bundle; steps
2 and 3 save BUNDLE.step-2.checkpoint and BUNDLE.step-3.checkpoint after every epoch. The bundle is written at the end. A
training that was stopped, in whatever way, goes on with --resume; one that has ended goes on with --resume and a larger
budget. A step that goes on changes the network that later steps of the same command had started from: they begin anew,
and their checkpoints are kept beside with the ending .outdated, .outdated-2 and so on. --resume may use another --devices
or --precision; the result is then not exactly what it would have been. Files and folders of other kinds in BUNDLE (a
poster to print) are kept.

--data DIR trains step 1 on data sets that `deepsft synth` wrote, instead of new images: where images are dear to make or
several trainings are to see the same ones. All samples come once an epoch, in another order each time; windows are cut
anew. Their end is never trained on but measured on: the last tenth of all samples, at most 48. Samples are read when they
are wanted, so sets may be larger than memory. The accuracy on the card, and from when on the object counts as found, are
measured on images made on the fly all the same: --images, --camera-effects and --backgrounds then choose those alone.

--preset paper takes the paper's optimisers, learning rates, batches and epochs, and in steps 2 and 3 its losses, as means
over pixels where it prints sums, depths in decimetres: with these its learning rates learn. It does not choose the network, whose loss in step 1 goes with it (compact: ours, smooth
L1 and bins), nor the images: the paper's are --network paper and --images paper. --preset ours is what was measured to
work on the compact network in the time of a CPU.

--network paper and r50f learn by the paper's loss, as a mean, on full-resolution maps of whole frames. In full width they
are for a large GPU: `deepsft network describe paper` lists what they cost. --width-divisor 8 or 16 makes
narrow ones (ours, not the paper's) that a CPU can train to see that everything works.

--devices N gives each of N devices a part of every batch, in a thread of its own; gradients are summed on the first.
The loss is that of the whole batch; batch normalisation (paper, r50f) sees each part alone. On the cpu a device is a
thread. --precision f16 or bf16 is mixed precision: layers in half precision; weights, optimiser, batch normalisation
and loss in single precision. f16 scales the loss: steps that overflow are told, not made, and halve the scale. On the
cpu both cost time; prefer bf16 there.

Examples:
  deepsft train --template cover --out cover-model --minutes 60
  deepsft train --template cover --out cover-model --minutes 180 --resume
  deepsft synth --template cover --count 5000 --seed 5 --images paper --out cover-data
  deepsft train --template cover --data cover-data --images paper --out cover-model --minutes 60
  deepsft train --steps 2,3 --model cover-model --recording recording --out cover-refined
  deepsft train --steps 2,3 --model cover-model --recording recording --total-variation 0 --out cover-without-tv
  deepsft train --network paper --width-divisor 16 --images paper --template cover --out cover-narrow --minutes 60
  deepsft train --network paper --images paper --template cover --out cover-paper --device vulkan
  deepsft train --steps 1,2,3 --template cover --recording recording --minutes 60 --out cover-model"
)]
pub struct TrainArguments {
    /// Folder of the template, for step 1
    #[arg(long, value_name = "DIR")]
    pub template: Option<PathBuf>,
    /// Folder of a trained model bundle, to go on with steps 2 and 3
    #[arg(long, value_name = "BUNDLE")]
    pub model: Option<PathBuf>,
    /// Folder of the model bundle to write
    #[arg(long, value_name = "BUNDLE")]
    pub out: PathBuf,
    /// Train step 1 on this data set (as `deepsft synth` writes), not on images made on the fly; may be given several times
    #[arg(long, value_name = "DIR")]
    pub data: Vec<PathBuf>,
    /// Steps to train, in their order
    #[arg(long, aliases = ["stages", "stage"], value_name = "1,2,3", value_delimiter = ',', default_value = "1",
          value_parser = clap::value_parser!(u8).range(1..=3))]
    pub steps: Vec<u8>,
    /// Folder of the RGB-D recording for steps 2 and 3 (its layout: `deepsft recording simulate --help`)
    #[arg(long, value_name = "DIR")]
    pub recording: Option<PathBuf>,
    /// Whose settings to train with [default: paper with --network paper, else ours]
    #[arg(long, value_name = "PRESET", value_enum)]
    pub preset: Option<Preset>,
    /// Network that step 1 trains
    #[arg(long, value_name = "NETWORK", value_enum, default_value_t = NetworkChoice::Compact, conflicts_with = "model")]
    pub network: NetworkChoice,
    /// Divide the widths of --network paper or r50f by this; time and memory go with its square
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    pub width_divisor: u16,
    /// Minutes of step 1 in all, resumed ones included [default: 60, with the paper's preset its samples]
    #[arg(long, value_name = "M", value_parser = positive)]
    pub minutes: Option<f64>,
    /// Training samples of step 1 in all, instead of minutes; repeatable on the CPU [default with the paper's preset: 1880000, or 40 times what --data has]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub samples: Option<u64>,
    /// Epochs of steps 2 and 3 [default: 10]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub epochs: Option<u64>,
    /// Weight of the squared total variation in the losses of steps 2 and 3, the lambda of the paper; 0 trains without [default: 1e-9]
    #[arg(long, value_name = "LAMBDA", value_parser = weight)]
    pub total_variation: Option<f64>,
    /// What step 3 does about light and colours before it compares [default: recorded; with the paper's preset ignored]
    #[arg(long, value_name = "LIGHT", value_enum)]
    pub light: Option<LightChoice>,
    /// Fraction of the recording, its end, that steps 2 and 3 are measured on and not trained on
    #[arg(long, value_name = "FRACTION", default_value_t = TrainConfig::ours().held_out_fraction, value_parser = fraction)]
    pub held_out: f64,
    /// Seconds of step 1 between two measurements, each of which saves a checkpoint
    #[arg(long, value_name = "SECONDS", default_value_t = TrainConfig::ours().evaluate_every, value_parser = positive)]
    pub evaluate_every: f64,
    /// Go on from the checkpoints beside the bundle
    #[arg(long)]
    pub resume: bool,
    /// Seed of the weights, of the training images and of the order of recorded frames
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
    /// What computes: cpu, or vulkan or cuda if the program was built with it
    #[arg(long, value_name = "DEVICE", default_value_t = DeviceKind::Cpu)]
    pub device: DeviceKind,
    /// Devices of that kind among which each batch is divided; on the cpu threads
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    pub devices: u16,
    /// What the network's layers compute in (beyond the paper): f32, f16 or bf16 where the device has it
    #[arg(long, value_name = "PRECISION", default_value_t = Precision::F32)]
    pub precision: Precision,
    #[command(flatten)]
    pub images: SynthesisOptions,
    /// Name of the model for people [default: the name of BUNDLE]
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
}

impl TrainArguments {
    /// The preset that was asked for, or the one that belongs to the network.
    pub fn preset(&self) -> Preset {
        self.preset.unwrap_or(match self.network {
            NetworkChoice::Paper => Preset::Paper,
            NetworkChoice::Compact | NetworkChoice::R50f => Preset::Ours,
        })
    }
}

/// Whose settings a training has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// Beyond the paper: AdamW, warm-up and cosine, averaged weights, windows; AdamW in steps 2 and 3
    Ours,
    /// The paper's optimisers, rates, batches, epochs; its losses in steps 2 and 3, as means
    Paper,
}

/// What step 3 does about light and colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LightChoice {
    /// Nothing, as the paper: for a template in the colours of the camera that recorded
    Ignored,
    /// The template in the camera's colours: a gain and an offset per colour, found once for the recording
    Recorded,
    /// A gain and an offset fitted to each image and colour
    Fitted,
}

impl From<LightChoice> for Light {
    fn from(choice: LightChoice) -> Self {
        match choice {
            LightChoice::Ignored => Self::Ignored,
            LightChoice::Recorded => Self::Recorded,
            LightChoice::Fitted => Self::Fitted,
        }
    }
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

fn fraction(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|value: &f64| (0.01..=0.99).contains(value))
        .ok_or("expected a fraction of 0.01 to 0.99".into())
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// Arguments of a training of step 1, as the command line gives them without options.
    pub fn arguments(out: &str) -> TrainArguments {
        TrainArguments {
            template: Some("t".into()),
            model: None,
            out: out.into(),
            data: Vec::new(),
            steps: vec![1],
            recording: None,
            preset: None,
            network: NetworkChoice::Compact,
            width_divisor: 1,
            minutes: None,
            samples: None,
            epochs: None,
            total_variation: None,
            light: None,
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
    fn minutes_are_positive_numbers() {
        assert_eq!(positive("0.5"), Ok(0.5));
        for text in ["0", "-1", "NaN", "inf", "ten"] {
            assert!(positive(text).is_err(), "{text}");
        }
    }

    #[test]
    fn weights_of_losses_are_not_negative() {
        assert_eq!(weight("0"), Ok(0.0));
        assert!(weight("-1").is_err() && weight("inf").is_err());
    }
}
