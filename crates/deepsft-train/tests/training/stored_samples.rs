//! Step 1 on a data set on disk: what is trained on and what is held out, and which checkpoints go on.

use crate::common::{alone, copy, small_compact, template, weights};
use burn::tensor::Device;
use deepsft_geometry::{Template, training_camera};
use deepsft_synth::{DatasetFolder, DatasetPlan, Sample, SynthConfig, Synthesizer, UnfinishedDataset};
use deepsft_train::{
    BatchShape, Budget, Progress, SampleSource, Schedule, StoredSamples, TrainConfig, TrainError, Trained, train,
};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// A data set of `samples` samples of `seed` in one shard.
fn stored(folder: &Path, seed: u64, samples: u64) -> StoredSamples {
    let synthesizer = Synthesizer::new(&template(), SynthConfig::default()).unwrap();
    let place = folder.join(format!("{seed}-{samples}"));
    let plan = DatasetPlan::new(&synthesizer, seed, 0..samples, samples);
    let unfinished = UnfinishedDataset::open(&place, plan).unwrap();
    unfinished.make(&synthesizer, None, || ()).unwrap();
    StoredSamples::open(&[DatasetFolder::open(&place).unwrap()], &template(), |_| ()).unwrap()
}

/// A data set that keeps a list of the samples that were asked for.
struct Watched {
    stored: StoredSamples,
    asked: Mutex<Vec<u64>>,
}

impl SampleSource for Watched {
    fn template(&self) -> &Template {
        self.stored.template()
    }

    fn sample(&self, seed: u64, index: u64) -> Result<Sample, TrainError> {
        self.asked.lock().unwrap().push(index);
        self.stored.sample(seed, index)
    }

    fn training_samples(&self, held_out_frames: u64) -> Result<Option<u64>, TrainError> {
        self.stored.training_samples(held_out_frames)
    }

    fn held_out(&self, seed: u64, held_out_frames: u64) -> Result<Vec<Sample>, TrainError> {
        self.stored.held_out(seed, held_out_frames)
    }

    fn fingerprint(&self) -> String {
        self.stored.fingerprint()
    }
}

/// Two windows of a sample a step.
fn config(checkpoint: &Path, samples: u64) -> TrainConfig {
    let windows = BatchShape {
        frames: 2,
        width: 64,
        height: 64,
    };
    TrainConfig {
        budget: Budget::Samples(samples),
        held_out_frames: 2,
        evaluate_every: 1e9,
        checkpoint: checkpoint.to_path_buf(),
        resume: true,
        workers: 1,
        schedule: Schedule {
            windows,
            frames: windows,
            warm_up: 2,
            ..Schedule::default()
        },
        ..TrainConfig::ours()
    }
}

fn run<S: SampleSource + 'static>(
    source: &Arc<S>,
    config: &TrainConfig,
    report: impl FnMut(Progress),
) -> Result<Trained, TrainError> {
    train(
        source,
        &small_compact(&training_camera()),
        config,
        &Device::flex(),
        report,
    )
}

#[test]
fn every_sample_but_the_end_comes_once_per_epoch() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let stored = stored(folder.path(), 5, 24);
    // A tenth, and no more than asked for.
    for (held_out_frames, training) in [(48, 22), (2, 22), (1, 23), (0, 24)] {
        assert_eq!(stored.training_samples(held_out_frames).unwrap(), Some(training));
    }
    let source = Arc::new(Watched {
        stored: stored.clone(),
        asked: Mutex::default(),
    });
    let mut done = 0.0;
    let report = |told| {
        if let Progress::Step { fraction, .. } = told {
            done = fraction;
        }
    };
    run(&source, &config(&folder.path().join("checkpoint"), 87), report).unwrap();
    // The last batch of two goes beyond the end.
    assert_eq!(done, 1.0);
    let asked = source.asked.lock().unwrap();
    let epoch = |number: usize| asked[22 * number..22 * (number + 1)].to_vec();
    let (first, second) = (epoch(0), epoch(1));
    for epoch in [&first, &second] {
        assert_eq!(
            epoch.iter().copied().collect::<BTreeSet<_>>(),
            (0..22).collect::<BTreeSet<_>>()
        );
    }
    assert_ne!(first, second);
    // Those that were asked for ahead of what was trained on.
    assert!(asked[44..].iter().all(|&index| index < 22));
    let held_out = stored.held_out(0, 2).unwrap();
    let synthesizer = Synthesizer::new(&template(), SynthConfig::default()).unwrap();
    for (sample, index) in held_out.iter().zip([22, 23]) {
        assert!(sample.image == synthesizer.sample(5, index).image, "sample {index}");
    }
}

#[test]
fn a_training_on_a_data_set_goes_on_and_one_on_another_is_refused() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let set = Arc::new(stored(folder.path(), 5, 10));
    let (whole, half) = (folder.path().join("whole"), folder.path().join("half"));
    let mut at_once = config(&whole, 24);
    at_once.evaluate_every = 0.0;
    let uninterrupted = run(&set, &at_once, |told| {
        if let Progress::Evaluated(point) = told
            && point.samples == 10
        {
            copy(&whole, &half);
        }
    });
    let uninterrupted = uninterrupted.unwrap();
    let mut resumed_at = 0;
    let resumed = run(&set, &config(&half, 24), |told| {
        if let Progress::Resumed { samples, .. } = told {
            resumed_at = samples;
        }
    });
    assert_eq!(resumed_at, 10);
    assert!(
        weights(&resumed.unwrap().network) == weights(&uninterrupted.network),
        "the weights differ"
    );

    let refused = |result: Result<Trained, TrainError>| {
        let error = result.err().unwrap();
        assert!(matches!(error, TrainError::CheckpointMismatch { .. }), "{error}");
        error.to_string()
    };
    let longer = config(&half, 30);
    let other_seed = Arc::new(stored(folder.path(), 6, 10));
    let another_length = Arc::new(stored(folder.path(), 5, 11));
    for other in [other_seed, another_length] {
        let told = refused(run(&other, &longer, |_| {}));
        assert!(told.contains("other training images"), "{told}");
    }
    let on_the_fly = Arc::new(Synthesizer::new(&template(), SynthConfig::default()).unwrap());
    assert!(refused(run(&on_the_fly, &longer, |_| {})).contains("other training images"));
    let other_rate = TrainConfig {
        average_decay: 0.5,
        ..longer.clone()
    };
    assert!(refused(run(&set, &other_rate, |_| {})).contains("another preset"));
    run(&set, &longer, |_| {}).unwrap();
}

#[test]
fn a_set_too_small_to_hold_any_out_is_refused() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let set = Arc::new(stored(folder.path(), 5, 9));
    let error = run(&set, &config(&folder.path().join("checkpoint"), 4), |_| {}).err();
    assert!(
        matches!(
            error,
            Some(TrainError::TooFewSamples {
                actual: 9,
                expected: 10
            })
        ),
        "{error:?}"
    );
}
