//! Shards come back as they were written, and foreign or damaged ones are refused with the entry's name.

use deepsft_formats::FormatError;
use deepsft_geometry::{Maps, Picture, Template};
use deepsft_synth::{DatasetDescription, SampleRecord, ShardReader, SynthConfig, Synthesizer, write_shard};
use std::sync::LazyLock;

static SYNTHESIZER: LazyLock<Synthesizer> = LazyLock::new(|| {
    let texture = Picture::from_fn(64, 48, |x, y| [4 * x as u8, 5 * y as u8, 100]);
    let template = Template::thin_shell(texture, 297.0, 210.0).unwrap();
    // Half of the samples without the template, so that a few hold both kinds.
    Synthesizer::new(
        &template,
        SynthConfig {
            empty_probability: 0.5,
            ..SynthConfig::default()
        },
    )
    .unwrap()
});

fn records() -> Vec<SampleRecord> {
    (0..6)
        .map(|index| SampleRecord {
            seed: 3,
            index,
            sample: SYNTHESIZER.sample(3, index),
        })
        .collect()
}

fn shard() -> Vec<u8> {
    let mut bytes = Vec::new();
    assert_eq!(write_shard(&mut bytes, records()).unwrap(), 6);
    bytes
}

fn read(bytes: &[u8]) -> Result<Vec<SampleRecord>, FormatError> {
    ShardReader::new(bytes).records()?.collect()
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

/// The error of a shard whose entries went through `change`.
fn error_after(change: impl FnOnce(&mut Vec<(String, Vec<u8>)>)) -> String {
    let mut entries = entries(&shard());
    change(&mut entries);
    let entries: Vec<(&str, &[u8])> = entries
        .iter()
        .map(|(name, content)| (name.as_str(), content.as_slice()))
        .collect();
    read(&archive(&entries)).unwrap_err().to_string()
}

#[test]
fn samples_come_back_with_truth_rounded_to_the_documented_steps() {
    let (written, back) = (records(), read(&shard()).unwrap());
    assert_eq!(written.len(), back.len());
    assert!(written.iter().any(|r| r.sample.has_template) && written.iter().any(|r| !r.sample.has_template));
    for (a, b) in written.iter().zip(&back) {
        assert_eq!((a.seed, a.index), (b.seed, b.index));
        let (a, b) = (&a.sample, &b.sample);
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
}

#[test]
fn the_same_samples_make_the_same_bytes() {
    assert_eq!(shard(), shard());
}

#[test]
fn an_empty_shard_has_no_samples() {
    let mut bytes = Vec::new();
    assert_eq!(write_shard(&mut bytes, []).unwrap(), 0);
    assert!(read(&bytes).unwrap().is_empty());
    assert!(read(&[]).unwrap().is_empty());
}

#[test]
fn a_shard_cut_anywhere_gives_the_samples_before_the_cut_and_then_an_error() {
    let bytes = shard();
    for share in [0.1, 0.45, 0.8] {
        let cut = &bytes[..(bytes.len() as f64 * share) as usize];
        let results: Vec<_> = ShardReader::new(cut).records().unwrap().collect();
        assert!(results.len() <= 6 && !results.is_empty());
        let (last, before) = results.split_last().unwrap();
        assert!(last.is_err() && before.iter().all(Result::is_ok), "cut at {share}");
    }
}

#[test]
fn what_is_not_a_shard_is_refused() {
    assert!(matches!(read(&[b'x'; 5000]), Err(FormatError::Io(_))));
    assert_eq!(
        read(&archive(&[("readme.txt", b"hello")])).unwrap_err().to_string(),
        "shard entry readme.txt is not NNNNNN.rgb.png, .depth.png, .uv.png or .json"
    );
    assert_eq!(
        read(&archive(&[("a/000000.json", b"{}")])).unwrap_err().to_string(),
        "shard entry a/000000.json is not NNNNNN.rgb.png, .depth.png, .uv.png or .json"
    );
}

#[test]
fn damaged_entries_are_refused_by_name() {
    assert_eq!(
        error_after(|e| drop(e.remove(1))),
        "sample 000000 of the shard has no depth.png"
    );
    assert_eq!(
        error_after(|e| e.truncate(23)),
        "sample 000005 of the shard has no json"
    );
    assert_eq!(
        error_after(|e| e[1] = e[0].clone()),
        "shard entry 000000.rgb.png is there twice"
    );
    assert!(error_after(|e| e[4].1.truncate(100)).starts_with("shard entry 000001.rgb.png: "));
    assert!(error_after(|e| e[3].1 = b"{\"seed\": 1}".to_vec()).starts_with("000000.json: missing field"));
    // The picture in the place of the depth: 8-bit RGB instead of 16-bit grey.
    let mixed = error_after(|e| e[1].1 = e[0].1.clone());
    assert_eq!(mixed, "shard entry 000000.depth.png is Rgb8, expected 16-bit grey");
    let lens = error_after(|e| {
        let text = String::from_utf8(e[3].1.clone())
            .unwrap()
            .replace("\"fx\":380.0", "\"fx\":0.0");
        e[3].1 = text.into_bytes();
    });
    assert!(lens.starts_with("camera fx is 0"), "{lens}");
    let smaller = error_after(|e| {
        let text = String::from_utf8(e[3].1.clone())
            .unwrap()
            .replace("\"width\":480", "\"width\":481");
        e[3].1 = text.into_bytes();
    });
    assert_eq!(
        smaller,
        "shard entry 000000.rgb.png is 480 x 270 pixels, expected the camera's 481 x 270"
    );
}

#[test]
fn a_depth_that_16_bits_cannot_hold_is_refused_not_wrapped() {
    let mut record = records().remove(0);
    let mut truth = Maps::empty(480, 270);
    truth.set(7, 7000.0, [0.5; 2]);
    record.sample.truth = truth;
    let error = write_shard(Vec::new(), [record]).unwrap_err();
    assert!(matches!(
        error,
        FormatError::DepthRange {
            depth_mm: 7000.0,
            index: 0
        }
    ));
}

#[test]
fn the_description_comes_back_and_foreign_versions_are_refused() {
    let config = SynthConfig::default();
    let shards = vec!["shard-000000.tar".to_owned()];
    let description = DatasetDescription::new(SYNTHESIZER.template(), config.description(), 3, 6, shards);
    let text = description.to_json().unwrap();
    assert_eq!(DatasetDescription::from_json(&text).unwrap(), description);
    let newer = text.replace("\"format_version\": 1", "\"format_version\": 2");
    assert!(
        DatasetDescription::from_json(&newer)
            .unwrap_err()
            .to_string()
            .contains("format version 2")
    );
    assert!(matches!(
        DatasetDescription::from_json("[]"),
        Err(FormatError::Json { .. })
    ));
}
