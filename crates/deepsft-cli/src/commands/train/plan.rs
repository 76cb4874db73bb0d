//! What a training is to do, checked: its steps, its settings, and where their checkpoints lie.

use super::arguments::{Preset, TrainArguments};
use crate::failure::usage;
use crate::network_choice::NetworkChoice;
use anyhow::Result;
use deepsft_train::{ACCURACY_SEED, Budget, TrainConfig, TuningStep};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The steps to make, checked.
pub struct Plan<'a> {
    pub config: TrainConfig,
    pub synthetic: bool,
    pub steps: Vec<TuningStep>,
    pub recording: Option<&'a Path>,
    pub out: &'a Path,
}

impl<'a> Plan<'a> {
    pub fn new(arguments: &'a TrainArguments) -> Result<Self> {
        let numbers = &arguments.steps;
        if numbers.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(usage("--steps are to be in their order, each once"));
        }
        let synthetic = numbers.contains(&1);
        if synthetic != arguments.template.is_some() {
            return Err(usage(if synthetic {
                "step 1 starts from --template"
            } else {
                "steps 2 and 3 start from --model"
            }));
        }
        if !arguments.data.is_empty() && !synthetic {
            return Err(usage("--data is for step 1; steps 2 and 3 take --recording"));
        }
        let steps: Vec<TuningStep> = [TuningStep::Depth, TuningStep::Registration]
            .into_iter()
            .filter(|step| numbers.contains(&step.number()))
            .collect();
        if synthetic && !steps.is_empty() && arguments.network == NetworkChoice::R50f {
            return Err(usage("steps 2 and 3 train refinement blocks: --network r50f has none"));
        }
        if steps.is_empty() == arguments.recording.is_some() {
            return Err(usage(if steps.is_empty() {
                "--recording is for steps 2 and 3: add them to --steps"
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

    /// Takes in that data sets have so many samples to train on: they are what the paper's epochs are made of.
    pub fn take_training_samples(&mut self, arguments: &TrainArguments, samples: u64) {
        if arguments.preset() == Preset::Paper && arguments.samples.is_none() && arguments.minutes.is_none() {
            self.config.budget = Budget::paper_epochs(samples);
        }
    }

    /// The checkpoint of a step on a recording.
    pub fn checkpoint(&self, step: TuningStep) -> PathBuf {
        beside(self.out, &format!(".step-{}.checkpoint", step.number()))
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

fn config(arguments: &TrainArguments) -> Result<TrainConfig> {
    let defaults = match arguments.preset() {
        Preset::Ours => TrainConfig {
            budget: Budget::Seconds(3600.0),
            ..TrainConfig::ours()
        },
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
        evaluate_every: arguments.evaluate_every,
        checkpoint: beside(&arguments.out, ".checkpoint"),
        held_out_fraction: arguments.held_out,
        precision: arguments.precision,
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
        config.photo_consistency.light = light.into();
    }
    Ok(config)
}

/// The path beside `out` with the same name and an ending.
fn beside(out: &Path, ending: &str) -> PathBuf {
    let mut name: OsString = out.file_name().unwrap_or_default().to_os_string();
    name.push(ending);
    out.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::super::arguments::LightChoice;
    use super::super::arguments::tests::arguments;
    use super::*;
    use deepsft_train::Light;

    #[test]
    fn checkpoints_lie_beside_the_bundle() {
        for out in ["models/cover", "models/cover/"] {
            let config = config(&arguments(out)).unwrap();
            assert_eq!(config.checkpoint, Path::new("models/cover.checkpoint"));
            assert_eq!(config.budget, Budget::Seconds(3600.0));
        }
        assert!(config(&arguments("..")).is_err());
        let all = TrainArguments {
            steps: vec![1, 2, 3],
            recording: Some("r".into()),
            ..arguments("models/cover")
        };
        let names = ["cover.checkpoint", "cover.step-2.checkpoint", "cover.step-3.checkpoint"];
        let expected: Vec<PathBuf> = names.iter().map(|name| Path::new("models").join(name)).collect();
        assert_eq!(Plan::new(&all).unwrap().checkpoints(), expected);
    }

    #[test]
    fn the_first_step_of_a_training_does_not_become_outdated() {
        use TuningStep::{Depth, Registration};
        for (numbers, resume, outdated) in [
            (&[1, 2, 3][..], true, &[Depth, Registration][..]),
            (&[1, 2, 3], false, &[]),
            (&[1, 3], true, &[Registration]),
            (&[2, 3], true, &[Registration]),
            (&[3], true, &[]),
        ] {
            let arguments = TrainArguments {
                steps: numbers.to_vec(),
                template: numbers.contains(&1).then(|| "t".into()),
                recording: Some("r".into()),
                resume,
                ..arguments("a")
            };
            let plan = Plan::new(&arguments).unwrap();
            let found: Vec<_> = (plan.steps.iter().copied())
                .filter(|&step| plan.may_be_outdated(step))
                .collect();
            assert_eq!(found, outdated, "{numbers:?} {resume}");
        }
    }

    #[test]
    fn steps_and_what_they_need_belong_together() {
        let message = |arguments: TrainArguments| Plan::new(&arguments).err().unwrap().to_string();
        let steps = |numbers: &[u8]| TrainArguments {
            steps: numbers.to_vec(),
            ..arguments("a")
        };
        assert!(message(steps(&[2, 1])).contains("in their order"));
        assert!(message(steps(&[2])).contains("--model"));
        assert!(message(steps(&[1, 2])).contains("need --recording"));
        let mut without_blocks = steps(&[1, 2]);
        without_blocks.network = NetworkChoice::R50f;
        assert!(message(without_blocks).contains("r50f has none"));
        let mut unused = steps(&[1]);
        unused.recording = Some("r".into());
        assert!(message(unused).contains("add them to --steps"));
    }

    #[test]
    fn the_papers_preset_ends_after_the_papers_epochs() {
        let paper = TrainArguments {
            preset: Some(Preset::Paper),
            epochs: Some(3),
            ..arguments("a")
        };
        let config = config(&paper).unwrap();
        assert_eq!(config.budget, Budget::Samples(40 * 47_000));
        assert_eq!((config.depth_tuning.epochs, config.registration_tuning.epochs), (3, 3));
        assert_eq!((config.depth_tuning.batch, config.registration_tuning.batch), (7, 6));
    }

    #[test]
    fn the_papers_epochs_are_those_of_the_data_set_unless_a_budget_is_given() {
        let budget = |preset, samples, minutes| {
            let arguments = TrainArguments {
                data: vec!["d".into()],
                preset: Some(preset),
                samples,
                minutes,
                ..arguments("a")
            };
            let mut plan = Plan::new(&arguments).unwrap();
            plan.take_training_samples(&arguments, 90);
            plan.config.budget
        };
        assert_eq!(budget(Preset::Paper, None, None), Budget::Samples(3600));
        assert_eq!(budget(Preset::Paper, Some(7), None), Budget::Samples(7));
        assert_eq!(budget(Preset::Paper, None, Some(2.0)), Budget::Seconds(120.0));
        assert_eq!(budget(Preset::Ours, None, None), Budget::Seconds(3600.0));
    }

    #[test]
    fn data_sets_are_for_step_one() {
        let message = |arguments: TrainArguments| Plan::new(&arguments).err().unwrap().to_string();
        let without_step_one = TrainArguments {
            template: None,
            model: Some("m".into()),
            steps: vec![2],
            recording: Some("r".into()),
            data: vec!["d".into()],
            ..arguments("a")
        };
        assert!(message(without_step_one).contains("--data is for step 1"));
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
    }

    #[test]
    fn the_papers_network_has_the_papers_settings_unless_others_are_asked_for() {
        for (network, preset, expected) in [
            (NetworkChoice::Compact, None, Preset::Ours),
            (NetworkChoice::R50f, None, Preset::Ours),
            (NetworkChoice::Paper, None, Preset::Paper),
            (NetworkChoice::Paper, Some(Preset::Ours), Preset::Ours),
            (NetworkChoice::Compact, Some(Preset::Paper), Preset::Paper),
        ] {
            let arguments = TrainArguments {
                network,
                preset,
                ..arguments("a")
            };
            assert_eq!(arguments.preset(), expected, "{network:?} {preset:?}");
        }
    }

    #[test]
    fn light_is_as_the_preset_has_it_unless_it_is_asked_for() {
        for (preset, given, light) in [
            (Preset::Ours, None, Light::Recorded),
            (Preset::Paper, None, Light::Ignored),
            (Preset::Ours, Some(LightChoice::Fitted), Light::Fitted),
            (Preset::Paper, Some(LightChoice::Recorded), Light::Recorded),
            (Preset::Ours, Some(LightChoice::Ignored), Light::Ignored),
        ] {
            let config = config(&TrainArguments {
                preset: Some(preset),
                light: given,
                ..arguments("a")
            });
            assert_eq!(config.unwrap().photo_consistency.light, light, "{preset:?} {given:?}");
        }
    }

    #[test]
    fn the_seed_of_the_held_out_images_is_refused() {
        for seed in [TrainConfig::ours().held_out_seed, ACCURACY_SEED] {
            let held_out = TrainArguments { seed, ..arguments("a") };
            assert!(config(&held_out).unwrap_err().to_string().contains("held-out"));
        }
    }
}
