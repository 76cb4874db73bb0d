//! Data sets: shards and their description.

use crate::files::{join, split, with_folder};
use crate::png;
use crate::{picture, template};
use anyhow::{Context, Result, bail};
use deepsft_formats::{CameraFile, guarded};
use deepsft_geometry::glam::{DVec2, DVec3};
use deepsft_geometry::{Camera, Maps};
use deepsft_synth::{DATASET_FILE, DatasetFolder, IndexedShards, Sample, SynthError, write_dataset};
use serde_json::{Value, json};
use std::fs;
use std::io::Read;
use std::path::Path;
use std::sync::LazyLock;

/// The shard of a small data set, and its description.
static WRITTEN: LazyLock<Option<(Vec<u8>, Value)>> = LazyLock::new(|| written().ok());

const SHARD_FILE: &str = "shard-000000.tar";

/// Endings of a sample's entries.
const PARTS: [&str; 4] = ["rgb.png", "depth.png", "uv.png", "json"];

/// Largest entry of a shard, bytes.
const LARGEST_ENTRY: u64 = 64 << 20;

/// Bytes of a block of a tar archive.
const BLOCK: usize = 512;

/// A shard as it is; the descriptions of a data set in two parts; or the four entries of each sample.
pub(crate) fn read(input: &[u8]) -> Result<()> {
    match split(input).as_slice() {
        [shard] => read_shard(&sealed(shard)),
        [one, other] => read_descriptions(one, other),
        entries => read_shard(&archive(entries)?),
    }
}

fn read_descriptions(one: &[u8], other: &[u8]) -> Result<()> {
    let files = [("part-1-of-2/dataset.json", one), ("part-2-of-2/dataset.json", other)];
    with_folder(files, |folder| {
        let set = DatasetFolder::open(folder)?;
        let description = set.description();
        with_folder([(DATASET_FILE, description.to_json())], |folder| {
            let again = DatasetFolder::open(folder);
            let outside = description.shards.iter().any(|name| name.contains('/'));
            assert!(again.is_ok() || outside, "what was written cannot be read: {again:?}");
            Ok(())
        })?;
        let [template, _] = template::small()?;
        let _ = description.check_template(&template);
        // There are none.
        let _ = set.check_shards();
        Ok(())
    })
}

/// Reads a shard as that of the seed, the indices and the camera of its first sample, and writes what was read.
fn read_shard(shard: &[u8]) -> Result<()> {
    let (first, samples) = guarded(|| samples_of(shard))??;
    let first: Value = serde_json::from_slice(&first)?;
    let Some((_, mut description)) = WRITTEN.clone() else {
        bail!("no data set can be written");
    };
    (description["seed"], description["first"]) = (first["seed"].clone(), first["index"].clone());
    description["samples"] = samples.into();
    if let Some(fields) = description.as_object_mut() {
        fields.retain(|name, _| !["shard_bytes", "shard_sha256"].contains(&name.as_str()));
    }
    let description = description.to_string();
    let files = [(DATASET_FILE, description.as_bytes()), (SHARD_FILE, shard)];
    with_folder(files, |folder| {
        let read = samples_in(folder, &first, samples)?;
        let seed = first["seed"].as_u64().context("there is no seed")?;
        let [template, _] = template::small()?;
        let place = folder.join("again");
        let written = read.iter().cloned().map(Ok);
        let again = write_dataset::<SynthError>(&place, &template, Value::Null, seed, written);
        assert!(again.is_ok(), "a sample that was read cannot be written: {again:?}");
        // Seed and index of each are compared with the description. A camera is the same to the last digit but one.
        let (first, _) = samples_of(&fs::read(place.join(SHARD_FILE))?)?;
        let again = samples_in(&place, &serde_json::from_slice(&first)?, samples);
        assert!(again.is_ok(), "what was written cannot be read: {:?}", again.err());
        for (sample, again) in read.iter().zip(again?) {
            assert_eq!((&sample.image, &sample.truth), (&again.image, &again.truth));
        }
        Ok(())
    })
}

/// The samples of the data set in a folder, of the camera of its first one.
fn samples_in(folder: &Path, first: &Value, samples: u64) -> Result<Vec<Sample>> {
    let camera = serde_json::from_value::<CameraFile>(first["camera"].clone())?.camera()?;
    let shards = IndexedShards::open(&[DatasetFolder::open(folder)?], camera, |_| ())?;
    (0..samples).map(|number| Ok(shards.sample(number)?)).collect()
}

/// The JSON entry of a shard's first sample, and the number of its samples.
fn samples_of(shard: &[u8]) -> Result<(Vec<u8>, u64)> {
    let (mut first, mut samples) = (None, 0);
    for entry in tar::Archive::new(shard).entries()? {
        let entry = entry?;
        if entry.header().entry_type().is_file() && entry.path_bytes().ends_with(b".json") {
            samples += 1;
            if first.is_none() {
                let mut content = Vec::new();
                entry.take(LARGEST_ENTRY).read_to_end(&mut content)?;
                first = Some(content);
            }
        }
    }
    Ok((first.context("there is no sample in it")?, samples))
}

/// The shard with the right checksum in every header.
fn sealed(shard: &[u8]) -> Vec<u8> {
    let mut shard = shard.to_vec();
    let mut at = 0;
    while let Some(block) = shard.get_mut(at..at + BLOCK) {
        if block.iter().all(|&byte| byte == 0) {
            break;
        }
        let mut header = tar::Header::new_old();
        header.as_mut_bytes().copy_from_slice(block);
        header.set_cksum();
        block.copy_from_slice(header.as_bytes());
        let size = header.entry_size().unwrap_or(0) as usize;
        at = at
            .saturating_add(BLOCK)
            .saturating_add(size.min(shard.len()).next_multiple_of(BLOCK));
    }
    shard
}

/// The shard of these entries, four of each sample.
fn archive(entries: &[Vec<u8>]) -> Result<Vec<u8>> {
    let mut archive = tar::Builder::new(Vec::new());
    for (number, content) in entries.iter().enumerate() {
        let mut header = tar::Header::new_ustar();
        header.set_size(content.len() as u64);
        header.set_mode(0o644);
        let name = format!("{:06}.{}", number / PARTS.len(), PARTS[number % PARTS.len()]);
        archive.append_data(&mut header, name, content.as_slice())?;
    }
    Ok(archive.into_inner()?)
}

/// A data set of one sample: its shard, and its description.
fn written() -> Result<(Vec<u8>, Value)> {
    let camera = Camera::pinhole((5, 4), DVec2::new(5.0, 5.0), DVec2::new(2.5, 2.0))?;
    let mut truth = Maps::empty((5, 4));
    truth.set(7, 321.5, [0.25, 0.75]);
    let vertices = vec![DVec3::new(1.0, 2.0, 321.5); 2];
    let sample = Sample::new(picture::small(5, 4), truth, vertices, camera, DVec3::NEG_Z);
    let [template, _] = template::small()?;
    with_folder([("", "")], |folder| {
        let place = folder.join("set");
        write_dataset::<SynthError>(&place, &template, json!({"a": 1}), 5, std::iter::once(Ok(sample)))?;
        let description = serde_json::from_slice(&fs::read(place.join(DATASET_FILE))?)?;
        Ok((fs::read(place.join(SHARD_FILE))?, description))
    })
}

pub(crate) fn seeds() -> Result<Vec<Vec<u8>>> {
    let (shard, mut description) = written()?;
    let mut entries = Vec::new();
    let mut reader = tar::Archive::new(shard.as_slice());
    for entry in reader.entries()? {
        let mut content = Vec::new();
        entry?.read_to_end(&mut content)?;
        entries.push(content);
    }
    let json = entries.last().context("no entries")?.clone();
    // The same with pixels that mutations change: no object, one object.
    let rows = |bytes: usize| -> Vec<u8> { (0..4).flat_map(|_| [&[0], &vec![0; bytes][..]].concat()).collect() };
    let image = png::stored([5, 4], [8, 2, 0], &[], &rows(15));
    let (mut depth, mut uv) = (rows(10), rows(30));
    depth[11 + 1 + 4..][..2].copy_from_slice(&3215_u16.to_be_bytes());
    uv[31 + 1 + 12..][..6].copy_from_slice(&[0x40, 0, 0xc0, 0, 0xff, 0xff]);
    let depth = png::stored([5, 4], [16, 0, 0], &[], &depth);
    let uv = png::stored([5, 4], [16, 2, 0], &[], &uv);
    let next = String::from_utf8_lossy(&json)
        .replace("\"index\":0", "\"index\":1")
        .into_bytes();
    description["samples"] = 3.into();
    let mut follows = description.clone();
    follows["first"] = 3.into();
    let entries: Vec<&[u8]> = entries.iter().map(Vec::as_slice).collect();
    Ok(vec![
        shard,
        join(&entries),
        join(&[&image, &depth, &uv, &json, entries[0], entries[1], entries[2], &next]),
        join(&[description.to_string().as_bytes(), follows.to_string().as_bytes()]),
    ])
}
