//! Data sets that belong together, and those that do not.

use deepsft_geometry::{Picture, Template};
use deepsft_synth::{DatasetFolder, DatasetPlan, SynthConfig, Synthesizer, UnfinishedDataset};
use deepsft_train::{SampleSource, StoredSamples, TrainError};
use std::ops::Range;
use std::path::Path;

/// What makes samples of a template of this grey.
fn synthesizer(grey: u8) -> Synthesizer {
    let texture = Picture::from_fn(4, 3, |_, _| [grey; 3]);
    let template = Template::thin_shell(texture, 200.0, 150.0).unwrap();
    Synthesizer::new(&template, SynthConfig::default()).unwrap()
}

/// The data set `indices` of `seed`, of a template of this grey.
fn set(folder: &Path, grey: u8, seed: u64, indices: Range<u64>) -> DatasetFolder {
    let synthesizer = synthesizer(grey);
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
    let with = |other| StoredSamples::open(&[one.clone(), other], synthesizer(9).template(), |_| ());
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

#[test]
fn stored_samples_are_those_that_were_made_up_to_their_rounding() {
    let folder = tempfile::tempdir().unwrap();
    // The first in two shards.
    let sets = [set(folder.path(), 9, 5, 100..104), set(folder.path(), 90, 6, 0..2)];
    let stored = StoredSamples::open(&sets, synthesizer(9).template(), |_| ()).unwrap();
    let numbered = (100..104).map(|index| (9, 5, index)).chain([(90, 6, 0), (90, 6, 1)]);
    let mut area = 0;
    for (number, (grey, seed, index)) in (0..).zip(numbered) {
        let made = synthesizer(grey).sample(seed, index);
        // The seed of a training does not change what is stored.
        let read = stored.sample(77, number).unwrap();
        assert!(
            read.image == made.image && read.has_template == made.has_template,
            "{number}"
        );
        assert_eq!(read.truth.mask(), made.truth.mask(), "{number}");
        area += made.truth.area();
        for pixel in (0..480 * 270).filter(|&pixel| made.truth.inside(pixel)) {
            // Half of what the files tell apart, and the rounding of f32.
            assert!((read.truth.depth()[pixel] - made.truth.depth()[pixel]).abs() <= 0.05 + 1e-4);
            for k in 0..2 {
                let slip = read.truth.registration()[pixel][k] - made.truth.registration()[pixel][k];
                assert!(slip.abs() <= 0.5 / 65535.0 + 1e-7);
            }
        }
    }
    assert!(area > 10_000, "{area}");
}
