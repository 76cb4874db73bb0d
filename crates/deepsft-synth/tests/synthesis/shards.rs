//! Shards come back as they were written, and foreign or damaged ones are refused with the entry's name.

use deepsft_formats::{FormatError, encode_jpeg};
use deepsft_geometry::{Camera, Maps, Picture, Template, training_camera};
use deepsft_synth::{
    DATASET_FILE, DatasetFolder, IndexedShards, Sample, SynthConfig, SynthError, Synthesizer, write_dataset,
};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::sync::LazyLock;
use tempfile::TempDir;

const SHARD: &str = "set/shard-000000.tar";

static SYNTHESIZER: LazyLock<Synthesizer> = LazyLock::new(|| {
    let texture = Picture::from_fn(64, 48, |x, y| [4 * x as u8, 5 * y as u8, 100]);
    let template = Template::thin_shell(texture, 297.0, 210.0).unwrap();
    // Half of the samples without the template, so that a few hold both kinds.
    let empty_probability = 0.5;
    let config = SynthConfig {
        empty_probability,
        ..SynthConfig::default()
    };
    Synthesizer::new(&template, config).unwrap()
});

static SAMPLES: LazyLock<Vec<Sample>> = LazyLock::new(|| (0..6).map(|index| SYNTHESIZER.sample(3, index)).collect());

/// The data set `set` of all samples in a new folder, and its shard.
fn written() -> (TempDir, Vec<u8>) {
    let folder = tempfile::tempdir().unwrap();
    let samples = SAMPLES.iter().cloned().map(Ok);
    let configuration = SYNTHESIZER.config().description();
    write_dataset::<SynthError>(
        &folder.path().join("set"),
        SYNTHESIZER.template(),
        configuration,
        3,
        samples,
    )
    .unwrap();
    let shard = fs::read(folder.path().join(SHARD)).unwrap();
    (folder, shard)
}

/// Opens the set in a folder, whatever the hash of its shard is.
fn open(folder: &Path, camera: Camera) -> Result<IndexedShards, FormatError> {
    let path = folder.join("set").join(DATASET_FILE);
    let mut description: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    description.as_object_mut().unwrap().remove("shard_sha256");
    fs::write(path, description.to_string()).unwrap();
    let set = DatasetFolder::open(&folder.join("set")).unwrap();
    let shards = IndexedShards::open(std::slice::from_ref(&set), camera, |_| ())?;
    set.samples(camera)?.collect::<Result<Vec<_>, _>>()?;
    Ok(shards)
}

/// The message of an error that is to name the shard.
fn message(result: Result<impl std::fmt::Debug, FormatError>, folder: &Path) -> String {
    let error = result.unwrap_err();
    assert!(
        matches!(&error, FormatError::Unusable { path, .. } if *path == folder.join(SHARD)),
        "{error}"
    );
    error.to_string()
}

/// The message of a data set with this shard.
fn refused(shard: &[u8]) -> String {
    let (folder, _) = written();
    fs::write(folder.path().join(SHARD), shard).unwrap();
    message(open(folder.path(), training_camera()), folder.path())
}

/// A tar archive of the given entries.
fn archive(entries: &[(&str, &[u8])]) -> Vec<u8> {
    let mut builder = tar::Builder::new(Vec::new());
    for (name, content) in entries {
        let mut header = tar::Header::new_ustar();
        header.set_size(content.len() as u64);
        builder.append_data(&mut header, name, *content).unwrap();
    }
    builder.into_inner().unwrap()
}

/// The entries of a shard.
fn entries(shard: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut archive = tar::Archive::new(shard);
    let read = |entry: std::io::Result<tar::Entry<'_, &[u8]>>| {
        let mut entry = entry.unwrap();
        let mut content = Vec::new();
        std::io::Read::read_to_end(&mut entry, &mut content).unwrap();
        (entry.path().unwrap().to_str().unwrap().to_owned(), content)
    };
    archive.entries().unwrap().map(read).collect()
}

/// The message of a data set whose entries went through `change`.
fn refused_after(change: impl FnOnce(&mut Vec<(String, Vec<u8>)>)) -> String {
    let mut entries = entries(&written().1);
    change(&mut entries);
    let entries: Vec<(&str, &[u8])> = entries
        .iter()
        .map(|(name, content)| (name.as_str(), content.as_slice()))
        .collect();
    refused(&archive(&entries))
}

#[test]
fn samples_come_back_in_any_order_with_truth_rounded_to_the_documented_steps() {
    assert!(SAMPLES.iter().any(|s| s.has_template) && SAMPLES.iter().any(|s| !s.has_template));
    let (folder, _) = written();
    let shards = open(folder.path(), training_camera()).unwrap();
    assert_eq!(shards.samples(), 6);
    for number in [4, 0, 5, 2, 1, 3, 4] {
        let (a, b) = (&SAMPLES[number], shards.sample(number as u64).unwrap());
        assert_eq!(
            (&a.image, &a.camera, a.has_template),
            (&b.image, &b.camera, b.has_template)
        );
        assert_eq!(a.vertices_camera.len(), b.vertices_camera.len());
        for (p, q) in a.vertices_camera.iter().zip(&b.vertices_camera) {
            assert!((*p - *q).length() < 1e-9);
        }
        assert_eq!(a.truth.mask(), b.truth.mask());
        for pixel in (0..480 * 270).filter(|&pixel| a.truth.inside(pixel)) {
            // Half a step, and the rounding of f32 at some 500 mm.
            assert!((a.truth.depth()[pixel] - b.truth.depth()[pixel]).abs() <= 0.05 + 1e-4);
            for k in 0..2 {
                let slip = a.truth.registration()[pixel][k] - b.truth.registration()[pixel][k];
                assert!(slip.abs() <= 0.5 / 65535.0 + 1e-7);
            }
        }
    }
    let none = shards.sample(6).unwrap_err().to_string();
    assert!(none.contains("there is no sample 6, only 6"), "{none}");
}

#[test]
fn the_same_samples_make_the_same_bytes() {
    assert_eq!(written().1, written().1);
}

#[test]
fn a_data_set_without_shards_has_no_samples() {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("set");
    let none = std::iter::empty::<Result<Sample, SynthError>>();
    write_dataset(&place, SYNTHESIZER.template(), Value::Null, 3, none).unwrap();
    let shards = open(folder.path(), training_camera()).unwrap();
    assert_eq!(shards.samples(), 0);
    assert!(shards.sample(0).is_err());
}

#[test]
fn a_shard_cut_anywhere_is_refused() {
    let (_, shard) = written();
    for share in [0.1, 0.45, 0.8] {
        let told = refused(&shard[..(shard.len() as f64 * share) as usize]);
        assert!(
            told.contains("bytes, expected") || told.contains("has no"),
            "cut at {share}: {told}"
        );
    }
    // In the last entry: an archive ends with two empty blocks.
    let told = refused(&shard[..shard.len() - 1024 - 512]);
    assert!(told.contains("its entry 000005.json has"), "{told}");
}

#[test]
fn what_is_not_a_shard_is_refused() {
    refused(&[b'x'; 5000]);
    for name in ["readme.txt", "a/000000.json"] {
        let told = refused(&archive(&[(name, b"{}")]));
        let reason = format!("its entry {name} is not NNNNNN.rgb.png, .depth.png, .uv.png or .json");
        assert!(told.ends_with(&reason), "{told}");
    }
}

#[test]
fn damaged_entries_are_refused_by_name() {
    type Entries = Vec<(String, Vec<u8>)>;
    let replaced = |from: &'static str, to: &'static str| {
        move |e: &mut Entries| {
            e[3].1 = String::from_utf8(e[3].1.clone())
                .unwrap()
                .replace(from, to)
                .into_bytes()
        }
    };
    for (told, reason) in [
        (
            refused_after(|e| drop(e.remove(1))),
            "its sample 000000 has no depth.png",
        ),
        (refused_after(|e| e.truncate(23)), "its sample 000005 has no json"),
        (
            refused_after(|e| e[1] = e[0].clone()),
            "its entry 000000.rgb.png is there twice",
        ),
        (
            refused_after(|e| e[4].1.truncate(100)),
            "sample 000001: its rgb.png is refused: ",
        ),
        (
            refused_after(|e| e[3].1 = b"{\"seed\": 1}".to_vec()),
            "sample 000000: its json is malformed: missing field",
        ),
        // The picture in the place of the depth: 8-bit RGB instead of 16-bit grey.
        (
            refused_after(|e| e[1].1 = e[0].1.clone()),
            "sample 000000: its depth.png is Rgb8, expected 16-bit grey",
        ),
        (refused_after(replaced("\"fx\":380.0", "\"fx\":0.0")), "camera fx is 0"),
        (
            refused_after(replaced("\"width\":480", "\"width\":481")),
            "its rgb.png is refused: picture cannot be read: it has 480 x 270 pixels, its camera 481 x 270",
        ),
        // A size of another camera is met before the file is decoded, which is cut short.
        (
            refused_after(|e| {
                replaced("\"width\":480", "\"width\":481")(e);
                let half = e[0].1.len() / 2;
                e[0].1.truncate(half);
            }),
            "its rgb.png is refused: picture cannot be read: it has 480 x 270 pixels, its camera 481 x 270",
        ),
        (
            refused_after(|e| e[0].1 = encode_jpeg(&SAMPLES[0].image, 90).unwrap()),
            "sample 000000: its rgb.png is no PNG file",
        ),
    ] {
        assert!(told.contains(reason), "{told}");
    }
}

#[test]
fn a_depth_that_16_bits_cannot_hold_is_refused_not_wrapped() {
    let mut sample = SAMPLES[0].clone();
    sample.truth = Maps::empty((480, 270));
    sample.truth.set(7, 7000.0, [0.5; 2]);
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("set");
    let error = write_dataset(
        &place,
        SYNTHESIZER.template(),
        Value::Null,
        3,
        std::iter::once(Ok(sample)),
    )
    .unwrap_err();
    assert!(matches!(
        error,
        SynthError::DepthRange {
            depth_mm: 7000.0,
            index: 0
        }
    ));
}

#[test]
fn an_entry_that_cannot_be_coded_is_named_with_its_sample() {
    let mut sample = SAMPLES[0].clone();
    sample.truth = Maps::empty((0, 0));
    let folder = tempfile::tempdir().unwrap();
    let samples = [Ok(SAMPLES[1].clone()), Ok(sample)].into_iter();
    let place = folder.path().join("set");
    let error = write_dataset::<SynthError>(&place, SYNTHESIZER.template(), Value::Null, 3, samples).unwrap_err();
    let told = error.to_string();
    assert!(told.starts_with("depth.png of sample 1 cannot be written: "), "{told}");
}

#[test]
fn what_happens_to_a_shard_after_it_was_opened_is_told_when_a_sample_is_read() {
    let (folder, whole) = written();
    let path = folder.path().join(SHARD);
    let shards = open(folder.path(), training_camera()).unwrap();
    for left in [whole.len() / 20, 0] {
        fs::write(&path, &whole[..left]).unwrap();
        message(shards.sample(1), folder.path());
    }
    fs::write(&path, &whole).unwrap();
    shards.sample(1).unwrap();
    fs::remove_file(&path).unwrap();
    message(shards.sample(1), folder.path());
}
