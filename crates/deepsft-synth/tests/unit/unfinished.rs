//! Data sets in the making.

use crate::{DATASET_FILE, DatasetFolder, DatasetPlan, SynthConfig, SynthError, Synthesizer, UnfinishedDataset};
use deepsft_geometry::{Picture, Template};
use std::fs;
use std::path::Path;

fn synthesizer() -> Synthesizer {
    let texture = Picture::from_fn(8, 6, |x, _| [30 * x as u8; 3]);
    let template = Template::thin_shell(texture, 200.0, 150.0).unwrap();
    Synthesizer::new(&template, SynthConfig::default()).unwrap()
}

/// The plan of some samples, one in a shard.
fn plan(samples: u64) -> DatasetPlan {
    DatasetPlan::new(&synthesizer(), 3, 0..samples, 1)
}

#[test]
fn a_set_that_is_being_made_is_left_to_the_process_that_makes_it() {
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("set");
    let set = UnfinishedDataset::open(&place, plan(3)).unwrap();
    let error = UnfinishedDataset::open(&place, plan(3)).err().unwrap();
    assert!(error.to_string().contains("another process"), "{error}");
    drop(set);
    UnfinishedDataset::open(&place, plan(3)).unwrap();
}

#[test]
fn the_beginning_of_another_set_and_foreign_folders_are_left_alone() {
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("set");
    drop(UnfinishedDataset::open(&place, plan(3)).unwrap());
    let message = |result: Result<UnfinishedDataset, SynthError>| result.err().unwrap().to_string();
    let other = message(UnfinishedDataset::open(&place, plan(4)));
    assert!(
        other.contains("set.partial") && other.contains("number of samples 3, not 4"),
        "{other}"
    );
    let foreign = above.path().join("mine.partial");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("thesis.txt"), "").unwrap();
    assert!(message(UnfinishedDataset::open(&above.path().join("mine"), plan(3))).contains("mine.partial"));
}

#[test]
fn a_finished_set_stands_in_its_place_with_nothing_beside_it() {
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("set");
    let synthesizer = synthesizer();
    let plan = DatasetPlan::new(&synthesizer, 3, 4..7, 2);
    let mut made = 0;
    let set = UnfinishedDataset::open(&place, plan.clone()).unwrap();
    set.make(&synthesizer, None, || made += 1).unwrap();
    let names = |folder: &Path| {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    };
    assert_eq!(made, 3);
    assert_eq!(names(&place), [DATASET_FILE, "shard-000000.tar", "shard-000001.tar"]);
    assert_eq!(names(above.path()), ["set"]);
    let set = DatasetFolder::open(&place).unwrap();
    assert!(plan.is_of(set.description()));
    set.check_hashes(|| ()).unwrap();
    let samples: Vec<_> = set
        .samples(synthesizer.config().camera)
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert!(samples[2].image == synthesizer.sample(3, 6).image);
}

#[test]
fn a_set_goes_on_after_its_whole_shards_wherever_it_ended() {
    let above = tempfile::tempdir().unwrap();
    let (place, at_once) = (above.path().join("set"), above.path().join("at-once"));
    let synthesizer = synthesizer();
    let open = |place: &Path| UnfinishedDataset::open(place, DatasetPlan::new(&synthesizer, 3, 0..5, 2)).unwrap();
    open(&at_once).make(&synthesizer, None, || ()).unwrap();
    // It ends within a shard: with the second sample of the second, as when its process is killed.
    let begin = || {
        let mut made = 0;
        let made = || {
            made += 1;
            assert!(made < 4, "killed");
        };
        let set = open(&place);
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| set.make(&synthesizer, None, made))).unwrap_err();
    };
    begin();
    let begun = above.path().join("set.partial");
    assert!(begun.join("shard.tmp").is_file() && !place.exists());
    assert_eq!(open(&place).finished(), 2);
    // A shard cut short is not whole, nor is what comes after it.
    fs::write(begun.join("shard-000000.tar"), "cut").unwrap();
    assert_eq!(open(&place).finished(), 0);
    begin();
    open(&place).make(&synthesizer, None, || ()).unwrap();
    let set = |place: &Path| DatasetFolder::open(place).unwrap();
    assert_eq!(set(&place).description(), set(&at_once).description());
    assert_eq!(fs::read_dir(above.path()).unwrap().count(), 2);
}

#[test]
fn a_shard_that_fails_leaves_those_before_it_and_nothing_of_its_own() {
    let above = tempfile::tempdir().unwrap();
    let (place, begun) = (above.path().join("set"), above.path().join("set.partial"));
    let set = UnfinishedDataset::open(&place, plan(2)).unwrap();
    // In the way of the second.
    fs::create_dir(begun.join("shard-000001.tar")).unwrap();
    let error = set.make(&synthesizer(), None, || ()).unwrap_err().to_string();
    assert!(error.contains("shard-000001.tar"), "{error}");
    assert!(!begun.join("shard.tmp").exists());
    assert_eq!(UnfinishedDataset::open(&place, plan(2)).unwrap().finished(), 1);
}

#[test]
fn a_set_of_the_last_indices_there_are_is_finished() {
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("set");
    let synthesizer = synthesizer();
    let plan = DatasetPlan::new(&synthesizer, 3, u64::MAX - 6..u64::MAX - 3, 1000);
    let set = UnfinishedDataset::open(&place, plan).unwrap();
    set.make(&synthesizer, None, || ()).unwrap();
    let set = DatasetFolder::open(&place).unwrap();
    let samples = set.samples(synthesizer.config().camera).unwrap();
    assert_eq!(samples.map(Result::unwrap).count(), 3);
}
