//! The arguments of `deepsft train`, and its help.

use crate::network_choice::NetworkChoice;
use crate::numbers::{positive, within};
use crate::synthesis::SynthesisOptions;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{ArgGroup, Args, ValueEnum};
use deepsft::DeviceKind;
use deepsft_train::{Light, TrainConfig};
use std::path::PathBuf;

#[derive(Args)]
#[command(
    group = ArgGroup::new("budget").args(["minutes", "samples"]),
    group = ArgGroup::new("start").args(["template", "model"]).required(true),
    after_help = "\
The paper trains in three steps (section 4):
  1  All blocks, on synthetic images. The command makes them on the fly and needs nothing but the template; --data takes
     data sets instead.
  2  The depth refinement block alone, on the depth that an RGB-D camera measured.
  3  The registration refinement block alone, by photo-consistency: the template, drawn through the registration, has to
     look like the colour pictures. Nobody has to label anything.
Steps 2 and 3 need --recording, and --model unless step 1 comes before them. They change nothing but their own block. The
end of the recording is held out: the command prints the errors there before and after, and keeps them with the curves in
the bundle.

Ten minutes of step 1 on two cores show that it works. A model that is worth using takes an hour or more. At the start and
every two minutes, the command measures the model on held-out images and saves a checkpoint to BUNDLE.checkpoint. Steps 2
and 3 save BUNDLE.step-2.checkpoint and BUNDLE.step-3.checkpoint after every epoch. The bundle is written at the end.
Files in BUNDLE that belong to no bundle (a poster to print) stay.

--resume continues a training that was stopped in any way. With a larger budget it continues one that has ended. A step
that continues changes the network that later steps of the same command had started from. Those steps begin anew, and their
old checkpoints get the ending .outdated, .outdated-2 and so on.

--from DIR reads DIR/weights.bpk and takes the trunk of the network over: the layers that see edges and shapes, of
models/any-picture or of any model bundle with the compact network. What reads positions of your template off them starts
at random, as always. Name the same DIR with --resume; the checkpoint goes on, and DIR is not taken over again.

--data DIR trains step 1 on data sets of `deepsft synth`. Use it where images are slow to make, or where several trainings
have to see the same ones. An epoch takes every sample once, in a new order and with new windows. The last tenth of all
samples, at most 48, is held out to measure on. The command first compares each shard with the hash in dataset.json. Later
it reads a sample when it needs it, so sets may be larger than memory. The accuracy on the card, and the confidence from
which on the object counts as found, are always measured on images made on the fly. With --data, the options --images,
--camera-effects and --backgrounds choose only those.

--preset paper has the paper's optimisers, learning rates, batches and epochs, and its losses in steps 2 and 3. There we
take means over pixels where the paper prints sums. We measure depths in decimetres, since the paper's learning rates work
with them. The preset chooses neither network nor images; the paper's are --network paper and --images paper. The loss of
step 1 belongs to the network (compact: ours, smooth L1 and bins). --preset ours has settings that work for the compact
network in the time of a CPU.

--network paper and r50f learn by the paper's loss, as a mean, on full-resolution maps of whole frames. In full width they
are for a large GPU: `deepsft network describe paper` lists what they cost. --width-divisor 8 or 16 makes narrow ones (ours,
not the paper's). A CPU can train those to see that everything works.

Examples:
  deepsft train --template cover --out cover-model --minutes 60
  deepsft train --template cover --out cover-model --minutes 180 --resume
  deepsft train --template cover --from models/any-picture --out cover-model --minutes 60
  deepsft synth --template cover --count 5000 --seed 5 --images paper --out cover-data
  deepsft train --template cover --data cover-data --images paper --out cover-model --minutes 60
  deepsft train --steps 2,3 --model cover-model --recording recording --out cover-tuned
  deepsft train --steps 2,3 --model cover-model --recording recording --total-variation 0 --out cover-without-tv
  deepsft train --network paper --width-divisor 16 --images paper --template cover --out cover-narrow --minutes 60
  deepsft train --network paper --images paper --template cover --out cover-paper --device vulkan
  deepsft train --steps 1,2,3 --template cover --recording recording --minutes 60 --out cover-model"
)]
pub struct TrainArguments {
    /// Folder of the template, for step 1
    #[arg(long, value_name = "DIR")]
    pub template: Option<PathBuf>,
    /// Folder of a trained model bundle, which steps 2 and 3 start from
    #[arg(long, value_name = "BUNDLE")]
    pub model: Option<PathBuf>,
    /// Begin step 1 with the trunk of a trained compact network, not with random weights: models/any-picture, or a bundle
    #[arg(long, value_name = "DIR")]
    pub from: Option<PathBuf>,
    /// Folder of the model bundle to write
    #[arg(long, value_name = "BUNDLE")]
    pub out: PathBuf,
    /// Train step 1 on this data set of `deepsft synth`, not on images made on the fly; may be given several times
    #[arg(long, value_name = "DIR")]
    pub data: Vec<PathBuf>,
    /// Steps to train, in their order
    #[arg(long, value_name = "1,2,3", value_delimiter = ',', default_value = "1",
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
    /// Divide the widths of --network paper or r50f by this; time and memory fall with its square
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    pub width_divisor: u16,
    /// Minutes of step 1 in all, with those before --resume [default: 60; the paper's preset counts samples]
    #[arg(long, value_name = "M", value_parser = positive)]
    pub minutes: Option<f64>,
    /// Training samples of step 1 in all, instead of minutes; repeatable on the CPU [default with the paper's preset: 1880000, or 40 times what --data has]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub samples: Option<u64>,
    /// Epochs of steps 2 and 3 [default: 10]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub epochs: Option<u64>,
    /// Weight of the squared total variation in the losses of steps 2 and 3, the lambda of the paper; 0 trains without [default: 1e-9]
    #[arg(long, value_name = "LAMBDA", value_parser = |weight: &str| within(0.0..=f64::MAX, "a number of 0 or more", weight))]
    pub total_variation: Option<f64>,
    /// What step 3 does about light and colours before it compares [default: recorded; with the paper's preset ignored]
    #[arg(long, value_name = "LIGHT", value_parser = light())]
    pub light: Option<Light>,
    /// Fraction of the recording, at its end, that steps 2 and 3 do not train on but measure on
    #[arg(long, value_name = "FRACTION", default_value_t = TrainConfig::ours().held_out_fraction, value_parser = |fraction: &str| within(0.01..=0.99, "a fraction of 0.01 to 0.99", fraction))]
    pub held_out: f64,
    /// Seconds of step 1 between two measurements, each of which saves a checkpoint
    #[arg(long, value_name = "SECONDS", default_value_t = TrainConfig::ours().evaluate_every, value_parser = positive)]
    pub evaluate_every: f64,
    /// Frames that step 1 measures the finished model on: the accuracy on its card, and the confidence from which on the object
    /// counts as found
    #[arg(long, value_name = "N", default_value_t = TrainConfig::ours().accuracy_frames, value_parser = clap::value_parser!(u64).range(1..))]
    pub accuracy_frames: u64,
    /// Continue from the checkpoints beside the bundle
    #[arg(long)]
    pub resume: bool,
    /// Seed of the weights, of the training images and of the order of recorded frames
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
    /// What computes: cpu, or vulkan or cuda if the program was built with it
    #[arg(long, value_name = "DEVICE", default_value_t = DeviceKind::Cpu)]
    pub device: DeviceKind,
    #[command(flatten)]
    pub images: SynthesisOptions,
    /// Name of the model for people [default: the name of BUNDLE]
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
    /// Licence of the model that step 1 makes, an SPDX expression such as CC-BY-4.0 [default: none stated]
    #[arg(long, value_name = "SPDX", conflicts_with = "model")]
    pub licence: Option<String>,
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

/// What step 3 does about light and colours, by name.
fn light() -> impl TypedValueParser<Value = Light> {
    let names = [
        PossibleValue::new("ignored")
            .help("Nothing, as the paper: for a template in the colours of the camera that recorded"),
        PossibleValue::new("recorded").help(
            "The template in the camera's colours: a gain and an offset per colour, found once for the recording",
        ),
    ];
    PossibleValuesParser::new(names).map(|name| match name.as_str() {
        "ignored" => Light::Ignored,
        _ => Light::Recorded,
    })
}
