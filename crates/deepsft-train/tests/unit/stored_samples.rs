//! Data sets that belong together, and those that do not.

use deepsft_geometry::{Picture, Template, training_camera};
use deepsft_synth::{DatasetDescription, IndexedShards, SampleRecord, SynthConfig, Synthesizer, write_shard};
use deepsft_train::{StoredSamples, TrainError};
use std::fs::File;

fn template() -> Template {
    Template::thin_shell(Picture::from_fn(4, 3, |_, _| [9; 3]), 200.0, 150.0).unwrap()
}

fn description(seed: u64, first: u64, samples: u64) -> DatasetDescription {
    let configuration = SynthConfig::default().description();
    let mut set = DatasetDescription::new(&template(), configuration, seed, samples, Vec::new());
    set.first = first;
    set
}

#[test]
fn data_sets_with_a_sample_in_common_are_refused() {
    // Eight samples, for two sets of four: what is compared is their descriptions.
    let sample = Synthesizer::new(&template(), SynthConfig::default())
        .unwrap()
        .sample(5, 0);
    let records = (0..8).map(|index| SampleRecord {
        seed: 5,
        index,
        sample: sample.clone(),
    });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("0.tar");
    write_shard(File::create(&path).unwrap(), records).unwrap();
    let mut shards = IndexedShards::new(training_camera());
    shards.add(path).unwrap();
    let apart = |other: DatasetDescription| StoredSamples::new(shards.clone(), &[other, description(5, 100, 4)]);
    for other in [description(6, 100, 4), description(5, 104, 4), description(5, 96, 4)] {
        apart(other).unwrap();
    }
    let mut of_another_template = description(5, 100, 4);
    of_another_template.fingerprint = "0123".to_owned();
    apart(of_another_template).unwrap();
    for (first, common) in [(100, 100), (103, 103), (97, 100)] {
        let error = apart(description(5, first, 4)).unwrap_err();
        assert!(
            matches!(error, TrainError::RepeatedSample { seed: 5, index } if index == common),
            "{error}"
        );
    }
}

#[test]
fn shards_and_descriptions_have_as_many_samples() {
    let none = IndexedShards::new(training_camera());
    let error = StoredSamples::new(none, &[description(1, 0, 2), description(2, 0, 3)]).unwrap_err();
    assert!(
        matches!(error, TrainError::SampleCount { actual: 0, expected: 5 }),
        "{error}"
    );
}
