//! Data sets as folders.

use deepsft_formats::{
    DATASET_FILE, DatasetDescription, DatasetFolder, DatasetPart, FolderKind, Sample, SampleRecord, ShapeCounts,
    StagedFolder, sha256_file, write_shards,
};
use deepsft_geometry::glam::DVec3;
use deepsft_geometry::{Maps, Picture, Template, training_camera};
use serde_json::Value;
use std::fs;
use std::path::Path;

fn template() -> Template {
    Template::thin_shell(Picture::from_fn(4, 3, |_, _| [9; 3]), 200.0, 150.0).unwrap()
}

fn written(place: &Path, count: u64, described: u64) -> Vec<Sample> {
    let camera = training_camera();
    let (width, height) = (camera.width(), camera.height());
    // Pictures without the object, each of another colour.
    let samples: Vec<Sample> = (0..count)
        .map(|index| {
            let image = Picture::from_fn(width, height, |x, y| [x as u8, y as u8, 10 * index as u8]);
            Sample::new(image, Maps::empty(width, height), Vec::new(), camera, DVec3::NEG_Z)
        })
        .collect();
    let records = (0..)
        .zip(samples.clone())
        .map(|(index, sample)| SampleRecord { seed: 3, index, sample });
    let folder = StagedFolder::new(place, &FolderKind::DATASET).unwrap();
    let shards = write_shards(folder.path(), records, 2).unwrap();
    let description = DatasetDescription::new(&template(), Value::Null, 3, described, shards);
    fs::write(folder.path().join(DATASET_FILE), description.to_json().unwrap()).unwrap();
    folder.commit().unwrap();
    samples
}

#[test]
fn samples_come_back_in_order_over_all_shards() {
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("set");
    let samples = written(&place, 5, 5);
    let set = DatasetFolder::open(&place).unwrap();
    assert_eq!(
        set.description().shards,
        ["shard-000000.tar", "shard-000001.tar", "shard-000002.tar"]
    );
    let read: Vec<Sample> = set.samples(training_camera()).map(Result::unwrap).collect();
    assert_eq!(read.len(), 5);
    assert!(
        read.iter()
            .zip(&samples)
            .all(|(read, sample)| read.image == sample.image)
    );
}

#[test]
fn shapes_of_parts_are_added_up_where_all_parts_say_them() {
    let counts = |shapes| ShapeCounts {
        shapes,
        weakened: 1,
        at_rest: 0,
    };
    for (shapes, sum) in [
        ([(4, Some(counts(3))), (4, Some(counts(2)))], Some((5, 2))),
        ([(4, Some(counts(3))), (4, None)], None),
        ([(4, None), (4, Some(counts(3)))], None),
        ([(4, None), (4, None)], None),
        // A part without samples has nothing to say.
        ([(4, Some(counts(3))), (0, None)], Some((3, 1))),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let mut first = 0;
        for (number, (samples, handle_shapes)) in (1..).zip(shapes) {
            let mut part = DatasetDescription::new(&template(), Value::Null, 3, samples, Vec::new());
            (part.first, part.handle_shapes) = (first, handle_shapes);
            first += samples;
            let place = folder.path().join(DatasetPart::new(number, 2).unwrap().folder_name());
            fs::create_dir(&place).unwrap();
            fs::write(place.join(DATASET_FILE), part.to_json().unwrap()).unwrap();
        }
        let whole = DatasetFolder::open(folder.path()).unwrap();
        let shapes_of_all = whole.description().handle_shapes;
        assert_eq!(shapes_of_all.map(|all| (all.shapes, all.weakened)), sum, "{shapes:?}");
    }
}

#[test]
fn parts_of_more_samples_than_can_be_counted_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (number, first, samples) in [(1, 0, u64::MAX), (2, u64::MAX, 2)] {
        let mut part = DatasetDescription::new(&template(), Value::Null, 3, samples, Vec::new());
        part.first = first;
        let place = folder.path().join(DatasetPart::new(number, 2).unwrap().folder_name());
        fs::create_dir(&place).unwrap();
        fs::write(place.join(DATASET_FILE), part.to_json().unwrap()).unwrap();
    }
    let error = DatasetFolder::open(folder.path()).unwrap_err().to_string();
    assert!(error.contains("more samples than can be counted"), "{error}");
}

#[test]
fn a_shard_that_is_cut_and_a_sample_that_is_missing_are_errors() {
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("set");
    written(&place, 2, 3);
    let set = DatasetFolder::open(&place).unwrap();
    let last = |camera| set.samples(camera).last().unwrap().err().unwrap().to_string();
    assert!(last(training_camera()).contains("hold 2 samples, its description says 3"));
    let other = training_camera().resized((960, 540)).unwrap();
    assert!(last(other).contains("another camera"));
    let shard = place.join("shard-000000.tar");
    let bytes = fs::read(&shard).unwrap();
    fs::write(&shard, &bytes[..bytes.len() / 2]).unwrap();
    assert!(last(training_camera()).contains("shard-000000.tar"));
}

#[test]
fn shards_of_another_seed_or_place_or_content_are_refused() {
    let above = tempfile::tempdir().unwrap();
    let place = above.path().join("set");
    written(&place, 3, 3);
    let set = DatasetFolder::open(&place).unwrap();
    let message = |set: &DatasetFolder| {
        let last = set.samples(training_camera()).last().unwrap();
        last.err().unwrap().to_string()
    };
    let changed = |change: &dyn Fn(&mut DatasetDescription)| {
        let mut description = set.description().clone();
        change(&mut description);
        fs::write(place.join(DATASET_FILE), description.to_json().unwrap()).unwrap();
        DatasetFolder::open(&place).unwrap()
    };
    let other_seed = changed(&|description| description.seed = 4);
    assert!(message(&other_seed).contains("sample 0 of seed 3"));
    let exchanged = changed(&|description| description.shards.swap(0, 1));
    assert!(message(&exchanged).contains("sample 2 of seed 3"));
    let shards = set.description().shards.iter();
    let hashes: Vec<String> = shards.map(|name| sha256_file(&place.join(name)).unwrap()).collect();
    let hashed = changed(&|description| description.shard_sha256 = hashes.clone());
    hashed.check_hashes(|| ()).unwrap();
    assert_eq!(hashed.samples(training_camera()).map(Result::unwrap).count(), 3);
    let other_hash = changed(&|description| {
        description.shard_sha256 = hashes.clone();
        description.shard_sha256[1].replace_range(..1, "x");
    });
    let error = other_hash.check_hashes(|| ()).unwrap_err().to_string();
    assert!(
        error.contains("shard-000001.tar") && error.contains("SHA-256"),
        "{error}"
    );
    assert!(message(&other_hash).contains("SHA-256"));
}

#[test]
fn a_foreign_folder_is_no_data_set() {
    let folder = tempfile::tempdir().unwrap();
    let error = DatasetFolder::open(folder.path()).unwrap_err();
    assert!(error.to_string().contains("dataset.json"), "{error}");
}
