//! Samples of shards come out in any order as they come out in turn, and what is damaged is told with its file.

use deepsft_formats::FormatError;
use deepsft_geometry::{Picture, Template, training_camera};
use deepsft_synth::{IndexedShards, SampleRecord, ShardReader, SynthConfig, Synthesizer, write_shard};
use std::fs;
use std::path::{Path, PathBuf};

fn records(indices: std::ops::Range<u64>) -> Vec<SampleRecord> {
    let texture = Picture::from_fn(64, 48, |x, y| [4 * x as u8, 5 * y as u8, 100]);
    let template = Template::thin_shell(texture, 297.0, 210.0).unwrap();
    let synthesizer = Synthesizer::new(&template, SynthConfig::default()).unwrap();
    let record = |index| SampleRecord {
        seed: 3,
        index,
        sample: synthesizer.sample(3, index),
    };
    indices.map(record).collect()
}

fn write(folder: &Path, name: &str, records: Vec<SampleRecord>) -> PathBuf {
    let path = folder.join(name);
    write_shard(fs::File::create(&path).unwrap(), records).unwrap();
    path
}

/// The message of an error that is to name a file.
fn message(result: Result<impl std::fmt::Debug, FormatError>, path: &Path) -> String {
    let error = result.unwrap_err();
    assert!(
        matches!(&error, FormatError::File { path: named, .. } if named == path),
        "{error}"
    );
    error.to_string()
}

#[test]
fn samples_are_the_same_in_any_order_over_shards_of_different_lengths() {
    let folder = tempfile::tempdir().unwrap();
    let lengths = [0..2, 2..2, 2..5, 5..6];
    let paths: Vec<PathBuf> = (0..)
        .zip(lengths)
        .map(|(number, indices): (u32, _)| write(folder.path(), &format!("{number}.tar"), records(indices)))
        .collect();
    let in_turn: Vec<SampleRecord> = paths
        .iter()
        .flat_map(|path| {
            let mut reader = ShardReader::new(fs::File::open(path).unwrap());
            reader.records().unwrap().map(Result::unwrap).collect::<Vec<_>>()
        })
        .collect();
    let mut shards = IndexedShards::new(training_camera());
    let counts: Vec<u64> = paths.iter().map(|path| shards.add(path).unwrap()).collect();
    assert_eq!((counts, shards.samples()), (vec![2, 0, 3, 1], 6));
    for number in [4, 0, 5, 2, 1, 3, 4] {
        let record = shards.record(number).unwrap();
        assert_eq!(record.index, number);
        assert!(record == in_turn[number as usize], "sample {number}");
    }
    assert!(matches!(
        shards.record(6),
        Err(FormatError::NoSuchSample { number: 6, samples: 6 })
    ));
    assert!(IndexedShards::new(training_camera()).record(0).is_err());
}

#[test]
fn what_is_damaged_is_found_when_a_shard_is_added() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "shard.tar", records(0..2));
    let whole = fs::read(&path).unwrap();
    let add = || IndexedShards::new(training_camera()).add(&path);
    assert_eq!(add().unwrap(), 2);

    // In the second sample's last entry: all before it is whole. An archive ends with two empty blocks.
    fs::write(&path, &whole[..whole.len() - 1024 - 512]).unwrap();
    let cut = message(add(), &path);
    assert!(cut.contains("000001.json has") && cut.contains("shard.tar"), "{cut}");

    let header = |entry: &str| {
        whole
            .windows(entry.len())
            .position(|name| name == entry.as_bytes())
            .unwrap()
    };
    fs::write(&path, &whole[..header("000001.json")]).unwrap();
    assert!(message(add(), &path).contains("sample 000001 of the shard has no json"));

    // The picture of the first sample, behind its header and PNG's own.
    let mut spoilt = whole.clone();
    spoilt[512 + 40..512 + 60].fill(0);
    fs::write(&path, &spoilt).unwrap();
    assert!(message(add(), &path).contains("000000.rgb.png"));

    fs::remove_file(&path).unwrap();
    message(add(), &path);
}

#[test]
fn a_sample_of_another_camera_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "shard.tar", records(0..1));
    let twice = training_camera().resized((960, 540)).unwrap();
    let mut shards = IndexedShards::new(twice);
    assert!(message(shards.add(&path), &path).contains("another camera"));
    assert_eq!(shards.samples(), 0);
}

#[test]
fn what_happens_to_a_shard_after_it_was_added_is_told_when_a_sample_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "shard.tar", records(0..2));
    let mut shards = IndexedShards::new(training_camera());
    shards.add(&path).unwrap();
    let whole = fs::read(&path).unwrap();
    for left in [whole.len() / 2, 0] {
        fs::write(&path, &whole[..left]).unwrap();
        message(shards.record(1), &path);
    }
    fs::write(&path, &whole).unwrap();
    assert_eq!(shards.record(1).unwrap().index, 1);
    fs::remove_file(&path).unwrap();
    message(shards.record(1), &path);
}
