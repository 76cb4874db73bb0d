//! What a training is to do, checked: its steps, its settings, and where their checkpoints lie.

use super::arguments::{Preset, TrainArguments};
use crate::failure::usage;
use crate::network_choice::NetworkChoice;
use anyhow::Result;
use deepsft_train::{ACCURACY_SEED, Budget, TrainConfig, TuningStep};
use std::path::{Path, PathBuf};

/// The steps to make, checked.
pub struct Plan<'a> {
    pub arguments: &'a TrainArguments,
    pub config: TrainConfig,
    pub synthetic: bool,
    pub steps: Vec<TuningStep>,
}

impl<'a> Plan<'a> {
    pub fn new(arguments: &'a TrainArguments) -> Result<Self> {
        let numbers = &arguments.steps;
        let synthetic = numbers.contains(&1);
        let steps: Vec<TuningStep> = [TuningStep::Depth, TuningStep::Registration]
            .into_iter()
            .filter(|step| numbers.contains(&step.number()))
            .collect();
        let (tuned, from) = (!steps.is_empty(), arguments.from.is_some());
        let reason = if numbers.windows(2).any(|pair| pair[0] >= pair[1]) {
            "--steps are to be in their order, each once"
        } else if synthetic && arguments.template.is_none() {
            "step 1 starts from --template"
        } else if !synthetic && arguments.template.is_some() {
            "steps 2 and 3 start from --model"
        } else if !synthetic && !arguments.data.is_empty() {
            "--data is for step 1; steps 2 and 3 take --recording"
        } else if !synthetic && from {
            "--from is for step 1; steps 2 and 3 start from --model"
        } else if from && arguments.network != NetworkChoice::Compact {
            "--from begins with a trunk of the compact network: leave --network away"
        } else if synthetic && tuned && arguments.network == NetworkChoice::R50f {
            "steps 2 and 3 train refinement blocks: --network r50f has none"
        } else if !tuned && arguments.recording.is_some() {
            "--recording is for steps 2 and 3: add them to --steps"
        } else if tuned && arguments.recording.is_none() {
            "steps 2 and 3 need --recording"
        } else {
            let config = config(arguments)?;
            return Ok(Self {
                arguments,
                config,
                synthetic,
                steps,
            });
        };
        Err(usage(reason))
    }

    /// Takes in that data sets have so many samples to train on: they are what the paper's epochs are made of.
    pub fn take_training_samples(&mut self, samples: u64) {
        let arguments = self.arguments;
        if arguments.preset() == Preset::Paper && arguments.samples.is_none() && arguments.minutes.is_none() {
            self.config.budget = Budget::paper_epochs(samples);
        }
    }

    /// The checkpoint of a step on a recording.
    pub fn checkpoint(&self, step: TuningStep) -> PathBuf {
        beside(&self.arguments.out, &format!(".step-{}.checkpoint", step.number()))
    }

    /// Epochs of a step on a recording.
    pub fn epochs(&self, step: TuningStep) -> u64 {
        match step {
            TuningStep::Depth => self.config.depth_tuning.epochs,
            TuningStep::Registration => self.config.registration_tuning.epochs,
        }
    }

    /// Whether the checkpoint of a step on a recording may have begun with a network that is gone, because a step before
    /// it, which is part of this training, has gone on. Of the first step it is not so: another --model is another
    /// training.
    pub fn may_be_outdated(&self, step: TuningStep) -> bool {
        let earlier = |other: &TuningStep| other.number() < step.number();
        self.config.resume && (self.synthetic || self.steps.iter().any(earlier))
    }

    /// The checkpoints of all steps.
    pub fn checkpoints(&self) -> Vec<PathBuf> {
        let first = self.synthetic.then(|| self.config.checkpoint.clone());
        first
            .into_iter()
            .chain(self.steps.iter().map(|&step| self.checkpoint(step)))
            .collect()
    }
}

/// The path beside `path` with the same name and an ending.
fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(ending);
    path.with_file_name(name)
}

fn config(arguments: &TrainArguments) -> Result<TrainConfig> {
    let defaults = match arguments.preset() {
        Preset::Ours => TrainConfig::ours(),
        Preset::Paper => TrainConfig::paper(),
    };
    if [defaults.held_out_seed, ACCURACY_SEED].contains(&arguments.seed) {
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
        from: arguments.from.clone(),
        evaluate_every: arguments.evaluate_every,
        accuracy_frames: arguments.accuracy_frames,
        checkpoint: beside(&arguments.out, ".checkpoint"),
        held_out_fraction: arguments.held_out,
        ..defaults
    };
    if let Some(epochs) = arguments.epochs {
        config.depth_tuning.epochs = epochs;
        config.registration_tuning.epochs = epochs;
    }
    if let Some(lambda) = arguments.total_variation {
        config.depth_loss.total_variation = lambda;
        config.photo_consistency.total_variation = lambda;
    }
    if let Some(light) = arguments.light {
        config.photo_consistency.light = light;
    }
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Args, FromArgMatches};
    use deepsft_train::Light;

    /// The arguments of `deepsft train` with a command line of these words.
    fn arguments(words: &str) -> TrainArguments {
        let command = TrainArguments::augment_args(clap::Command::new("train"));
        let matches = command.try_get_matches_from(["train"].into_iter().chain(words.split_whitespace()));
        TrainArguments::from_arg_matches(&matches.unwrap()).unwrap()
    }

    /// The settings of a training of step 1 with these words more.
    fn settings(words: &str) -> TrainConfig {
        config(&arguments(&format!("--template t --out a {words}"))).unwrap()
    }

    #[test]
    fn checkpoints_lie_beside_the_bundle() {
        for out in ["models/cover", "models/cover/"] {
            let config = config(&arguments(&format!("--template t --out {out}"))).unwrap();
            assert_eq!(config.checkpoint, Path::new("models/cover.checkpoint"));
            assert_eq!(config.budget, Budget::Seconds(3600.0));
        }
        assert!(config(&arguments("--template t --out ..")).is_err());
        let all = arguments("--template t --steps 1,2,3 --recording r --out models/cover");
        let names = ["cover.checkpoint", "cover.step-2.checkpoint", "cover.step-3.checkpoint"];
        let expected: Vec<PathBuf> = names.iter().map(|name| Path::new("models").join(name)).collect();
        assert_eq!(Plan::new(&all).unwrap().checkpoints(), expected);
    }

    #[test]
    fn the_first_step_of_a_training_does_not_become_outdated() {
        use TuningStep::{Depth, Registration};
        for (words, outdated) in [
            ("--template t --steps 1,2,3 --resume", &[Depth, Registration][..]),
            ("--template t --steps 1,2,3", &[]),
            ("--template t --steps 1,3 --resume", &[Registration]),
            ("--model m --steps 2,3 --resume", &[Registration]),
            ("--model m --steps 3 --resume", &[]),
        ] {
            let arguments = arguments(&format!("{words} --recording r --out a"));
            let plan = Plan::new(&arguments).unwrap();
            let found: Vec<_> = (plan.steps.iter().copied())
                .filter(|&step| plan.may_be_outdated(step))
                .collect();
            assert_eq!(found, outdated, "{words}");
        }
    }

    #[test]
    fn options_that_do_not_belong_together_are_refused() {
        let held_out = TrainConfig::ours().held_out_seed;
        for (words, part) in [
            ("--template t --steps 2,1", "in their order"),
            ("--template t --steps 2", "--model"),
            ("--template t --steps 1,2", "need --recording"),
            ("--template t --steps 1,2 --network r50f", "r50f has none"),
            ("--template t --recording r", "add them to --steps"),
            ("--model m --steps 2 --recording r --data d", "--data is for step 1"),
            ("--model m --steps 2 --recording r --from f", "--from is for step 1"),
            ("--template t --network r50f --from f", "the compact network"),
            (&format!("--template t --seed {held_out}"), "held-out"),
            (&format!("--template t --seed {ACCURACY_SEED}"), "held-out"),
        ] {
            let arguments = arguments(&format!("{words} --out a"));
            let message = Plan::new(&arguments).err().unwrap().to_string();
            assert!(message.contains(part), "{words}: {message}");
        }
    }

    #[test]
    fn the_papers_preset_ends_after_the_papers_epochs() {
        let config = settings("--preset paper --epochs 3");
        assert_eq!(config.budget, Budget::Samples(40 * 47_000));
        assert_eq!((config.depth_tuning.epochs, config.registration_tuning.epochs), (3, 3));
        assert_eq!((config.depth_tuning.batch, config.registration_tuning.batch), (7, 6));
    }

    #[test]
    fn the_papers_epochs_are_those_of_the_data_set_unless_a_budget_is_given() {
        for (words, budget) in [
            ("--preset paper", Budget::Samples(3600)),
            ("--preset paper --samples 7", Budget::Samples(7)),
            ("--preset paper --minutes 2", Budget::Seconds(120.0)),
            ("--preset ours", Budget::Seconds(3600.0)),
        ] {
            let arguments = arguments(&format!("--template t --data d --out a {words}"));
            let mut plan = Plan::new(&arguments).unwrap();
            plan.take_training_samples(90);
            assert_eq!(plan.config.budget, budget, "{words}");
        }
    }

    #[test]
    fn the_papers_network_has_the_papers_settings_unless_others_are_asked_for() {
        for (words, expected) in [
            ("", Preset::Ours),
            ("--network r50f", Preset::Ours),
            ("--network paper", Preset::Paper),
            ("--network paper --preset ours", Preset::Ours),
            ("--preset paper", Preset::Paper),
        ] {
            let arguments = arguments(&format!("--template t --out a {words}"));
            assert_eq!(arguments.preset(), expected, "{words}");
        }
    }

    #[test]
    fn light_and_the_weight_of_the_total_variation_are_as_the_preset_has_them_unless_they_are_asked_for() {
        for (words, light, lambda) in [
            ("", Light::Recorded, 1e-9),
            ("--preset paper", Light::Ignored, 1e-9),
            (
                "--preset paper --light recorded --total-variation 0",
                Light::Recorded,
                0.0,
            ),
            ("--light ignored --total-variation 1e-6", Light::Ignored, 1e-6),
        ] {
            let config = settings(words);
            assert_eq!(config.photo_consistency.light, light, "{words}");
            let weights = [
                config.depth_loss.total_variation,
                config.photo_consistency.total_variation,
            ];
            assert_eq!(weights, [lambda; 2], "{words}");
        }
    }

    #[test]
    fn weights_of_losses_are_not_negative() {
        for weight in ["-1", "inf"] {
            let command = TrainArguments::augment_args(clap::Command::new("train"));
            let words = ["train", "--template", "t", "--out", "a"].map(str::to_owned);
            let words = words.into_iter().chain([format!("--total-variation={weight}")]);
            let refusal = command.try_get_matches_from(words).unwrap_err().to_string();
            assert!(refusal.contains("expected a number of 0 or more"), "{refusal}");
        }
    }
}
