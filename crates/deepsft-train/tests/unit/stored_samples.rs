//! Data sets that belong together, and those that do not.

use deepsft_geometry::{Picture, Template};
use deepsft_synth::{DatasetFolder, DatasetPlan, SynthConfig, Synthesizer, UnfinishedDataset};
use deepsft_train::{StoredSamples, TrainError};
use std::ops::Range;
use std::path::Path;

/// The data set `indices` of `seed`, of a template of this grey.
fn set(folder: &Path, grey: u8, seed: u64, indices: Range<u64>) -> DatasetFolder {
    let texture = Picture::from_fn(4, 3, |_, _| [grey; 3]);
    let template = Template::thin_shell(texture, 200.0, 150.0).unwrap();
    let synthesizer = Synthesizer::new(&template, SynthConfig::default()).unwrap();
    let place = folder.join(format!("{grey}-{seed}-{}", indices.start));
    let plan = DatasetPlan::new(&synthesizer, seed, indices, 3);
    let unfinished = UnfinishedDataset::open(&place, plan).unwrap();
    unfinished.make(&synthesizer, None, || ()).unwrap();
    DatasetFolder::open(&place).unwrap()
}

#[test]
fn data_sets_with_a_sample_in_common_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let set = |grey, seed, first| set(folder.path(), grey, seed, first..first + 2);
    let one = set(9, 5, 100);
    let with = |other| StoredSamples::open(&[one.clone(), other], |_| ());
    for other in [set(9, 6, 100), set(9, 5, 102), set(9, 5, 98), set(10, 5, 100)] {
        with(other).unwrap();
    }
    for (first, common) in [(100, 100), (101, 101), (99, 100)] {
        let error = with(set(9, 5, first)).unwrap_err();
        assert!(
            matches!(error, TrainError::RepeatedSample { seed: 5, index } if index == common),
            "{error}"
        );
    }
}
