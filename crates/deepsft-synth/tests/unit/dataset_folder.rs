//! Data sets as folders.

use crate::{
    DATASET_FILE, DatasetFolder, DatasetPlan, Sample, SynthConfig, SynthError, Synthesizer, UnfinishedDataset,
    write_dataset,
};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Camera, Maps, Picture, Template, training_camera};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn template() -> Template {
    Template::thin_shell(Picture::from_fn(4, 3, |_, _| [9; 3]), 200.0, 150.0).unwrap()
}

/// The description in a folder, after `change`.
fn changed(folder: &Path, change: impl FnOnce(&mut Value)) -> DatasetFolder {
    let path = folder.join(DATASET_FILE);
    let mut description: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    change(&mut description);
    fs::write(&path, description.to_string()).unwrap();
    DatasetFolder::open(folder).unwrap()
}

/// A data set of pictures without the object, each of another colour.
fn written(place: &Path, count: u64) -> Vec<Sample> {
    let camera = training_camera();
    let (width, height) = (camera.size().width, camera.size().height);
    let sample = |index| {
        let image = Picture::from_fn(width, height, |x, y| [x as u8, y as u8, 10 * index as u8]);
        Sample::new(image, Maps::empty((width, height)), Vec::new(), camera, DVec3::NEG_Z)
    };
    let samples: Vec<Sample> = (0..count).map(sample).collect();
    write_dataset::<SynthError>(place, &template(), Value::Null, 3, samples.iter().cloned().map(Ok)).unwrap();
    samples
}

/// A data set of three samples, two in a shard.
fn synthetic(place: &Path) -> DatasetFolder {
    let synthesizer = Synthesizer::new(&template(), SynthConfig::default()).unwrap();
    let plan = DatasetPlan::new(&synthesizer, 3, 0..3, 2);
    let unfinished = UnfinishedDataset::open(place, plan).unwrap();
    unfinished.make(&synthesizer, None, || ()).unwrap();
    DatasetFolder::open(place).unwrap()
}

/// The first error of reading all samples.
fn error(set: &DatasetFolder, camera: Camera) -> String {
    let read = set.samples(camera).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    read.unwrap_err().to_string()
}

#[test]
fn samples_come_back_in_order_over_all_shards() {
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("set");
    let samples = written(&place, 501);
    let set = DatasetFolder::open(&place).unwrap();
    assert_eq!(set.description().shards, ["shard-000000.tar", "shard-000001.tar"]);
    set.check_shards().unwrap();
    let read = set.samples(training_camera()).unwrap().map(Result::unwrap);
    assert!(read.zip(&samples).filter(|(read, sample)| read == *sample).count() == 501);
}

#[test]
fn a_size_of_many_digits_is_that_of_its_own_template_alone() {
    // Read from its own text it differs in the last bit.
    let sized = |width: f64| Template::thin_shell(Picture::from_fn(4, 3, |_, _| [9; 3]), width, 150.0).unwrap();
    let template = sized(450.518_714_852_853_63);
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("set");
    write_dataset::<SynthError>(&place, &template, Value::Null, 3, std::iter::empty()).unwrap();
    let set = DatasetFolder::open(&place).unwrap();
    set.description().check_template(&template).unwrap();
    let refused = set.description().check_template(&sized(450.6)).unwrap_err();
    assert!(refused.to_string().contains("not 450.6 x 150 mm"), "{refused}");
}

#[test]
fn the_first_sample_that_is_an_error_leaves_no_data_set() {
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("set");
    let samples = [Err(SynthError::Refused("none".to_owned()))];
    assert!(write_dataset(&place, &template(), Value::Null, 3, samples.into_iter()).is_err());
    assert_eq!(fs::read_dir(above.path()).unwrap().count(), 0);
}

#[test]
fn the_samples_of_parts_are_added_up() {
    let whole = tempfile::tempdir().unwrap();
    let above = tempfile::tempdir().unwrap();
    written(&above.path().join("set"), 0);
    let empty = fs::read(above.path().join("set").join(DATASET_FILE)).unwrap();
    for (number, (first, samples)) in (1..).zip([(0, 4), (4, 0), (4, 5)]) {
        let place = whole.path().join(format!("part-{number}-of-3"));
        fs::create_dir(&place).unwrap();
        fs::write(place.join(DATASET_FILE), &empty).unwrap();
        changed(&place, |description| {
            (description["first"], description["samples"]) = (first.into(), samples.into());
        });
    }
    let set = DatasetFolder::open(whole.path()).unwrap();
    assert_eq!(set.description().samples, 9);
    // A part of another seed, or one that does not follow.
    for (field, value) in [("seed", 4), ("first", 5)] {
        let place = whole.path().join("part-3-of-3");
        let before = fs::read(place.join(DATASET_FILE)).unwrap();
        changed(&place, |description| description[field] = value.into());
        let refused = DatasetFolder::open(whole.path()).unwrap_err().to_string();
        assert!(
            refused.contains("part-3-of-3") && refused.contains("another data set"),
            "{refused}"
        );
        fs::write(place.join(DATASET_FILE), before).unwrap();
    }
    let last = u64::MAX;
    changed(&whole.path().join("part-3-of-3"), |description| {
        description["samples"] = last.into()
    });
    let refused = DatasetFolder::open(whole.path()).unwrap_err().to_string();
    assert!(refused.contains("more samples than can be counted"), "{refused}");
}

#[test]
fn a_shard_that_is_cut_and_a_sample_that_is_missing_are_errors() {
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("set");
    written(&place, 2);
    let set = changed(&place, |description| description["samples"] = 3.into());
    let told = error(&set, training_camera());
    assert!(told.contains("hold 2 samples, its description says 3"), "{told}");
    let other = training_camera().resized((960, 540)).unwrap();
    assert!(error(&set, other).contains("another camera"));
    let shard = place.join("shard-000000.tar");
    let bytes = fs::read(&shard).unwrap();
    fs::write(&shard, &bytes[..bytes.len() / 2]).unwrap();
    assert!(set.check_shards().unwrap_err().to_string().contains("should have"));
    assert!(error(&set, training_camera()).contains("shard-000000.tar"));
}

#[test]
fn shards_of_another_seed_or_place_or_content_are_refused() {
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("set");
    let set = synthetic(&place);
    let count = set.samples(training_camera()).unwrap().map(Result::unwrap).count();
    assert_eq!(count, 3);
    let whole = fs::read(place.join(DATASET_FILE)).unwrap();
    let other_hash = changed(&place, |description| {
        let hash = description["shard_sha256"][1].as_str().unwrap().to_owned();
        description["shard_sha256"][1] = format!("x{}", &hash[1..]).into();
    });
    for told in [
        other_hash.check_hashes(|| ()).unwrap_err().to_string(),
        error(&other_hash, training_camera()),
    ] {
        assert!(told.contains("shard-000001.tar") && told.contains("SHA-256"), "{told}");
    }
    // A shard is checked when its first sample is asked for, and after an error there are no more.
    let read = other_hash.samples(training_camera()).unwrap();
    let whole_ones: Vec<bool> = read.map(|sample| sample.is_ok()).collect();
    assert_eq!(whole_ones, [true, true, false]);
    let unhashed = |description: &mut Value| drop(description.as_object_mut().unwrap().remove("shard_sha256"));
    let other_seed = changed(&place, |description| {
        unhashed(description);
        description["seed"] = 4.into();
    });
    let told = error(&other_seed, training_camera());
    assert!(told.contains("sample 0 of seed 3"), "{told}");
    fs::write(place.join(DATASET_FILE), whole).unwrap();
    let exchanged = changed(&place, |description| {
        unhashed(description);
        description["shards"].as_array_mut().unwrap().swap(0, 1);
    });
    let told = error(&exchanged, training_camera());
    assert!(told.contains("sample 2 of seed 3"), "{told}");
}

#[test]
fn foreign_folders_and_descriptions_are_no_data_set() {
    let folder = tempfile::tempdir().unwrap();
    let refused = || DatasetFolder::open(folder.path()).unwrap_err().to_string();
    let told = refused();
    assert!(told.contains("dataset.json"), "{told}");
    fs::write(folder.path().join(DATASET_FILE), "[]").unwrap();
    let told = refused();
    assert!(told.contains("dataset.json"), "{told}");
    let place = folder.path().join("set");
    written(&place, 0);
    let text = fs::read_to_string(place.join(DATASET_FILE)).unwrap();
    for (ours, theirs, reason) in [
        ("\"format_version\": 1", "\"format_version\": 2", "format version 2"),
        ("\"shards\": []", "\"shards\": [\"../a.tar\"]", "outside of its folder"),
    ] {
        fs::write(folder.path().join(DATASET_FILE), text.replace(ours, theirs)).unwrap();
        let told = refused();
        assert!(told.contains(reason), "{told}");
    }
}
